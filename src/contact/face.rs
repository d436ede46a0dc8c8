//! A face of a yarn's closed surface, seen from a point that may touch it: a bilinear quadrilateral, its edges and its corners.
//!
//! Surfaces are tables of faces. A face *owns* some of its edges and corners, so that each of a body is owned once: what is
//! summed over faces, less what is summed over edges, plus what is summed over corners does not depend on how the
//! surface is cut into faces (see [`super::penalty`]).

use super::{key, shift};
use crate::kernel::lane::Real;
use crate::kernel::node::{Displacements, Lattice};
use crate::kernel::vector::{Vector, add, apply, cross, dot, fma, norm, scale, sub};

/// Integers of a face: four corners, counter-clockwise seen from outside, as [`coded`]; its marks, see [`marks`].
pub const FACE: usize = 5;
/// Most nodes that a corner can tell apart, and most faces that an entry of a list can.
pub const MOST_NODES: usize = 1 << 26;
pub const MOST_FACES: usize = (1 << 24) - 1;

/// A node with the image in which it is seen, −1, 0 or 1 periods along x and y.
pub fn coded(node: usize, image: [i32; 2]) -> u32 {
    node as u32 | ((image[0] + 1) as u32) << 26 | ((image[1] + 1) as u32) << 28
}

/// Node and image of a [`coded`] one.
#[inline(always)]
pub fn of_coded(coded: u32) -> (usize, [i32; 2]) {
    ((coded & (1 << 26) - 1) as usize, [(coded >> 26 & 3) as i32 - 1, (coded >> 28) as i32 - 1])
}

/// Marks of a face: the edges (from corner `a` to the next one) and the corners that it owns, along which of x and y its body
/// goes on in its own images, and the body.
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

/// The corners of a face relative to a point: in the reference and now.
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

    /// Key of the body and the lateral image that an entry belongs to. A yarn goes on through its own images: they are one body.
    #[inline(always)]
    pub fn body(&self, face: usize, image: [i32; 2]) -> u32 {
        let marks = self.marks(face);
        let lateral = |axis: usize| if marks >> (8 + axis) & 1 == 1 { 0 } else { image[axis] };
        key((marks >> 10) as usize, [lateral(0), lateral(1)])
    }

    /// Reference and current position of a node in an image relative to another one.
    #[inline(always)]
    pub fn from_node(&self, node: usize, image: [i32; 2], base: usize) -> (Vector<R>, Vector<R>) {
        let rest: Vector<R> = self.reference.between(node, base, shift::<PERIODIC>(self.period, image));
        let affine = if PERIODIC { add(rest, apply(self.gradient, rest)) } else { rest };
        (rest, add(affine, self.displacement.between(node, base)))
    }

    /// A point of `N` coded nodes by weights, relative to the first of them, in the reference and now.
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

    /// The corners of a face in an image, seen from a point that lies `from` beside a node.
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

/// Middle and derivatives of a bilinear face.
#[derive(Clone, Copy)]
pub struct Patch<R> {
    middle: Vector<R>,
    along: Vector<R>,
    across: Vector<R>,
    twist: Vector<R>,
}

impl<R: Real> Patch<R> {
    /// From the corners.
    #[inline(always)]
    pub fn new(q: &[Vector<R>; 4]) -> Self {
        let quarter = R::from_f64(0.25);
        let (s01, s23) = (add(q[0], q[1]), add(q[2], q[3]));
        let (d01, d32) = (sub(q[1], q[0]), sub(q[2], q[3]));
        Self {
            middle: scale(add(s01, s23), quarter),
            along: scale(add(d01, d32), quarter),
            across: scale(sub(s23, s01), quarter),
            twist: scale(sub(d32, d01), quarter),
        }
    }

    /// No point of the face is nearer to the origin than this, mm; negative if some may be anywhere.
    #[inline(always)]
    pub fn nearest(&self) -> R {
        let (a, b) = (add(self.along, self.across), sub(self.along, self.across));
        norm(self.middle) - dot(a, a).max(dot(b, b)).sqrt() - norm(self.twist)
    }

    #[inline(always)]
    fn at(&self, xi: R, eta: R) -> Vector<R> {
        fma(self.twist, xi * eta, fma(self.across, eta, fma(self.along, xi, self.middle)))
    }

    /// Derivatives along both coordinates.
    #[inline(always)]
    fn tangents(&self, xi: R, eta: R) -> (Vector<R>, Vector<R>) {
        (fma(self.twist, eta, self.along), fma(self.twist, xi, self.across))
    }

