//! Contact of beams with beams: every step the forces of the touching pairs (see [`super::pairs`]), from the integral over the
//! lines of both threads (see [`super::segments`] and [`super::arc_offset`]), with damping and friction at the point of action.
//!
//! A pair with a gap is skipped until the gap can have closed, as in [`super::penalty`]: points of lines move at most as fast
//! as nodes times the sum of their absolute weights.

use super::arc_offset::{self, Piece};
use super::friction::slide;
use super::pairs::{READS, Scene};
use super::segments::{self, Push, Segments};
use super::sums::{self, SUM_DAMPING, SUM_ENERGY, SUM_FRICTION, SUM_RADIUS, SUM_SLIP, add_virial, virial};
use super::{EMPTY, Params, add_force, add_stiffness, is_in_range, of_key, slot_state, status};
use crate::elements::beam2::{self, TABLE};
use crate::kernel::buffer::Kind::{Int, Scalar, Uint};
use crate::kernel::interface::{Slot, constants, joined, slot};
use crate::kernel::lane::{Lane, Real};
use crate::kernel::node::Field;
use crate::kernel::position;
use crate::kernel::row::Row;
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::{Io, Kernel, raise};
use crate::kernel::vector::{add, apply, dot, fma, norm, scale, sub};
use std::ops::Range;
use std::sync::atomic::{AtomicI32, AtomicU32, Ordering};

/// Largest number of pairs per beam.
pub const MOST_PAIRS: usize = 64;
/// Lower bound of the touching length as a divisor, as a share of the beam length.
const LEAST: f64 = 1e-6;

/// The slots of [`Force`].
const FORCE: [Slot; 15] = joined(
    &READS,
    &[
        Slot::read("velocity", Scalar),
        Slot::read("mass", Scalar),
        Slot::row_of_plan("keys", Uint),
        Slot::row_of_plan("states", Scalar),
        Slot::row_of_plan("sums", Scalar),
        Slot::atomic("forces", Int),
        Slot::atomic("stiffness", Int),
        Slot::atomic("status", Uint),
    ],
);

/// Contact forces of pairs of beams.
pub struct Force<const FRICTION: bool, const PERIODIC: bool>;

/// Two touching beams: their nodes and weights, the penalty times their lengths, N/mm, and their reference pieces.
struct Pair<R> {
    nodes: [[usize; 4]; 2],
    weights: [[[R; 4]; 2]; 2],
    strengths: [R; 2],
    rest: Segments<R>,
}

impl<R: Real> Pair<R> {
    /// Weights of the nodes at points of both pieces.
    #[inline(always)]
    fn at(&self, points: [R; 2]) -> [[R; 4]; 2] {
        let one = R::from_f64(1.0);
        [0, 1].map(|i| {
            let ([first, second], s) = (self.weights[i], points[i]);
            [0, 1, 2, 3].map(|n| first[n] * (one - s) + second[n] * s)
        })
    }

    /// Adds forces on the ends of both pieces to their nodes, as integers whose sum is zero.
    #[inline(always)]
    fn add_forces(&self, forces: &[AtomicI32], status: &[AtomicU32], quantum: R, push: &Push<R>) {
        let mut rest = [0i32; 3];
        for (i, ends) in [push.own, push.others].into_iter().enumerate() {
            for (n, node) in self.nodes[i].into_iter().enumerate() {
                let force = fma(ends[0], self.weights[i][0][n], scale(ends[1], self.weights[i][1][n]));
                let quanta = scale(force, R::from_f64(1.0) / quantum);
                if !quanta.into_iter().all(|quanta| is_in_range(status, quanta, node)) {
                    return;
                }
                let whole = if (i, n) == (1, 3) { rest } else { quanta.map(R::to_i32) };
                rest = [0, 1, 2].map(|k| rest[k] - whole[k]);
                add_force(forces, node, whole);
            }
        }
    }

