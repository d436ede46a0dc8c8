//! The outer surface of a block along its fibres: a ring of fibre lines around the section, and quadrilaterals between
//! neighbouring lines and slices. The end caps of an open block are not part of it.

use super::vector::{add, cross, norm, scale, sub};
use super::{Block, Mesh, Seen};

/// The structured surface of a block. Faces and nodes have a place around the ring, counter-clockwise seen against ξ from
/// the corner at column 0 and layer 0, and a place along the slices.
#[derive(Debug, Clone, Copy)]
pub struct Surface<'a> {
    block: &'a Block,
}

impl<'a> Surface<'a> {
    pub fn new(block: &'a Block) -> Self {
        Self { block }
    }

    /// Number of fibre lines around the section, which is also the number of faces around it.
    pub fn ring(&self) -> usize {
        2 * (self.block.columns + self.block.layers)
    }

    /// Number of faces.
    pub fn faces(&self) -> usize {
        self.ring() * self.block.slices
    }

    /// Column and layer of a place around the ring.
    pub fn line(&self, r: usize) -> [usize; 2] {
        let [columns, layers] = [self.block.columns, self.block.layers];
        match r {
            r if r < columns => [r, 0],
            r if r < columns + layers => [columns, r - columns],
            r if r < 2 * columns + layers => [2 * columns + layers - r, layers],
            r => [0, 2 * (columns + layers) - r],
        }
    }

    /// Place around the ring of the line at a column and layer; `None` inside the block.
    pub fn place(&self, column: usize, layer: usize) -> Option<usize> {
        let [columns, layers] = [self.block.columns, self.block.layers];
        if layer == 0 {
            Some(column)
        } else if column == columns {
            Some(columns + layer)
        } else if layer == layers {
            Some(2 * columns + layers - column)
        } else if column == 0 {
            Some(2 * (columns + layers) - layer)
        } else {
            None
        }
    }

    /// Place around the ring and along the slices of a node of the block; `None` inside the block.
    pub fn place_of(&self, node: usize) -> Option<[usize; 2]> {
        let stations = self.block.stations();
        let [line, station] = [(node - self.block.first) / stations, (node - self.block.first) % stations];
        let columns = self.block.columns + 1;
        Some([self.place(line % columns, line / columns)?, station])
    }

    /// The node at a place around the ring and a slice boundary (0 ..= slices).
    pub fn node(&self, r: usize, slice: usize) -> Seen {
        let [column, layer] = self.line(r);
        self.block.node(slice, column, layer)
    }

    /// Corners of the face behind ring place `r` in a slice, counter-clockwise seen from outside.
    pub fn face(&self, r: usize, slice: usize) -> [Seen; 4] {
        let next = (r + 1) % self.ring();
        [self.node(r, slice), self.node(next, slice), self.node(next, slice + 1), self.node(r, slice + 1)]
    }

    /// Share of the surface that belongs to each node in mm², lines around the ring first, stations fastest: the integral
    /// of the bilinear shape functions (2 × 2 points).
    pub fn tributary_areas(&self, mesh: &Mesh) -> Vec<f64> {
        let stations = self.block.stations();
        let mut areas = vec![0.0; self.ring() * stations];
        for r in 0..self.ring() {
            for slice in 0..self.block.slices {
                let shares = corner_shares(self.face(r, slice).map(|n| mesh.position(n)));
                for (corner, share) in shares.into_iter().enumerate() {
                    let line = (r + usize::from(corner == 1 || corner == 2)) % self.ring();
                    let station = (slice + usize::from(corner >= 2)) % stations;
                    areas[line * stations + station] += share;
                }
            }
        }
        areas
    }
}

/// Integral of each corner's bilinear shape function over a quadrilateral.
fn corner_shares([a, b, c, d]: [[f64; 3]; 4]) -> [f64; 4] {
    let gauss = 0.5 / 3f64.sqrt();
    let mut shares = [0.0; 4];
    for [s, t] in [[-gauss, -gauss], [gauss, -gauss], [gauss, gauss], [-gauss, gauss]].map(|p| p.map(|x| 0.5 + x)) {
        let along = add(scale(sub(b, a), 1.0 - t), scale(sub(c, d), t));
        let up = add(scale(sub(d, a), 1.0 - s), scale(sub(c, b), s));
        let area = 0.25 * norm(cross(along, up));
        for (share, weight) in shares.iter_mut().zip([(1.0 - s) * (1.0 - t), s * (1.0 - t), s * t, (1.0 - s) * t]) {
            *share += weight * area;
        }
    }
    shares
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::fabric::Material;
    use crate::mesh::Ply;

    fn block(columns: usize, layers: usize) -> Block {
        Block {
            name: String::new(),
            ply: Ply::Free,
            first: 7,
            slices: 3,
            columns,
            layers,
            wrap: None,
            fibre: [1.0, 0.0, 0.0],
            density: 1.0,
            material: Material::NeoHookean { young_mpa: 1.0, poisson: 0.0 },
            velocity: [0.0; 3],
        }
    }

    #[test]
    fn places_and_lines_are_inverse_and_the_inside_has_none() {
        for (columns, layers) in [(1, 1), (4, 2), (3, 3)] {
            let block = block(columns, layers);
            let surface = Surface::new(&block);
            for r in 0..surface.ring() {
                let [column, layer] = surface.line(r);
                assert_eq!(surface.place(column, layer), Some(r));
                assert_eq!(surface.place_of(surface.node(r, 2).node), Some([r, 2]));
            }
            let inside = (0..=columns).flat_map(|c| (0..=layers).map(move |l| (c, l)));
            let inside = inside.filter(|&(c, l)| surface.place(c, l).is_none()).count();
            assert_eq!(inside, (columns - 1) * (layers - 1));
        }
    }

    #[test]
    fn shares_of_a_trapezium_follow_its_width() {
        let shares = corner_shares([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
        assert!((shares.iter().sum::<f64>() - 1.5).abs() < 1e-14);
        assert!(shares[0] > shares[3]);
    }
}
