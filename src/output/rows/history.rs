//! Rows of `history.csv`: how far a run is, and its curve.

use super::number;
use serde::{Deserialize, Serialize};

/// The state of a run at a moment.
#[serde_with::apply(f64 => #[serde(serialize_with = "number")])]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct History {
    /// Simulated time.
    pub time_s: f64,
    /// Time steps so far.
    pub step: u64,
    /// Name of the load step.
    pub phase: String,
    /// Time step.
    pub dt_s: f64,
    /// Shear angle that the rig states.
    pub shear_angle_deg: f64,
    /// Largest prescribed displacement.
    pub displacement_mm: f64,
    /// Force of the machine.
    pub force_n: f64,
    /// Normalised shear force; NaN where it has no meaning.
    pub f_nor_n_per_mm: f64,
    /// Strain energy of yarns and threads.
    pub e_internal_mj: f64,
    /// Kinetic energy of the total velocity.
    pub e_kinetic_mj: f64,
    /// What the energy balance misses, as a share.
    pub e_balance_error: f64,
    /// Deepest penetration since the row before.
    pub max_penetration_mm: f64,
    /// Smallest det F of a hexahedron.
    pub min_jacobian: f64,
    /// How often the run went back to an earlier state so far.
    pub retries: usize,
}
