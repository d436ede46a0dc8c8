//! The mesh resolution of a fabric.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
