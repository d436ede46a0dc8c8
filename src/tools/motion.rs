//! Motion of tools by central differences, after the nodes have moved.
//!
//! Along an axis a tool either follows the amplitude of the schedule, or it is free: then it has its mass, with the mass added that its
//! contacts call for in a stable step, and moves by the forces of contact, the force on it times the amplitude, and gravity.

use super::shape::{MOTION, MOVED, SEAT};
use super::touch::{NOTES, STIFFNESS};
use crate::dynamics::integrate::factors;
use crate::kernel::buffer::Kind::{Int, Scalar};
use crate::kernel::interface::{Constant, Slot, constants, slot};
use crate::kernel::io::Io;
use crate::kernel::lane::{Lane, Real};
use crate::kernel::position::{self, carry};
use crate::kernel::shader::Shader;
use crate::kernel::stage::Kernel;
use bytemuck::{Pod, Zeroable};
use std::ops::Range;

/// Numbers per tool: displacement at full amplitude (3), mm; force at full amplitude (3), N; one along free axes, else zero (3); mass,
/// tonne.
pub const LOAD: usize = 10;
pub const FORCE: usize = 3;
pub const FREE: usize = 6;
pub const MASS: usize = 9;
/// Work on tools, mJ: by the schedule and by forces on them, of gravity, of added inertia, and lost to damping; and their kinetic
/// energy.
pub const WORKS: usize = 5;
pub const LOADED: usize = 0;
pub const GRAVITY: usize = 1;
pub const INERTIA: usize = 2;
pub const DAMPED: usize = 3;
pub const KINETIC: usize = 4;
/// Constants shared with the twin.
const CONSTANTS: [Constant; 10] =
    constants![uint: LOAD, FORCE, FREE, MASS, WORKS, LOADED, GRAVITY, INERTIA, DAMPED, KINETIC];

/// Constants of the stage.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Params {
    /// Gravity, mm/s².
    pub gravity: [f32; 3],
    /// Factor on the mass required by contact.
    pub mass_factor: f32,
}

/// The motion of tools.
pub struct Motion;

impl Kernel for Motion {
    const SHADER: Shader = Shader {
        constants: &[&position::CONSTANTS, &constants![uint: SEAT, MOVED, MOTION, NOTES, STIFFNESS], &CONSTANTS],
        ..Shader::new("tools/motion", "march")
    };
    const SLOTS: &'static [Slot] = &[
        Slot::read("loads", Scalar),
        // sums of the notes of points on all tools, part by part
        Slot::read("parts", Scalar),
        Slot::row("seats", Int, SEAT),
        Slot::row("motions", Scalar, MOTION),
        // the sums of the notes of all points
        Slot::row("results", Scalar, NOTES),
        Slot::row("works", Scalar, WORKS),
    ];
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let real = |x: f32| L::Scalar::from_f64(f64::from(x));
        let (zero, half) = (L::Scalar::from_f64(0.0), L::Scalar::from_f64(0.5));
        let params: Params = io.params();
        let (loads, parts) = (io.scalars(slot!(Self::SLOTS, "loads")), io.scalars(slot!(Self::SLOTS, "parts")));
        let mut seats = io.own::<i32>(slot!(Self::SLOTS, "seats"));
        let mut motions = io.own::<L::Scalar>(slot!(Self::SLOTS, "motions"));
        let mut results = io.own::<L::Scalar>(slot!(Self::SLOTS, "results"));
        let mut works = io.own::<L::Scalar>(slot!(Self::SLOTS, "works"));
        let row = io.row;
        let (keep, gain) = factors::<_, true>(row.damping_solid, row.dt_mid);
        let count = loads.len() / LOAD;
        for tool in items {
            let load = &loads[LOAD * tool..][..LOAD];
            let results = results.item(0, tool);
            results.fill(zero);
            for part in 0..parts.len() / (NOTES * count) {
                for i in 0..NOTES {
                    results[i] = results[i] + parts[NOTES * (count * part + tool) + i];
                }
            }
            let (seat, motion) = (seats.item(0, tool), motions.item(0, tool));
            let works = works.item(0, tool);
            let mass = load[MASS];
            let needed = results[STIFFNESS] * real(params.mass_factor * 0.25) * row.dt * row.dt;
            let acting = mass.max(needed);
            let mut squares = zero;
            for k in 0..3 {
                let old = motion[3 + k];
                let gravity = real(params.gravity[k]);
                let pushed = load[FORCE + k] * row.amplitude;
                let is_free = load[FREE + k] > zero;
                let a = (results[k] + pushed + mass * gravity) / acting;
                let new = if is_free { old * keep + a * gain } else { load[k] * row.motion };
                let way = half * (old + new) * row.dt_mid;
                if is_free {
                    let mean = half * (old + new);
                    works[LOADED] = works[LOADED] + pushed * way;
                    works[GRAVITY] = works[GRAVITY] + mass * gravity * way;
                    works[INERTIA] = works[INERTIA] - (acting - mass) * a * way;
                    works[DAMPED] = works[DAMPED] + mass * row.damping_solid * mean * way;
                    squares = squares + half * (old * old + new * new);
                } else {
                    works[LOADED] = works[LOADED] - results[k] * way;
                }
                motion[3 + k] = new;
                (seat[MOVED + k], motion[k]) = carry(seat[MOVED + k], motion[k] + new * row.dt);
            }
            works[KINETIC] = half * mass * squares;
        }
    }
}
