//! Rigid tools: their shape, place, motion and friction.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A rigid tool, which every yarn and thread may touch. It moves without turning.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tool {
    /// Name in messages and in the table of tools.
    #[schemars(length(min = 1, max = 100))]
    pub name: String,
    /// Its shape, in its own axes.
    pub shape: Shape,
    /// Position of its origin at the start, mm. Default `[0, 0, 0]`.
    #[serde(default)]
    #[schemars(inner(range(min = -250, max = 250)))]
    pub at_mm: [f64; 3],
    /// Rotation of its axes: about the direction of this vector, by its length in degrees. Default none.
    #[serde(default)]
    #[schemars(inner(range(min = -360, max = 360)))]
    pub turned_deg: [f64; 3],
    /// Displacement at the end of a `move` step to 1, mm. Default zero: the tool is held.
    #[serde(default)]
    #[schemars(inner(range(min = -250, max = 250)))]
    pub displacement_mm: [f64; 3],
    /// Axes along which it moves by forces instead. Default null.
    #[serde(default)]
    pub free: Option<Free>,
    /// Coulomb friction coefficient against yarns and threads, or one for each. Default 0.
    #[serde(default)]
    pub friction: ToolFriction,
}

/// Motion of a tool by forces.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Free {
    /// Axes x, y and z along which it is free.
    pub axes: [bool; 3],
    /// Its mass, g.
    #[schemars(range(min = 1e-6, max = 1e6))]
    pub mass_g: f64,
    /// Force on it at the end of a `move` step to 1, N. Default zero.
    #[serde(default)]
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub force_n: [f64; 3],
}

/// The shape of a tool.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    /// The half-space z < 0.
    Plane,
    /// A sphere about the origin.
    Sphere {
        /// Radius, mm.
        #[schemars(range(min = 1e-3, max = 250))]
        radius_mm: f64,
    },
    /// A cylinder about the x axis, its ends closed by half-spheres.
    Cylinder {
        /// Radius, mm.
        #[schemars(range(min = 1e-3, max = 250))]
        radius_mm: f64,
        /// Length without its ends, mm.
        #[schemars(range(min = 1e-3, max = 500))]
        length_mm: f64,
    },
    /// A box about the origin with rounded edges.
    Box {
        /// Sizes along x, y and z, mm.
        #[schemars(inner(range(min = 1e-3, max = 500)))]
        size_mm: [f64; 3],
        /// Radius of its edges, mm.
        #[schemars(range(min = 0, max = 250))]
        edge_radius_mm: f64,
    },
    /// A closed surface of triangles, sampled as signed distances on a grid of cubic cells.
    Mesh {
        /// An STL file, relative to the case. Give either this or `triangles_mm`.
        #[serde(default)]
        file: Option<String>,
        /// Corners of the triangles, mm, counter-clockwise seen from outside.
        #[serde(default)]
        #[schemars(inner(inner(inner(range(min = -1e4, max = 1e4)))))]
        triangles_mm: Option<Vec<[[f64; 3]; 3]>>,
        /// Size of a cell, mm. The shape is exact to about its square over eight times the radius of curvature.
        #[schemars(range(min = 1e-3, max = 50))]
        cell_mm: f64,
    },
}

/// Coulomb friction of a tool: one coefficient, or one against yarns and one against threads.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum ToolFriction {
    /// Against yarns and threads.
    All(#[schemars(range(min = 0, max = 2))] f64),
    /// Against each.
    Kinds(Kinds),
}

/// Coulomb friction coefficients of a tool by what touches it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Kinds {
    /// Against yarns, 0 to 2.
    #[schemars(range(min = 0, max = 2))]
    pub yarn: f64,
    /// Against threads, 0 to 2.
    #[schemars(range(min = 0, max = 2))]
    pub thread: f64,
}

impl ToolFriction {
    /// The coefficients against threads and yarns.
    pub fn kinds(self) -> Kinds {
        match self {
            Self::All(all) => Kinds { yarn: all, thread: all },
            Self::Kinds(kinds) => kinds,
        }
    }
}

impl Default for ToolFriction {
    fn default() -> Self {
        Self::All(0.0)
    }
}

impl Tool {
    /// A held tool without friction at a place.
    pub fn held(name: &str, shape: Shape, at_mm: [f64; 3]) -> Self {
        Self {
            name: name.into(),
            shape,
            at_mm,
            turned_deg: [0.0; 3],
            displacement_mm: [0.0; 3],
            free: None,
            friction: ToolFriction::default(),
        }
    }

    /// Whether it moves by forces along each axis.
    pub fn is_free(&self) -> [bool; 3] {
        self.free.as_ref().map_or([false; 3], |free| free.axes)
    }
}
