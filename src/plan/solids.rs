//! Tables of the hexahedra: blocks of sixteen lanes, shapes, corner slots of nodes, lumped mass, stiffness of fibre lines.

use super::shapes::{self, GAUSS, Point};
use crate::dynamics::assemble::{NONE, SOLID};
use crate::elements::LANES;
use crate::elements::block::Header;
use crate::error::{Error, Result};
use crate::kernel::position::{QUANTUM, quanta};
use crate::materials::{self, Law};
use crate::mesh::{Block, CORNER_SIGNS, Mesh, Seen};
use std::collections::{BTreeMap, HashMap};

/// Tables of all hexahedra of a mesh.
#[derive(Default)]
pub struct Solids {
    pub headers: Vec<Header>,
    /// Corner nodes, `[block][corner][lane]`.
    pub corners: Vec<u32>,
    pub shapes: Vec<f64>,
    pub frames: Vec<f64>,
    pub materials: Vec<f64>,
    /// Range of blocks of each law.
    pub laws: Vec<(Law, std::ops::Range<usize>)>,
    /// Block and lane of each hexahedron, in the order of the mesh.
    pub place: Vec<(usize, usize)>,
    /// Corner slots of each solid node: index of the x force.
    pub slots: Vec<u32>,
    /// Indices of the corner stiffness bounds of each solid node.
    pub bounds: Vec<u32>,
    /// Lumped mass of solid nodes, tonne.
    pub mass: Vec<f64>,
    /// Axial stiffness of the segment that starts at each solid node, N/mm.
    pub line_stiffness: Vec<f64>,
    /// Reference volume of the hexahedra, mm³, in the order of the mesh.
    pub volume: Vec<f64>,
}

/// A hexahedron of the mesh.
struct Hex {
    /// Index in the order of the mesh.
    index: usize,
    block: usize,
    corners: [Seen; 8],
}

impl Solids {
    /// Tables of a mesh; an hourglass coefficient selects hexahedra with reduced integration.
    ///
    /// # Errors
    /// Names an inverted hexahedron.
    pub fn new(mesh: &Mesh, hourglass: Option<f64>) -> Result<Self> {
        let nodes = mesh.first_thread_node();
        let mut tables = Self {
            mass: vec![0.0; nodes],
            line_stiffness: vec![0.0; nodes],
            slots: vec![NONE; SOLID * nodes],
            bounds: vec![NONE; SOLID * nodes],
            place: vec![(0, 0); mesh.hexes()],
            volume: vec![0.0; mesh.hexes()],
            ..Self::default()
        };
        let frames: Vec<_> = mesh.blocks.iter().map(|b| frame(b.fibre)).collect();
        tables.frames = frames.iter().flatten().flatten().copied().collect();
        // blocks of lanes by law, fibre direction and material: runs of sixteen along a line first, the rest afterwards
        let mut groups: BTreeMap<(Law, usize), (Vec<Hex>, Vec<Hex>)> = BTreeMap::new();
        let mut index = 0;
        for (number, block) in mesh.blocks.iter().enumerate() {
            let (law, parameters, _) = materials::choose(&block.material);
            tables.materials.extend(parameters);
            let like = |other: &Block| other.fibre == block.fibre && other.material == block.material;
            let group = mesh.blocks.iter().position(like).unwrap_or(number);
            let (runs, rest) = groups.entry((law, group)).or_default();
            for layer in 0..block.layers {
                for column in 0..block.columns {
                    for slice in 0..block.slices {
                        let hex = Hex { index, block: number, corners: block.corners(slice, column, layer) };
                        index += 1;
                        if slice < block.slices / LANES * LANES { runs.push(hex) } else { rest.push(hex) }
                    }
                }
            }
        }
        let mut shapes = HashMap::new();
        for ((law, group), (runs, rest)) in groups {
            let first = tables.headers.len();
            for hexes in runs.chunks(LANES).chain(rest.chunks(LANES)) {
                tables.push(mesh, hourglass, &frames[group], group, hexes, &mut shapes)?;
            }
            let end = tables.headers.len();
            match tables.laws.last_mut() {
                Some((known, range)) if *known == law => range.end = end,
                _ => tables.laws.push((law, first..end)),
            }
        }
        Ok(tables)
    }

