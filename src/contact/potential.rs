//! The contact potential of a point near the closed surface of a body, and its forces on the point.
//!
//! The force is the gradient of one energy. With b(d) = ½ k ⟨r − d⟩², where d is the distance to a closed feature and ⟨·⟩ the
//! positive part, the energy of a point of radius r is
//!
//! ```text
//! Ψ = Σ_faces b − Σ_edges b + Σ_corners b  +  inside · [½ k (r + d)² − b(d)]
//! ```
//!
//! The signed sum is ∫ −b′(ρ) χ(ρ) dρ with χ(ρ) the Euler characteristic of the part of the surface within ρ of the point: 1
//! for a single piece, 2 for two walls, for any subdivision into faces. So a flat or convex surface pushes with b of its
//! distance, both walls of a valley push, and the force is continuous across edges and corners (inclusion–exclusion, as in Li
//! et al., Convergent Incremental Potential Contact, 2023; the interpretation as an Euler characteristic is our own).
//!
//! A body is closed: a point is inside if it lies behind the nearest part of the surface, which then pushes it out. On the
//! surface the inside and outside energies agree. Yarn nodes have no radius, so only the energy ½ k d² remains.

use super::face::{Closest, OnEdge, on_corner, on_edge};
use super::look::{Face, View};
use super::{EMPTY, Params};
use crate::elements::LANES;
use crate::kernel::interface::{Constant, constants};
use crate::kernel::lane::{Lane, Real};
use crate::kernel::vector::{Vector, add, fma, scale, select};

/// Upper bound of the rounding error of a gap, mm: a face that touches by less must not be missed, whenever its gap was last
/// evaluated.
pub const GAP_ROUNDING: f64 = 1e-6;
/// Two distances count as equal if they differ by at most this share.
const TIE: f64 = 1e-4;
/// Constants shared with the twin.
pub const CONSTANTS: [Constant; 2] = constants![scalar: GAP_ROUNDING, TIE];

/// Tolerance within which a face counts as nearest at a `distance`, with a safety margin, mm.
#[inline(always)]
pub fn margin<R: Real>(distance: R) -> R {
    R::from_f64(2.0 * TIE) * distance + R::from_f64(GAP_ROUNDING)
}

/// The nearest point of a body's surface: the entry of its face; unit vector from there to the point; distance, and height
/// above the face, mm.
#[derive(Clone, Copy)]
pub struct Nearest<R> {
    pub found: bool,
    pub entry: u32,
    pub away: Vector<R>,
    pub distance: R,
    pub height: R,
}

/// Force, N, and energy, mJ, on a point inside, for its depth below the surface, mm.
#[inline(always)]
pub fn out<R: Real>(at: &View<R>, depth: R) -> (R, R) {
    let (whole, outside) = (at.radius + depth, (at.radius - depth).max(R::from_f64(0.0)));
    (at.penalty * (whole + outside), R::from_f64(0.5) * at.penalty * (whole * whole - outside * outside))
}

/// Forces of a face on a point, with the edges and corners that it owns; a face and its point in each lane.
#[derive(Clone, Copy)]
pub struct Push<L> {
    /// Forces on its corners, N.
    pub pull: [Vector<L>; 4],
    /// Energy, mJ, and sum of the force magnitudes, N: the derivative of the energy by the radius.
    pub energy: L,
    pub pressing: L,
    /// Bound of the stiffness at each corner, in penalties: its weights in the face and the corners that push. Edges only soften.
    pub stiff: [L; 4],
}

impl<L: Lane> Push<L> {
    /// Adds, in the lanes of a mask, a `force` (N) on the point in the direction `away` from a place given by corner weights, its
    /// `energy` (mJ); `stiffens` is one where this stiffens the contact, else zero.
    #[inline(always)]
    fn add(&mut self, mask: L::Mask, (weights, away): ([L; 4], Vector<L>), force: L, energy: L, stiffens: f64) {
        self.energy = L::select(mask, self.energy + energy, self.energy);
        self.pressing = L::select(mask, self.pressing + force, self.pressing);
        for a in 0..4 {
            self.stiff[a] = L::select(mask, self.stiff[a] + weights[a] * L::new(stiffens), self.stiff[a]);
            self.pull[a] = select(mask, fma(away, -(force * weights[a]), self.pull[a]), self.pull[a]);
        }
    }

    /// Adds an edge or a corner within the radius, with its `sign` in the sum, in lanes where `owned` is positive.
    #[inline(always)]
    fn add_border(&mut self, radius: L, penalty: L, border: &OnEdge<L>, owned: L, sign: f64) {
        let zero = L::new(0.0);
        let distance = border.square.sqrt();
        let depth = radius - distance;
        let force = L::new(sign) * (penalty * depth);
        let away = scale(border.offset, L::new(1.0) / distance.max(L::new(1e-12)));
        let mask = zero.lt(L::select(border.square.lt(radius * radius), owned, zero));
        self.add(mask, (border.weights, away), force, L::new(0.5) * force * depth, sign.max(0.0));
    }

