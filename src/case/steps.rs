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

/// Integration in time, and over hexahedra.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Integration {
    /// Time step: a fixed number of s, or `null` for the estimate times `safety`. Default null.
    #[schemars(range(min = 1e-12, max = 0.001))]
    pub dt_s: Option<f64>,
    /// Largest time step the estimate may reach, s. Default 5e-7.
    #[schemars(range(min = 1e-12, max = 0.001))]
    pub dt_max_s: f64,
    /// Factor on the estimated limit, above 0 to 1. Default 0.9.
    #[schemars(range(min = 0.01, max = 1))]
    pub safety: f64,
    /// `f32` or `f64`. Default f32.
    pub precision: Precision,
    /// How stress is integrated over a hexahedron. Default full.
    pub hexahedra: Hexahedra,
    /// Stiffness of the modes that the one point of `reduced` hexahedra does not see, over what the shear modulus of the yarn
    /// would give them with full integration. Near 0 yarns fold into these modes; they stiffen as it grows. `full` takes no notice. Default 1.
    #[schemars(range(min = 0, max = 1000))]
    pub hourglass: f64,
    /// Relative error of the energy balance at which the run stops. Default 0.1.
    #[schemars(range(min = 1e-6, max = 100))]
    pub energy_tolerance: f64,
    /// Penetration at which the run stops, as a share of the thread radius (threads) or yarn thickness (yarns). Default 0.5.
    #[schemars(range(min = 0.01, max = 100))]
    pub penetration_tolerance: f64,
    /// How often a run that a guard stops goes back to an earlier state, 1000 steps or more before where there are so many, and
    /// goes on from there with half the time step. With 0 the guard stops it. Default 0.
    #[schemars(range(min = 0, max = 20))]
    pub retries: usize,
    /// Largest displacement of nodes at the start along each axis, mm: measures how far runs scatter by chance. Every body moves by
    /// a smooth pattern of its own that strains no fibres: yarns across their fibres, threads in all directions, differently from
    /// lap to lap, prescribed nodes not at all. The negative number mirrors the pattern. Default 0.
    #[schemars(range(min = -0.01, max = 0.01))]
    pub perturbation_mm: f64,
}

impl Integration {
    /// The hourglass coefficient of reduced hexahedra.
    pub fn hourglass_control(&self) -> Option<f64> {
        (self.hexahedra == Hexahedra::Reduced).then_some(self.hourglass)
    }
}

impl Default for Integration {
    fn default() -> Self {
        Self {
            dt_s: None,
            dt_max_s: 5e-7,
            safety: 0.9,
            precision: Precision::F32,
            hexahedra: Hexahedra::Full,
            hourglass: 1.0,
            energy_tolerance: 0.1,
            penetration_tolerance: 0.5,
            retries: 0,
            perturbation_mm: 0.0,
        }
    }
}

/// Scalar type of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    #[default]
    F32,
    F64,
}

/// Integration of stress over a hexahedron.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Hexahedra {
    /// Eight points.
    #[default]
    Full,
    /// One point, with hourglass control: cheaper steps, but shorter ones where edges of hexahedra turn away from their mean fibre,
    /// and layers of hexahedra without the stiffness of their fibres against bending.
    Reduced,
}

/// What a run writes, and when.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// Rows of the tables per load step. Default 200.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub rows_per_step: usize,
    /// Shear angles at which a frame (VTU) is written, degrees, whatever their sign: each time that the path comes by. A frame is also
    /// written at the start and at the end of every load step.
    #[schemars(length(max = 1000), inner(range(min = 0, max = 80)))]
    pub frames_at_deg: Vec<f64>,
    /// Displacements of a `move` at which a frame is written, mm, in the same way. Default none.
    #[schemars(length(max = 1000), inner(range(min = 0, max = 512)))]
    pub frames_at_mm: Vec<f64>,
    /// Frames per load step besides. Default 0.
    #[schemars(range(min = 0, max = 10_000))]
    pub frames_per_step: usize,
    /// Places whose displacement is written in every row, to `probes.csv`. Default none.
    #[schemars(length(max = 1000))]
    pub probes: Vec<Probe>,
    /// Whether pictures are rendered of the frames. Default true.
    pub pictures: bool,
    /// Seconds of wall time between two checkpoints, which `--resume` goes on from; there is one at the end of every load step
    /// besides. `null` for none at all. Default 300.
    #[schemars(range(min = 0, max = 1_000_000))]
    pub checkpoint_wall_s: Option<f64>,
}

impl Default for Output {
    fn default() -> Self {
        Self {
            rows_per_step: 200,
            frames_at_deg: vec![25.0],
            frames_at_mm: Vec::new(),
            frames_per_step: 0,
            probes: Vec::new(),
            pictures: true,
            checkpoint_wall_s: Some(300.0),
        }
    }
}

/// A place whose displacement is written in every row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    /// Name of its columns.
    #[schemars(length(min = 1, max = 100))]
    pub name: String,
    /// Where it is.
    pub at: Place,
}

/// Where a probe is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Place {
    /// A node, by its number in the mesh (that of its point in `mesh.vtu`).
    Node(#[schemars(range(min = 0, max = 1_000_000_000))] usize),
    /// The first node of a thread, by its name.
    FirstOf(String),
    /// The last node of a thread, by its name.
    LastOf(String),
    /// The mean of all nodes whose reference position is in this box `[[x, y, z], [x, y, z]]`, mm.
    Within(#[schemars(inner(inner(range(min = -1e6, max = 1e6))))] [[f64; 3]; 2]),
}
