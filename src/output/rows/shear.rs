//! Rows of `shear.csv`: shear of the plies at their crossings.

use super::number;
use serde::{Deserialize, Serialize};

/// Shear and slip over all crossings of warp and weft at one time.
#[serde_with::apply(f64 => #[serde(serialize_with = "number")])]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Shear {
    /// Simulated time.
    pub time_s: f64,
    /// Shear angle that the rig states.
    pub shear_angle_deg: f64,
    /// Largest prescribed displacement.
    pub displacement_mm: f64,
    /// Effective shear angle.
    pub effective_angle_mean_deg: f64,
    pub effective_angle_std_deg: f64,
    pub effective_angle_min_deg: f64,
    pub effective_angle_max_deg: f64,
    /// Slip of the plies.
    pub slip_mean_mm: f64,
    pub slip_max_mm: f64,
}
