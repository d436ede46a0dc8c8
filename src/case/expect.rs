//! Expected results of a case: bounds for hard scenes, which a test and `tricot study stability` check.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// How a run must end, and bounds on its results. A quantity that is left out is not checked.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Expect {
    /// How the run ends. Default `finished`.
    pub verdict: Verdict,
    /// Largest absolute error of the energy balance before a guard stops the run, over the largest energy of the run.
    pub energy_balance: Option<Bounds>,
    /// Smallest det F in any hexahedron at any time.
    pub min_jacobian: Option<Bounds>,
    /// Largest penetration of any kind at any time, mm.
    pub penetration_mm: Option<Bounds>,
    /// Kinetic energy at the end, mJ.
    pub kinetic_mj: Option<Bounds>,
    /// Strain energy of yarns and threads at the end, mJ.
    pub internal_mj: Option<Bounds>,
    /// Work lost to friction during the run, mJ.
    pub friction_mj: Option<Bounds>,
    /// Largest distance between the initial and final positions of a node, mm.
    pub displacement_mm: Option<Bounds>,
    /// Largest distance between the positions of a node at the beginning and end of the last load step, mm.
    pub drift_mm: Option<Bounds>,
    /// Smallest final distance between the lowest and highest node layers of the first block, over the initial one.
    pub thickness_ratio: Option<Bounds>,
    /// Largest force in a beam at the end, N.
    pub tension_n: Option<Bounds>,
    /// Force in the last beam of the first thread over the force in its first beam, averaged over the middle half of the last
    /// load step, while the thread slides fast. The ratio oscillates as beams leave the surface they slide on.
    pub tension_ratio: Option<Bounds>,
    /// Another case that this one must agree with. `null` for none.
    pub same_as: Option<SameAs>,
}

/// Bounds of a number, exclusive.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Bounds {
    /// The number must be above this. `null` for any.
    #[schemars(range(min = -1e12, max = 1e12))]
    pub above: Option<f64>,
    /// The number must be below this. `null` for any.
    #[schemars(range(min = -1e12, max = 1e12))]
    pub below: Option<f64>,
}

impl Bounds {
    /// Whether a number lies between the bounds; NaN never does.
    pub fn hold(&self, number: f64) -> bool {
        !number.is_nan() && self.above.is_none_or(|a| number > a) && self.below.is_none_or(|b| number < b)
    }
}

/// A case with the same answer: a rotated, mirrored, moved or refined copy.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SameAs {
    /// Path of the other case, relative to this one.
    pub case: PathBuf,
    /// Quantity to compare.
    pub quantity: Quantity,
    /// Largest difference relative to the other case.
    #[schemars(range(min = 0, max = 1))]
    pub within: f64,
}

/// Quantity by which the final states of two cases are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Sorted magnitudes of nodal displacements, which are invariant to rotation and reflection.
    Displacements,
    /// Strain energy of yarns and threads.
    InternalEnergy,
}

/// How a run ends: after its last load step, or stopped by a guard, named by its cause.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    #[default]
    Finished,
    /// Stopped by any guard: which one trips first may be chance.
    Stopped,
    NonFinite,
    PositionRange,
    Inversion,
    Energy,
    Penetration,
    TimeStep,
    ForceRange,
    ContactOverflow,
}

impl Verdict {
    const ALL: [Self; 10] = [
        Self::Finished,
        Self::Stopped,
        Self::NonFinite,
        Self::PositionRange,
        Self::Inversion,
        Self::Energy,
        Self::Penetration,
        Self::TimeStep,
        Self::ForceRange,
        Self::ContactOverflow,
    ];

    /// Name in a table and, for a guard, in its message.
    pub fn name(self) -> &'static str {
        match self {
            Self::Finished => "finished",
            Self::Stopped => "stopped",
            Self::NonFinite => "non-finite",
            Self::PositionRange => "position range",
            Self::Inversion => "inversion",
            Self::Energy => "energy",
            Self::Penetration => "penetration",
            Self::TimeStep => "time step",
            Self::ForceRange => "force range",
            Self::ContactOverflow => "contact overflow",
        }
    }

    /// Whether a run that ended this way is as expected.
    pub fn covers(self, ended: Self) -> bool {
        self == ended || self == Self::Stopped && ended != Self::Finished
    }

    /// The verdict of a run that a guard stopped for a cause.
    pub fn of_cause(cause: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|verdict| verdict.name() == cause)
    }
}
