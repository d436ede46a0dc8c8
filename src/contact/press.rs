//! Forces of faces on points as integers: the forces on the corners of a face and on the nodes that carry a point cancel exactly.

use super::is_in_range;
use super::joint::{Joint, quanta};
use super::look::{Seen, View};
use super::penalty::{Step, Walk};
use super::potential::{Pushed, out};
use super::rub::Rubbed;
use super::sums::{add_virial, virial};
use crate::kernel::lane::Real;
use crate::kernel::vector::{add, fma, scale};

impl<R: Real, const FRICTION: bool, const PERIODIC: bool> Step<'_, R, FRICTION, PERIODIC> {
    /// Adds the forces of a face on a point to its corners, with its share of damping and friction, and their opposite to the
    /// force on the point: the last corner takes the rounding error of the others.
    #[inline(always)]
    pub(super) fn press(
        &self,
        view: &View<R>,
        (number, entry, seen): (usize, u32, &Seen<R>),
        (pushed, rubbed): (&Pushed<R>, &Rubbed<R>),
        corners: &mut Joint<4>,
        own: &mut [i32; 3],
        sums: &mut [R],
    ) {
        let Some(face) = seen.face(number) else { return };
        let mut pull = seen.pull(number);
        let (zero, is_nearest) = (R::from_f64(0.0), entry == pushed.nearest.entry);
        if pushed.inside && is_nearest {
            let (force, _) = out(view, face.distance);
            let away = scale(face.away, R::from_f64(-1.0));
            for a in 0..4 {
                pull[a] = fma(away, -(force * face.weights[a]), pull[a]);
            }
        }
        let alone = if is_nearest { R::from_f64(1.0) } else { zero };
        let force = view.penalty * (view.radius - face.distance).max(zero);
        let share = if pushed.shared > zero { force / pushed.shared } else { alone };
        for a in 0..4 {
            pull[a] = fma(rubbed.force, -(share * face.weights[a]), pull[a]);
        }
        let nodes = self.nodes(entry);
        let joint = corners.of(nodes, self.forces, self.stiffness);
        // a face that has just begun to push is as stiff as any other, whatever its share of the force
        let mut rows = [zero; 4];
        for a in 0..4 {
            let features = if pushed.inside && is_nearest { face.stiff[a] + face.weights[a] } else { face.stiff[a] };
            rows[a] = rubbed.feature * features + rubbed.viscous * (share * face.weights[a]);
        }
        joint.stiffen(self.per_stiffness, &rows);
        let sum = scale(add(add(pull[0], pull[1]), add(pull[2], pull[3])), self.per_force);
        for sum in sum {
            if !is_in_range(self.flags, sum, nodes[0]) {
                return;
            }
        }
        let mut rest = quanta(sum);
        for k in 0..3 {
            own[k] = own[k].wrapping_sub(rest[k]);
        }
        for a in 0..3 {
            let part = quanta(scale(pull[a], self.per_force));
            for k in 0..3 {
                rest[k] = rest[k].wrapping_sub(part[k]);
            }
            joint.push(a, part);
        }
        joint.push(3, rest);
        if PERIODIC {
            let reference = seen.reference(number);
            for a in 0..4 {
                add_virial(&mut sums[virial(FRICTION)..], pull[a], reference[a]);
            }
        }
    }

    /// Adds the stiffness of a touch to the nodes that carry a point.
    #[inline(always)]
    pub(super) fn stiffen<const N: usize>(&self, walk: &Walk<R, N>, rows: R, carriers: &mut Joint<N>) {
        carriers.of(walk.nodes, self.forces, self.stiffness).stiffen(rows * self.per_stiffness, &walk.weights);
    }

    /// Distributes the force on a point to its nodes.
    #[inline(always)]
    pub(super) fn share_out<const N: usize>(&self, walk: &Walk<R, N>, own: [i32; 3], carriers: &mut Joint<N>) {
        carriers.of(walk.nodes, self.forces, self.stiffness).share(own, &walk.weights);
    }
}
