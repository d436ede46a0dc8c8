//! Pieces of fabric and how they are held: a cell, a cut specimen, a picture frame, a pull-out.

use super::constituents::OnePly;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A periodic cell of whole repeats: x spans `warps` warp pitches, y spans `wefts` weft pitches.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(inline)]
pub struct Cell {
    /// Number of warp yarns, at least 2. Default 2.
    #[schemars(range(min = 2, max = 2000))]
    pub warps: usize,
    /// Number of weft yarns: even (a tricot repeats after two courses), at least 2. Default 4.
    #[schemars(range(min = 2, max = 2000))]
    pub wefts: usize,
}

impl Default for Cell {
    fn default() -> Self {
        Self { warps: 2, wefts: 4 }
    }
}

/// A periodic cell between smooth plates, which come together in the `move` steps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CellCompaction {
    /// Number of warp yarns, at least 2. Default 2.
    #[schemars(range(min = 2, max = 2000))]
    pub warps: usize,
    /// Number of weft yarns: even (a tricot repeats after two courses), at least 2. Default 4.
    #[schemars(range(min = 2, max = 2000))]
    pub wefts: usize,
    /// Distance of the plates at the end of a `move` step to 1, mm. Default 0.6.
    #[schemars(range(min = 0.001, max = 50))]
    pub thickness_mm: f64,
    /// Density of the fibres, g/cm³, for the fibre volume fraction. Default 1.8 (carbon).
    #[schemars(range(min = 0.1, max = 20))]
    pub fibre_density_g_cm3: f64,
}

impl Default for CellCompaction {
    fn default() -> Self {
        let Cell { warps, wefts } = Cell::default();
        Self { warps, wefts, thickness_mm: 0.6, fibre_density_g_cm3: 1.8 }
    }
}

/// A rectangle of fabric centred at the origin, its length along x, clamped at both ends. Its long edges are free.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Specimen {
    /// Length between the clamps, mm: H in Eqs 18 and 19 of the paper. Default 240.
    #[schemars(range(min = 1, max = 500))]
    pub length_mm: f64,
    /// Width, mm: W in Eqs 18 and 19. Default 80.
    #[schemars(range(min = 1, max = 500))]
    pub width_mm: f64,
    /// Angle from the length of the specimen to the warps, counter-clockwise seen from the warp side, degrees. Default 45.
    #[schemars(range(min = -90, max = 90))]
    pub warp_angle_deg: f64,
    /// Length of fabric inside each clamp, beyond `length_mm`, mm. All its nodes are held in all directions; with 0, only the
    /// nodes in the cut faces are. Default 0.
    #[schemars(range(min = 0, max = 200))]
    pub clamp_mm: f64,
    /// When the clamps begin to hold. Default `start`.
    pub clamps: Clamps,
    /// How threads behave at cuts. Default `held`.
    pub thread_ends: ThreadEnds,
    /// Displacement of the clamp at x > 0, away from the other clamp, at the end of the `move` step, mm. Default 60.
    #[schemars(range(min = 0, max = 200))]
    pub displacement_mm: f64,
}

/// A cross-shaped sample in a hinged frame, whose sides turn in `shear` steps and keep their length. Warps run along y, wefts along x.
/// In the arms of the cross only the yarns that run to the clamps are left.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PictureFrame {
    /// Side of the frame from hinge to hinge, mm: L_frame in Eqs 15 to 17 of the paper. Default 120.
    #[schemars(range(min = 1, max = 300))]
    pub frame_mm: f64,
    /// Side of the square in the middle where both plies are, mm: L_fabric in Eq. 17. Default 80.
    #[schemars(range(min = 1, max = 300))]
    pub fabric_mm: f64,
    /// How the ends of yarns are held. Default `pinned`.
    pub clamps: FrameClamps,
    /// Strain by which the clamps stretch the yarns in a `move` step to 1 before the frame shears. Default 0: there is no such step.
    #[schemars(range(min = 0, max = 0.05))]
    pub tension_strain: f64,
}

impl Default for PictureFrame {
    fn default() -> Self {
        Self { frame_mm: 120.0, fabric_mm: 80.0, clamps: FrameClamps::Pinned, tension_strain: 0.0 }
    }
}

/// A rectangle of fabric whose middle yarn is pulled along itself, along x. The yarns across it are held at both ends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PullOut {
    /// The ply that the yarn belongs to. Default `warp`.
    pub ply: OnePly,
    /// Length of the piece along the pulled yarn, mm. Default 20.
    #[schemars(range(min = 1, max = 400))]
    pub length_mm: f64,
    /// Width of the piece, mm. Default 20.
    #[schemars(range(min = 1, max = 400))]
    pub width_mm: f64,
    /// Displacement of the pulled end at the end of the `move` step, mm. Default 1.
    #[schemars(range(min = 0, max = 200))]
    pub displacement_mm: f64,
}

impl Default for PullOut {
    fn default() -> Self {
        Self { ply: OnePly::Warp, length_mm: 20.0, width_mm: 20.0, displacement_mm: 1.0 }
    }
}

/// How a picture frame holds the ends of yarns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FrameClamps {
    /// By the fibres in the middle of each yarn, as by a needle: yarns turn with the frame.
    #[default]
    Pinned,
    /// By all fibres: as the frame turns, every yarn is sheared by the angle of the frame, since its fibres keep their length.
    Glued,
}

/// When clamps begin to hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Clamps {
    /// From the start: the stitch tightens between held ends.
    #[default]
    Start,
    /// From the end of the pretension step: until then the ends may draw in.
    AfterPretension,
}

/// How the stitch behaves where it is cut: at thread ends outside the clamps, and at loops through which no other loop passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ThreadEnds {
    /// Cut ends slide freely. As the stitch tightens, it draws in from the cuts and its loops unravel one after another.
    Free,
    /// One node of each cut end is tied to the yarn beside it, like a thread end caught between fibres. Needs contact.
    #[default]
    Held,
}

impl Default for Specimen {
    fn default() -> Self {
        Self {
            length_mm: 240.0,
            width_mm: 80.0,
            warp_angle_deg: 45.0,
            clamp_mm: 0.0,
            clamps: Clamps::Start,
            thread_ends: ThreadEnds::Held,
            displacement_mm: 60.0,
        }
    }
}

impl Specimen {
    /// Half the length of the fabric, clamps included, and half its width, mm.
    pub fn half(&self) -> [f64; 2] {
        [0.5 * self.length_mm + self.clamp_mm, 0.5 * self.width_mm]
    }
}

/// A rectangle of fabric, its warps along x, clamped at both ends between two plates that come together; the lower one slides along x.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ToolFriction {
    /// Length between the clamps, mm. Default 15.
    #[schemars(range(min = 1, max = 400))]
    pub length_mm: f64,
    /// Width, mm. Default 15.
    #[schemars(range(min = 1, max = 400))]
    pub width_mm: f64,
    /// Distance of the plates at the end of a `move` step to 1, mm. Default 0.9.
    #[schemars(range(min = 0.001, max = 50))]
    pub thickness_mm: f64,
    /// Way of the sliding plate at the end of a `move` step to 1, mm. Default 8.
    #[schemars(range(min = 0.001, max = 200))]
    pub slide_mm: f64,
    /// Coulomb friction coefficient of that plate against yarns and threads. Default 0.3.
    #[schemars(range(min = 0.001, max = 2))]
    pub coefficient: f64,
}

impl Default for ToolFriction {
    fn default() -> Self {
        Self { length_mm: 15.0, width_mm: 15.0, thickness_mm: 0.9, slide_mm: 8.0, coefficient: 0.3 }
    }
}
