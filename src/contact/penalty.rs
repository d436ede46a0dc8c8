//! Penalty contact of points with the closed surfaces of yarns, every step: points along the beams of a thread, and the nodes
//! of yarn surfaces.
//!
//! The elastic force is the gradient of the potential of [`super::potential`].
//!
//! The dissipative forces do not follow from the potential. Normal damping and friction act once per point and body, along and
//! across the resultant, against the mean motion of the pushing faces, weighted by their forces: a choice of one wall of a
//! valley would jump from step to step.
//!
//! Every face of a point's list has a gap counter. A face is evaluated again once the bodies can have closed its gap.

use super::candidates::MADE;
use super::face::{Closest, Patch, closest};
use super::friction::slide;
use super::memory::{CLOSED, DAMPED, ELASTIC, GAPS, INNER, Kept, LEAST, NORMAL, touch};
use super::potential::{self, Nearest, Point, Push, Pushed, Seen, margin, out};
use super::sums::{SUM_DAMPING, SUM_ENERGY, SUM_FRICTION, SUM_RADIUS, SUM_SLIP, add_virial, virial};
use super::surface::{self, CARRIED, Corners, POINT, Surface, of_coded};
use super::{EMPTY, Params, add_force, add_stiffness, candidates, is_in_range, of_key, status, sums};
use crate::kernel::buffer::Kind::{Int, Scalar, Uint};
use crate::kernel::interface::{Constant, Slot, constants, slot};
use crate::kernel::lane::{Lane, Real};
use crate::kernel::node::{Displacements, Field, Lattice};
use crate::kernel::position;
use crate::kernel::row::Row;
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::{Io, Kernel, raise};
use crate::kernel::vector::{Vector, add, apply, dot, fma, norm, scale};
use std::ops::Range;
use std::sync::atomic::{AtomicI32, AtomicU32, Ordering};

/// Constants shared with the twin, for points of a `kind`.
const fn shared(kind: usize, friction: bool) -> [Constant; 9] {
    constants![uint: LEAST, CLOSED, INNER, GAPS, NORMAL, DAMPED, ELASTIC, TOUCH = touch(friction), KIND = kind]
}

const SLOTS: [Slot; 16] = [
    Slot::read("nodes", Uint),
    Slot::read("points", Scalar),
    Slot::read("faces", Uint),
    Slot::read("near", Uint),
    Slot::read("reference", Int),
    Slot::read("quanta", Int),
    Slot::read("remainder", Scalar),
    Slot::read("velocity", Scalar),
    Slot::read("mass", Scalar),
    Slot::row_of_plan("gaps", Scalar),
    Slot::row_of_plan("keys", Uint),
    Slot::row_of_plan("touches", Scalar),
    Slot::row_of_plan("sums", Scalar),
    Slot::atomic("forces", Int),
    Slot::atomic("stiffness", Int),
    Slot::atomic("status", Uint),
];

/// Contact forces of points of threads (`THREAD`) or of nodes of yarn surfaces on yarns.
pub struct Penalty<const THREAD: bool, const FRICTION: bool, const PERIODIC: bool>;

/// Index of the kind of points in the status.
const fn kind(threads: bool) -> usize {
    if threads { 0 } else { 1 }
}

/// Viscosity, N·s/mm, for a given share of critical damping of a spring of `penalty` (N/mm) between masses of joint inverse
/// `inverse` (1/tonne).
#[inline(always)]
fn viscosity<R: Real>(params: &Params, penalty: R, inverse: R) -> R {
    R::from_f64(f64::from(params.damping)) * R::from_f64(2.0) * (penalty / inverse).sqrt()
}

/// Inputs and sums of one step.
struct Step<'a, R: Real, const FRICTION: bool, const PERIODIC: bool> {
    params: Params,
    row: &'a Row<R>,
    /// Time since the previous positions, s.
    elapsed: R,
    surface: Surface<'a, R, PERIODIC>,
    velocity: Field<'a, R>,
    mass: &'a [R],
    forces: &'a [AtomicI32],
    stiffness: &'a [AtomicI32],
    flags: &'a [AtomicU32],
    /// Index of the kind of points in the status.
    kind: usize,
}

/// Damping and friction force on a point, N, and an upper bound of its total stiffness against a body, N/mm.
struct Rubbed<R> {
    force: Vector<R>,
    rows: R,
}

