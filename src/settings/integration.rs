//! Time integration, integration over hexahedra, and the limits at which a run stops.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Time integration, and integration over hexahedra.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Integration {
    /// Fixed time step, s, or `null` for the estimated limit times `safety`. Default null.
    #[schemars(range(min = 1e-12, max = 0.001))]
    pub dt_s: Option<f64>,
    /// Upper bound on a time step that follows the estimate, s. Default 5e-7.
    #[schemars(range(min = 1e-12, max = 0.001))]
    pub dt_max_s: f64,
    /// Factor on the estimated limit, above 0 to 1. Default 0.9.
    #[schemars(range(min = 0.01, max = 1))]
    pub safety: f64,
    /// `f32` or `f64`. Default f32.
    pub precision: Precision,
    /// Integration of stress over a hexahedron. Default full.
    pub hexahedra: Hexahedra,
    /// Hourglass stiffness of `reduced` hexahedra, relative to the stiffness that full integration with the shear modulus of the
    /// yarn gives. Near 0, yarns fold into hourglass modes; higher values stiffen the yarns. `full` ignores it. Default 1.
    #[schemars(range(min = 0, max = 1000))]
    pub hourglass: f64,
    /// Relative error of the energy balance at which the run stops. Default 0.1.
    #[schemars(range(min = 1e-6, max = 100))]
    pub energy_tolerance: f64,
    /// Penetration at which the run stops, as a share of the thread radius (threads) or yarn thickness (yarns). Default 0.5.
    #[schemars(range(min = 0.01, max = 100))]
    pub penetration_tolerance: f64,
    /// Maximum number of rollbacks. When a guard trips, the run returns to an earlier state, 1000 steps or more back if there are
    /// as many, and continues with half the time step. With 0 the guard stops the run. Default 0.
    #[schemars(range(min = 0, max = 20))]
    pub retries: usize,
    /// Amplitude of an initial perturbation of the nodes along each axis, mm. It shows how far results scatter by chance. Every
    /// body has its own smooth pattern that strains no fibres: yarns move across their fibres, threads in all directions and
    /// differently from lap to lap, prescribed nodes not at all. A negative number mirrors the pattern. Default 0.
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
    /// Eight Gauss points.
    #[default]
    Full,
    /// One Gauss point, with hourglass control. Steps are cheaper, but shorter where edges of hexahedra turn away from their mean
    /// fibre direction, and layers of hexahedra lack the bending stiffness of their fibres.
    Reduced,
}
