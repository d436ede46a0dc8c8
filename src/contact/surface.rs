//! The surfaces of yarns as tables of faces, and points carried by nodes: positions are relative to a node, so that they are as
//! exact far from the origin as near it.
//!
//! A face *owns* some of its edges and corners, so that each edge and corner of a body is owned once: a sum over faces, minus
//! edges, plus corners is then independent of the subdivision of the surface into faces (see [`super::potential`]).

use super::{key, shift};
use crate::kernel::interface::{Constant, constants};
use crate::kernel::lane::Real;
use crate::kernel::node::{Displacements, Lattice};
use crate::kernel::vector::{Vector, add, apply, fma, sub};

/// Integers per face: four corners, counter-clockwise seen from outside, as [`coded`]; its marks, see [`marks`].
pub const FACE: usize = 5;
/// Integers per point: up to four coded nodes that carry it; its list of faces.
pub const CARRIED: usize = 5;
/// Numbers per point: weights of its four nodes; penalty, N/mm; radius, mm.
pub const POINT: usize = 6;
/// Constants of faces and points shared with the twins; carriers are beams of `threads` or nodes of yarns.
pub const fn shared(threads: bool) -> [Constant; 4] {
    constants![uint: FACE, CARRIED, POINT, CARRIED_BY = if threads { 4 } else { 1 }]
}
/// Largest number of nodes that a corner can encode, and of faces that a list entry can encode.
pub const MOST_NODES: usize = 1 << 26;
pub const MOST_FACES: usize = (1 << 24) - 1;

/// A node and its image, −1, 0 or 1 periods along x and y, as one number.
pub fn coded(node: usize, image: [i32; 2]) -> u32 {
    node as u32 | ((image[0] + 1) as u32) << 26 | ((image[1] + 1) as u32) << 28
}

/// Decodes a [`coded`] node and its image.
#[inline(always)]
pub fn of_coded(coded: u32) -> (usize, [i32; 2]) {
    ((coded & ((1 << 26) - 1)) as usize, [(coded >> 26 & 3) as i32 - 1, (coded >> 28) as i32 - 1])
}

/// Marks of a face: the edges (from corner `a` to the next one) and corners that it owns, the axes x and y along which its body
/// continues in its own images, and the body.
pub fn marks(edges: [bool; 4], corners: [bool; 4], wraps: [bool; 2], body: usize) -> u32 {
    let bits = edges.into_iter().chain(corners).chain(wraps).enumerate();
    bits.fold((body as u32) << 10, |marks, (bit, is_set)| marks | u32::from(is_set) << bit)
}

/// An entry of a list of near faces: a face in an image.
#[inline(always)]
pub fn entry(face: usize, image: [i32; 2]) -> u32 {
    key(face, image)
}

/// The faces of all bodies. Without `PERIODIC` there are no images.
pub struct Surface<'a, R, const PERIODIC: bool> {
    pub faces: &'a [u32],
    pub reference: Lattice<'a>,
    pub displacement: Displacements<'a, R>,
    /// F̄ − I.
    pub gradient: &'a [[R; 3]; 3],
    /// Periods in quanta.
    pub period: [i32; 2],
}

/// The corners of a face relative to a point, in the reference and current states.
#[derive(Clone, Copy)]
pub struct Corners<R> {
    pub nodes: [usize; 4],
    pub reference: [Vector<R>; 4],
    pub current: [Vector<R>; 4],
}

impl<R: Real, const PERIODIC: bool> Surface<'_, R, PERIODIC> {
    /// Marks of a face.
    #[inline(always)]
    pub fn marks(&self, face: usize) -> u32 {
        self.faces[FACE * face + 4]
    }

    /// Key of the body and lateral image of an entry. A yarn that continues through its own images is one body.
    #[inline(always)]
    pub fn body(&self, face: usize, image: [i32; 2]) -> u32 {
        let marks = self.marks(face);
        let mut lateral = image;
        for axis in 0..2 {
            if marks >> (8 + axis) & 1 == 1 {
                lateral[axis] = 0;
            }
        }
        key((marks >> 10) as usize, lateral)
    }

    /// Reference and current position of a node in an image relative to another node.
    #[inline(always)]
    pub fn from_node(&self, node: usize, image: [i32; 2], base: usize) -> (Vector<R>, Vector<R>) {
        let rest: Vector<R> = self.reference.between(node, base, shift::<PERIODIC>(self.period, image));
        let affine = if PERIODIC { add(rest, apply(self.gradient, rest)) } else { rest };
        (rest, add(affine, self.displacement.between(node, base)))
    }

    /// A point given by weights of `N` coded nodes, relative to the first of them, in the reference and current states.
    #[inline(always)]
    pub fn point<const N: usize>(&self, nodes: [u32; N], weights: [R; N]) -> (Vector<R>, Vector<R>) {
        let base = of_coded(nodes[0]).0;
        let mut point = ([R::from_f64(0.0); 3], [R::from_f64(0.0); 3]);
        for a in 1..N {
            let (node, image) = of_coded(nodes[a]);
            let (rest, now) = self.from_node(node, image, base);
            point = (fma(rest, weights[a], point.0), fma(now, weights[a], point.1));
        }
        point
    }

    /// The corners of a face in an image, relative to a point at the offset `from` from a node.
    #[inline(always)]
    pub fn corners(&self, face: usize, image: [i32; 2], base: usize, from: (Vector<R>, Vector<R>)) -> Corners<R> {
        let zero = [R::from_f64(0.0); 3];
        let mut corners = Corners { nodes: [0; 4], reference: [zero; 4], current: [zero; 4] };
        for a in 0..4 {
            let (node, own) = of_coded(self.faces[FACE * face + a]);
            let (rest, now) = self.from_node(node, [image[0] + own[0], image[1] + own[1]], base);
            corners.nodes[a] = node;
            (corners.reference[a], corners.current[a]) = (sub(rest, from.0), sub(now, from.1));
        }
        corners
    }
}
