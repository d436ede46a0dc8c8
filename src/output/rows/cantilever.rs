//! Rows of `cantilever.csv`: a thread that bends under its own weight.

use super::number;
use serde::{Deserialize, Serialize};

/// The bent thread at one time.
#[serde_with::apply(f64 => #[serde(serialize_with = "number")])]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Cantilever {
    /// Simulated time.
    pub time_s: f64,
    /// Position of the free end from the clamp, along the clamped direction and down.
    pub tip_along_mm: f64,
    pub tip_down_mm: f64,
    /// Angle of the line from the clamp to the free end below the horizontal.
    pub chord_angle_deg: f64,
    /// Bending stiffness of that angle by Eq. 9 of the paper, and by the heavy elastica.
    pub bending_eq_9_n_mm2: f64,
    pub bending_elastica_n_mm2: f64,
}
