//! Dissipative forces of a touch. Normal damping and friction do not follow from the potential. They act once per point and
//! body, along and across the resultant, against the mean motion of the pushing faces, weighted by their forces: a choice of one
//! wall of a valley would jump from step to step.

use super::candidates::MADE;
use super::friction::slide;
use super::joint::Joint;
use super::look::View;
use super::memory::{DAMPED, ELASTIC, Kept, NORMAL, touch};
use super::penalty::{Step, Walk};
use super::potential::Pushed;
use super::sums::{SUM_DAMPING, SUM_FRICTION, SUM_RADIUS, SUM_SLIP};
use super::{EMPTY, Params, status};
use crate::kernel::io::raise;
use crate::kernel::lane::Real;
use crate::kernel::vector::{Vector, add, apply, dot, fma, norm, scale};

/// Damping and friction force on a point, N, and row sums of the stiffness against a body, N/mm: of a feature that pushes, and of
/// damping.
pub(super) struct Rubbed<R> {
    pub force: Vector<R>,
    pub feature: R,
    pub viscous: R,
}

/// Viscosity, N·s/mm, for a given share of critical damping of a spring of `penalty` (N/mm) between masses of joint inverse
/// `inverse` (1/tonne).
#[inline(always)]
pub(crate) fn viscosity<R: Real>(params: &Params, penalty: R, inverse: R) -> R {
    R::from_f64(f64::from(params.damping)) * R::from_f64(2.0) * (penalty / inverse).sqrt()
}

impl<R: Real, const FRICTION: bool, const PERIODIC: bool> Step<'_, R, FRICTION, PERIODIC> {
    /// Damping and friction, once per point and body: against the mean motion of the pushing faces, weighted by their forces.
    /// An existing touch continues with its state.
    #[inline(always)]
    fn rub<const N: usize>(
        &self,
        (walk, view): (&Walk<R, N>, &View<R>),
        pushed: &mut Pushed<R>,
        touch: &mut [R],
        sums: &mut [R],
    ) -> Rubbed<R> {
        let (zero, half, two) = (R::from_f64(0.0), R::from_f64(0.5), R::from_f64(2.0));
        let shared = if pushed.shared > zero { pushed.shared } else { R::from_f64(1.0) };
        let mut motion = scale(pushed.motion, R::from_f64(-1.0) / shared);
        let mut inverse = pushed.inverse / shared;
        for a in 0..N {
            let (node, weight) = (walk.nodes[a], walk.weights[a]);
            motion = fma(self.velocity.at(node), weight, motion);
            inverse = inverse + weight * weight / self.mass[node];
        }
        if PERIODIC {
            let apart = scale(pushed.apart, R::from_f64(-1.0) / shared);
            motion = add(motion, apply(&self.row.rate, apart));
        }
        let size = norm(pushed.push);
        let normal = if size > zero { scale(pushed.push, R::from_f64(1.0) / size) } else { pushed.nearest.away };
        let approach = dot(motion, normal);
        let viscosity = viscosity(&self.params, view.penalty, inverse);
        let pressing = (size - viscosity * approach).max(zero);
        // over the motion since the previous positions, with the mean of the old and new forces
        let drag = size - pressing;
        sums[SUM_DAMPING] = sums[SUM_DAMPING] + half * (touch[DAMPED] + drag) * approach * self.elapsed;
        (touch[NORMAL], touch[DAMPED]) = (pressing, drag);
        let mut force = scale(normal, -drag);
        if FRICTION {
            let tangential = view.penalty * R::from_f64(f64::from(self.params.tangential));
            let limit = R::from_f64(f64::from(self.params.friction)) * pressing;
            let elastic = [touch[ELASTIC], touch[ELASTIC + 1], touch[ELASTIC + 2]];
            let slid = slide(elastic, scale(motion, self.elapsed), normal, tangential, limit);
            sums[SUM_FRICTION] = sums[SUM_FRICTION] + slid.dissipated;
            sums[SUM_SLIP] = sums[SUM_SLIP] + slid.slip;
            touch[ELASTIC..].copy_from_slice(&slid.elastic);
            pushed.energy = pushed.energy + half * tangential * dot(slid.elastic, slid.elastic);
            force = fma(slid.elastic, -tangential, force);
        }
        let weights = R::from_f64(1.0) + walk.size;
        Rubbed { force, feature: weights * view.penalty, viscous: weights * (viscosity * (two / self.row.dt)) }
    }

    /// Damping, friction, and the end of a body's touch; returns the forces if it still touches.
    #[inline(always)]
    pub(super) fn settle<const N: usize>(
        &self,
        (walk, view): (&Walk<R, N>, &View<R>),
        (body, depth): (u32, R),
        pushed: &mut Pushed<R>,
        kept: &mut Kept<R>,
        carriers: &mut Joint<N>,
    ) -> Option<Rubbed<R>> {
        let (zero, size) = (R::from_f64(0.0), const { touch(FRICTION) });
        let touches = pushed.features > zero;
        let keys = &mut kept.keys[MADE..];
        let slot = place_of(keys, body, touches)?;
        let touch = &mut kept.touches[size * slot..][..size];
        let rubbed = self.rub((walk, view), pushed, touch, kept.sums);
        self.stiffen(walk, rubbed.feature * pushed.features + rubbed.viscous, carriers);
        let work = pushed.pressing * walk.full_radius * self.row.radius_increment;
        kept.sums[SUM_RADIUS] = kept.sums[SUM_RADIUS] + work;
        if !touches {
            keys[slot] = EMPTY;
            touch.fill(zero);
            return None;
        }
        keys[slot] = body;
        let outside = (view.radius - pushed.nearest.distance).max(zero);
        raise(&self.flags[status::PENETRATION[self.kind]], if depth > zero { view.radius + depth } else { outside });
        Some(rubbed)
    }
}

/// The index of a body among the touches of a point; if it `begins` to touch, a free index (there are as many as bodies in a
/// list). `None` if it does not touch.
#[inline(always)]
fn place_of(keys: &[u32], key: u32, begins: bool) -> Option<usize> {
    let known = keys.iter().position(|known| *known == key);
    known.or_else(|| if begins { keys.iter().position(|known| *known == EMPTY) } else { None })
}
