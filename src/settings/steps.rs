//! Load steps, in the order in which they run.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One load step. Every amplitude is smooth: it starts and ends with zero velocity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Step {
    /// The load stays constant; threads have their settling damping.
    Settle {
        /// Duration, s.
        #[schemars(range(min = 1e-9, max = 10))]
        time_s: f64,
    },
    /// The thermal strain tightens the stitch; contact radii grow to full size over the first half of the step.
    Pretension {
        /// Duration, s.
        #[schemars(range(min = 1e-9, max = 10))]
        time_s: f64,
    },
    /// The load stays constant.
    Hold {
        /// Duration, s.
        #[schemars(range(min = 1e-9, max = 10))]
        time_s: f64,
    },
    /// Trellis shear of a periodic cell from its current angle to `angle_deg`. The deformation gradient is F̄ = [[cos γ/2, sin
    /// γ/2], [sin γ/2, cos γ/2]], its columns multiplied by the stretches of wefts and warps.
    Shear {
        /// Shear angle at the end, degrees, −80 to 80.
        #[schemars(range(min = -80, max = 80))]
        angle_deg: f64,
        /// Duration, s.
        #[schemars(range(min = 1e-9, max = 10))]
        time_s: f64,
    },
    /// Stretch or membrane force of a periodic cell along its fibres. The cell reaches the given condition over the step and
    /// keeps it in later steps. Before the first such step both directions are held at their initial length.
    Stretch {
        /// Along the warps, y. Default held.
        #[serde(default)]
        warp: Along,
        /// Along the wefts, x. Default held.
        #[serde(default)]
        weft: Along,
        /// Duration, s.
        #[schemars(range(min = 1e-9, max = 10))]
        time_s: f64,
    },
    /// The prescribed displacements of clamps, conditions and tools, and the forces on tools, change to a share of their full
    /// value.
    Move {
        /// Share of the full value at the end, −1 to 1. Default 1.
        #[serde(default = "whole")]
        #[schemars(range(min = -1, max = 1))]
        to: f64,
        /// Amplitudes on the way, `[[share of the duration, share of the full value], …]`: a smooth curve leads through them
        /// and turns at each extreme. Default none.
        #[serde(default)]
        #[schemars(inner(inner(range(min = -1, max = 1))))]
        through: Vec<[f64; 2]>,
        /// Duration, s.
        #[schemars(range(min = 1e-9, max = 10))]
        time_s: f64,
    },
}

/// Condition on a periodic cell along one fibre direction.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Along {
    /// The length stays as it is.
    #[default]
    Held,
    /// The length follows that of a cell pulled at one corner while the two adjacent corners are free: the membrane force along
    /// the fibres is F_nor (1 + sin γ).
    CornerDriven,
    /// This stretch, current over initial length.
    To(#[schemars(range(min = 0.8, max = 1.25))] f64),
    /// This membrane force, N per mm across the fibres; 0 leaves the direction free.
    ForceNPerMm(#[schemars(range(min = -1000, max = 1000))] f64),
}

impl Along {
    /// Whether the stretch follows a membrane force.
    pub fn is_driven(&self) -> bool {
        matches!(self, Self::CornerDriven | Self::ForceNPerMm(_))
    }
}

fn whole() -> f64 {
    1.0
}

impl Step {
    /// Duration, s.
    pub fn time(&self) -> f64 {
        match *self {
            Step::Settle { time_s }
            | Step::Pretension { time_s }
            | Step::Hold { time_s }
            | Step::Shear { time_s, .. }
            | Step::Stretch { time_s, .. }
            | Step::Move { time_s, .. } => time_s,
        }
    }

    /// Mutable duration, s.
    pub fn time_mut(&mut self) -> &mut f64 {
        match self {
            Step::Settle { time_s }
            | Step::Pretension { time_s }
            | Step::Hold { time_s }
            | Step::Shear { time_s, .. }
            | Step::Stretch { time_s, .. }
            | Step::Move { time_s, .. } => time_s,
        }
    }

    /// Name of the step in a case.
    pub fn name(&self) -> &'static str {
        match self {
            Step::Settle { .. } => "settle",
            Step::Pretension { .. } => "pretension",
            Step::Hold { .. } => "hold",
            Step::Shear { .. } => "shear",
            Step::Stretch { .. } => "stretch",
            Step::Move { .. } => "move",
        }
    }
}
