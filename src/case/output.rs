//! What a run writes, and when.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a run writes, and when.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// Rows of the tables per load step. Default 200.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub rows_per_step: usize,
    /// Shear angles, without sign, at which a frame (VTU) is written each time the load passes them, degrees. A frame is also
    /// written at the start and at the end of every load step.
    #[schemars(length(max = 1000), inner(range(min = 0, max = 80)))]
    pub frames_at_deg: Vec<f64>,
    /// Displacements of a `move` step at which a frame is written in the same way, mm. Default none.
    #[schemars(length(max = 1000), inner(range(min = 0, max = 512)))]
    pub frames_at_mm: Vec<f64>,
    /// Additional frames per load step. Default 0.
    #[schemars(range(min = 0, max = 10_000))]
    pub frames_per_step: usize,
    /// Places whose displacement is written to `probes.csv` in every row. Default none.
    #[schemars(length(max = 1000))]
    pub probes: Vec<Probe>,
    /// Whether the frames are rendered as pictures. Default true.
    pub pictures: bool,
    /// Wall time between two checkpoints for `--resume`, s. There is also one at the end of every load step. `null` turns
    /// checkpoints off. Default 300.
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
    /// A node, by its number in the mesh (its point number in `mesh.vtu`).
    Node(#[schemars(range(min = 0, max = 1_000_000_000))] usize),
    /// The first node of a thread, by its name.
    FirstOf(String),
    /// The last node of a thread, by its name.
    LastOf(String),
    /// Mean over all nodes whose reference position is in this box `[[x, y, z], [x, y, z]]`, mm.
    Within(#[schemars(inner(inner(range(min = -1e6, max = 1e6))))] [[f64; 3]; 2]),
}
