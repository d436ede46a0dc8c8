//! Rows of `contacts.csv`: contacts, penetrations, added mass and time step limit.

use super::number;
use serde::{Deserialize, Serialize};

/// Contact at one time.
#[serde_with::apply(f64 => #[serde(serialize_with = "number")])]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Contacts {
    /// Simulated time.
    pub time_s: f64,
    /// Shear angle that the rig states.
    pub shear_angle_deg: f64,
    /// Thread nodes in contact with yarns.
    pub thread_nodes_on_yarns: u32,
    /// Yarn nodes in contact with other yarns.
    pub yarn_nodes_on_yarns: u32,
    /// Beams in contact with beams.
    pub beams_on_beams: u32,
    /// Deepest penetration of threads into yarns since the previous row.
    pub thread_yarn_penetration_mm: f64,
    /// Deepest penetration of yarns into yarns since the previous row.
    pub yarn_yarn_penetration_mm: f64,
    /// Deepest penetration of threads into threads since the previous row.
    pub thread_thread_penetration_mm: f64,
    /// Mass added by contact over true mass, for yarns.
    pub added_mass_yarns: f64,
    /// Mass added by contact over true mass, for threads.
    pub added_mass_threads: f64,
    /// Estimated limit of the time step.
    pub dt_limit_s: f64,
}
