//! Rows of `frame.csv`: a picture frame, as its machine sees it.

use super::number;
use serde::{Deserialize, Serialize};

/// The frame at one time.
#[serde_with::apply(f64 => #[serde(serialize_with = "number")])]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PictureFrame {
    /// Simulated time.
    pub time_s: f64,
    /// Shear angle of the frame.
    pub shear_angle_deg: f64,
    /// Displacement and force of the machine along the diagonal (Eq. 15).
    pub machine_displacement_mm: f64,
    pub machine_force_n: f64,
    /// Shear force along the sides (Eq. 16).
    pub shear_force_n: f64,
    /// F_nor (Eq. 17).
    pub f_nor_n_per_mm: f64,
    /// Force along the fibres in the clamps of each ply, per width of the fabric.
    pub warp_tension_n_per_mm: f64,
    pub weft_tension_n_per_mm: f64,
}
