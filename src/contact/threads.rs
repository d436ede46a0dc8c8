//! Contact of beams with beams: every step the forces of the touching pairs (see [`super::pairs`]), from the integral over the
//! lines of both threads (see [`super::segments`] and [`super::arc_offset`]), with damping and friction at the point of action.
//!
//! A pair with a gap is skipped until the gap can have closed, as in [`super::penalty`]: points of lines move at most as fast
//! as nodes times the sum of their absolute weights.

use super::arc_offset::{self, Piece};
use super::friction::slide;
use super::joint::Joint;
use super::pairs::{READS, Scene};
use super::potential::GAP_ROUNDING;
use super::segments::{self, Push, Segments};
use super::sums::{self, SUM_DAMPING, SUM_ENERGY, SUM_FRICTION, SUM_RADIUS, SUM_SLIP, add_virial, virial};
use super::{EMPTY, Params, is_in_range, of_key, slot_state, status};
use crate::elements::beam2::{self, TABLE};
use crate::kernel::buffer::Kind::{Int, Scalar, Uint};
use crate::kernel::interface::{Slot, constants, joined, slot};
use crate::kernel::io::{Io, raise, read};
use crate::kernel::lane::{Lane, Real};
use crate::kernel::node::Field;
use crate::kernel::position;
use crate::kernel::row::Row;
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::Kernel;
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

/// Two touching beams: weights of their nodes, the penalty times their lengths, N/mm, and their reference pieces.
struct Pair<R> {
    weights: [[[R; 4]; 2]; 2],
    strengths: [R; 2],
    rest: Segments<R>,
}

impl<R: Real> Pair<R> {
    /// Weights of the nodes at points of both pieces.
    #[inline(always)]
    fn at(&self, points: [R; 2]) -> [[R; 4]; 2] {
        let one = R::from_f64(1.0);
        let mut weights = [self.weights[0][0], self.weights[1][0]];
        for i in 0..2 {
            let ([first, second], s) = (&self.weights[i], points[i]);
            for n in 0..4 {
                weights[i][n] = first[n] * (one - s) + second[n] * s;
            }
        }
        weights
    }

    /// Adds forces on the ends of both pieces to their nodes, as integers whose sum is zero; `inverse` is one over the quantum.
    #[inline(always)]
    fn add_forces(&self, loads: &mut [Joint<4>; 2], status: &[AtomicU32], inverse: R, push: &Push<R>) {
        let mut rest = [0i32; 3];
        for i in 0..2 {
            let ends = if i == 0 { push.own } else { push.others };
            for n in 0..4 {
                let force = fma(ends[0], self.weights[i][0][n], scale(ends[1], self.weights[i][1][n]));
                let quanta = scale(force, inverse);
                let mut whole = [0; 3];
                for k in 0..3 {
                    if !is_in_range(status, quanta[k], loads[i].nodes[n]) {
                        return;
                    }
                    whole[k] = quanta[k].to_i32();
                }
                if (i, n) == (1, 3) {
                    whole = rest;
                }
                for k in 0..3 {
                    rest[k] -= whole[k];
                }
                loads[i].push(n, whole);
            }
        }
    }

    /// Adds bounds of the stiffness at the ends of both pieces, times the sum of the weights of both; `inverse` as above.
    #[inline(always)]
    fn add_rows(&self, loads: &mut [Joint<4>; 2], inverse: R, push: &Push<R>, most_weights: R) {
        for i in 0..2 {
            let rows = if i == 0 { push.own_rows } else { push.other_rows };
            for end in 0..2 {
                loads[i].stiffen(rows[end] * most_weights * inverse, &self.weights[i][end]);
            }
        }
    }
}

