//! Rows of `tools.csv`: every rigid tool, and what presses on it.

use super::number;
use serde::{Deserialize, Serialize};

/// One tool at one time.
#[serde_with::apply(f64 => #[serde(serialize_with = "number")])]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Tool {
    /// Simulated time.
    pub time_s: f64,
    /// Its name.
    pub tool: String,
    /// Displacement.
    pub displacement_x_mm: f64,
    pub displacement_y_mm: f64,
    pub displacement_z_mm: f64,
    /// Force of yarns and threads on it.
    pub force_x_n: f64,
    pub force_y_n: f64,
    pub force_z_n: f64,
    /// Moment of these forces about its origin.
    pub moment_x_n_mm: f64,
    pub moment_y_n_mm: f64,
    pub moment_z_n_mm: f64,
    /// Area of yarn surfaces that touch it.
    pub area_mm2: f64,
}
