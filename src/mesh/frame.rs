//! The deformed state of a mesh at one moment: what measures, files and pictures are made from.

/// A deformed state. Fields are named with their unit, as ParaView shows them.
#[derive(Debug, Clone, Default)]
pub struct Frame {
    /// Time, s.
    pub time: f64,
    /// Shear angle γ of the periodic cell, degrees.
    pub angle_deg: f64,
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

/// A named field: one or three numbers an item.
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
}