    /// Adds a block of up to sixteen hexahedra; empty lanes repeat the last one with zero volume.
    fn push(
        &mut self,
        mesh: &Mesh,
        hourglass: Option<f64>,
        frame: &[[f64; 3]; 3],
        group: usize,
        hexes: &[Hex],
        shapes: &mut HashMap<(usize, Vec<i32>), u32>,
    ) -> Result<()> {
        let number = self.headers.len();
        let last = hexes.len() - 1;
        let lane = |l: usize| &hexes[l.min(last)];
        let edges = |hex: &Hex| {
            let origin = mesh.position(hex.corners[0]).map(quanta);
            hex.corners.map(|c| mesh.position(c).map(quanta)).map(|c| [0, 1, 2].map(|k| c[k] - origin[k]))
        };
        let mut key: Vec<i32> = Vec::with_capacity(LANES * 24 + 1);
        for l in 0..LANES {
            key.extend(edges(lane(l)).iter().flatten());
            key.push(i32::from(l > last));
        }
        let mut elements = Vec::with_capacity(hexes.len());
        for (l, hex) in hexes.iter().enumerate() {
            let block = &mesh.blocks[hex.block];
            let corners = local(&edges(hex), frame);
            let element = shapes::points(&corners).map_err(|volume| upside_down(mesh, block, hex, volume))?;
            self.lump(block, hex, &element);
            self.place[hex.index] = (number, l);
            for (corner, seen) in hex.corners.iter().enumerate() {
                let slot = (number * 8 + corner) * LANES + l;
                let force = (number * 8 + corner) * 3 * LANES + l;
                put(&mut self.bounds, seen.node, slot);
                put(&mut self.slots, seen.node, force);
            }
            elements.push((element, corners));
        }
        let shape = *shapes.entry((group, key)).or_insert_with(|| {
            let modulus = materials::shear_modulus(&mesh.blocks[hexes[0].block].material);
            let numbers = |(points, corners): &([Point; 8], [[f64; 3]; 8])| match hourglass {
                None => shapes::full(points),
                Some(coefficient) => shapes::reduced(points, corners, coefficient * modulus),
            };
            let numbers: Vec<Vec<f64>> = elements.iter().map(numbers).collect();
            let size = numbers[0].len();
            let shape = self.shapes.len() / (size * LANES);
            for entry in 0..size {
                self.shapes.extend((0..LANES).map(|l| numbers.get(l).map_or(0.0, |n| n[entry])));
            }
            shape as u32
        });
        let ids: Vec<u32> =
            (0..8).flat_map(|c| (0..LANES).map(move |l| (c, l))).map(|(c, l)| lane(l).corners[c].node as u32).collect();
        let contiguous = ids.chunks(LANES).all(|c| c.windows(2).all(|w| w[1] == w[0] + 1));
        self.corners.extend(ids);
        self.headers.push(Header {
            material: group as u32,
            frame: group as u32,
            shape,
            contiguous: u32::from(contiguous),
        });
        Ok(())
    }

    /// Adds an element's mass and axial stiffness to its nodes.
    fn lump(&mut self, block: &Block, hex: &Hex, points: &[Point; 8]) {
        let (_, _, fibre_stiffness) = materials::choose(&block.material);
        let mut axial = [0.0; 8];
        for (point, (inverse, volume)) in points.iter().enumerate() {
            self.volume[hex.index] += volume;
            for corner in 0..8 {
                let mut weight = 1.0;
                let mut section = 1.0;
                for (k, sign) in CORNER_SIGNS[corner].iter().enumerate() {
                    let factor = 0.5 * (1.0 + sign * GAUSS * if point >> k & 1 == 1 { 1.0 } else { -1.0 });
                    weight *= factor;
                    section *= if k == 0 { 1.0 } else { factor };
                }
                self.mass[hex.corners[corner].node] += block.density * volume * weight;
                // derivative of the linear shape function along the fibre
                let slope = 0.5 * inverse[0][0];
                axial[corner] += fibre_stiffness * volume * section * slope * slope;
            }
        }
        for (corner, k) in axial.into_iter().enumerate().filter(|(corner, _)| CORNER_SIGNS[*corner][0] < 0.0) {
            self.line_stiffness[hex.corners[corner].node] += k;
        }
    }
}

/// Largest top-to-bottom distance of a block's first section, mm.
pub(super) fn thickness(mesh: &Mesh, block: &Block) -> f64 {
    (0..=block.columns)
        .map(|c| {
            let (low, high) = (mesh.nodes[block.line(c, 0)], mesh.nodes[block.line(c, block.layers)]);
            let d = [0, 1, 2].map(|k| high[k] - low[k]);
            libm::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        })
        .fold(0.0, f64::max)
}

/// Writes a slot to the first free place of a node.
fn put(table: &mut [u32], node: usize, slot: usize) {
    let places = &mut table[SOLID * node..][..SOLID];
    let free = places.iter_mut().find(|p| **p == NONE).expect("a node of a structured block has at most eight corners");
    *free = slot as u32;
}

/// Orthonormal frame with the fibre as first axis and the second axis in the plane of the fabric: `frame[i][j]` is component i
/// of axis j.
fn frame(fibre: [f64; 3]) -> [[f64; 3]; 3] {
    let cross =
        |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let unit = |a: [f64; 3]| {
        let l = libm::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
        a.map(|x| x / l)
    };
    let first = unit(fibre);
    let up = if first[2].abs() < 0.9 { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] };
    let second = unit(cross(up, first));
    let third = cross(first, second);
    std::array::from_fn(|i| [first[i], second[i], third[i]])
}

/// Corners in the axes of a frame, mm.
fn local(edges: &[[i32; 3]; 8], frame: &[[f64; 3]; 3]) -> [[f64; 3]; 8] {
    edges
        .map(|e| e.map(|q| f64::from(q) * QUANTUM))
        .map(|e| std::array::from_fn(|j| frame[0][j] * e[0] + frame[1][j] * e[1] + frame[2][j] * e[2]))
}

fn upside_down(mesh: &Mesh, block: &Block, hex: &Hex, volume: f64) -> Error {
    let [x, y, z] = mesh.position(hex.corners[0]);
    Error::geometry(
        format!("{}, hexahedron {}", block.name, hex.index),
        format!(
            "has the Jacobian {volume:.3e} mm³ at ({x:.3}, {y:.3}, {z:.3}); it must be positive: check the order of its nodes"
        ),
    )
}
