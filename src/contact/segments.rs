//! Contact of two straight segments A and B: a potential of the distance from B, integrated along A.
//!
//! ```text
//! E = ∫_A φ(d²) ds,   φ(q) = k/(8R²) ⟨R² − q⟩²,   R: distance at which both touch, mm; k: penalty per length, N/mm²
//! ```
//! Near first touch, φ is ½ k (R − d)²: a force k per length and depth. Line integrals have no difficulty with parallel or
//! nearly parallel lines, for which the closest pair of points is not unique (Meier, Wall, Popp, arXiv 1603.09227).
//!
//! The closest-point projection of a point s (0 to 1) of A onto B is the first end of B, then a point that moves along B in
//! proportion to s, then the second end. In each of these three parts q is a polynomial of degree 2 in s, and is below R² in
//! one interval, so three Gauss points integrate energy (degree 4) and forces on ends (degree 4) exactly. The interval limits
//! move with positions, but q is continuous and φ and its slope vanish at R, so the forces are the gradient of the energy. A
//! enters with its constant reference length. Nothing is normalised and lines may cross: the force between coincident points is
//! zero.
//!
//! The segments of a chain overlap around each joint, which must count once. From the energy of all segments the energy of all
//! joints of two segments is subtracted, ∫_A φ(|x − joint|²) ds (inclusion–exclusion, as in Li et al. 2023, Convergent
//! Incremental Potential Contact). Hence the energy is independent of the subdivision of either side. A segment that *owns* the
//! joint at its first end subtracts it; where that end is closest, both terms cancel.

use crate::kernel::interface::{Constant, constants};
use crate::kernel::lane::Real;
use crate::kernel::vector::{Vector, add, dot, fma, scale, sub};

/// Two segments, relative to the first end of A, mm.
pub struct Segments<R> {
    /// To the second end of A.
    pub along: Vector<R>,
    /// To the first end of B.
    pub start: Vector<R>,
    /// From the first end of B to the second.
    pub other: Vector<R>,
}

/// Points of A from `low` to `high`, with projections `base + slope s` on B; all from 0 to 1.
#[derive(Clone, Copy)]
struct Part<R> {
    low: R,
    high: R,
    base: R,
    slope: R,
}

impl<R: Real> Part<R> {
    #[inline(always)]
    fn new(low: R, high: R, base: R, slope: R) -> Self {
        Self { low, high, base, slope }
    }
}

/// Contact forces between two segments.
pub struct Push<R> {
    /// Energy, mJ, and its derivative by the distance R, N.
    pub energy: R,
    pub growth: R,
    /// Forces on the ends of A and of B, N.
    pub own: [Vector<R>; 2],
    pub others: [Vector<R>; 2],
    /// Bounds of the stiffness at the ends of A and of B, N/mm: of the pushing terms only, without the subtracted joints.
    pub own_rows: [R; 2],
    pub other_rows: [R; 2],
    /// Stiffness of the contact, N/mm.
    pub stiffness: R,
    /// Contact position along A and along B, times `weight`.
    pub at: [R; 2],
    /// Sum of the pushing weights; zero without contact.
    pub weight: R,
}

/// Gauss points and weights on 0 to 1.
const GAUSS: [[f64; 2]; 3] =
    [[0.112_701_665_379_258_31, 5.0 / 18.0], [0.5, 8.0 / 18.0], [0.887_298_334_620_741_7, 5.0 / 18.0]];
/// Lower bounds of |dq/ds| of projections and of the curvature of q over R², to avoid division by zero: for lines at right
/// angles, and parallel.
const STRAIGHT: f64 = 1e-20;
/// Constants shared with the twin.
pub const CONSTANTS: [Constant; 1] = constants![scalar: STRAIGHT];

impl<R: Real> Segments<R> {
    /// The parts of A where the first end of B, its inside and its second end are closest, and the part where the first end is not.
    #[inline(always)]
    fn parts(&self) -> [Part<R>; 4] {
        let (zero, one) = (R::from_f64(0.0), R::from_f64(1.0));
        let (turn, first) = (dot(self.along, self.other), dot(self.start, self.other));
        let size = dot(self.other, self.other);
        let forward = !(turn < zero);
        let least = size * R::from_f64(STRAIGHT);
        let safe = if forward { turn.max(least) } else { turn.min(-least) };
        let (enters, leaves) = (unit(first / safe), unit((first + size) / safe));
        let (low, high) = if forward { (enters, leaves) } else { (leaves, enters) };
        let inside = Part::new(low, high, -first / size, turn / size);
        let (ends, beyond) =
            if forward { ([zero, low, high, one], [low, one]) } else { ([high, one, zero, low], [zero, high]) };
        [
            Part::new(ends[0], ends[1], zero, zero),
            inside,
            Part::new(ends[2], ends[3], one, zero),
            Part::new(beyond[0], beyond[1], zero, zero),
        ]
    }