    /// Coordinates of the point of the unbounded patch that is closest to the origin, kept within ±2, by Newton's method. Where
    /// the patch is so warped that the distance is not convex, the warp is left out of its second derivative.
    #[inline(always)]
    fn project(&self) -> (R, R) {
        let (zero, two) = (R::from_f64(0.0), R::from_f64(2.0));
        let (mut xi, mut eta) = (zero, zero);
        for _ in 0..6 {
            let (t1, t2) = self.tangents(xi, eta);
            let r = self.at(xi, eta);
            let (g11, flat, g22) = (dot(t1, t1), dot(t1, t2), dot(t2, t2));
            let warped = flat + dot(self.twist, r);
            let convex = warped * warped < R::from_f64(0.9) * (g11 * g22);
            let g12 = if convex { warped } else { flat };
            let (b1, b2) = (dot(t1, r), dot(t2, r));
            let inverse = R::from_f64(1.0) / (g11 * g22 - g12 * g12).max(R::from_f64(1e-30));
            let (dx, dy) = ((g12 * b2 - g22 * b1) * inverse, (g12 * b1 - g11 * b2) * inverse);
            xi = (xi + dx).min(two).max(-two);
            eta = (eta + dy).min(two).max(-two);
            if dx.abs() + dy.abs() < R::from_f64(1e-5) {
                break;
            }
        }
        (xi, eta)
    }
}

/// The point of a face closest to the origin.
#[derive(Clone, Copy)]
pub struct Closest<R> {
    /// Weights of the four corners.
    pub weights: [R; 4],
    /// Unit vector from it to the origin.
    pub away: Vector<R>,
    pub distance: R,
    /// Height of the origin above the plane that touches the face there, mm.
    pub height: R,
    /// Whether it lies inside the face rather than on its border.
    pub interior: bool,
}

/// The point of an edge closest to the origin, or a corner.
#[derive(Clone, Copy)]
pub struct OnEdge<R> {
    pub weights: [R; 4],
    /// From it to the origin, mm, and the square of the distance.
    pub offset: Vector<R>,
    pub square: R,
}

/// The closest point of the edge from corner `a` to the next one.
#[inline(always)]
pub fn on_edge<R: Real>(q: &[Vector<R>; 4], a: usize) -> OnEdge<R> {
    let (zero, one) = (R::from_f64(0.0), R::from_f64(1.0));
    let b = (a + 1) % 4;
    let along = sub(q[b], q[a]);
    let share = (-dot(q[a], along) / dot(along, along)).max(zero).min(one);
    let mut weights = [zero; 4];
    (weights[a], weights[b]) = (one - share, share);
    let offset = scale(fma(along, share, q[a]), -one);
    OnEdge { weights, offset, square: dot(offset, offset) }
}

/// A corner.
#[inline(always)]
pub fn on_corner<R: Real>(q: &[Vector<R>; 4], a: usize) -> OnEdge<R> {
    let mut weights = [R::from_f64(0.0); 4];
    weights[a] = R::from_f64(1.0);
    let offset = scale(q[a], R::from_f64(-1.0));
    OnEdge { weights, offset, square: dot(offset, offset) }
}

/// The closest point of a face: where the origin projects into it, else on the nearest of its edges.
#[inline(always)]
pub fn closest<R: Real>(q: &[Vector<R>; 4], p: &Patch<R>) -> Closest<R> {
    let (zero, one, quarter) = (R::from_f64(0.0), R::from_f64(1.0), R::from_f64(0.25));
    let (xi, eta) = p.project();
    if xi.abs() <= one && eta.abs() <= one {
        let (t1, t2) = p.tangents(xi, eta);
        let n = cross(t1, t2);
        let normal = scale(n, one / norm(n).max(R::from_f64(1e-20)));
        let height = -dot(p.at(xi, eta), normal);
        let (a, b, c, d) = (one - xi, one + xi, one - eta, one + eta);
        let weights = [quarter * a * c, quarter * b * c, quarter * b * d, quarter * a * d];
        let away = if height < zero { scale(normal, -one) } else { normal };
        return Closest { weights, away, distance: height.abs(), height, interior: true };
    }
    let mut best = on_edge(q, 0);
    for a in 1..4 {
        let other = on_edge(q, a);
        if other.square < best.square {
            best = other;
        }
    }
    let OnEdge { weights: w, offset, square } = best;
    let two = R::from_f64(2.0);
    let (t1, t2) = p.tangents(two * (w[1] + w[2]) - one, two * (w[2] + w[3]) - one);
    let n = cross(t1, t2);
    let distance = square.sqrt();
    Closest {
        weights: w,
        away: scale(offset, one / distance.max(R::from_f64(1e-12))),
        distance,
        height: dot(offset, n) / norm(n).max(R::from_f64(1e-20)),
        interior: false,
    }
}