impl<'a, R: Real, const FRICTION: bool, const PERIODIC: bool> Step<'a, R, FRICTION, PERIODIC> {
    /// From the bindings of the kernel.
    #[inline(always)]
    fn new(io: &'a Io<R>, kind: usize) -> Self {
        let params: Params = io.params();
        Self {
            params,
            row: io.row,
            elapsed: io.row.dt_mid + io.row.dt_mid - io.row.dt,
            surface: Surface {
                faces: io.uints(slot!(&SLOTS, "faces")),
                reference: Lattice::new(io, slot!(&SLOTS, "reference")),
                displacement: Displacements::new(io, slot!(&SLOTS, "quanta"), slot!(&SLOTS, "remainder")),
                gradient: &io.row.gradient,
                period: params.period,
            },
            velocity: Field::new(io, slot!(&SLOTS, "velocity")),
            mass: io.scalars(slot!(&SLOTS, "mass")),
            forces: io.atomics(slot!(&SLOTS, "forces")),
            stiffness: io.atomics(slot!(&SLOTS, "stiffness")),
            flags: io.atomic_uints(slot!(&SLOTS, "status")),
            kind,
        }
    }

    /// Largest closure of a gap since the previous positions, mm, for a point whose weights have the absolute sum `size`.
    #[inline(always)]
    fn closing(&self, size: R, full_radius: R) -> R {
        let reach = R::from_f64(0.5) * (R::from_f64(1.0) + size);
        self.row.approach * reach * self.elapsed + full_radius * self.row.radius_increment
    }

