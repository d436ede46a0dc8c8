//! Rows of `contacts.csv`: what touches, how deep, and what that costs.

use super::number;
use serde::{Deserialize, Serialize};

/// Contact at a moment.
#[serde_with::apply(f64 => #[serde(serialize_with = "number")])]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Contacts {
    /// Simulated time.
    pub time_s: f64,
    /// Shear angle that the rig states.
    pub shear_angle_deg: f64,
    /// Nodes of threads that touch yarns.
    pub thread_nodes_on_yarns: u32,
    /// Nodes of yarns that touch yarns.
    pub yarn_nodes_on_yarns: u32,
    /// Beams that touch beams.
    pub beams_on_beams: u32,
    /// Deepest penetration of threads into yarns since the row before.
    pub thread_yarn_penetration_mm: f64,
    /// The same of yarns.
    pub yarn_yarn_penetration_mm: f64,
    /// The same of threads.
    pub thread_thread_penetration_mm: f64,
    /// Mass added by contact over true mass, of yarns.
    pub added_mass_yarns: f64,
    /// The same of threads.
    pub added_mass_threads: f64,
    /// Estimated limit of the time step.
    pub dt_limit_s: f64,
}
