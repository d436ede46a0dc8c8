//! Contact of beams with beams: closest points of two segments, the beams' lines (see [`super::bow`]), penalty and friction as
//! for faces.
//!
//! A pair with a gap is left alone until the gap can have closed, as in [`super::penalty`]: points of lines move at most as fast as
//! nodes times the sum of their weights.
//!
//! Every pair within reach counts, also where two beams of a thread are near with their common end: the distance of each
//! pair is continuous, so the energy is, and nothing is gained as a contact passes from beam to beam.

use super::bow::Bows;
use super::friction::slide;
use super::grid::{BOX, MOTION, absolute, cell_index, cells, has_moved, inverse, pull_back};
use super::penalty::{Press, SUM_DAMPING, SUM_ENERGY, SUM_FRICTION, SUM_RADIUS, SUM_SLIP, add_virial, press, virial};
use super::{EMPTY, MOST_STATE, Params, add_pair, add_stiffness, found, key, of_key, shift, slot_state, status};
use crate::elements::beam2;
use crate::kernel::lane::{Lane, Real};
use crate::kernel::node::{Displacements, Field, Lattice};
use crate::kernel::position::QUANTUM;
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::{Io, Kernel, raise};
use crate::kernel::vector::{Vector, add, apply, dot, fma, norm, scale, sub};
use std::ops::Range;
use std::sync::atomic::Ordering;

/// Numbers of a beam's place on its thread: arc length of its middle, mm; its length, mm; length of a closed thread, mm, else 0.
pub const ARC: usize = 3;
/// Pairs that a beam can have.
pub const MOST_PAIRS: usize = 64;

pub const ENDS: usize = 0;
pub const BEAMS: usize = 1;
pub const REFERENCE: usize = 2;
pub const QUANTA: usize = 3;
pub const REMAINDER: usize = 4;
/// See [`super::bow`].
pub const NEIGHBOURS: usize = 5;
pub const SHARES: usize = 6;

/// Finds pairs of beams.
pub struct Pairs<const PERIODIC: bool>;
/// Contact forces of pairs of beams.
pub struct Force<const FRICTION: bool, const PERIODIC: bool>;

/// What both kernels read of beams.
struct Scene<'a, R, const PERIODIC: bool> {
    ends: &'a [u32],
    beams: &'a [R],
    bows: Bows<'a, R>,
    reference: Lattice<'a>,
    displacement: Displacements<'a, R>,
    gradient: &'a [[R; 3]; 3],
    period: [i32; 2],
}

impl<'a, R: Real, const PERIODIC: bool> Scene<'a, R, PERIODIC> {
    #[inline(always)]
    fn new(io: &'a Io<R>, period: [i32; 2]) -> Self {
        Self {
            ends: io.uints(ENDS),
            beams: io.scalars(BEAMS),
            bows: Bows { neighbours: io.uints(NEIGHBOURS), shares: io.scalars(SHARES) },
            reference: Lattice::new(io, REFERENCE),
            displacement: Displacements::new(io, QUANTA, REMAINDER),
            gradient: &io.row.gradient,
            period,
        }
    }

    /// A beam's vector, in the reference and now.
    #[inline(always)]
    fn vector(&self, beam: usize) -> (Vector<R>, Vector<R>) {
        let (d, change) = beam2::vector::<_, PERIODIC>(self.beams, self.ends, beam, &self.displacement, self.gradient);
        (d, add(d, change))
    }

    /// From a beam's chord to its line, in the reference and now.
    #[inline(always)]
    fn bow(&self, beam: usize) -> (Vector<R>, Vector<R>) {
        self.bows.bow::<PERIODIC>(self.beams, self.ends, beam, &self.displacement, self.gradient)
    }

    /// From the line of beam `a`, which lies `bow` beside its chord, to that of `b` in an image, in the reference and now.
    #[inline(always)]
    fn between(&self, a: usize, bow: &(Vector<R>, Vector<R>), b: usize, image: [i32; 2]) -> (Vector<R>, Vector<R>) {
        let other = self.bow(b);
        let (a, b) = (self.ends[2 * a] as usize, self.ends[2 * b] as usize);
        let rest: Vector<R> = self.reference.between(b, a, shift::<PERIODIC>(self.period, image));
        let affine = if PERIODIC { add(rest, apply(self.gradient, rest)) } else { rest };
        let now = add(affine, self.displacement.between(b, a));
        (add(rest, sub(other.0, bow.0)), add(now, sub(other.1, bow.1)))
    }
}

