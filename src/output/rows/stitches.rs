//! Rows of `stitches.csv`: tension of the stitch.

use super::number;
use serde::{Deserialize, Serialize};

/// Tension at one time, weighted by reference length. Compression is negative and counts as slack.
#[serde_with::apply(f64 => #[serde(serialize_with = "number")])]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Stitches {
    /// Simulated time.
    pub time_s: f64,
    /// Shear angle that the rig states.
    pub shear_angle_deg: f64,
    /// Axial force of all threads.
    pub tension_min_n: f64,
    pub tension_mean_n: f64,
    pub tension_max_n: f64,
    /// Share of the length that is slack.
    pub slack_share: f64,
    /// Loops only.
    pub loop_tension_mean_n: f64,
    pub loop_slack_share: f64,
    /// Underlaps only.
    pub underlap_tension_mean_n: f64,
    pub underlap_slack_share: f64,
}
