//! Pieces of the constituents of a fabric: its thread and its yarns.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A straight piece of the stitching thread along x, held at one end and pulled at the other.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ThreadTension {
    /// Length between the grips, mm. Default 90.
    #[schemars(range(min = 0.1, max = 400))]
    pub length_mm: f64,
    /// Number of beams. Default 90.
    #[schemars(range(min = 1, max = 100_000))]
    pub elements: usize,
    /// Displacement of the moved end, away from the held one, at the end of the `move` step, mm. Default 4.5.
    #[schemars(range(min = 0, max = 80))]
    pub displacement_mm: f64,
}

impl Default for ThreadTension {
    fn default() -> Self {
        Self { length_mm: 90.0, elements: 90, displacement_mm: 4.5 }
    }
}

/// A straight piece of the stitching thread along x, clamped at one end. Its weight comes from `effects.gravity_mm_s2`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Cantilever {
    /// Overhanging length, mm. Default 22.
    #[schemars(range(min = 0.1, max = 400))]
    pub length_mm: f64,
    /// Number of beams of the overhanging length. Default 44.
    #[schemars(range(min = 4, max = 100_000))]
    pub elements: usize,
}

impl Default for Cantilever {
    fn default() -> Self {
        Self { length_mm: 22.0, elements: 44 }
    }
}

/// A straight piece of one yarn, its fibres along x: those at one edge of its width are held, those at the other are moved along
/// themselves. Its section is a rectangle of the width and the area of the yarn's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct YarnShear {
    /// The ply that the yarn is taken from. Default `warp`.
    pub ply: OnePly,
    /// Length of the sheared zone, mm. Default 100.
    #[schemars(range(min = 0.1, max = 400))]
    pub length_mm: f64,
    /// Displacement of the moved fibres at the end of the `move` step, mm. Far beyond the default, the free ends of the fibres
    /// buckle. Default 0.2.
    #[schemars(range(min = 0, max = 80))]
    pub displacement_mm: f64,
}

impl Default for YarnShear {
    fn default() -> Self {
        Self { ply: OnePly::Warp, length_mm: 100.0, displacement_mm: 0.2 }
    }
}

/// A short piece of one yarn between smooth plates. Its section is a rectangle of the width and the area of the yarn's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct YarnCompaction {
    /// The ply that the yarn is taken from. Default `warp`.
    pub ply: OnePly,
    /// Distance of the plates at the end of the `move` step, mm. Default 0.23.
    #[schemars(range(min = 0.001, max = 20))]
    pub thickness_mm: f64,
    /// Whether the sides of the yarn are free. Default `held`.
    pub sides: Sides,
    /// Density of the fibres, g/cm³, for the fibre volume fraction. Default 1.8 (carbon).
    #[schemars(range(min = 0.1, max = 20))]
    pub fibre_density_g_cm3: f64,
}

impl Default for YarnCompaction {
    fn default() -> Self {
        Self { ply: OnePly::Warp, thickness_mm: 0.23, sides: Sides::Held, fibre_density_g_cm3: 1.8 }
    }
}

/// Sides of a compacted yarn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Sides {
    /// A die keeps the width.
    #[default]
    Held,
    /// The yarn widens.
    Free,
}

/// One of the two plies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OnePly {
    #[default]
    Warp,
    Weft,
}
