//! Integration in time and over hexahedra, and the limits at which a run stops.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
