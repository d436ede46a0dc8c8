//! The simulated piece of fabric and its mesh resolution.

use crate::settings::friction::Friction;
use crate::settings::material::Material;
use crate::settings::tool::Tool;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The piece of fabric.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Domain {
    /// A periodic cell of whole repeats: x spans `warps` warp pitches, y spans `wefts` weft pitches.
    Cell(Cell),
    /// A periodic cell, compacted between plates.
    CellCompaction(CellCompaction),
    /// A rectangle cut from the fabric at an angle and pulled: the bias-extension test.
    Specimen(Specimen),
    /// A cross-shaped sample in a hinged frame (Fig. 14).
    PictureFrame(PictureFrame),
    /// A piece of the stitching thread, pulled along its length (Fig. 10 of the paper).
    ThreadTension(ThreadTension),
    /// A piece of the stitching thread, clamped at one end, that bends under its own weight (Fig. 11).
    Cantilever(Cantilever),
    /// A single yarn, sheared along its fibres by the outermost ones (Fig. 8).
    YarnShear(YarnShear),
    /// A single yarn, compacted between plates.
    YarnCompaction(YarnCompaction),
    /// A mesh written out in the case, for verification scenes.
    Mesh(InlineMesh),
}

impl InlineThread {
    /// Whether the thread is a ring: its first and last nodes coincide.
    pub fn is_ring(&self) -> bool {
        /// Nodes closer than this along every axis coincide, mm.
        const SAME_MM: f64 = 1e-6;
        let ends = self.nodes.first().zip(self.nodes.last());
        ends.is_some_and(|(first, last)| (0..3).all(|k| (first[k] - last[k]).abs() < SAME_MM))
    }
}

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

/// Mesh resolution of the fabric.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Resolution {
    /// Hexahedra across a warp yarn. Default 18.
    #[schemars(range(min = 1, max = 1000))]
    pub warp_columns: usize,
    /// Hexahedra across a weft yarn. Default 8.
    #[schemars(range(min = 1, max = 1000))]
    pub weft_columns: usize,
    /// Hexahedra through the thickness of a yarn. Default 2.
    #[schemars(range(min = 1, max = 100))]
    pub layers: usize,
    /// Length of a hexahedron along the fibre, mm; rounded so that a whole number fits the yarn. Default 0.303.
    #[schemars(range(min = 0.001, max = 50))]
    pub slice_mm: f64,
    /// Beams per lap (a loop and its underlap), graded by curvature. Default 90.
    #[schemars(range(min = 8, max = 10_000))]
    pub beams_per_lap: usize,
    /// Largest deviation of a lap from `beams_per_lap`, as a share of it. Some laps have more beams and others as many fewer, so
    /// that loops do not all slip at once. The deviation is rounded to whole beams, at least one; 0 makes all laps alike. Laps
    /// cut at the edge of a specimen have `beams_per_lap` beams. Default 0.05.
    #[schemars(range(min = 0, max = 0.2))]
    pub lap_variation: f64,
    /// Refinement factor for everything but the layers: it multiplies columns and beams and divides the slice length. Default 1.
    #[schemars(range(min = 0.1, max = 10))]
    pub finer: f64,
}

impl Default for Resolution {
    fn default() -> Self {
        Self {
            warp_columns: 18,
            weft_columns: 8,
            layers: 2,
            slice_mm: 0.303,
            beams_per_lap: 90,
            lap_variation: 0.05,
            finer: 1.0,
        }
    }
}

impl Resolution {
    /// The resolution with its factor applied.
    pub fn refined(&self) -> Self {
        let times = |count: usize| (count as f64 * self.finer).round() as usize;
        Self {
            warp_columns: times(self.warp_columns),
            weft_columns: times(self.weft_columns),
            layers: self.layers,
            slice_mm: self.slice_mm / self.finer,
            beams_per_lap: times(self.beams_per_lap),
            lap_variation: self.lap_variation,
            finer: 1.0,
        }
    }

    /// Largest difference in beams between a lap and [`Self::beams_per_lap`].
    pub fn lap_spread(&self) -> usize {
        let spread = (self.lap_variation * self.beams_per_lap as f64).round() as usize;
        if self.lap_variation > 0.0 { spread.max(1) } else { 0 }
    }
}
