//! Rows of `history.csv`: progress, and the main curve.

use super::number;
use serde::{Deserialize, Serialize};

/// The state of a run at one time.
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
    /// Machine force.
    pub force_n: f64,
    /// Normalised shear force; NaN where it is undefined.
    pub f_nor_n_per_mm: f64,
    /// Strain energy of yarns and threads.
    pub e_internal_mj: f64,
    /// Kinetic energy of the total velocity.
    pub e_kinetic_mj: f64,
    /// Relative error of the energy balance.
    pub e_balance_error: f64,
    /// Deepest penetration since the previous row.
    pub max_penetration_mm: f64,
    /// Smallest det F of a hexahedron.
    pub min_jacobian: f64,
    /// Number of rollbacks to an earlier state so far.
    pub retries: usize,
}
