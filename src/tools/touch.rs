//! Penalty contact of points with tools, every step: points along the beams of a thread, and the nodes of yarn surfaces.
//!
//! A point at a depth δ has the energy ½ k δ², with k its penalty, so that a tool is pressed as a yarn would be. Damping and friction
//! are those of contact between bodies, see [`crate::contact::rub`], against a tool of infinite mass.

use super::shape::{self, MOTION, MOVED, RUBS, SEAT, Shapes, TOOL, steepness};
use crate::contact::friction::slide;
use crate::contact::joint::{Joint, quanta};
use crate::contact::memory::{DAMPED, ELASTIC, NORMAL, touch};
use crate::contact::rub::viscosity;
use crate::contact::sums::{self, SUM_DAMPING, SUM_ENERGY, SUM_FRICTION, SUM_RADIUS, SUM_SLIP};
use crate::contact::surface::{self, CARRIED, POINT, Surface, of_coded};
use crate::contact::{Params, is_in_range, status};
use crate::kernel::buffer::Kind::{Int, Scalar, Uint};
use crate::kernel::interface::{Constant, Slot, constants, slot};
use crate::kernel::io::{Io, raise};
use crate::kernel::lane::{Lane, Real};
use crate::kernel::node::{Displacements, Field, Lattice};
use crate::kernel::position::{self, QUANTUM, difference};
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::Kernel;
use crate::kernel::vector::{add, apply, cross, dot, fma, scale};
use std::ops::Range;
use std::sync::atomic::Ordering;

/// What a point does to a tool: its force, N (3), and its moment about the origin of the tool, N·mm (3); the row sum of its stiffness,
/// N/mm; and the penalty of a point of a yarn, N/mm.
pub const NOTES: usize = 8;
pub const MOMENT: usize = 3;
pub const STIFFNESS: usize = 6;
pub const TOUCHED: usize = 7;
/// Constants shared with the twins.
pub const CONSTANTS: [Constant; 4] = constants![uint: NOTES, MOMENT, STIFFNESS, TOUCHED];

/// Constants of the memory of a touch shared with the twin, for points of a `kind`.
const fn shared(kind: usize, friction: bool) -> [Constant; 5] {
    constants![uint: NORMAL, DAMPED, ELASTIC, TOUCH = touch(friction), KIND_OF_POINT = kind]
}

/// Forces between points of threads (`THREAD`) or of yarn surfaces and tools.
pub struct Touch<const THREAD: bool, const FRICTION: bool, const PERIODIC: bool>;

impl<const THREAD: bool, const FRICTION: bool, const PERIODIC: bool> Kernel for Touch<THREAD, FRICTION, PERIODIC> {
    const SHADER: Shader = Shader {
        defines: &[when(THREAD, "THREAD"), when(FRICTION, "FRICTION"), when(PERIODIC, "PERIODIC")],
        constants: &[
            &position::CONSTANTS,
            &status::CONSTANTS,
            &crate::contact::CONSTANTS,
            &surface::shared(THREAD),
            &sums::shared(FRICTION, PERIODIC),
            &shape::CONSTANTS,
            &CONSTANTS,
            &shared(kind(THREAD), FRICTION),
        ],
        ..Shader::new("tools/touch", "press")
    };
    const SLOTS: &'static [Slot] = &[
        Slot::read("nodes", Uint),
        Slot::read("points", Scalar),
        Slot::read("reference", Int),
        Slot::read("quanta", Int),
        Slot::read("remainder", Scalar),
        Slot::read("velocity", Scalar),
        Slot::read("mass", Scalar),
        // see [`TOOL`], [`SEAT`] and [`MOTION`]
        Slot::read("tools", Scalar),
        Slot::read("seats", Int),
        Slot::read("motions", Scalar),
        // for each tool, see [`touch`] and [`NOTES`]
        Slot::row_of_plan("touches", Scalar),
        Slot::row_of_plan("notes", Scalar),
        Slot::row_of_plan("sums", Scalar),
        Slot::atomic("forces", Int),
        Slot::atomic("stiffness", Int),
        Slot::atomic("status", Uint),
    ];
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        if THREAD {
            Self::press::<_, 4>(io, items);
        } else {
            Self::press::<_, 1>(io, items);
        }
    }
}