    /// Adds bounds of the stiffness at the ends of both pieces, times the sum of the weights of both.
    #[inline(always)]
    fn add_rows(&self, stiffness: &[AtomicI32], quantum: R, push: &Push<R>, most_weights: R) {
        for (i, rows) in [push.own_rows, push.other_rows].into_iter().enumerate() {
            for (end, row) in rows.into_iter().enumerate() {
                add_stiffness(
                    stiffness,
                    row * most_weights,
                    quantum,
                    self.nodes[i].into_iter().zip(self.weights[i][end]),
                );
            }
        }
    }
}

/// Inputs and sums of touching pairs.
struct Touch<'a, R, const FRICTION: bool, const PERIODIC: bool> {
    scene: Scene<'a, R, PERIODIC>,
    row: &'a Row<R>,
    velocity: Field<'a, R>,
    mass: &'a [R],
    forces: &'a [AtomicI32],
    stiffness: &'a [AtomicI32],
    flags: &'a [AtomicU32],
    params: Params,
    /// Distance at which threads touch, mm, and its increment since the previous step.
    reach: R,
    growth: R,
    /// Time since the previous step, s.
    elapsed: R,
}

#[inline(always)]
fn real<R: Real>(x: f32) -> R {
    R::from_f64(f64::from(x))
}

impl<'a, R: Real, const FRICTION: bool, const PERIODIC: bool> Touch<'a, R, FRICTION, PERIODIC> {
    #[inline(always)]
    fn new(io: &'a Io<R>) -> Self {
        let params: Params = io.params();
        let thick = real::<R>(2.0 * params.thread_radius);
        Self {
            scene: Scene::new(io, &params),
            row: io.row,
            velocity: Field::new(io, slot!(&FORCE, "velocity")),
            mass: io.scalars(slot!(&FORCE, "mass")),
            forces: io.atomics(slot!(&FORCE, "forces")),
            stiffness: io.atomics(slot!(&FORCE, "stiffness")),
            flags: io.atomic_uints(slot!(&FORCE, "status")),
            params,
            reach: thick * io.row.radius,
            growth: thick * io.row.radius_increment,
            elapsed: io.row.dt_mid + io.row.dt_mid - io.row.dt,
        }
    }

    /// Reduces the gap counters, and tells whether one of a beam's pairs can touch.
    #[inline(always)]
    fn can_touch(&self, beam: usize, keys: &[u32], states: &mut [R]) -> bool {
        let zero = R::from_f64(0.0);
        let weights = self.scene.offsets.most_weights(beam);
        let mut can_touch = false;
        for (key, state) in keys.iter().zip(states.chunks_exact_mut(slot_state(FRICTION))) {
            if state[0] < zero {
                let mean = R::from_f64(0.5) * (weights + self.scene.offsets.most_weights(of_key(*key).0));
                state[0] = state[0] + self.row.approach * mean * self.elapsed + self.growth;
            }
            can_touch |= !(state[0] < zero);
        }
        can_touch
    }

    /// Reference length of a beam, mm.
    #[inline(always)]
    fn length(&self, beam: usize) -> R {
        self.scene.beams[TABLE * beam + 3]
    }

    /// Tangential stiffness of a beam's pairs, N/mm, for a contact length equal to the beam length or the thread diameter,
    /// whichever is less.
    #[inline(always)]
    fn tangential(&self, beam: usize) -> R {
        let thick = real::<R>(2.0 * self.params.thread_radius);
        real::<R>(self.params.thread_thread) * self.length(beam).min(thick) * real(self.params.tangential)
    }

    /// Releases the elastic tangential displacement of friction.
    #[inline(always)]
    fn release(&self, beam: usize, state: &mut [R], sum: &mut [R]) {
        if FRICTION {
            let elastic = [state[1], state[2], state[3]];
            sum[SUM_FRICTION] = sum[SUM_FRICTION] + R::from_f64(0.5) * self.tangential(beam) * dot(elastic, elastic);
            state[1..].fill(R::from_f64(0.0));
        }
    }