/// Coordinates (0 to 1) of the closest points of segment `0 → d1` and segment `start → start + d2`.
#[inline(always)]
pub fn closest_points<R: Real>(d1: Vector<R>, d2: Vector<R>, start: Vector<R>) -> (R, R) {
    let (zero, one) = (R::from_f64(0.0), R::from_f64(1.0));
    let unit = |x: R| x.max(zero).min(one);
    let (a, e, b) = (dot(d1, d1), dot(d2, d2), dot(d1, d2));
    let (c, f) = (-dot(d1, start), -dot(d2, start));
    let determinant = a * e - b * b;
    let s = if determinant > a * e * R::from_f64(1e-6) {
        unit((b * f - c * e) / determinant)
    } else {
        // parallel: the middle of the overlap
        let (p, q) = (dot(d1, start) / a, dot(d1, add(start, d2)) / a);
        let (low, high) = (p.min(q).max(zero), p.max(q).min(one));
        unit(R::from_f64(0.5) * (low + high))
    };
    let t = (b * s + f) / e;
    if t < zero {
        (unit(-c / a), zero)
    } else if t > one {
        (unit((b - c) / a), one)
    } else {
        (s, t)
    }
}

impl<const PERIODIC: bool> Kernel for Pairs<PERIODIC> {
    const SHADER: Shader = Shader { defines: &[when(PERIODIC, "PERIODIC")], ..Shader::new("contact/threads", "pairs") };

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        // thread of each beam, and see `ARC`
        const THREADS: usize = 7;
        const ARCS: usize = 8;
        const COUNTS: usize = 9;
        const ITEMS: usize = 10;
        const BOXES: usize = 11;
        let params: Params = io.params();
        let constant = L::Scalar::from_f64;
        let scene = Scene::<_, PERIODIC>::new(io, params.period);
        let (threads, arcs) = (io.uints(THREADS), io.scalars(ARCS));
        let (counts, lists) = (io.uints(COUNTS), io.uints(ITEMS));
        let boxes = io.scalars(BOXES);
        let mut keys = io.own::<u32>(12);
        let mut states = io.own::<L::Scalar>(13);
        let mut when = io.own::<u32>(14);
        let flags = io.atomic_uints(15);
        let apart = L::Scalar::from_i32(params.apart as i32);
        let inverse = inverse::<_, PERIODIC>(&io.row.gradient);
        let period = params.period.map(|p| L::Scalar::from_i32(p) * constant(QUANTUM));
        let reach = constant(f64::from(2.0 * params.thread_radius + params.skin));
        let slots = params.beam_slots as usize;
        for beam in items {
            let middle = |item: usize, k: usize| boxes[BOX * item + k];
            let (_, along) = scene.vector(beam);
            let bow = scene.bow(beam);
            let (node, _) = absolute(io, [REFERENCE, QUANTA, REMAINDER], &inverse, scene.ends[2 * beam] as usize);
            let (aside, back) = (pull_back(&inverse, bow.1), pull_back(&inverse, along));
            let start = [node[0] + aside[0], node[1] + aside[1]];
            let range = |k: usize| {
                let end = start[k] + back[k];
                cells::<_, PERIODIC>(&params, k, start[k].min(end), start[k].max(end))
            };
            let ((x0, x1), (y0, y1)) = (range(0), range(1));
            if !(start[0].is_finite() && start[1].is_finite()) {
                flags[status::FLAGS].fetch_or(status::NOT_FINITE, Ordering::Relaxed);
                continue;
            }
            let when = when.at(0, beam);
            let own = &boxes[BOX * (params.slabs as usize + beam)..][..BOX];
            let (least, greatest) = ([0, 1, 2].map(|k| own[MOTION + k]), [0, 1, 2].map(|k| own[MOTION + 3 + k]));
            let (mut searches, mut full) = (*when != found::WITH_ALL, false);
            for y in y0..=y1 {
                for x in x0..=x1 {
                    let cell = cell_index(&params, x, y);
                    full |= counts[cell] > params.capacity;
                    if searches || full {
                        continue;
                    }
                    let items = &lists[cell * params.capacity as usize..][..counts[cell] as usize];
                    searches = items
                        .iter()
                        .filter(|near| **near > params.slabs + beam as u32)
                        .any(|near| has_moved(&boxes[BOX * *near as usize..][..BOX], least, greatest, apart));
                }
            }
            // overflow keeps what was known, and is searched again with larger tables
            if !searches || full {
                continue;
            }
            // in ascending order
            let mut pairs = [EMPTY; MOST_PAIRS];
            let mut count = 0;
            for y in y0..=y1 {
                for x in x0..=x1 {
                    let cell = cell_index(&params, x, y);
                    let listed = counts[cell] as usize;
                    for &near in &lists[cell * params.capacity as usize..][..listed] {
                        if near < params.slabs + beam as u32 + 1 {
                            continue;
                        }
                        let other = (near - params.slabs) as usize;
                        if threads[other] == threads[beam] {
                            let (a, b) = (&arcs[ARC * beam..][..ARC], &arcs[ARC * other..][..ARC]);
                            let direct = (a[0] - b[0]).abs();
                            let around = if a[2] > constant(0.0) { direct.min(a[2] - direct) } else { direct };
                            let between = around - constant(0.5) * (a[1] + b[1]);
                            if between < constant(f64::from(params.self_arc)) {
                                continue;
                            }
                        }
                        let image_along = |k: usize| {
                            if !PERIODIC || params.period[k] == 0 {
                                return 0;
                            }
                            let apart = middle(params.slabs as usize + beam, k) - middle(near as usize, k);
                            (apart / period[k]).to_i32()
                        };
                        let image = [image_along(0), image_along(1)];
                        let (_, apart) = scene.between(beam, &bow, other, image);
                        let (_, direction) = scene.vector(other);
                        let (s, t) = closest_points(along, direction, apart);
                        let offset = sub(scale(along, s), fma(direction, t, apart));
                        if !(norm(offset) < reach) {
                            continue;
                        }
                        let key = key(other, image);
                        let place = pairs[..count].partition_point(|known| *known < key);
                        if pairs[..count].get(place) == Some(&key) {
                            continue;
                        }
                        if count == MOST_PAIRS {
                            full = true;
                            continue;
                        }
                        pairs.copy_within(place..count, place + 1);
                        pairs[place] = key;
                        count += 1;
                    }
                }
            }
            if full || count > slots {
                flags[status::FLAGS].fetch_or(status::SLOTS_FULL, Ordering::Relaxed);
                continue;
            }
            let (keys, states) = (keys.item(0, beam), states.item(0, beam));
            let size = params.state as usize;
            let mut old = [(EMPTY, [constant(0.0); MOST_STATE]); MOST_PAIRS];
            for ((old, key), state) in old.iter_mut().zip(keys.iter()).zip(states.chunks_exact(size)) {
                old.0 = *key;
                old.1[..size].copy_from_slice(state);
            }
            for (slot, (key, state)) in keys.iter_mut().zip(states.chunks_exact_mut(size)).enumerate() {
                *key = pairs[..count].get(slot).copied().unwrap_or(EMPTY);
                let known = old.iter().find(|(old, _)| *key != EMPTY && old == key);
                state.copy_from_slice(&known.map_or([constant(0.0); MOST_STATE], |(_, state)| *state)[..size]);
            }
            *when = if *when == found::NEVER { found::WITH_ALL } else { found::SINCE };
            flags[status::SEARCHED].fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl<const FRICTION: bool, const PERIODIC: bool> Kernel for Force<FRICTION, PERIODIC> {
    const SHADER: Shader = Shader {
        defines: &[when(FRICTION, "FRICTION"), when(PERIODIC, "PERIODIC")],
        ..Shader::new("contact/threads", "force")
    };
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        const VELOCITY: usize = 7;
        const MASS: usize = 8;
        let (state_size, virial) = const { (slot_state(FRICTION), virial(FRICTION)) };
        let params: Params = io.params();
        let real = |x: f32| L::Scalar::from_f64(f64::from(x));
        let constant = L::Scalar::from_f64;
        let (zero, one) = (constant(0.0), constant(1.0));
        let scene = Scene::<_, PERIODIC>::new(io, params.period);
        let velocity = Field::new(io, VELOCITY);
        let mass = io.scalars(MASS);
        let mut keys = io.own::<u32>(9);
        let mut states = io.own::<L::Scalar>(10);
        let mut sums = io.own::<L::Scalar>(11);
        let (forces, stiffness, flags) = (io.atomics(12), io.atomics(13), io.atomic_uints(14));
        let radius = real(params.thread_radius) * io.row.radius;
        let growth = constant(2.0) * real(params.thread_radius) * io.row.radius_increment;
        let elapsed = io.row.dt_mid + io.row.dt_mid - io.row.dt;
        for beam in items {
            let slot_keys = keys.item(0, beam);
            if slot_keys[0] == EMPTY {
                continue;
            }
            let slot_states = states.item(0, beam);
            let sum = sums.item(0, beam);
            let count = slot_keys.iter().position(|key| *key == EMPTY).unwrap_or(slot_keys.len());
            let weights = scene.bows.line_weights(beam);
            let mean_weights = |other| constant(0.5) * (weights + scene.bows.line_weights(other));
            let mut can_touch = false;
            for (key, state) in slot_keys[..count].iter().zip(slot_states.chunks_exact_mut(state_size)) {
                if state[0] < zero {
                    state[0] = state[0] + io.row.approach * mean_weights(of_key(*key).0) * elapsed + growth;
                }
                can_touch |= !(state[0] < zero);
            }
            sum[SUM_ENERGY] = zero;
            if !can_touch {
                continue;
            }
            let mut energy = zero;
            let mut touches = false;
            let (rest, along) = scene.vector(beam);
            let bow = scene.bow(beam);
            for (key, state) in slot_keys[..count].iter().zip(slot_states.chunks_exact_mut(state_size)) {
                if state[0] < zero {
                    continue;
                }
                let (other, image) = of_key(*key);
                let (apart_rest, apart) = scene.between(beam, &bow, other, image);
                let (direction_rest, direction) = scene.vector(other);
                let (s, t) = closest_points(along, direction, apart);
                let offset = sub(scale(along, s), fma(direction, t, apart));
                let distance = norm(offset);
                let depth = radius + radius - distance;
                let penalty = real(params.thread_thread);
                let tangential = penalty * real(params.tangential);
                if depth <= zero || distance < constant(1e-6) {
                    if FRICTION {
                        let elastic = [state[1], state[2], state[3]];
                        sum[SUM_FRICTION] = sum[SUM_FRICTION] + constant(0.5) * tangential * dot(elastic, elastic);
                    }
                    state.fill(zero);
                    state[0] = depth.min(zero);
                    continue;
                }
                touches = true;
                let normal = scale(offset, one / distance);
                let nodes = scene.bows.line_nodes(scene.ends, beam, s);
                let others = scene.bows.line_nodes(scene.ends, other, t);
                let mut motion = [zero; 3];
                let mut inverse = zero;
                for (node, weight) in nodes {
                    motion = fma(velocity.at(node), weight, motion);
                    inverse = inverse + weight * weight / mass[node];
                }
                for (node, weight) in others {
                    motion = fma(velocity.at(node), -weight, motion);
                    inverse = inverse + weight * weight / mass[node];
                }
                let between = sub(scale(rest, s), fma(direction_rest, t, apart_rest));
                if PERIODIC {
                    motion = add(motion, apply(&io.row.rate, between));
                }
                let approach = dot(motion, normal);
                let Press { elastic_force, pressing: normal_force, row_sum } =
                    press(&params, io.row, penalty, depth, inverse, approach);
                sum[SUM_DAMPING] = sum[SUM_DAMPING] + (elastic_force - normal_force) * approach * elapsed;
                sum[SUM_RADIUS] = sum[SUM_RADIUS] + elastic_force * growth;
                state[0] = normal_force;
                let mut stored = elastic_force * depth;
                let mut force = scale(normal, normal_force);
                if FRICTION {
                    let elastic = [state[1], state[2], state[3]];
                    let limit = real(params.friction) * normal_force;
                    let slid = slide(elastic, scale(motion, elapsed), normal, tangential, limit);
                    sum[SUM_FRICTION] = sum[SUM_FRICTION] + slid.dissipated;
                    sum[SUM_SLIP] = sum[SUM_SLIP] + slid.slip;
                    state[1..].copy_from_slice(&slid.elastic);
                    stored = stored + tangential * dot(slid.elastic, slid.elastic);
                    force = sub(force, scale(slid.elastic, tangential));
                }
                energy = energy + constant(0.5) * stored;
                if PERIODIC {
                    add_virial(&mut sum[virial..], force, between);
                }
                add_pair(forces, flags, force, real(params.force_quantum), nodes, others);
                let row_sum = row_sum * mean_weights(other);
                add_stiffness(stiffness, row_sum, real(params.stiffness_quantum), nodes.into_iter().chain(others));
                raise(&flags[status::PENETRATION[2]], depth);
            }
            sum[SUM_ENERGY] = energy;
            if touches {
                flags[status::TOUCHING[2]].fetch_add(1, Ordering::Relaxed);
            }
        }
    }
}
