//! Penalty contact of slave nodes with the surfaces of yarns, every step, for the candidates of each slave that can touch: one
//! with a gap is left alone until the gap can have closed at the largest speed there is.

use super::face::{Near, Place, Surface};
use super::friction::slide;
use super::{BODY, EMPTY, Params, Split, add_force, add_quanta, add_stiffness, of_key, slot_state, status};
use crate::kernel::lane::{Lane, Real};
use crate::kernel::node::{Displacements, Field, Lattice};
use crate::kernel::row::Row;
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::{Io, Kernel, raise};
use crate::kernel::vector::{Vector, add, apply, dot, fma, norm, scale};
use std::ops::Range;
use std::sync::atomic::Ordering;

/// Integers of a slave: node, own body (or [`EMPTY`] for a thread).
pub const SLAVE: usize = 2;
/// Numbers of a slave: penalty, N/mm; radius, mm.
pub const SLAVE_VALUES: usize = 2;
/// Integers of a slot: key, ring position, slice.
pub const SLOT_KEYS: usize = 3;
/// Sums of a slave or a beam: elastic energy now, mJ; over steps, energy lost to contact damping, and work of the growing
/// radius, mJ.
pub const SUM_ENERGY: usize = 0;
pub const SUM_DAMPING: usize = 1;
pub const SUM_RADIUS: usize = 2;
/// With friction: energy lost to it, mJ, and slip, mm.
pub const SUM_FRICTION: usize = 3;
pub const SUM_SLIP: usize = 4;

/// Where force ⊗ ΔX, N·mm (9), starts in the sums of a periodic scene.
pub const fn virial(friction: bool) -> usize {
    if friction { SUM_SLIP + 1 } else { SUM_RADIUS + 1 }
}
/// Number of the sums.
pub const fn sums(friction: bool, periodic: bool) -> usize {
    virial(friction) + if periodic { 9 } else { 0 }
}

pub const SLAVES: usize = 0;
pub const VALUES: usize = 1;
pub const BODIES: usize = 2;
pub const RING_LINES: usize = 3;
pub const REFERENCE: usize = 4;
pub const QUANTA: usize = 5;
pub const REMAINDER: usize = 6;
pub const VELOCITY: usize = 7;
pub const MASS: usize = 8;
const KEYS: usize = 9;
const STATE: usize = 10;
const SUM: usize = 11;
const FORCE: usize = 12;
const STIFFNESS: usize = 13;
const STATUS: usize = 14;

/// From the front, contact begins no deeper than two bodies approach in a step, with this margin, mm: what is first seen
/// deeper inside an open yarn came in through its end, and no side pushes it out. Nor does one push a thread that touched the
/// rim of the end before: its middle is inside as soon as it has passed the rim, and the energy of the touch is lost. A thread that
/// came in stays [`INSIDE`] until its middle is out again, and while any side would push it out, a touch of another one does not
/// count as contact. A side of an open yarn that is found late, deeper than half a thread and than the contact was a step ago, is not
/// one either: it has been passed where the surface is folded. Bodies may overlap at the start.
const ENTRY: f64 = 1e-3;
/// Bound on approach from which on the scene is looked at before it moves, mm/s.
pub const AT_REST: f64 = 1e20;
/// Force that stands for a touch without pressure, N.
const TOUCH: f64 = 1e-30;
/// And the one that stands for a thread inside an open yarn, N.
const INSIDE: f64 = 4e-30;
/// What is smaller is such a mark and no force, N.
pub const LEAST_FORCE: f64 = 1e-29;

/// Contact forces of the nodes of threads (`THREAD`) or of yarn surfaces on yarns.
pub struct Penalty<const THREAD: bool, const FRICTION: bool, const PERIODIC: bool>;

/// The first of the faces that push a slave: friction acts there, and is added to nodes together with the normal force.
#[derive(Clone, Copy)]
struct First<R> {
    motion: Vector<R>,
    apart: Vector<R>,
    nodes: [usize; 4],
    weights: [R; 4],
    split: Split,
}

/// What presses two bodies apart.
pub struct Press<R> {
    /// Penalty times depth, N.
    pub elastic_force: R,
    /// With damping, never pulling, N.
    pub pressing: R,
    /// Row sum of stiffness and damping for the time step, N/mm.
    pub row_sum: R,
}

/// Penalty force of a pair at `depth` (mm) with `approach` (mm/s, negative when closing) and the inverse of its joint mass
/// `inverse` (1/tonne).
#[inline(always)]
pub fn press<R: Real>(params: &Params, row: &Row<R>, penalty: R, depth: R, inverse: R, approach: R) -> Press<R> {
    let two = R::from_f64(2.0);
    let viscosity = R::from_f64(f64::from(params.damping)) * two * (penalty / inverse).sqrt();
    let elastic_force = penalty * depth;
    Press {
        elastic_force,
        pressing: (elastic_force - viscosity * approach).max(R::from_f64(0.0)),
        row_sum: two * (penalty + viscosity * (two / row.dt)),
    }
}