    /// Forces between a known beam piece and another beam; whether they touch.
    #[inline(always)]
    fn pair(&self, beam: usize, own: &Piece<R>, key: u32, state: &mut [R], sum: &mut [R]) -> bool {
        let zero = R::from_f64(0.0);
        let (other, image) = of_key(key);
        let [rest, now] = self.scene.segments(beam, own, other, image);
        let strengths = [beam, other].map(|beam| real::<R>(self.params.thread_thread) * self.length(beam));
        let depth = self.reach - now.distance();
        let push = || now.push(self.reach, strengths[0], self.scene.owns(beam, other, image));
        let push = if depth > zero { Some(push()) } else { None };
        let Some(mut push) = push.filter(|push| push.weight > zero) else {
            self.release(beam, state, sum);
            state[0] = depth.min(zero);
            return false;
        };
        sum[SUM_ENERGY] = sum[SUM_ENERGY] + push.energy;
        sum[SUM_RADIUS] = sum[SUM_RADIUS] + push.growth * self.growth;
        let offsets = &self.scene.offsets;
        let pair = Pair {
            nodes: [beam, other].map(|beam| offsets.nodes(self.scene.ends, beam)),
            weights: [beam, other].map(|beam| offsets.weights(beam)),
            strengths,
            rest,
        };
        let pressed = norm(push.total());
        if pressed > zero {
            let tangential = if FRICTION { self.tangential(beam) } else { zero };
            self.resist(&pair, pressed, tangential, &mut push, state, sum);
        } else {
            self.release(beam, state, sum);
        }
        state[0] = pressed;
        if PERIODIC {
            let sum = &mut sum[const { virial(FRICTION) }..];
            add_virial(sum, push.own[1], pair.rest.along);
            add_virial(sum, push.others[0], pair.rest.start);
            add_virial(sum, push.others[1], add(pair.rest.start, pair.rest.other));
        }
        pair.add_forces(self.forces, self.flags, real(self.params.force_quantum), &push);
        let most_weights = offsets.most_weights(beam) + offsets.most_weights(other);
        pair.add_rows(self.stiffness, real(self.params.stiffness_quantum), &push, most_weights);
        raise(&self.flags[status::PENETRATION[2]], depth);
        true
    }

    /// Adds damping, and friction of stiffness `tangential` (N/mm), to an elastic force of size `pressed` (N), at its point of
    /// action.
    ///
    /// Damping is a share of the critical value for the touching lengths, with their penalty and mass: it is the same per
    /// contact length in any mesh, and it cannot reverse the velocity. A node has half of its mass on either side.
    ///
    /// Damping requires the velocity in the middle of a step, but only the velocity half a step earlier is known. The true
    /// value lies between that velocity (other forces hold the contact in equilibrium) and the velocity after half a step of
    /// the elastic force alone (free flight). The smaller of the two in magnitude is used, and zero if their signs differ, so
    /// that no contact gains energy however few steps it lasts. The dissipation is computed with the mean of
    /// both, less what the damping itself slows within half a step.
    #[inline(always)]
    fn resist(&self, pair: &Pair<R>, pressed: R, tangential: R, push: &mut Push<R>, state: &mut [R], sum: &mut [R]) {
        let (zero, one, half) = (R::from_f64(0.0), R::from_f64(1.0), R::from_f64(0.5));
        let [s, t] = push.at.map(|moment| moment / push.weight);
        let normal = scale(push.total(), one / pressed);
        let mut motion = [zero; 3];
        let mut square = zero;
        for (i, weights) in pair.at([s, t]).into_iter().enumerate() {
            for (node, weight) in pair.nodes[i].into_iter().zip(weights) {
                motion = fma(self.velocity.at(node), if i == 0 { weight } else { -weight }, motion);
                square = square + (pair.strengths[i] + pair.strengths[i]) * weight * weight / self.mass[node];
            }
        }
        if PERIODIC {
            let between = sub(scale(pair.rest.along, s), fma(pair.rest.other, t, pair.rest.start));
            motion = add(motion, apply(&self.row.rate, between));
        }
        let frequency = square.sqrt();
        let stiffness = push.stiffness.max(pair.strengths[0] * R::from_f64(LEAST));
        let half_step = half * self.row.dt_mid * square / stiffness;
        let approach = dot(motion, normal);
        let free = approach + half_step * pressed;
        let mean = if approach > zero { approach } else { free.min(zero) };
        let damping = real::<R>(self.params.damping);
        let viscosity = R::from_f64(2.0) * damping * stiffness / frequency;
        let held = viscosity / (one + damping * frequency * self.row.dt_mid);
        let normal_force = (pressed - held * mean).max(zero);
        let drag = pressed - normal_force;
        let between = half * (approach + free) - half_step * drag;
        sum[SUM_DAMPING] = sum[SUM_DAMPING] + drag * between * self.row.dt_mid;
        let mut force = scale(normal, -drag);
        let mut row = held * (R::from_f64(2.0) / self.row.dt);
        if FRICTION {
            let elastic = [state[1], state[2], state[3]];
            let limit = real::<R>(self.params.friction) * normal_force;
            let slid = slide(elastic, scale(motion, self.elapsed), normal, tangential, limit);
            sum[SUM_FRICTION] = sum[SUM_FRICTION] + slid.dissipated;
            sum[SUM_SLIP] = sum[SUM_SLIP] + slid.slip;
            sum[SUM_ENERGY] = sum[SUM_ENERGY] + half * tangential * dot(slid.elastic, slid.elastic);
            state[1..].copy_from_slice(&slid.elastic);
            force = sub(force, scale(slid.elastic, tangential));
            row = row + (tangential - push.stiffness).max(zero);
        }
        push.own = [fma(force, one - s, push.own[0]), fma(force, s, push.own[1])];
        push.others = [fma(force, t - one, push.others[0]), fma(force, -t, push.others[1])];
        push.own_rows = [push.own_rows[0] + row * (one - s), push.own_rows[1] + row * s];
        push.other_rows = [push.other_rows[0] + row * (one - t), push.other_rows[1] + row * t];
    }
}

