//! A face of a yarn's surface, seen from a contact point: a bilinear quadrilateral, its edges and its corners. Every lane of a
//! register holds its own face and point.

use crate::kernel::lane::Lane;
use crate::kernel::vector::{Vector, add, cross, dot, fma, norm, scale, select, sub};

/// Centre and derivatives of a bilinear face.
#[derive(Clone, Copy)]
pub struct Patch<L> {
    middle: Vector<L>,
    along: Vector<L>,
    across: Vector<L>,
    twist: Vector<L>,
}

impl<L: Lane> Patch<L> {
    /// From the corners.
    #[inline(always)]
    pub fn new(q: &[Vector<L>; 4]) -> Self {
        let quarter = L::new(0.25);
        let (s01, s23) = (add(q[0], q[1]), add(q[2], q[3]));
        let (d01, d32) = (sub(q[1], q[0]), sub(q[2], q[3]));
        Self {
            middle: scale(add(s01, s23), quarter),
            along: scale(add(d01, d32), quarter),
            across: scale(sub(s23, s01), quarter),
            twist: scale(sub(d32, d01), quarter),
        }
    }

    /// Lower bound of the distance of the face from the origin, mm; negative if there is no bound.
    #[inline(always)]
    pub fn nearest(&self) -> L {
        let (a, b) = (add(self.along, self.across), sub(self.along, self.across));
        norm(self.middle) - dot(a, a).max(dot(b, b)).sqrt() - norm(self.twist)
    }

    #[inline(always)]
    fn at(&self, xi: L, eta: L) -> Vector<L> {
        fma(self.twist, xi * eta, fma(self.across, eta, fma(self.along, xi, self.middle)))
    }

    /// Derivatives along both coordinates.
    #[inline(always)]
    fn tangents(&self, xi: L, eta: L) -> (Vector<L>, Vector<L>) {
        (fma(self.twist, eta, self.along), fma(self.twist, xi, self.across))
    }

    /// Closest-point projection of the origin onto the unbounded patch by Newton's method, with coordinates limited to ±2.
    /// Where the patch is so warped that the distance is not convex, the warp is omitted from its second derivative.
    #[inline(always)]
    fn project(&self) -> (L, L) {
        let (zero, one, two) = (L::new(0.0), L::new(1.0), L::new(2.0));
        let (mut xi, mut eta) = (zero, zero);
        // one in lanes that have not converged
        let mut going = one;
        for _ in 0..6 {
            let (t1, t2) = self.tangents(xi, eta);
            let r = self.at(xi, eta);
            let (g11, flat, g22) = (dot(t1, t1), dot(t1, t2), dot(t2, t2));
            let warped = flat + dot(self.twist, r);
            let g12 = L::select((warped * warped).lt(L::new(0.9) * (g11 * g22)), warped, flat);
            let (b1, b2) = (dot(t1, r), dot(t2, r));
            let inverse = one / (g11 * g22 - g12 * g12).max(L::new(1e-30));
            let (dx, dy) = ((g12 * b2 - g22 * b1) * inverse, (g12 * b1 - g11 * b2) * inverse);
            let moves = zero.lt(going);
            xi = L::select(moves, (xi + dx).min(two).max(-two), xi);
            eta = L::select(moves, (eta + dy).min(two).max(-two), eta);
            going = L::select((dx.abs() + dy.abs()).lt(L::new(1e-5)), zero, going);
            if !L::any(zero.lt(going)) {
                break;
            }
        }
        (xi, eta)
    }
}

/// The point of a face closest to the origin.
#[derive(Clone, Copy)]
pub struct Closest<L: Lane> {
    /// Weights of the four corners.
    pub weights: [L; 4],
    /// Unit vector from this point to the origin.
    pub away: Vector<L>,
    pub distance: L,
    /// Height of the origin above the tangent plane of the face at this point, mm.
    pub height: L,
    /// Whether it lies on the border of the face.
    pub on_border: L::Mask,
}

/// The point of an edge closest to the origin, or a corner.
#[derive(Clone, Copy)]
pub struct OnEdge<L> {
    pub weights: [L; 4],
    /// Vector from this point to the origin, mm, and the squared distance.
    pub offset: Vector<L>,
    pub square: L,
}

/// The closest point of the edge from corner `a` to the next one.
#[inline(always)]
pub fn on_edge<L: Lane>(q: &[Vector<L>; 4], a: usize) -> OnEdge<L> {
    let (zero, one) = (L::new(0.0), L::new(1.0));
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
pub fn on_corner<L: Lane>(q: &[Vector<L>; 4], a: usize) -> OnEdge<L> {
    let mut weights = [L::new(0.0); 4];
    weights[a] = L::new(1.0);
    let offset = scale(q[a], L::new(-1.0));
    OnEdge { weights, offset, square: dot(offset, offset) }
}

impl<L: Lane> OnEdge<L> {
    /// The nearer of two places.
    #[inline(always)]
    fn or(self, other: Self) -> Self {
        let nearer = other.square.lt(self.square);
        let mut weights = self.weights;
        for a in 0..4 {
            weights[a] = L::select(nearer, other.weights[a], weights[a]);
        }
        let offset = select(nearer, other.offset, self.offset);
        Self { weights, offset, square: L::select(nearer, other.square, self.square) }
    }
}

/// The closest point of a face: the projection of the origin if it lies inside, else the closest point of the nearest edge.
#[inline(always)]
pub fn closest<L: Lane>(q: &[Vector<L>; 4], p: &Patch<L>) -> Closest<L> {
    let (zero, one, two, quarter) = (L::new(0.0), L::new(1.0), L::new(2.0), L::new(0.25));
    let (xi, eta) = p.project();
    let on_border = one.lt(xi.abs().max(eta.abs()));
    let (t1, t2) = p.tangents(xi, eta);
    let n = cross(t1, t2);
    let normal = scale(n, one / norm(n).max(L::new(1e-20)));
    let height = -dot(p.at(xi, eta), normal);
    let (a, b, c, d) = (one - xi, one + xi, one - eta, one + eta);
    let inside = Closest {
        weights: [quarter * a * c, quarter * b * c, quarter * b * d, quarter * a * d],
        away: select(height.lt(zero), scale(normal, -one), normal),
        distance: height.abs(),
        height,
        on_border,
    };
    if !L::any(on_border) {
        return inside;
    }
    let OnEdge { weights: w, offset, square } = on_edge(q, 0).or(on_edge(q, 1)).or(on_edge(q, 2)).or(on_edge(q, 3));
    let (t1, t2) = p.tangents(two * (w[1] + w[2]) - one, two * (w[2] + w[3]) - one);
    let n = cross(t1, t2);
    let distance = square.sqrt();
    let away = scale(offset, one / distance.max(L::new(1e-12)));
    let height = dot(offset, n) / norm(n).max(L::new(1e-20));
    let mut weights = inside.weights;
    for a in 0..4 {
        weights[a] = L::select(on_border, w[a], weights[a]);
    }
    Closest {
        weights,
        away: select(on_border, away, inside.away),
        distance: L::select(on_border, distance, inside.distance),
        height: L::select(on_border, height, inside.height),
        on_border,
    }
}
