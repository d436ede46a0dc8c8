//! Rows of `crossings.csv`: every crossing at every frame.

use super::number;
use serde::{Deserialize, Serialize};

/// One crossing of warp and weft at one time; NaN if the yarns cross no longer.
#[serde_with::apply(f64 => #[serde(serialize_with = "number")])]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Crossing {
    /// Simulated time.
    pub time_s: f64,
    /// Shear angle that the rig states.
    pub shear_angle_deg: f64,
    /// Largest prescribed displacement.
    pub displacement_mm: f64,
    /// A, B or C in a specimen, `none` elsewhere.
    pub zone: String,
    /// Names of the yarns.
    pub warp: String,
    pub weft: String,
    /// Crossing in the reference state.
    pub reference_x_mm: f64,
    pub reference_y_mm: f64,
    /// Current crossing.
    pub x_mm: f64,
    pub y_mm: f64,
    pub z_mm: f64,
    /// Effective shear angle.
    pub effective_angle_deg: f64,
    /// Directions of the yarns, from x.
    pub warp_direction_deg: f64,
    pub weft_direction_deg: f64,
    /// Vector from the warp's material point to the weft's.
    pub slip_x_mm: f64,
    pub slip_y_mm: f64,
    /// Sizes at the nearest stations.
    pub warp_width_mm: f64,
    pub weft_width_mm: f64,
    pub warp_gap_mm: f64,
    pub weft_gap_mm: f64,
}
