//! Rows of `stress.csv`: homogenised stress of a cell.

use super::number;
use serde::{Deserialize, Serialize};

/// Stress and fibre stretch of a cell at one time; x is along the wefts, y along the warps.
#[serde_with::apply(f64 => #[serde(serialize_with = "number")])]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Stress {
    /// Simulated time.
    pub time_s: f64,
    /// Shear angle that the rig states.
    pub shear_angle_deg: f64,
    /// Components of V P̄/A₀: membrane stress of the cell.
    pub p_xx_n_per_mm: f64,
    pub p_xy_n_per_mm: f64,
    pub p_xz_n_per_mm: f64,
    pub p_yx_n_per_mm: f64,
    pub p_yy_n_per_mm: f64,
    pub p_yz_n_per_mm: f64,
    pub p_zx_n_per_mm: f64,
    pub p_zy_n_per_mm: f64,
    pub p_zz_n_per_mm: f64,
    /// Stretch along the fibres.
    pub weft_stretch: f64,
    pub warp_stretch: f64,
    /// Membrane force along the fibres.
    pub weft_membrane_n_per_mm: f64,
    pub warp_membrane_n_per_mm: f64,
}
