//! What a case must show when it has run: margins for hard scenes, which a test and `tricot study stability` check.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// How a run must end, and between which bounds its numbers must lie. A quantity that is left out is not checked.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Expect {
    /// How the run ends. Default `finished`.
    pub verdict: Verdict,
    /// Largest error of the energy balance at any time, before a guard stops the run, without its sign, over the largest energy of
    /// the run.
    pub energy_balance: Option<Bounds>,
    /// Smallest det F of all hexahedra at any time.
    pub min_jacobian: Option<Bounds>,
    /// Largest penetration of any kind at any time, mm.
    pub penetration_mm: Option<Bounds>,
    /// Kinetic energy at the end, mJ.
    pub kinetic_mj: Option<Bounds>,
    /// Strain energy of yarns and threads at the end, mJ.
    pub internal_mj: Option<Bounds>,
    /// Work lost to friction until the end, mJ.
    pub friction_mj: Option<Bounds>,
    /// Largest distance of a node from where it started, at the end, mm.
    pub displacement_mm: Option<Bounds>,
    /// Largest distance of a node at the end from where it was when the last load step began, mm.
    pub drift_mm: Option<Bounds>,
    /// Smallest distance between the lowest and the highest layer of nodes of the first block at the end, over that at the start.
    pub thickness_ratio: Option<Bounds>,
    /// Largest force in a beam at the end, N.
    pub tension_n: Option<Bounds>,
    /// Force in the last beam of the first thread over that in its first, mean over the middle half of the last load step, while it slides fast:
    /// the ratio goes up and down as beams come off what they slide on.
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
    /// Whether a number lies between the bounds; not-a-number never does.
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
    /// What is compared.
    pub quantity: Quantity,
    /// Largest difference relative to the other case.
    #[schemars(range(min = 0, max = 1))]
    pub within: f64,
}

/// What two cases are compared by, at their ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// How far nodes have moved, sorted: the same after a rotation or a mirror.
    Displacements,
    /// Strain energy of yarns and threads.
    InternalEnergy,
}

/// How a run ends: at the end of its load steps, or stopped by a guard, named by its cause.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    #[default]
    Finished,
    /// By any guard: which one is first may be chance.
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

    /// As it is called in a table and, for a guard, in its message.
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

    /// Whether a run that ended in one way is as expected.
    pub fn covers(self, ended: Self) -> bool {
        self == ended || self == Self::Stopped && ended != Self::Finished
    }

    /// The verdict of a run that a guard stopped for a cause.
    pub fn of_cause(cause: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|verdict| verdict.name() == cause)
    }
}