/// Index of the kind of points in the status, and among the friction coefficients of a tool.
const fn kind(threads: bool) -> usize {
    if threads { 0 } else { 1 }
}

impl<const THREAD: bool, const FRICTION: bool, const PERIODIC: bool> Touch<THREAD, FRICTION, PERIODIC> {
    /// Forces of all tools on points carried by `N` nodes.
    #[inline(always)]
    fn press<R: Real, const N: usize>(io: &Io<R>, items: Range<usize>) {
        let real = |x: f32| R::from_f64(f64::from(x));
        let (zero, half, one, two) = (R::from_f64(0.0), R::from_f64(0.5), R::from_f64(1.0), R::from_f64(2.0));
        let params: Params = io.params();
        let row = io.row;
        let elapsed = row.dt_mid + row.dt_mid - row.dt;
        let (nodes, points) = (io.uints(slot!(Self::SLOTS, "nodes")), io.scalars(slot!(Self::SLOTS, "points")));
        let reference = Lattice::new(io, slot!(Self::SLOTS, "reference"));
        let displacement = Displacements::new(io, slot!(Self::SLOTS, "quanta"), slot!(Self::SLOTS, "remainder"));
        let surface = Surface::<_, PERIODIC> {
            faces: &[],
            reference,
            displacement,
            gradient: &row.gradient,
            period: params.period,
        };
        let velocity = Field::new(io, slot!(Self::SLOTS, "velocity"));
        let mass = io.scalars(slot!(Self::SLOTS, "mass"));
        let (tools, seats) = (io.scalars(slot!(Self::SLOTS, "tools")), io.ints(slot!(Self::SLOTS, "seats")));
        let shapes = Shapes { tools, seats };
        let motions = io.scalars(slot!(Self::SLOTS, "motions"));
        let mut touches = io.own::<R>(slot!(Self::SLOTS, "touches"));
        let mut notes = io.own::<R>(slot!(Self::SLOTS, "notes"));
        let mut all_sums = io.own::<R>(slot!(Self::SLOTS, "sums"));
        let (forces, stiffness) =
            (io.atomics(slot!(Self::SLOTS, "forces")), io.atomics(slot!(Self::SLOTS, "stiffness")));
        let flags = io.atomic_uints(slot!(Self::SLOTS, "status"));
        let (count, size) = (seats.len() / SEAT, const { touch(FRICTION) });
        let per_force = R::from_f64(1.0 / f64::from(params.force_quantum));
        let per_stiffness = R::from_f64(1.0 / f64::from(params.stiffness_quantum));
        let (mut carriers, mut touching) = (Joint::new([0; N]), 0);
        for item in items {
            let (mut coded, mut weights) = ([0; N], [zero; N]);
            let (mut places, mut extent) = ([0; N], zero);
            let (mut own_motion, mut inverse) = ([zero; 3], zero);
            for a in 0..N {
                (coded[a], weights[a]) = (nodes[CARRIED * item + a], points[POINT * item + a]);
                places[a] = of_coded(coded[a]).0;
                extent = extent + weights[a].abs();
                own_motion = fma(velocity.at(places[a]), weights[a], own_motion);
                inverse = inverse + weights[a] * weights[a] / mass[places[a]];
            }
            let (penalty, full_radius) = (points[POINT * item + 4], points[POINT * item + 5]);
            let radius = full_radius * row.radius;
            let offset = surface.point(coded, weights);
            let (base, (own, rest)) = (reference.at(places[0]), displacement.at(places[0]));
            let sums = all_sums.item(0, item);
            sums[SUM_ENERGY] = zero;
            let (mut force, mut rows) = ([zero; 3], zero);
            let mut is_touching = false;
            for tool in 0..count {
                let note = &mut notes.item(0, item)[NOTES * tool..][..NOTES];
                note.fill(zero);
                let memory = &mut touches.item(0, item)[size * tool..][..size];
                // from the origin of the tool to the point, in the reference and current states
                let seat = &seats[SEAT * tool..][..SEAT];
                let (mut from, mut by) = ([zero; 3], [zero; 3]);
                for k in 0..3 {
                    from[k] = R::from_i32(base[k].wrapping_sub(seat[k])) * R::from_f64(QUANTUM);
                    by[k] = difference(own[k], rest[k], seat[MOVED + k], motions[MOTION * tool + k]);
                }
                let affine = if PERIODIC { add(from, apply(&row.gradient, from)) } else { from };
                let at = add(add(affine, by), offset.1);
                let Some(near) = shapes.near(tool, at) else {
                    memory.fill(zero);
                    continue;
                };
                let depth = radius - near.distance;
                if !(depth > zero) && memory[NORMAL] == zero && memory[DAMPED] == zero {
                    continue;
                }
                let (steep, normal) = steepness(near.slope);
                let pressing = penalty * depth.max(zero);
                let size = pressing * steep;
                let mut motion = own_motion;
                for k in 0..3 {
                    motion[k] = motion[k] - motions[MOTION * tool + 3 + k];
                }
                if PERIODIC {
                    motion = add(motion, apply(&row.rate, add(from, offset.0)));
                }
                let approach = dot(motion, normal);
                let viscosity = viscosity(&params, penalty, inverse);
                let firm = (size - viscosity * approach).max(zero);
                // over the motion since the previous positions, with the mean of the old and new forces
                let drag = size - firm;
                sums[SUM_DAMPING] = sums[SUM_DAMPING] + half * (memory[DAMPED] + drag) * approach * elapsed;
                (memory[NORMAL], memory[DAMPED]) = (firm, drag);
                let mut push = scale(normal, firm);
                let mut energy = half * pressing * depth.max(zero);
                if FRICTION {
                    let tangential = penalty * real(params.tangential);
                    let limit = tools[TOOL * tool + RUBS + kind(THREAD)] * firm;
                    let elastic = [memory[ELASTIC], memory[ELASTIC + 1], memory[ELASTIC + 2]];
                    let slid = slide(elastic, scale(motion, elapsed), normal, tangential, limit);
                    sums[SUM_FRICTION] = sums[SUM_FRICTION] + slid.dissipated;
                    sums[SUM_SLIP] = sums[SUM_SLIP] + slid.slip;
                    memory[ELASTIC..].copy_from_slice(&slid.elastic);
                    energy = energy + half * tangential * dot(slid.elastic, slid.elastic);
                    push = fma(slid.elastic, -tangential, push);
                }
                sums[SUM_RADIUS] = sums[SUM_RADIUS] + pressing * full_radius * row.radius_increment;
                if !(depth > zero) {
                    memory.fill(zero);
                    continue;
                }
                is_touching = true;
                raise(&flags[status::PENETRATION[kind(THREAD)]], depth);
                sums[SUM_ENERGY] = sums[SUM_ENERGY] + energy;
                let row_sum = (one + extent) * (penalty + viscosity * (two / row.dt));
                (force, rows) = (add(force, push), rows + row_sum);
                let back = scale(push, -one);
                note[..3].copy_from_slice(&back);
                note[MOMENT..STIFFNESS].copy_from_slice(&cross(at, back));
                (note[STIFFNESS], note[TOUCHED]) = (row_sum, if THREAD { zero } else { penalty });
            }
            if is_touching {
                touching += 1;
                let all = scale(force, per_force);
                let fits = |k: usize| is_in_range(flags, all[k], places[0]);
                let joint = carriers.of(places, forces, stiffness);
                joint.stiffen(rows * per_stiffness, &weights);
                if fits(0) && fits(1) && fits(2) {
                    joint.share(quanta(all), &weights);
                }
            }
        }
        carriers.finish(forces, stiffness);
        if touching > 0 {
            flags[status::TOUCHING[kind(THREAD)]].fetch_add(touching, Ordering::Relaxed);
        }
    }
}