    /// Forces of all bodies of a list on a point. The bodies can have approached by `closed` since the last evaluation of
    /// faces, and by `closing` in the last step, mm.
    #[inline(always)]
    fn all_bodies<const N: usize>(&self, at: &Point<R, N>, list: &[u32], closed: R, closing: R, kept: &mut Kept<R>) {
        let zero = R::from_f64(0.0);
        // upper bound of the penetration of a point that was inside
        let deepest = kept.gaps[INNER] + closing;
        let most = deepest + margin(at.radius + deepest);
        let skin = R::from_f64(f64::from(self.params.skin));
        let (mut least, mut inner) = (skin, zero);
        let (mut own, mut energy, mut touching) = ([0i32; 3], zero, false);
        let mut end = 0;
        while end < list.len() && list[end] != EMPTY {
            let (first, body) = (end, self.body(list[end]));
            let mut nearest = skin;
            while end < list.len() && list[end] != EMPTY && self.body(list[end]) == body {
                let gap = &mut kept.gaps[GAPS + end];
                *gap = *gap - closed;
                nearest = nearest.min(*gap);
                end += 1;
            }
            if nearest > most {
                least = least.min(nearest);
                continue;
            }
            let (entries, gaps) = (&list[first..end], GAPS + first..GAPS + end);
            let mut pushed = self.look(at, entries, &mut kept.gaps[gaps.clone()], most);
            least = kept.gaps[gaps.clone()].iter().fold(least, |least, gap| least.min(*gap));
            let depth = if pushed.is_behind(&self.params, most) { pushed.push_out(at) } else { zero };
            inner = inner.max(depth);
            if let Some(rubbed) = self.settle(at, body, depth, &mut pushed, kept) {
                touching = true;
                for (entry, i) in entries.iter().zip(gaps) {
                    if kept.gaps[i] < zero || *entry == pushed.nearest.entry {
                        self.press(at, *entry, &pushed, &rubbed, &mut own, kept.sums);
                    }
                }
            }
            energy = energy + pushed.energy;
        }
        (kept.gaps[LEAST], kept.gaps[CLOSED], kept.gaps[INNER]) =
            (least - inner - margin(at.radius + inner), zero, inner);
        kept.sums[SUM_ENERGY] = energy;
        if own != [0; 3] {
            self.share_out(at, own);
        }
        if touching {
            self.flags[status::TOUCHING[self.kind]].fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Damping, friction, and the end of a body's touch; returns the forces if it still touches.
    #[inline(always)]
    fn settle<const N: usize>(
        &self,
        at: &Point<R, N>,
        body: u32,
        depth: R,
        pushed: &mut Pushed<R>,
        kept: &mut Kept<R>,
    ) -> Option<Rubbed<R>> {
        let (zero, size) = (R::from_f64(0.0), const { touch(FRICTION) });
        let touches = pushed.features > zero;
        let keys = &mut kept.keys[MADE..];
        let slot = place_of(keys, body, touches)?;
        let touch = &mut kept.touches[size * slot..][..size];
        let rubbed = self.rub(at, pushed, touch, kept.sums);
        let work = pushed.pressing * at.full_radius * self.row.radius_increment;
        kept.sums[SUM_RADIUS] = kept.sums[SUM_RADIUS] + work;
        if !touches {
            keys[slot] = EMPTY;
            touch.fill(zero);
            return None;
        }
        keys[slot] = body;
        let outside = (at.radius - pushed.nearest.distance).max(zero);
        raise(&self.flags[status::PENETRATION[self.kind]], if depth > zero { at.radius + depth } else { outside });
        Some(rubbed)
    }

    /// Adds the forces of a face on a point; returns the gap or a lower bound of it, mm. A face whose gap certainly exceeds
    /// `most` is not evaluated closely.
    #[inline(always)]
    fn face<const N: usize>(&self, at: &Point<R, N>, entry: u32, most: R, pushed: &mut Pushed<R>) -> R {
        let corners = self.corners(at, entry);
        let patch = Patch::new(&corners.current);
        let sure = patch.nearest() - at.radius;
        if sure > most {
            return sure;
        }
        let seen = self.see(at, entry, corners, &patch);
        let Seen { point, push, .. } = &seen;
        pushed.add(push);
        let (zero, is_nearer) = (R::from_f64(0.0), pushed.is_nearer(point));
        if is_nearer {
            let Closest { away, distance, height, .. } = *point;
            pushed.nearest = Nearest { found: true, entry, away, distance, height };
        }
        let gap = point.distance - at.radius;
        let force = at.penalty * (-gap).max(zero);
        if force > zero || is_nearer {
            pushed.last = seen;
        }
        let alone = !(pushed.shared > zero);
        if force > zero || alone && is_nearer {
            let share = if force > zero { force } else { R::from_f64(1.0) };
            if alone {
                (pushed.motion, pushed.apart, pushed.inverse) = ([zero; 3], [zero; 3], zero);
            }
            for (a, weight) in point.weights.into_iter().enumerate() {
                let node = corners.nodes[a];
                pushed.motion = fma(self.velocity.at(node), share * weight, pushed.motion);
                pushed.apart = fma(corners.reference[a], share * weight, pushed.apart);
                pushed.inverse = pushed.inverse + share * (weight * weight / self.mass[node]);
            }
            pushed.shared = pushed.shared + force;
        }
        gap
    }

    /// The body of an entry.
    #[inline(always)]
    fn body(&self, entry: u32) -> u32 {
        let (face, image) = of_key(entry);
        self.surface.body(face, image)
    }

    /// Forces of a body on a point, by its entries and their gaps: entries with gaps up to `most` are evaluated.
    #[inline(always)]
    fn look<const N: usize>(&self, at: &Point<R, N>, entries: &[u32], gaps: &mut [R], most: R) -> Pushed<R> {
        let mut pushed = Pushed::none();
        for again in [false, true] {
            // a point that seems to be inside is inside only if no other face is nearer
            if again && !pushed.is_behind(&self.params, most) {
                break;
            }
            for (gap, entry) in gaps.iter_mut().zip(entries) {
                let limit = if again { pushed.beyond() - at.radius } else { most };
                if (*gap > most) == again && *gap <= limit {
                    *gap = self.face(at, *entry, limit, &mut pushed);
                }
            }
        }
        pushed
    }

    /// The corners of a face.
    #[inline(always)]
    fn corners<const N: usize>(&self, at: &Point<R, N>, entry: u32) -> Corners<R> {
        let (face, image) = of_key(entry);
        self.surface.corners(face, image, at.nodes[0], at.from)
    }

    /// Evaluates a face closely.
    #[inline(always)]
    fn see<const N: usize>(&self, at: &Point<R, N>, entry: u32, corners: Corners<R>, patch: &Patch<R>) -> Seen<R> {
        let point = closest(&corners.current, patch);
        let push = Push::of_face(at, &corners.current, self.surface.marks(of_key(entry).0), &point);
        Seen { entry, corners, point, push }
    }

    /// Adds the forces of a face on a point to the nodes, with its share of damping and friction.
    #[inline(always)]
    fn press<const N: usize>(
        &self,
        at: &Point<R, N>,
        entry: u32,
        pushed: &Pushed<R>,
        rubbed: &Rubbed<R>,
        own: &mut [i32; 3],
        sums: &mut [R],
    ) {
        let Seen { corners, point, mut push, .. } = if entry == pushed.last.entry {
            pushed.last
        } else {
            let corners = self.corners(at, entry);
            self.see(at, entry, corners, &Patch::new(&corners.current))
        };
        let (zero, is_nearest) = (R::from_f64(0.0), entry == pushed.nearest.entry);
        if pushed.inside && is_nearest {
            let (force, energy) = out(at, point.distance);
            push.add(point.weights, scale(point.away, R::from_f64(-1.0)), force, energy);
        }
        let alone = if is_nearest { R::from_f64(1.0) } else { zero };
        let force = at.penalty * (at.radius - point.distance).max(zero);
        let share = if pushed.shared > zero { force / pushed.shared } else { alone };
        for (pull, weight) in push.pull.iter_mut().zip(point.weights) {
            *pull = fma(rubbed.force, -(share * weight), *pull);
        }
        self.pull(&corners, &push.pull, own, sums);
        let quantum = R::from_f64(f64::from(self.params.stiffness_quantum));
        add_stiffness(self.stiffness, rubbed.rows * share, quantum, corners.nodes.into_iter().zip(point.weights));
    }

    /// Adds forces to the corners of a face and their opposite to the force on the point, as integers whose sum is zero: the
    /// last corner takes the rounding error of the others.
    #[inline(always)]
    fn pull(&self, corners: &Corners<R>, pull: &[Vector<R>; 4], own: &mut [i32; 3], sums: &mut [R]) {
        let quantum = R::from_f64(f64::from(self.params.force_quantum));
        let sum = add(add(pull[0], pull[1]), add(pull[2], pull[3])).map(|f| f / quantum);
        if !sum.iter().all(|q| is_in_range(self.flags, *q, corners.nodes[0])) {
            return;
        }
        let mut rest = sum.map(|q| q.to_i32());
        for k in 0..3 {
            own[k] = own[k].wrapping_sub(rest[k]);
        }
        for a in 0..4 {
            let part = if a == 3 { rest } else { pull[a].map(|f| (f / quantum).to_i32()) };
            for k in 0..3 {
                rest[k] = rest[k].wrapping_sub(part[k]);
            }
            add_force(self.forces, corners.nodes[a], part);
            if PERIODIC {
                add_virial(&mut sums[virial(FRICTION)..], pull[a], corners.reference[a]);
            }
        }
    }

    /// Damping and friction, once per point and body: against the mean motion of the pushing faces, weighted by their forces.
    /// An existing touch continues with its state.
    #[inline(always)]
    fn rub<const N: usize>(
        &self,
        at: &Point<R, N>,
        pushed: &mut Pushed<R>,
        touch: &mut [R],
        sums: &mut [R],
    ) -> Rubbed<R> {
        let (zero, half, two) = (R::from_f64(0.0), R::from_f64(0.5), R::from_f64(2.0));
        let shared = if pushed.shared > zero { pushed.shared } else { R::from_f64(1.0) };
        let mut motion = scale(pushed.motion, R::from_f64(-1.0) / shared);
        let mut inverse = pushed.inverse / shared;
        for (node, weight) in at.nodes.into_iter().zip(at.weights) {
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
        let viscosity = viscosity(&self.params, at.penalty, inverse);
        let pressing = (size - viscosity * approach).max(zero);
        // over the motion since the previous positions, with the mean of the old and new forces
        let drag = size - pressing;
        sums[SUM_DAMPING] = sums[SUM_DAMPING] + half * (touch[DAMPED] + drag) * approach * self.elapsed;
        (touch[NORMAL], touch[DAMPED]) = (pressing, drag);
        let mut force = scale(normal, -drag);
        if FRICTION {
            let tangential = at.penalty * R::from_f64(f64::from(self.params.tangential));
            let limit = R::from_f64(f64::from(self.params.friction)) * pressing;
            let elastic = [touch[ELASTIC], touch[ELASTIC + 1], touch[ELASTIC + 2]];
            let slid = slide(elastic, scale(motion, self.elapsed), normal, tangential, limit);
            sums[SUM_FRICTION] = sums[SUM_FRICTION] + slid.dissipated;
            sums[SUM_SLIP] = sums[SUM_SLIP] + slid.slip;
            touch[ELASTIC..].copy_from_slice(&slid.elastic);
            pushed.energy = pushed.energy + half * tangential * dot(slid.elastic, slid.elastic);
            force = fma(slid.elastic, -tangential, force);
        }
        let rows = (R::from_f64(1.0) + at.size) * (at.penalty * pushed.features + viscosity * (two / self.row.dt));
        let quantum = R::from_f64(f64::from(self.params.stiffness_quantum));
        add_stiffness(self.stiffness, rows, quantum, at.nodes.into_iter().zip(at.weights));
        Rubbed { force, rows }
    }

    /// Distributes the force on a point to its nodes.
    #[inline(always)]
    fn share_out<const N: usize>(&self, at: &Point<R, N>, own: [i32; 3]) {
        let mut rest = own;
        for i in 0..N {
            let part = if i + 1 == N { rest } else { own.map(|q| (R::from_i32(q) * at.weights[i]).to_i32()) };
            for k in 0..3 {
                rest[k] = rest[k].wrapping_sub(part[k]);
            }
            add_force(self.forces, at.nodes[i], part);
        }
    }
}

/// The index of a body among the touches of a point; if it `begins` to touch, a free index (there are as many as bodies in a
/// list). `None` if it does not touch.
#[inline(always)]
fn place_of(keys: &[u32], key: u32, begins: bool) -> Option<usize> {
    let known = keys.iter().position(|known| *known == key);
    known.or_else(|| if begins { keys.iter().position(|known| *known == EMPTY) } else { None })
}

impl<const THREAD: bool, const FRICTION: bool, const PERIODIC: bool> Kernel for Penalty<THREAD, FRICTION, PERIODIC> {
    const SHADER: Shader = Shader {
        defines: &[when(THREAD, "THREAD"), when(FRICTION, "FRICTION"), when(PERIODIC, "PERIODIC")],
        constants: &[
            &position::CONSTANTS,
            &status::CONSTANTS,
            &super::CONSTANTS,
            &surface::shared(THREAD),
            &candidates::CONSTANTS,
            &potential::CONSTANTS,
            &sums::shared(FRICTION, PERIODIC),
            &shared(kind(THREAD), FRICTION),
        ],
        ..Shader::new("contact/penalty", "penalty")
    };
    const SLOTS: &'static [Slot] = &SLOTS;
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        if THREAD {
            run::<_, 4, FRICTION, PERIODIC>(io, items, kind(THREAD));
        } else {
            run::<_, 1, FRICTION, PERIODIC>(io, items, kind(THREAD));
        }
    }
}

/// Forces of points carried by `N` nodes; `kind` gives their places in the status.
#[inline(always)]
fn run<R: Real, const N: usize, const FRICTION: bool, const PERIODIC: bool>(
    io: &Io<R>,
    items: Range<usize>,
    kind: usize,
) {
    let step = Step::<_, FRICTION, PERIODIC>::new(io, kind);
    let (nodes, points) = (io.uints(slot!(&SLOTS, "nodes")), io.scalars(slot!(&SLOTS, "points")));
    let near = io.uints(slot!(&SLOTS, "near"));
    let (mut gaps, mut keys) = (io.own::<R>(slot!(&SLOTS, "gaps")), io.own::<u32>(slot!(&SLOTS, "keys")));
    let (mut touches, mut sums) = (io.own::<R>(slot!(&SLOTS, "touches")), io.own::<R>(slot!(&SLOTS, "sums")));
    let (zero, faces) = (R::from_f64(0.0), step.params.faces as usize);
    for item in items {
        let (coded, list) = nodes[CARRIED * item..][..CARRIED].split_at(CARRIED - 1);
        let list = &near[(MADE + faces) * list[0] as usize..][..MADE + faces];
        let values = &points[POINT * item..][..POINT];
        let weights: [R; N] = std::array::from_fn(|a| values[a]);
        let size = weights.iter().fold(zero, |size, weight| size + weight.abs());
        let mut kept = Kept {
            gaps: gaps.item(0, item),
            keys: keys.item(0, item),
            touches: touches.item(0, item),
            sums: sums.item(0, item),
        };
        kept.renew(list[0], R::from_f64(f64::from(step.params.depth)));
        let closing = step.closing(size, values[5]);
        let closed = kept.gaps[CLOSED] + closing;
        if closed < kept.gaps[LEAST] {
            kept.gaps[CLOSED] = closed;
            continue;
        }
        let coded: [u32; N] = std::array::from_fn(|a| coded[a]);
        let at = Point {
            nodes: coded.map(|node| of_coded(node).0),
            weights,
            from: step.surface.point(coded, weights),
            penalty: values[4],
            full_radius: values[5],
            radius: values[5] * io.row.radius,
            size,
        };
        step.all_bodies(&at, &list[MADE..], closed, closing, &mut kept);
    }
}