    /// Vector from the projection on B to a point s of A: its value at s = 0, and its change with s, mm.
    #[inline(always)]
    fn between(&self, part: &Part<R>) -> (Vector<R>, Vector<R>) {
        let base = sub(scale(self.other, -part.base), self.start);
        (base, fma(self.other, -part.slope, self.along))
    }

    /// Distance of the two segments, mm.
    #[inline(always)]
    pub fn distance(&self) -> R {
        let parts = self.parts();
        let mut least = dot(self.start, self.start);
        for part in &parts[..3] {
            let (base, slope) = self.between(part);
            let curvature = dot(slope, slope).max(dot(self.along, self.along) * R::from_f64(STRAIGHT));
            let s = (-dot(base, slope) / curvature).max(part.low).min(part.high);
            let offset = fma(slope, s, base);
            if part.low < part.high {
                least = least.min(dot(offset, offset));
            }
        }
        least.sqrt()
    }

    /// Contact forces of two segments that touch at a distance of `reach` (mm), with `strength` (N/mm), the penalty times the
    /// reference length of A; `owns` tells whether B owns the joint at its first end.
    #[inline(always)]
    pub fn push(&self, reach: R, strength: R, owns: bool) -> Push<R> {
        let [first, inside, second, beyond] = self.parts();
        let mut push = Push::none();
        push.add(self, &inside, reach, strength);
        push.add(self, &second, reach, strength);
        let (last, strength) = if owns { (beyond, -strength) } else { (first, strength) };
        push.add(self, &last, reach, strength);
        push
    }
}

/// The nearest number from 0 to 1.
#[inline(always)]
fn unit<R: Real>(s: R) -> R {
    s.max(R::from_f64(0.0)).min(R::from_f64(1.0))
}

/// Interval of a part in which q = |base + slope s|² is below `square`; an empty interval if there is none.
#[inline(always)]
fn touching<R: Real>(part: &Part<R>, base: Vector<R>, slope: Vector<R>, square: R) -> (R, R) {
    let zero = R::from_f64(0.0);
    let curvature = dot(slope, slope).max(square * R::from_f64(STRAIGHT));
    let (half, above) = (-dot(base, slope), dot(base, base) - square);
    let root = half * half - curvature * above;
    if !(root > zero) {
        return (part.low, part.low);
    }
    let sum = if half < zero { half - root.sqrt() } else { half + root.sqrt() };
    let (a, b) = (sum / curvature, above / sum);
    (a.min(b).max(part.low), a.max(b).min(part.high))
}

impl<R: Real> Push<R> {
    /// No contact.
    #[inline(always)]
    pub fn none() -> Self {
        let zero = R::from_f64(0.0);
        Self {
            energy: zero,
            growth: zero,
            own: [[zero; 3]; 2],
            others: [[zero; 3]; 2],
            own_rows: [zero; 2],
            other_rows: [zero; 2],
            stiffness: zero,
            at: [zero; 2],
            weight: zero,
        }
    }

    /// Adds a part, or subtracts it with a negative strength.
    #[inline(always)]
    fn add(&mut self, segments: &Segments<R>, part: &Part<R>, reach: R, strength: R) {
        let (zero, one) = (R::from_f64(0.0), R::from_f64(1.0));
        let square = reach * reach;
        let (base, slope) = segments.between(part);
        let (low, high) = touching(part, base, slope, square);
        if !(low < high) {
            return;
        }
        let half = R::from_f64(0.5) / square;
        for &[place, weight] in &GAUSS {
            let s = low + (high - low) * R::from_f64(place);
            let t = part.base + part.slope * s;
            let offset = fma(slope, s, base);
            let inside = (square - dot(offset, offset)).max(zero);
            let share = strength * (high - low) * R::from_f64(weight);
            let pressed = share * half * inside;
            self.energy = self.energy + R::from_f64(0.25) * pressed * inside;
            self.growth = self.growth + half * reach * pressed * (square + square - inside);
            let force = scale(offset, pressed);
            self.own[0] = fma(force, one - s, self.own[0]);
            self.own[1] = fma(force, s, self.own[1]);
            self.others[0] = fma(force, t - one, self.others[0]);
            self.others[1] = fma(force, -t, self.others[1]);
            self.stiffness = self.stiffness + share;
            let (pushes, rows) = (pressed.max(zero), share.max(zero));
            self.own_rows = [self.own_rows[0] + rows * (one - s), self.own_rows[1] + rows * s];
            self.other_rows = [self.other_rows[0] + rows * (one - t), self.other_rows[1] + rows * t];
            self.at = [self.at[0] + pushes * s, self.at[1] + pushes * t];
            self.weight = self.weight + pushes;
        }
    }

    /// The force on A, N.
    #[inline(always)]
    pub fn total(&self) -> Vector<R> {
        add(self.own[0], self.own[1])
    }
}
