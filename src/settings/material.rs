//! The constitutive law of a yarn and its parameters.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Constitutive law of a yarn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Material {
    /// Transversely isotropic hyperelastic law of fibre bundles (Charmetant et al.; Eqs 4 to 7 of the paper).
    Charmetant {
        /// Tensile stiffness along the fibres, MPa. Paper: 108500.
        #[schemars(range(min = 0.001, max = 1e7))]
        k_elong_mpa: f64,
        /// Stiffness of cross-sectional compaction, MPa. Paper: 1.25.
        #[schemars(range(min = 0, max = 1e6))]
        k_comp_mpa: f64,
        /// Exponent of cross-sectional compaction, above 1. Paper: 1.84.
        #[schemars(range(min = 1.01, max = 10))]
        p_comp: f64,
        /// Transverse shear (distortion) stiffness, MPa. Paper: 0.6.
        #[schemars(range(min = 0, max = 1e6))]
        k_dist_mpa: f64,
        /// Longitudinal shear stiffness, MPa. Paper: 2.2.
        #[schemars(range(min = 0, max = 1e6))]
        k_sh_mpa: f64,
        /// Compaction |I_comp| below which a parabola replaces the power law, whose tangent is infinite at zero for exponents
        /// below 2. 0 turns it off. Default 1e-3.
        #[serde(default = "compaction_cap")]
        #[schemars(range(min = 0, max = 0.1))]
        compaction_cap: f64,
    },
    /// Compressible neo-Hookean solid, for verification.
    NeoHookean {
        /// Young's modulus at small strain, MPa.
        #[schemars(range(min = 0.001, max = 1e7))]
        young_mpa: f64,
        /// Poisson's ratio at small strain, 0 to 0.49.
        #[schemars(range(min = 0, max = 0.49))]
        poisson: f64,
    },
}

fn compaction_cap() -> f64 {
    1e-3
}
