//! Rows of `plates.csv`: a fabric between plates.

use super::number;
use serde::{Deserialize, Serialize};

/// The compacted fabric at one time.
#[serde_with::apply(f64 => #[serde(serialize_with = "number")])]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Plates {
    /// Simulated time.
    pub time_s: f64,
    /// Macroscopic shear angle.
    pub shear_angle_deg: f64,
    /// Distance of the plates.
    pub thickness_mm: f64,
    /// Force on the upper and on the lower plate over the present area of the cell.
    pub upper_pressure_mpa: f64,
    pub lower_pressure_mpa: f64,
    /// Volume of the fibres of both plies over that between the plates.
    pub fibre_volume_fraction: f64,
}
