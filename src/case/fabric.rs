//! Parameters of a fabric: yarns, stitch, materials, friction. Usually a separate file, shared between cases.

use crate::settings::friction::Friction;
use crate::settings::material::Material;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A biaxial non-crimp fabric: two plies of straight yarns bound by a warp-knitted stitch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fabric {
    /// Name for reports.
    #[schemars(length(min = 1, max = 200))]
    pub name: String,
    /// Yarns along y, on the zig-zag face (z > 0).
    pub warp: Yarn,
    /// Yarns along x, on the looped face (z < 0).
    pub weft: Yarn,
    /// The thread that binds both plies.
    pub stitch: Stitch,
    /// Coulomb friction coefficient of every contact, 0 to 2, or coefficients by kind of pair. Paper: 0.2 for all.
    pub friction: Friction,
    /// Distance between the two plies before pre-tension, mm. Default 0.
    #[serde(default)]
    #[schemars(range(min = 0, max = 10))]
    pub ply_gap_mm: f64,
}

/// Yarns of one ply: a straight extrusion of a truncated ellipse (Eq. 1 of the paper).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Yarn {
    /// Distance between neighbouring yarns, centre to centre, mm.
    #[schemars(range(min = 0.1, max = 100))]
    pub pitch_mm: f64,
    /// Width of the truncated section before pre-tension, mm.
    #[schemars(range(min = 0.05, max = 100))]
    pub width_mm: f64,
    /// Thickness at the centre before pre-tension, mm.
    #[schemars(range(min = 0.01, max = 20))]
    pub thickness_mm: f64,
    /// Truncated width over full width of the ellipse, 0.5 to 0.99. Default 0.95.
    #[serde(default = "truncation")]
    #[schemars(range(min = 0.5, max = 0.99))]
    pub truncation: f64,
    /// Mass of the ply per area, g/m². Sets the density, independent of the mesh. Paper: 300.
    #[schemars(range(min = 1, max = 10000))]
    pub areal_mass_g_m2: f64,
    /// Constitutive law of the yarn.
    pub material: Material,
    /// Sizes measured on the real fabric, for comparison; a run ignores them. Default null.
    #[serde(default)]
    pub measured: Option<Measured>,
}

/// Sizes of the yarns of a ply, mean and standard deviation, mm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Measured {
    /// Method of measurement, e.g. `tomography`.
    #[schemars(length(min = 1, max = 30))]
    pub by: String,
    /// Width, across the yarn.
    #[schemars(inner(range(min = 0, max = 100)))]
    pub width_mm: [f64; 2],
    /// Thickness at the centre.
    #[schemars(inner(range(min = 0, max = 20)))]
    pub thickness_mm: [f64; 2],
    /// Gap between neighbours.
    #[schemars(inner(range(min = 0, max = 100)))]
    pub gap_mm: [f64; 2],
}

impl Measured {
    /// Width, thickness and gap as text, mm.
    pub fn texts(&self) -> [String; 3] {
        [self.width_mm, self.thickness_mm, self.gap_mm].map(|[mean, spread]| format!("{mean:.2} ± {spread:.2}"))
    }
}

fn truncation() -> f64 {
    0.95
}

/// The stitch: one thread per wale.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stitch {
    /// Knitting pattern.
    #[serde(default)]
    pub pattern: Pattern,
    /// Whether the legs of a loop cross at its base.
    #[serde(default)]
    pub lap: Lap,
    /// Radius of the thread's envelope, for contact, mm. Paper: 0.1.
    #[schemars(range(min = 0.001, max = 5))]
    pub radius_mm: f64,
    /// Young's modulus referred to the area of the envelope, MPa; EA is the measured quantity. Paper: 350.
    #[schemars(range(min = 0.001, max = 1e7))]
    pub young_mpa: f64,
    /// Bending stiffness, N·mm². Paper: 5.6e-4.
    #[schemars(range(min = 0, max = 1000))]
    pub bending_n_mm2: f64,
    /// Mass per length, tex (g/km). Only sets inertia. Default: 43.4, a solid polyester thread of 0.1 mm radius,
    /// as in the paper; a real 76 dtex thread has 7.6.
    #[serde(default = "linear_density")]
    #[schemars(range(min = 0.01, max = 1e5))]
    pub linear_density_tex: f64,
    /// Thermal strain along the thread path that tightens the stitch, additive to the elastic strain (Eq. 14). 0 leaves it as generated. Paper: −0.15.
    #[schemars(range(min = -0.9, max = 0.5))]
    pub thermal_strain: f64,
    /// Share of the generated curvature that is stress-free: with 1, threads are stress-free as generated (as in Abaqus); with 0,
    /// when straight. Default 1.
    #[serde(default = "rest_curvature")]
    #[schemars(range(min = 0, max = 1))]
    pub rest_curvature: f64,
    /// Initial clearance between thread surface and yarn surface, mm. Default 0.01.
    #[serde(default = "clearance_yarn")]
    #[schemars(range(min = 0, max = 5))]
    pub clearance_yarn_mm: f64,
    /// Initial clearance between two thread surfaces, mm. This slack in the loops takes up part of the thermal strain. Default
    /// 0.03.
    #[serde(default = "clearance_thread")]
    #[schemars(range(min = 0, max = 5))]
    pub clearance_thread_mm: f64,
    /// Largest inward shift of the legs of a loop in the warp gap, mm. Default 0.12.
    #[serde(default = "leg_shift")]
    #[schemars(range(min = 0, max = 10))]
    pub leg_shift_mm: f64,
    /// Length over which an underlap turns from and into its legs, mm. Default 0.6.
    #[serde(default = "underlap_ramp")]
    #[schemars(range(min = 0.01, max = 50))]
    pub underlap_ramp_mm: f64,
}

fn linear_density() -> f64 {
    43.4
}
fn rest_curvature() -> f64 {
    1.0
}
fn clearance_yarn() -> f64 {
    0.01
}
fn clearance_thread() -> f64 {
    0.03
}
fn leg_shift() -> f64 {
    0.12
}
fn underlap_ramp() -> f64 {
    0.6
}

/// Knitting pattern of the stitch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Pattern {
    /// 1-0/1-2: every thread zig-zags between two wales.
    #[default]
    Tricot,
}

/// Closed laps cross their legs, open laps do not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Lap {
    #[default]
    Closed,
    Open,
}
