//! Rows of `compaction.csv`: a yarn between plates.

use super::number;
use serde::{Deserialize, Serialize};

/// The compacted yarn at one time.
#[serde_with::apply(f64 => #[serde(serialize_with = "number")])]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Compaction {
    /// Simulated time.
    pub time_s: f64,
    /// Thickness between the plates, and mean width.
    pub thickness_mm: f64,
    pub width_mm: f64,
    /// Force over the present area of the yarn on a plate.
    pub pressure_mpa: f64,
    /// Area of the fibres over that of the section.
    pub fibre_volume_fraction: f64,
    /// Compaction stiffness K_comp of this state, by the law with the yarn's other parameters.
    pub k_comp_mpa: f64,
}