impl<const FRICTION: bool, const PERIODIC: bool> Kernel for Force<FRICTION, PERIODIC> {
    const SHADER: Shader = Shader {
        defines: &[when(FRICTION, "FRICTION"), when(PERIODIC, "PERIODIC")],
        constants: &[
            &position::CONSTANTS,
            &beam2::CONSTANTS,
            &status::CONSTANTS,
            &super::CONSTANTS,
            &arc_offset::CONSTANTS,
            &segments::CONSTANTS,
            &sums::shared(FRICTION, PERIODIC),
            &constants![uint: SLOT_STATE = slot_state(FRICTION); scalar: LEAST],
        ],
        ..Shader::new("contact/threads", "force")
    };
    const SLOTS: &'static [Slot] = &FORCE;
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let zero = L::Scalar::from_f64(0.0);
        let touch = Touch::<_, FRICTION, PERIODIC>::new(io);
        let mut keys = io.own::<u32>(slot!(&FORCE, "keys"));
        let mut states = io.own::<L::Scalar>(slot!(&FORCE, "states"));
        let mut sums = io.own::<L::Scalar>(slot!(&FORCE, "sums"));
        for beam in items {
            let slot_keys = keys.item(0, beam);
            if slot_keys[0] == EMPTY {
                continue;
            }
            let slot_states = states.item(0, beam);
            let sum = sums.item(0, beam);
            let count = slot_keys.iter().position(|key| *key == EMPTY).unwrap_or(slot_keys.len());
            sum[SUM_ENERGY] = zero;
            if !touch.can_touch(beam, &slot_keys[..count], slot_states) {
                continue;
            }
            let own = touch.scene.piece(beam);
            let mut touches = false;
            for (key, state) in slot_keys[..count].iter().zip(slot_states.chunks_exact_mut(slot_state(FRICTION))) {
                if !(state[0] < zero) {
                    touches |= touch.pair(beam, &own, *key, state, sum);
                }
            }
            if touches {
                touch.flags[status::TOUCHING[2]].fetch_add(1, Ordering::Relaxed);
            }
        }
    }
}
