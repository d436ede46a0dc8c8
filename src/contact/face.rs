//! A face of a yarn's surface, seen from a contact point: a bilinear quadrilateral, its edges and its corners.

use crate::kernel::lane::Real;
use crate::kernel::vector::{Vector, add, cross, dot, fma, norm, scale, sub};

/// Centre and derivatives of a bilinear face.
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

    /// Lower bound of the distance of the face from the origin, mm; negative if there is no bound.
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

    /// Closest-point projection of the origin onto the unbounded patch by Newton's method, with coordinates limited to ±2.
    /// Where the patch is so warped that the distance is not convex, the warp is omitted from its second derivative.
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
    /// Unit vector from this point to the origin.
    pub away: Vector<R>,
    pub distance: R,
    /// Height of the origin above the tangent plane of the face at this point, mm.
    pub height: R,
    /// Whether it lies inside the face, not on its border.
    pub interior: bool,
}

/// The point of an edge closest to the origin, or a corner.
#[derive(Clone, Copy)]
pub struct OnEdge<R> {
    pub weights: [R; 4],
    /// Vector from this point to the origin, mm, and the squared distance.
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

/// The closest point of a face: the projection of the origin if it lies inside, else the closest point of the nearest edge.
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
