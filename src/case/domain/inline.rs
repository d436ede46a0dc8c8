//! A mesh written out in a case, node by node.

use crate::settings::friction::Friction;
use crate::settings::material::Material;
use crate::settings::tool::Tool;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

impl InlineThread {
    /// Whether the thread is a ring: its first and last nodes coincide.
    pub fn is_ring(&self) -> bool {
        /// Nodes closer than this along every axis coincide, mm.
        const SAME_MM: f64 = 1e-6;
        let ends = self.nodes.first().zip(self.nodes.last());
        ends.is_some_and(|(first, last)| (0..3).all(|k| (first[k] - last[k]).abs() < SAME_MM))
    }
}

/// Blocks of hexahedra and threads of beams, given node by node. A scene that reaches beyond ±250 mm is computed about its
/// middle; it may be 499 mm long along each axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InlineMesh {
    /// Structured blocks of 8-node hexahedra.
    #[serde(default)]
    pub blocks: Vec<InlineBlock>,
    /// Chains of 2-node beams.
    #[serde(default)]
    pub threads: Vec<InlineThread>,
    /// Coulomb friction coefficient of every contact, or coefficients by kind of pair. Default 0.
    #[serde(default)]
    pub friction: Friction,
    /// Conditions on nodes.
    #[serde(default)]
    pub conditions: Vec<Condition>,
    /// Rigid tools.
    #[serde(default)]
    pub tools: Vec<Tool>,
}

/// A structured block: fibres run from slice to slice.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InlineBlock {
    /// Name for messages and reports.
    #[schemars(length(min = 1, max = 100))]
    pub name: String,
    /// Elements along the fibre, across it, and through the thickness: `[slices, columns, layers]`, each at least 1.
    #[schemars(inner(range(min = 1, max = 1_000_000)))]
    pub elements: [usize; 3],
    /// Opposite corners of a straight block `[[x, y, z], [x, y, z]]`, mm: fibres along x, columns along y, layers along z.
    /// Give either this or `nodes`.
    #[serde(default)]
    #[schemars(inner(inner(range(min = -1e6, max = 1e6))))]
    pub corners: Option<[[f64; 3]; 2]>,
    /// All nodes, mm, with slices fastest, then columns, then layers.
    #[serde(default)]
    #[schemars(inner(inner(range(min = -1e6, max = 1e6))))]
    pub nodes: Option<Vec<[f64; 3]>>,
    /// Fibre direction. Default `[1, 0, 0]`.
    #[serde(default = "fibre")]
    #[schemars(inner(range(min = -1000, max = 1000)))]
    pub fibre: [f64; 3],
    /// Density, tonne/mm³.
    #[schemars(range(min = 1e-15, max = 1e-6))]
    pub density_t_mm3: f64,
    /// Constitutive law.
    pub material: Material,
    /// Initial velocity of every node, mm/s. Default zero.
    #[serde(default)]
    #[schemars(inner(range(min = -1e7, max = 1e7)))]
    pub velocity_mm_s: [f64; 3],
}

fn fibre() -> [f64; 3] {
    [1.0, 0.0, 0.0]
}

/// A chain of 2-node beams.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InlineThread {
    /// Name for messages and reports.
    #[schemars(length(min = 1, max = 100))]
    pub name: String,
    /// Nodes in order, mm; at least 2.
    #[schemars(length(min = 2, max = 10_000_000), inner(inner(range(min = -1e6, max = 1e6))))]
    pub nodes: Vec<[f64; 3]>,
    /// Radius for contact, mm.
    #[schemars(range(min = 0.001, max = 50))]
    pub radius_mm: f64,
    /// Axial stiffness EA, N.
    #[schemars(range(min = 1e-6, max = 1e9))]
    pub axial_n: f64,
    /// Bending stiffness, N·mm². Default 0.
    #[serde(default)]
    #[schemars(range(min = 0, max = 1e9))]
    pub bending_n_mm2: f64,
    /// Share of the given curvature that is stress-free, 0 to 1. Default 1.
    #[serde(default = "rest_curvature")]
    #[schemars(range(min = 0, max = 1))]
    pub rest_curvature: f64,
    /// Mass per length, tex (g/km).
    #[schemars(range(min = 0.001, max = 1e7))]
    pub linear_density_tex: f64,
    /// Thermal strain at the end of a pretension step. Default 0.
    #[serde(default)]
    #[schemars(range(min = -0.9, max = 0.5))]
    pub thermal_strain: f64,
    /// Initial velocity of every node, mm/s. Default zero.
    #[serde(default)]
    #[schemars(inner(range(min = -1e7, max = 1e7)))]
    pub velocity_mm_s: [f64; 3],
}

fn rest_curvature() -> f64 {
    1.0
}

/// Prescribed motion of the nodes of an inline mesh inside a box.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Condition {
    /// Name in the table of reactions. Default `condition N`, N counted from 0.
    #[serde(default)]
    #[schemars(length(min = 1, max = 100))]
    pub name: Option<String>,
    /// Nodes whose reference position lies in this box `[[x, y, z], [x, y, z]]` (bounds included, 1e-6 mm tolerance), mm.
    #[schemars(inner(inner(range(min = -1e6, max = 1e6))))]
    pub within: [[f64; 3]; 2],
    /// Restrict to one block or thread, by name. Default: every body.
    #[serde(default)]
    pub body: Option<String>,
    /// Which components are prescribed. Default all three.
    #[serde(default = "all")]
    pub components: [bool; 3],
    /// Displacement at the end of the `move` steps, mm. Default zero: the nodes are held.
    #[serde(default)]
    #[schemars(inner(range(min = -250, max = 250)))]
    pub displacement_mm: [f64; 3],
}

fn all() -> [bool; 3] {
    [true; 3]
}
