//! The effects of a scene. An absent effect leaves no buffer, no stage and no work.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Which effects the scene has, and the numerical parameters of each.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Effects {
    /// Contact, by kind of pair. `null` turns it off.
    pub contact: Option<Contact>,
    /// Bending stiffness of threads. Default true.
    pub bending: bool,
    /// Damping of velocities. `null` turns it off.
    pub damping: Option<Damping>,
    /// Selective mass scaling along fibres and threads. It raises the time-step limit set by their axial stiffness and adds no
    /// inertia to rigid motion. `null` turns it off.
    pub fibre_lines: Option<FibreLines>,
    /// Contact-aware mass: nodal mass added only where and while contact or crushed elements would limit the time step. `null`
    /// turns it off.
    pub contact_mass: Option<ContactMass>,
    /// Minimum nodal mass (mass floor), as a share of the body's mean nodal mass. It applies to light nodes at truncated edges
    /// and on short beams. 0 turns it off. Default 0.5.
    #[schemars(range(min = 0, max = 1))]
    pub mass_floor: f64,
    /// Gravity, mm/s². `null` (the default) turns it off.
    #[schemars(inner(range(min = -1e7, max = 1e7)))]
    pub gravity_mm_s2: Option<[f64; 3]>,
}

impl Default for Effects {
    fn default() -> Self {
        Self {
            contact: Some(Contact::default()),
            bending: true,
            damping: Some(Damping::default()),
            fibre_lines: Some(FibreLines::default()),
            contact_mass: Some(ContactMass::default()),
            mass_floor: 0.5,
            gravity_mm_s2: None,
        }
    }
}

/// Penalty contact with Coulomb friction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Contact {
    /// Threads against yarns. Default true.
    pub thread_yarn: bool,
    /// Yarns against yarns: ply on ply and lateral neighbours. Default true.
    pub yarn_yarn: bool,
    /// Threads against threads. Default true.
    pub thread_thread: bool,
    /// Penalty stiffness of a thread per length, N/mm². Default 140 (30 N/mm at a node with a tributary length of 0.22 mm).
    #[schemars(range(min = 1e-6, max = 1e9))]
    pub thread_penalty_n_mm2: f64,
    /// Penalty stiffness of a yarn surface per area, N/mm³. Default 65 (5 N/mm at a node with a tributary area of 0.078 mm²).
    #[schemars(range(min = 1e-6, max = 1e9))]
    pub yarn_penalty_n_mm3: f64,
    /// Penalty stiffness between threads per length of contact, N/mm². Default 660. Threads that cross at right angles then
    /// follow Hertz contact with a contact modulus E* of twice this number, in MPa: 0.1 N presses threads of 0.1 mm radius
    /// together by 3 µm.
    #[schemars(range(min = 1e-6, max = 1e9))]
    pub thread_thread_penalty_n_mm2: f64,
    /// Stiffness of the ties between cut threads and yarns, N/mm. Default 30, as for a thread node on a yarn.
    #[schemars(range(min = 1e-6, max = 1e9))]
    pub tie_n_mm: f64,
    /// Coulomb friction with true stick. The coefficient belongs to the fabric. Default true.
    pub friction: bool,
    /// Ratio of tangential to normal penalty stiffness, above 0 to 1. Default 0.5.
    #[schemars(range(min = 0.001, max = 1))]
    pub tangential_ratio: f64,
    /// Damping of the normal approach, as a share of critical damping. Default 0.1.
    #[schemars(range(min = 0, max = 1))]
    pub damping_ratio: f64,
    /// Contact skin (Verlet skin): gap below which a pair becomes a contact candidate, mm. Default 0.12.
    #[schemars(range(min = 1e-4, max = 5))]
    pub skin_mm: f64,
    /// Contact radius of threads at the start of pre-tension over the full radius, above 0 to 1. The radius grows to full size
    /// over the first half of pre-tension. Use a value below 1 for threads that start inside a yarn. Default 1.
    #[schemars(range(min = 0.05, max = 1))]
    pub initial_radius_ratio: f64,
}

impl Default for Contact {
    fn default() -> Self {
        Self {
            thread_yarn: true,
            yarn_yarn: true,
            thread_thread: true,
            thread_penalty_n_mm2: 140.0,
            yarn_penalty_n_mm3: 65.0,
            thread_thread_penalty_n_mm2: 660.0,
            tie_n_mm: 30.0,
            friction: true,
            tangential_ratio: 0.5,
            damping_ratio: 0.1,
            skin_mm: 0.12,
            initial_radius_ratio: 1.0,
        }
    }
}

/// Mass-proportional damping. In a periodic cell it acts on the fluctuation, not on the affine motion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Damping {
    /// Rate for every node, 1/s. Default 2000.
    #[schemars(range(min = 0, max = 1e7))]
    pub rate_per_s: f64,
    /// Rate for threads during pretension and settle steps, 1/s. Default 20000.
    #[schemars(range(min = 0, max = 1e7))]
    pub thread_settle_rate_per_s: f64,
    /// Rate for every node during move steps, and shear steps of a picture frame, 1/s. There the fabric moves as a whole, and the damping acts like a surrounding
    /// medium at rest. `null` (the default) takes `rate_per_s`.
    #[schemars(range(min = 0, max = 1e7))]
    pub move_rate_per_s: Option<f64>,
}

impl Default for Damping {
    fn default() -> Self {
        Self { rate_per_s: 2000.0, thread_settle_rate_per_s: 2e4, move_rate_per_s: None }
    }
}

/// Fibre-line selective mass scaling.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FibreLines {
    /// Strength β of the added inertia β dt² K; at least 0.25. Default 0.5.
    #[schemars(range(min = 0.25, max = 100))]
    pub beta: f64,
    /// Whether threads are scaled as well. Default true.
    pub threads: bool,
}

impl Default for FibreLines {
    fn default() -> Self {
        Self { beta: 0.5, threads: true }
    }
}

/// Contact-aware nodal mass.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ContactMass {
    /// Factor on the mass dt²/4·K that a contact of stiffness K requires at a node. With 1, contact oscillates at the stability
    /// limit and gains energy when it opens and closes. Default 2.
    #[schemars(range(min = 0, max = 100))]
    pub factor: f64,
    /// Share of the added mass that remains after each step once contact is lost, 0 to 1. Mass that comes and goes with contact
    /// would add energy. Default 0.999.
    #[schemars(range(min = 0, max = 1))]
    pub memory: f64,
    /// Lower bound on the time-step limit, s. Nodes whose elements alone would require a shorter step are made heavier, in
    /// contact or not. Default 0: no bound.
    #[schemars(range(min = 0, max = 1e-3))]
    pub least_limit_s: f64,
}

impl Default for ContactMass {
    fn default() -> Self {
        Self { factor: 2.0, memory: 0.999, least_limit_s: 0.0 }
    }
}