/// Subtracts force ⊗ ΔX from the nine sums that make the homogenised stress.
#[inline(always)]
pub fn add_virial<R: Real>(sum: &mut [R], force: Vector<R>, apart: Vector<R>) {
    for i in 0..3 {
        for j in 0..3 {
            let v = &mut sum[3 * i + j];
            *v = *v - force[i] * apart[j];
        }
    }
}

impl<const THREAD: bool, const FRICTION: bool, const PERIODIC: bool> Kernel for Penalty<THREAD, FRICTION, PERIODIC> {
    const SHADER: Shader = Shader {
        defines: &[when(THREAD, "THREAD"), when(FRICTION, "FRICTION"), when(PERIODIC, "PERIODIC")],
        ..Shader::new("contact/penalty", "penalty")
    };
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let (state_size, virial) = const { (slot_state(FRICTION), virial(FRICTION)) };
        let params: Params = io.params();
        let slots = params.slots as usize;
        let real = |x: f32| L::Scalar::from_f64(f64::from(x));
        let constant = L::Scalar::from_f64;
        let zero = constant(0.0);
        let surface = Surface::<_, PERIODIC> {
            bodies: bytemuck::cast_slice(io.uints(BODIES)),
            ring_lines: io.uints(RING_LINES),
            reference: Lattice::new(io, REFERENCE),
            displacement: Displacements::new(io, QUANTA, REMAINDER),
            gradient: &io.row.gradient,
            period: params.period,
        };
        debug_assert!(io.uints(BODIES).len() % BODY == 0);
        let velocity = Field::new(io, VELOCITY);
        let (slaves, values, mass) = (io.uints(SLAVES), io.scalars(VALUES), io.scalars(MASS));
        let mut keys = io.own::<u32>(KEYS);
        let mut states = io.own::<L::Scalar>(STATE);
        let mut sums = io.own::<L::Scalar>(SUM);
        let (forces, stiffness, flags) = (io.atomics(FORCE), io.atomics(STIFFNESS), io.atomic_uints(STATUS));
        let elapsed = io.row.dt_mid + io.row.dt_mid - io.row.dt;
        let mut near = Near::none();
        for item in items {
            let slot_keys = keys.item(0, item);
            if slot_keys[0] == EMPTY {
                continue;
            }
            let slave = slaves[SLAVE * item] as usize;
            let (penalty, full_radius) = (values[SLAVE_VALUES * item], values[SLAVE_VALUES * item + 1]);
            let radius = full_radius * io.row.radius;
            let closing = io.row.approach * elapsed + full_radius * io.row.radius_increment;
            let slot_states = states.item(0, item);
            let sum = sums.item(0, item);
            let mut energy = zero;
            let mut touches = false;
            // what acts on the slave is added to it once
            let (mut own_force, mut own_row_sum) = ([0i32; 3], 0i32);
            for slot in 0..slots {
                let at = &mut slot_keys[SLOT_KEYS * slot..][..SLOT_KEYS];
                if at[0] == EMPTY {
                    break;
                }
                let (body, image) = of_key(at[0]);
                let state = &mut slot_states[state_size * slot..][..state_size];
                if state[0] < zero {
                    state[0] = state[0] + closing;
                    if state[0] < zero {
                        continue;
                    }
                    if !THREAD {
                        // until now it was in front
                        state[0] = zero;
                    }
                }
                let from = Place { ring: at[1] as i32, slice: at[2] as i32 };
                let open = !surface.is_closed(body);
                let mut found = surface.walk(slave, body, image, from);
                if THREAD && open && surface.is_rim(body, found.0, &found.2) {
                    found = surface.around(slave, body, image, found);
                }
                if THREAD && found.2.distance >= radius && !found.2.is_behind() {
                    found = surface.beside(slave, body, image, found);
                }
                let (place, corners, point) = found;
                (at[1], at[2]) = (place.ring as u32, place.slice as u32);
                let moves = io.row.approach < constant(AT_REST);
                let mut inside = false;
                if THREAD && open && moves {
                    let was = state[0] == constant(INSIDE);
                    let comes = point.interior && (state[0] <= zero || surface.is_end(body, place));
                    let stays = was && !surface.is_rim(body, place, &point);
                    inside = point.height() < zero && (comes || stays);
                    if was && !inside {
                        state[0] = zero;
                    }
                }
                let enters = open && moves && state[0] <= zero;
                let before = state[0].max(zero) / penalty;
                let single;
                // what is behind the border of a cut end is before the end, and not in the yarn
                let before_end = !THREAD && point.height() < zero && surface.is_rim(body, place, &point);
                let faces = if inside || before_end {
                    &[][..]
                } else if THREAD && point.distance < radius {
                    near.faces[0] = (corners, point);
                    surface.faces_within(slave, body, image, place, radius, &mut near);
                    &near.faces[..near.count]
                } else {
                    single = [(corners, point)];
                    &single[..]
                };
                // the normal forces of all faces, and where the closest one is
                let mut push = [zero; 3];
                let mut normal_force = zero;
                let mut first: Option<First<_>> = None;
                let mut came_in = false;
                for (corners, point) in faces {
                    let Some((normal, distance)) = point.normal_and_distance(THREAD) else { continue };
                    let depth = radius - distance;
                    if depth <= zero || -distance >= real(params.depth) {
                        continue;
                    }
                    let weights = point.weights();
                    let mut motion = velocity.at(slave);
                    let mut apart = [zero; 3];
                    let mut inverse = constant(1.0) / mass[slave];
                    for a in 0..4 {
                        motion = fma(velocity.at(corners.nodes[a]), -weights[a], motion);
                        apart = fma(corners.reference[a], -weights[a], apart);
                        inverse = inverse + weights[a] * weights[a] / mass[corners.nodes[a]];
                    }
                    if PERIODIC {
                        motion = add(motion, apply(&io.row.rate, apart));
                    }
                    let approach = dot(motion, normal);
                    let entry = constant(ENTRY) - constant(2.0) * approach.min(zero) * elapsed;
                    let late = THREAD && open && moves && depth > constant(0.5) * radius;
                    if (enters || late) && depth > before + entry {
                        came_in |= enters;
                        continue;
                    }
                    let Press { elastic_force, pressing, row_sum } =
                        press(&params, io.row, penalty, depth, inverse, approach);
                    sum[SUM_DAMPING] = sum[SUM_DAMPING] + (elastic_force - pressing) * approach * elapsed;
                    sum[SUM_RADIUS] = sum[SUM_RADIUS] + elastic_force * full_radius * io.row.radius_increment;
                    energy = energy + constant(0.5) * elastic_force * depth;
                    let force = scale(normal, pressing);
                    push = add(push, force);
                    normal_force = normal_force + pressing;
                    if PERIODIC {
                        add_virial(&mut sum[virial..], force, apart);
                    }
                    let split = Split::new(flags, force, real(params.force_quantum), slave, weights);
                    if first.is_none() {
                        first = Some(First { motion, apart, nodes: corners.nodes, weights, split });
                    } else {
                        add_quanta(&mut own_force, split.slave);
                        split.add_to_corners(forces, corners.nodes);
                    }
                    let stiffness_quantum = real(params.stiffness_quantum);
                    add_stiffness(stiffness, row_sum, stiffness_quantum, corners.nodes.into_iter().zip(weights));
                    own_row_sum = own_row_sum.wrapping_add((row_sum / stiffness_quantum).to_i32());
                    raise(&flags[status::PENETRATION[usize::from(!THREAD)]], depth);
                }
                let size = norm(push);
                let tangential = penalty * real(params.tangential);
                let Some(First { motion, apart, nodes, weights, mut split }) = first.filter(|_| size > zero) else {
                    if let Some(first) = &first {
                        add_quanta(&mut own_force, first.split.slave);
                        first.split.add_to_corners(forces, first.nodes);
                    }
                    if FRICTION {
                        let elastic = [state[1], state[2], state[3]];
                        sum[SUM_FRICTION] = sum[SUM_FRICTION] + constant(0.5) * tangential * dot(elastic, elastic);
                        state[1..].fill(zero);
                    }
                    if inside {
                        sum[SUM_DAMPING] = sum[SUM_DAMPING] + constant(0.5) * penalty * before * before;
                        state[0] = constant(INSIDE);
                        continue;
                    }
                    // a point behind a face keeps being looked at
                    let gap = if THREAD || point.height() > zero { point.distance - radius } else { zero };
                    state[0] = if open && first.is_some() && !came_in { constant(TOUCH) } else { -gap.max(zero) };
                    continue;
                };
                touches = true;
                state[0] = if came_in { zero } else { normal_force };
                if FRICTION {
                    let elastic = [state[1], state[2], state[3]];
                    let limit = real(params.friction) * normal_force;
                    let normal = scale(push, constant(1.0) / size);
                    let slid = slide(elastic, scale(motion, elapsed), normal, tangential, limit);
                    sum[SUM_FRICTION] = sum[SUM_FRICTION] + slid.dissipated;
                    sum[SUM_SLIP] = sum[SUM_SLIP] + slid.slip;
                    state[1..].copy_from_slice(&slid.elastic);
                    energy = energy + constant(0.5) * tangential * dot(slid.elastic, slid.elastic);
                    let force = scale(slid.elastic, -tangential);
                    if PERIODIC {
                        add_virial(&mut sum[virial..], force, apart);
                    }
                    split.add(&Split::new(flags, force, real(params.force_quantum), slave, weights));
                }
                add_quanta(&mut own_force, split.slave);
                split.add_to_corners(forces, nodes);
            }
            if own_row_sum != 0 || own_force != [0; 3] {
                add_force(forces, slave, own_force);
                stiffness[slave].fetch_add(own_row_sum, Ordering::Relaxed);
            }
            sum[SUM_ENERGY] = energy;
            if touches {
                flags[status::TOUCHING[usize::from(!THREAD)]].fetch_add(1, Ordering::Relaxed);
            }
        }
    }
}