/// A beam with its piece, and the loads of this piece and of the one that it touched last.
struct Own<R> {
    beam: usize,
    piece: Piece<R>,
    loads: [Joint<4>; 2],
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
    /// One over the quanta of force and of stiffness, exact since these are powers of two.
    per_force: R,
    per_stiffness: R,
    /// Distance at which threads touch, mm, and its increment since the previous step.
    reach: R,
    growth: R,
    /// Time since the previous step, s.
    elapsed: R,
    /// Upper bound of the approach speed of two near beams over this time, mm/s.
    approach: R,
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
        let flags = io.atomic_uints(slot!(&FORCE, "status"));
        let fastest: R = read(&flags[status::turn(io.row.turn.to_i32(), status::BEFORE) + 1]);
        Self {
            scene: Scene::new(io, &params),
            row: io.row,
            velocity: Field::new(io, slot!(&FORCE, "velocity")),
            mass: io.scalars(slot!(&FORCE, "mass")),
            forces: io.atomics(slot!(&FORCE, "forces")),
            stiffness: io.atomics(slot!(&FORCE, "stiffness")),
            flags,
            params,
            per_force: R::from_f64(1.0) / real(params.force_quantum),
            per_stiffness: R::from_f64(1.0) / real(params.stiffness_quantum),
            reach: thick * io.row.radius,
            growth: thick * io.row.radius_increment,
            elapsed: io.row.dt_mid + io.row.dt_mid - io.row.dt,
            approach: io.row.closing * (fastest + fastest + io.row.affine),
        }
    }

    /// Reduces the gap counters, and tells whether one of a beam's pairs can touch.
    #[inline(always)]
    fn can_touch(&self, beam: usize, keys: &[u32], states: &mut [R]) -> bool {
        let (zero, size) = (R::from_f64(0.0), const { slot_state(FRICTION) });
        let weights = self.scene.offsets.most_weights(beam);
        let mut can_touch = false;
        for slot in 0..keys.len() {
            let state = &mut states[size * slot];
            if *state < zero {
                let mean = R::from_f64(0.5) * (weights + self.scene.offsets.most_weights(of_key(keys[slot]).0));
                *state = *state + self.approach * mean * self.elapsed + self.growth;
            }
            can_touch |= !(*state < zero);
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

    /// Forces between a beam and another one; their depth if they touch, mm, else zero.
    #[inline(always)]
    fn pair(&self, own: &mut Own<R>, key: u32, state: &mut [R], sum: &mut [R]) -> R {
        let zero = R::from_f64(0.0);
        let (beam, (other, image)) = (own.beam, of_key(key));
        let [rest, now] = self.scene.segments(beam, &own.piece, other, image);
        let penalty = real::<R>(self.params.thread_thread);
        let strengths = [penalty * self.length(beam), penalty * self.length(other)];
        let depth = self.reach - now.distance();
        let mut push = if depth > zero {
            now.push(self.reach, strengths[0], self.scene.owns(beam, other, image))
        } else {
            Push::none()
        };
        if !(push.weight > zero) {
            self.release(beam, state, sum);
            state[0] = (depth + R::from_f64(GAP_ROUNDING)).min(zero);
            return zero;
        }
        sum[SUM_ENERGY] = sum[SUM_ENERGY] + push.energy;
        sum[SUM_RADIUS] = sum[SUM_RADIUS] + push.growth * self.growth;
        let offsets = &self.scene.offsets;
        own.loads[1].go_on(offsets.nodes(self.scene.ends, other), self.forces, self.stiffness);
        let nodes = [own.loads[0].nodes, own.loads[1].nodes];
        let pair = Pair { weights: [offsets.weights(beam), offsets.weights(other)], strengths, rest };
        let pressed = norm(push.total());
        if pressed > zero {
            let tangential = if FRICTION { self.tangential(beam) } else { zero };
            self.resist(&pair, nodes, [pressed, tangential], &mut push, state, sum);
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
        pair.add_forces(&mut own.loads, self.flags, self.per_force, &push);
        let most_weights = offsets.most_weights(beam) + offsets.most_weights(other);
        pair.add_rows(&mut own.loads, self.per_stiffness, &push, most_weights);
        depth
    }

    /// Adds damping, and friction of stiffness `tangential` (N/mm), to an elastic force of size `pressed` (N), at its point of
    /// action, for a pair with its nodes.
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
    fn resist(
        &self,
        pair: &Pair<R>,
        nodes: [[usize; 4]; 2],
        [pressed, tangential]: [R; 2],
        push: &mut Push<R>,
        state: &mut [R],
        sum: &mut [R],
    ) {
        let (zero, one, half) = (R::from_f64(0.0), R::from_f64(1.0), R::from_f64(0.5));
        let (s, t) = (push.at[0] / push.weight, push.at[1] / push.weight);
        let normal = scale(push.total(), one / pressed);
        let mut motion = [zero; 3];
        let mut square = zero;
        let weights = pair.at([s, t]);
        for i in 0..2 {
            for n in 0..4 {
                let (node, weight) = (nodes[i][n], weights[i][n]);
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
            &constants![uint: SLOT_STATE = slot_state(FRICTION); scalar: LEAST, GAP_ROUNDING],
        ],
        light: true,
        ..Shader::new("contact/threads", "force")
    };
    const SLOTS: &'static [Slot] = &FORCE;
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let (zero, size) = (L::Scalar::from_f64(0.0), const { slot_state(FRICTION) });
        let touch = Touch::<_, FRICTION, PERIODIC>::new(io);
        let mut keys = io.own::<u32>(slot!(&FORCE, "keys"));
        let mut states = io.own::<L::Scalar>(slot!(&FORCE, "states"));
        let mut sums = io.own::<L::Scalar>(slot!(&FORCE, "sums"));
        let (mut touching, mut deepest) = (0, zero);
        for beam in items {
            let keys = keys.item(0, beam);
            let mut count = 0;
            while count < keys.len() && keys[count] != EMPTY {
                count += 1;
            }
            if count == 0 {
                continue;
            }
            let states = states.item(0, beam);
            let sum = sums.item(0, beam);
            sum[SUM_ENERGY] = zero;
            if !touch.can_touch(beam, &keys[..count], states) {
                continue;
            }
            let nodes = touch.scene.offsets.nodes(touch.scene.ends, beam);
            let loads = [Joint::new(nodes), Joint::new([0; 4])];
            let mut own = Own { beam, piece: touch.scene.piece(beam), loads };
            let mut depth = zero;
            for slot in 0..count {
                let state = &mut states[size * slot..][..size];
                if !(state[0] < zero) {
                    depth = depth.max(touch.pair(&mut own, keys[slot], state, sum));
                }
            }
            if depth > zero {
                own.loads[0].finish(touch.forces, touch.stiffness);
                own.loads[1].finish(touch.forces, touch.stiffness);
                touching += 1;
                deepest = deepest.max(depth);
            }
        }
        if touching > 0 {
            touch.flags[status::TOUCHING[2]].fetch_add(touching, Ordering::Relaxed);
            raise(&touch.flags[status::PENETRATION[2]], deepest);
        }
    }
}
