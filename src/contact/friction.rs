//! Coulomb friction with true stick: an elastic tangential displacement t is accumulated, rotated into the tangent plane, and
//! limited where its force would exceed μ times the normal force. A pair at rest keeps its force indefinitely, without creep.

use crate::kernel::lane::Real;
use crate::kernel::vector::{Vector, add, dot, fma, scale, sub};

/// Result of one friction step.
pub struct Slide<R> {
    /// Elastic tangential displacement, mm; the force is −k_t t.
    pub elastic: Vector<R>,
    /// Distance slid, mm.
    pub slip: R,
    /// Energy lost, mJ.
    pub dissipated: R,
}

/// The part of a vector across a unit normal.
#[inline(always)]
fn flat<R: Real>(a: Vector<R>, normal: Vector<R>) -> Vector<R> {
    fma(normal, -dot(normal, a), a)
}

/// Advances the tangential displacement `elastic` by `motion` (relative motion over the step, mm) on a surface with unit normal
/// `normal`, tangential stiffness `stiffness` (N/mm) and largest force `limit` (N).
#[inline(always)]
pub fn slide<R: Real>(elastic: Vector<R>, motion: Vector<R>, normal: Vector<R>, stiffness: R, limit: R) -> Slide<R> {
    let turned = flat(elastic, normal);
    let trial = add(turned, flat(motion, normal));
    let size = dot(trial, trial).sqrt();
    let held = size * stiffness;
    let half = R::from_f64(0.5) * stiffness;
    let new = if held > limit { scale(trial, limit / held) } else { trial };
    let gone = sub(trial, new);
    // work over the step with the mean of the old and new forces, minus the stored energy
    let lost = (dot(elastic, elastic) - dot(turned, turned)) + dot(add(turned, new), gone);
    Slide { elastic: new, slip: dot(gone, gone).sqrt(), dissipated: half * lost }
}
