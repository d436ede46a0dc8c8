//! Rows of `yarns.csv`: sizes of the yarns of both plies.

use super::number;
use serde::{Deserialize, Serialize};

/// Sizes of both plies at one time, as defined by [`measure::yarns`](crate::measure::yarns).
#[serde_with::apply(f64 => #[serde(serialize_with = "number")])]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Yarns {
    /// Simulated time.
    pub time_s: f64,
    /// Shear angle that the rig states.
    pub shear_angle_deg: f64,
    /// Means over the stations of all warps.
    pub warp_width_mm: f64,
    pub warp_thickness_mm: f64,
    pub warp_gap_mm: f64,
    /// Means over the stations of all wefts.
    pub weft_width_mm: f64,
    pub weft_thickness_mm: f64,
    pub weft_gap_mm: f64,
    /// Standard deviations over the stations of all warps.
    pub warp_width_std_mm: f64,
    pub warp_thickness_std_mm: f64,
    pub warp_gap_std_mm: f64,
    /// Standard deviations over the stations of all wefts.
    pub weft_width_std_mm: f64,
    pub weft_thickness_std_mm: f64,
    pub weft_gap_std_mm: f64,
    /// Mean of width plus gap.
    pub warp_broadness_mm: f64,
    pub weft_broadness_mm: f64,
}
