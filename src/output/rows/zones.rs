//! Additional columns of `shear.csv` for the zones of a specimen.

use super::number;
use serde::{Deserialize, Serialize};

/// Means over the crossings well inside each zone at one time.
#[serde_with::apply(f64 => #[serde(serialize_with = "number")])]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Zones {
    /// No-slip angle of zone C (Eq. 18); NaN where the theory does not apply.
    pub theory_angle_deg: f64,
    /// Effective shear angle by zone.
    pub zone_a_angle_deg: f64,
    pub zone_b_angle_deg: f64,
    pub zone_c_angle_deg: f64,
    /// Standard deviation of the effective shear angle by zone.
    pub zone_a_angle_std_deg: f64,
    pub zone_b_angle_std_deg: f64,
    pub zone_c_angle_std_deg: f64,
    /// Slip of the plies by zone.
    pub zone_a_slip_mm: f64,
    pub zone_b_slip_mm: f64,
    pub zone_c_slip_mm: f64,
    /// Sizes of yarns in zone C.
    pub zone_c_warp_width_mm: f64,
    pub zone_c_weft_width_mm: f64,
    pub zone_c_warp_gap_mm: f64,
    pub zone_c_weft_gap_mm: f64,
    /// Width plus gap.
    pub zone_c_warp_broadness_mm: f64,
    pub zone_c_weft_broadness_mm: f64,
    /// Directions of yarns in zone C, from x.
    pub zone_c_warp_direction_deg: f64,
    pub zone_c_weft_direction_deg: f64,
}