    /// The force on the point, N.
    #[inline(always)]
    pub fn total(&self) -> Vector<L> {
        let [a, b, c, d] = self.pull;
        scale(add(add(a, b), add(c, d)), L::new(-1.0))
    }

    /// Forces of a face with the edges and corners in its `marks`, on a point of a `radius` (mm) and `penalty` (N/mm).
    #[inline(always)]
    pub fn of_face(radius: L, penalty: L, q: &[Vector<L>; 4], marks: &[u32; LANES], point: &Closest<L>) -> Self {
        let (zero, depth) = (L::new(0.0), radius - point.distance);
        let mut push = Self { pull: [[zero; 3]; 4], energy: zero, pressing: zero, stiff: [zero; 4] };
        let touches = zero.lt(depth);
        if !L::any(touches) {
            return push;
        }
        let force = penalty * depth;
        push.add(touches, (point.weights, point.away), force, L::new(0.5) * force * depth, 1.0);
        for a in 0..4 {
            let edge = L::select(touches, marked(marks, a), zero);
            push.add_border(radius, penalty, &on_edge(q, a), edge, -1.0);
            let corner = L::select(touches, marked(marks, 4 + a), zero);
            push.add_border(radius, penalty, &on_corner(q, a), corner, 1.0);
        }
        push
    }
}

/// One in lanes whose marks have a bit, else zero.
#[inline(always)]
fn marked<L: Lane>(marks: &[u32; LANES], bit: usize) -> L {
    let mut values = [L::Scalar::from_f64(0.0); LANES];
    for lane in 0..L::WIDTH {
        values[lane] = L::Scalar::from_i32((marks[lane] >> bit & 1) as i32);
    }
    L::load(&values)
}

/// Forces of a body on a point.
pub struct Pushed<R> {
    pub nearest: Nearest<R>,
    /// Whether the point is pushed out from behind the nearest face.
    pub inside: bool,
    /// Resultant of the elastic forces on the point, N, and their energy, mJ; see [`Push`].
    pub push: Vector<R>,
    pub energy: R,
    pub pressing: R,
    /// Number of features that push: faces, corners, and the way out from the inside.
    pub features: R,
    /// Sum of the forces of faces, N.
    pub shared: R,
    /// Sums over the places on pushing faces, weighted by their forces, or the values of the nearest place if no face pushes:
    /// velocity, mm/s, reference position relative to the point, mm, and inverse mass, 1/tonne.
    pub motion: Vector<R>,
    pub apart: Vector<R>,
    pub inverse: R,
}

impl<R: Real> Pushed<R> {
    #[inline(always)]
    pub fn none() -> Self {
        let zero = R::from_f64(0.0);
        let nearest = Nearest { found: false, entry: EMPTY, away: [zero; 3], distance: zero, height: zero };
        let (push, motion, apart) = ([zero; 3], [zero; 3], [zero; 3]);
        let (energy, pressing, features, shared, inverse) = (zero, zero, zero, zero, zero);
        Self { nearest, inside: false, push, energy, pressing, features, shared, motion, apart, inverse }
    }

    /// Whether a place is nearer than the known one. If several faces share the nearest edge or corner, the face seen most
    /// steeply decides on which side the point lies.
    #[inline(always)]
    pub fn is_nearer(&self, face: &Face<R>) -> bool {
        let known = &self.nearest;
        let tie = known.distance * R::from_f64(TIE) + R::from_f64(0.1 * GAP_ROUNDING);
        let apart = face.distance - known.distance;
        !known.found || apart < -tie || apart <= tie && face.height.abs() > known.height.abs()
    }

    /// Whether the point is behind the nearest known place, within the depth that is pushed out, and within `most` (mm), the
    /// largest depth it can have reached since its last evaluation: at a corner of a crumpled surface, a point in front may
    /// appear to be behind.
    #[inline(always)]
    pub fn is_behind(&self, params: &Params, most: R) -> bool {
        let Nearest { found, distance, height, .. } = self.nearest;
        found && height < R::from_f64(0.0) && distance < most.min(R::from_f64(f64::from(params.depth)))
    }

    /// Distance beyond which a face cannot change the nearest place, mm.
    #[inline(always)]
    pub fn beyond(&self) -> R {
        self.nearest.distance * R::from_f64(1.0 - 2.0 * TIE) - R::from_f64(0.2 * GAP_ROUNDING)
    }

    /// Adds the force that pushes out a point inside; returns its depth, mm.
    #[inline(always)]
    pub fn push_out(&mut self, at: &View<R>) -> R {
        let Nearest { away, distance, .. } = self.nearest;
        let (force, energy) = out(at, distance);
        self.inside = true;
        self.push = fma(away, -force, self.push);
        self.energy = self.energy + energy;
        self.pressing = self.pressing + force;
        self.features = self.features + R::from_f64(1.0);
        distance
    }

    /// Adds the forces of a face.
    #[inline(always)]
    pub fn add(&mut self, face: &Face<R>) {
        self.push = add(self.push, face.total);
        self.energy = self.energy + face.energy;
        self.pressing = self.pressing + face.pressing;
        let [a, b, c, d] = face.stiff;
        self.features = self.features + ((a + b) + (c + d));
    }
}
