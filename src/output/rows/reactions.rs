//! Rows of `reactions.csv`: force of each grip on the scene.

use super::number;
use serde::{Deserialize, Serialize};

/// Force of one grip at one time.
#[serde_with::apply(f64 => #[serde(serialize_with = "number")])]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Reaction {
    /// Simulated time.
    pub time_s: f64,
    /// Largest prescribed displacement.
    pub displacement_mm: f64,
    /// Name of the grip.
    pub condition: String,
    /// Components of its force on the scene.
    pub force_x_n: f64,
    pub force_y_n: f64,
    pub force_z_n: f64,
    /// Magnitude of that force.
    pub force_n: f64,
}
