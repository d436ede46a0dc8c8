//! Rows of `yarns_each.csv`: sizes of every yarn.

use super::number;
use serde::{Deserialize, Serialize};

/// Sizes of one yarn at one time: means over its stations, and the extremes of its width.
#[serde_with::apply(f64 => #[serde(serialize_with = "number")])]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Yarn {
    /// Simulated time.
    pub time_s: f64,
    /// Shear angle that the rig states.
    pub shear_angle_deg: f64,
    /// Name of the yarn.
    pub yarn: String,
    /// Means over its stations.
    pub width_mm: f64,
    pub thickness_mm: f64,
    pub gap_mm: f64,
    /// Mean of width plus gap.
    pub broadness_mm: f64,
    /// Smallest and largest width.
    pub width_min_mm: f64,
    pub width_max_mm: f64,
}
