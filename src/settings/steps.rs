//! Load steps, in the order in which they are run.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One load step. Every amplitude is smooth: it starts and ends with zero velocity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Step {
    /// Nothing changes; the threads' settling damping acts.
    Settle {
        /// Duration, s.
        #[schemars(range(min = 1e-9, max = 10))]
        time_s: f64,
    },
    /// The stitch tightens to its thermal strain; contact radii grow to full size over the first half.
    Pretension {
        /// Duration, s.
        #[schemars(range(min = 1e-9, max = 10))]
        time_s: f64,
    },
    /// Nothing changes.
    Hold {
        /// Duration, s.
        #[schemars(range(min = 1e-9, max = 10))]
        time_s: f64,
    },
    /// Trellis shear of a periodic cell to `angle_deg`, from the angle before: F̄ = [[cos γ/2, sin γ/2], [sin γ/2, cos γ/2]], its
    /// columns times the stretches of wefts and warps.
    Shear {
        /// Shear angle at the end, degrees, −80 to 80.
        #[schemars(range(min = -80, max = 80))]
        angle_deg: f64,
        /// Duration, s.
        #[schemars(range(min = 1e-9, max = 10))]
        time_s: f64,
    },
    /// How long the fibres of a periodic cell are, from here on: over the step the cell goes from how it is to how it shall be, and
    /// there it stays in the steps behind. Before the first such step both directions are held at their length.
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
    /// The prescribed displacements of a specimen's clamp, or of the conditions of an inline mesh, go on to a share of their full
    /// value.
    Move {
        /// Share of the full value at the end, −1 to 1. Default 1.
        #[serde(default = "whole")]
        #[schemars(range(min = -1, max = 1))]
        to: f64,
        /// Duration, s.
        #[schemars(range(min = 1e-9, max = 10))]
        time_s: f64,
    },
}

/// What holds a periodic cell along one of its fibre directions.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Along {
    /// It stays as long as it is.
    #[default]
    Held,
    /// It is as long as in a cell that is pulled at one corner while the two beside it are free: the membrane force along the
    /// fibres is F_nor (1 + sin γ).
    CornerDriven,
    /// It is stretched to this length, over the one at the start.
    To(#[schemars(range(min = 0.8, max = 1.25))] f64),
    /// It has this membrane force, N per mm across the fibres; 0 lets it free.
    ForceNPerMm(#[schemars(range(min = -1000, max = 1000))] f64),
}

fn whole() -> f64 {
    1.0
}

impl Step {
    /// Duration in s.
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

    /// Duration in s, to be changed.
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

    /// Name as the user writes it.
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
