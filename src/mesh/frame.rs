//! The deformed state of a mesh at one moment, the source of measures, files and pictures.

use super::{Mesh, Seen};
use crate::error::{Error, Result};

/// A deformed state. Fields are named with their unit, as ParaView shows them.
#[derive(Debug, Clone, Default)]
pub struct Frame {
    /// Time, s.
    pub time: f64,
    /// Shear angle γ of the periodic cell, degrees.
    pub angle_deg: f64,
    /// Largest prescribed displacement of a free scene, mm: the displacement of a specimen's clamp.
    pub displacement_mm: f64,
    /// Macroscopic deformation gradient F̄ (in-plane part, rows first); identity for free scenes.
    pub gradient: [[f64; 2]; 2],
    /// Current position of every node, mm.
    pub positions: Vec<[f64; 3]>,
    /// Fields on nodes.
    pub node_fields: Vec<Field>,
    /// Fields on hexahedra, blocks in order, slices fastest, then columns, then layers.
    pub hex_fields: Vec<Field>,
    /// Fields on beams, threads in order.
    pub beam_fields: Vec<Field>,
}

/// A named field: one or three numbers per item.
#[derive(Debug, Clone)]
pub struct Field {
    pub name: String,
    /// 1 or 3.
    pub components: usize,
    pub values: Vec<f64>,
}

impl Frame {
    /// Displacement of periodic image `[i, j]` of a cell with lengths `period`, mm: F̄·(i Lx, j Ly).
    pub fn shift(&self, period: [f64; 2], image: [i32; 2]) -> [f64; 3] {
        let [x, y] = [f64::from(image[0]) * period[0], f64::from(image[1]) * period[1]];
        let [[a, b], [c, d]] = self.gradient;
        [a * x + b * y, c * x + d * y, 0.0]
    }

    /// Current position of a node in an image, mm.
    pub fn position(&self, mesh: &Mesh, seen: Seen) -> [f64; 3] {
        let [x, y, z] = self.positions[seen.node];
        let [dx, dy, dz] = self.shift(mesh.period.unwrap_or_default(), seen.image);
        [x + dx, y + dy, z + dz]
    }

    /// Whether positions and fields have as many values as the mesh has items; the error names the first mismatch.
    pub fn check(&self, mesh: &Mesh) -> Result<()> {
        let sized = |name: &str, count: usize, wanted: usize| {
            if count == wanted {
                return Ok(());
            }
            Err(Error::geometry(format!("frame, {name}"), format!("{count} values where the mesh needs {wanted}")))
        };
        sized("positions", self.positions.len(), mesh.nodes.len())?;
        for (fields, items) in
            [(&self.node_fields, mesh.nodes.len()), (&self.hex_fields, mesh.hexes()), (&self.beam_fields, mesh.beams())]
        {
            for field in fields {
                if field.components != 1 && field.components != 3 {
                    let message = format!("{} components; 1 or 3 can be written", field.components);
                    return Err(Error::geometry(format!("frame, field {}", field.name), message));
                }
                sized(&format!("field {}", field.name), field.values.len(), items * field.components)?;
            }
        }
        Ok(())
    }
}
