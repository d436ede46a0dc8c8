//! The outer surface of a block: a ring of fibre lines around the section, with quadrilaterals between neighbouring lines and
//! slices, and for an open block the caps at both ends. The surface is therefore closed, or infinite along the fibre.

use super::vector::{add, cross, norm, scale, sub};
use super::{Block, Mesh, Seen};
use std::collections::BTreeSet;

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

    /// Number of faces along the fibres.
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

    /// Corners of the faces that close an open block at both ends, counter-clockwise seen from outside; none for a closed block.
    pub fn caps(&self) -> Vec<[Seen; 4]> {
        if self.block.wrap.is_some() {
            return Vec::new();
        }
        let Block { slices, columns, layers, .. } = *self.block;
        let places = (0..layers).flat_map(|l| (0..columns).map(move |c| (c, l)));
        let first = |(c, l)| [[c, l], [c, l + 1], [c + 1, l + 1], [c + 1, l]].map(|[c, l]| self.block.node(0, c, l));
        let last =
            |(c, l)| [[c, l], [c + 1, l], [c + 1, l + 1], [c, l + 1]].map(|[c, l]| self.block.node(slices, c, l));
        places.clone().map(first).chain(places.map(last)).collect()
    }

    /// Corners of all faces: slice by slice around the ring, then the caps.
    pub fn closed(&self) -> Vec<[Seen; 4]> {
        let along = (0..self.block.slices).flat_map(|slice| (0..self.ring()).map(move |r| self.face(r, slice)));
        along.chain(self.caps()).collect()
    }

    /// Tributary area of each node on the surface along the fibres, mm², lines around the ring first, stations fastest: the
    /// integral of the bilinear shape functions (2 × 2 Gauss points).
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

/// The edges (from a corner to the next one) and corners that each face of a closed surface owns. Every edge and corner is owned
/// once, by the first face that has it.
pub fn owned(faces: &[[Seen; 4]]) -> Vec<[[bool; 4]; 2]> {
    let (mut edges, mut corners) = (BTreeSet::new(), BTreeSet::new());
    let owned = faces.iter().map(|face| {
        let edge = |a: usize| {
            let ends = [face[a], face[(a + 1) % 4]];
            let apart = |from: Seen, to: Seen| [to.image[0] - from.image[0], to.image[1] - from.image[1]];
            let [there, back] = [(ends[0], ends[1]), (ends[1], ends[0])].map(|(a, b)| (a.node, b.node, apart(a, b)));
            there.min(back)
        };
        let edges = [0, 1, 2, 3].map(|a| edges.insert(edge(a)));
        [edges, face.map(|corner| corners.insert(corner.node))]
    });
    owned.collect()
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
    use crate::mesh::Ply;
    use crate::settings::material::Material;

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

    /// Faces less edges plus corners.
    fn euler(block: &Block) -> i64 {
        let faces = Surface::new(block).closed();
        let count = |owned: [bool; 4]| owned.iter().filter(|is_owned| **is_owned).count() as i64;
        let owned = owned(&faces);
        faces.len() as i64 + owned.iter().map(|[edges, corners]| count(*corners) - count(*edges)).sum::<i64>()
    }

    #[test]
    fn surfaces_are_closed_and_every_edge_and_corner_is_owned_once() {
        for (columns, layers) in [(1, 1), (4, 2), (3, 3)] {
            let open = block(columns, layers);
            assert_eq!(euler(&open), 2, "a ball");
            for slices in [1, 2, 5] {
                assert_eq!(
                    euler(&Block { slices, wrap: Some([0, 1]), ..block(columns, layers) }),
                    0,
                    "a tube in a ring"
                );
            }
            // every edge is in two faces, in opposite directions
            let faces = Surface::new(&open).closed();
            let edges = faces.iter().flat_map(|face| (0..4).map(|a| (face[a].node, face[(a + 1) % 4].node)));
            let mut balance = std::collections::BTreeMap::new();
            edges.for_each(|(a, b)| *balance.entry((a.min(b), a.max(b))).or_insert(0) += if a < b { 3 } else { 5 });
            assert!(balance.values().all(|sum| *sum == 8));
        }
    }

    #[test]
    fn shares_of_a_trapezium_follow_its_width() {
        let shares = corner_shares([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
        assert!((shares.iter().sum::<f64>() - 1.5).abs() < 1e-14);
        assert!(shares[0] > shares[3]);
    }
}
