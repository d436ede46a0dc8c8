//! Accelerations: each node gathers its corner slots in a fixed order, adds contact forces and weight, and divides by its mass.
//!
//! Gravity acts on the true mass only, not on mass added by the mass floor, a minimum time step or contact: a body at rest
//! presses with its true weight.
//!
//! With contact-aware mass scaling, a node in contact has at least the mass of a stable step, m ≥ dt²/4 · K, with K the row sum
//! of the stiffness of contact and elements at the node; added mass decays once contact is lost. A minimum time step does the
//! same for elements alone, so that a few slivers at cut edges do not limit a scene. Without contact-aware mass scaling, the
//! largest K/m of contact is reported for the choice of the time step.

use super::BLOCK;
use crate::contact::status::{self, CONTACT_RATE};
use crate::elements::{self, LANES};
use crate::kernel::buffer::Kind::{Int, Scalar, Uint};
use crate::kernel::interface::{Constant, Slot, constants, slot};
use crate::kernel::io::{Io, raise};
use crate::kernel::lane::{Lane, Real};
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::Kernel;
use bytemuck::{Pod, Zeroable};
use std::ops::Range;
use std::sync::atomic::Ordering;

/// Corner slots gathered by a solid node.
pub const SOLID: usize = 8;
/// Slots gathered by a thread node: two beams.
pub const THREAD: usize = 2;
/// Additional slots with bending: three bends, as first, middle and last node.
pub const BENT: usize = 3;
/// An empty slot.
pub const NONE: u32 = u32::MAX;
/// Constants of nodal slots shared with the twins.
pub const CONSTANTS: [Constant; 4] = constants![uint: SOLID, THREAD, BENT, NONE];

/// Largest sum of contact forces at a node, quanta. Every pair stays below an eighth of it, so that at least 24 pairs must push
/// beyond it at once for a sum to wrap unseen.
const MOST_SUM: u32 = 1 << 30;

/// Constants of the stage.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Params {
    /// First node of a thread.
    pub first_thread: u32,
    /// Quantum of contact force, N.
    pub force_quantum: f32,
    /// Quantum of contact stiffness, N/mm.
    pub stiffness_quantum: f32,
    /// Factor on the mass required by contact.
    pub mass_factor: f32,
    /// Share of added mass kept per step.
    pub mass_memory: f32,
    /// Minimum nodal mass per element stiffness, s²: a quarter of the square of the minimum time step.
    pub mass_per_stiffness: f32,
    /// Gravity, mm/s².
    pub gravity: [f32; 3],
}

/// Assembly; with `CONTACT` contact forces, with `MASS_ADDED` contact-aware mass scaling, with `BENDING` bends of threads, with
/// `GRAVITY` weight.
pub struct Assemble<const CONTACT: bool, const MASS_ADDED: bool, const BENDING: bool, const GRAVITY: bool>;

impl<const CONTACT: bool, const MASS_ADDED: bool, const BENDING: bool, const GRAVITY: bool> Kernel
    for Assemble<CONTACT, MASS_ADDED, BENDING, GRAVITY>
{
    const SHADER: Shader = Shader {
        defines: &[
            when(CONTACT, "CONTACT"),
            when(MASS_ADDED, "MASS_ADDED"),
            when(BENDING, "BENDING"),
            when(GRAVITY, "GRAVITY"),
        ],
        constants: &[&elements::CONSTANTS, &status::CONSTANTS, &CONSTANTS, &constants![uint: MOST_SUM]],
        ..Shader::new("dynamics/assemble", "assemble")
    };
    const SLOTS: &'static [Slot] = &[
        Slot::read("solid_slots", Uint),
        Slot::read("hex_force", Scalar),
        Slot::read("thread_slots", Uint),
        Slot::read("beam_force", Scalar),
        Slot::read("mass", Scalar),
        Slot::read("bend_slots", Uint).when(BENDING),
        Slot::read("bend_force", Scalar).when(BENDING),
        // row sums of element stiffness, N/mm
        Slot::read("element_stiffness", Scalar).when(MASS_ADDED),
        // true mass, tonne
        Slot::read("true_mass", Scalar).when(GRAVITY),
        // mm/s²
        Slot::planes("acceleration", Scalar, 3),
        // inverse of the effective mass, 1/tonne
        Slot::row("inverse_mass", Scalar, 1),
        // in quanta, reset to zero
        Slot::planes("contact_force", Int, 3).when(CONTACT),
        Slot::row("contact_stiffness", Int, 1).when(CONTACT),
        // tonne
        Slot::row("added_mass", Scalar, 1).when(CONTACT && MASS_ADDED),
        Slot::atomic("status", Uint).when(CONTACT),
    ];

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let params: Params = io.params();
        let first_thread = params.first_thread as usize;
        let hexes = (io.uints(slot!(Self::SLOTS, "solid_slots")), io.scalars(slot!(Self::SLOTS, "hex_force")));
        let beams = (io.uints(slot!(Self::SLOTS, "thread_slots")), io.scalars(slot!(Self::SLOTS, "beam_force")));
        let bends = BENDING.then(|| {
            let slots = io.uints(slot!(Self::SLOTS, "bend_slots", BENDING));
            (slots, io.scalars(slot!(Self::SLOTS, "bend_force", BENDING)))
        });
        let masses = io.scalars(slot!(Self::SLOTS, "mass"));
        let true_masses = if GRAVITY { io.scalars(slot!(Self::SLOTS, "true_mass", GRAVITY)) } else { &[] };
        let mut acceleration = io.own::<L::Scalar>(slot!(Self::SLOTS, "acceleration"));
        let mut inverse = io.own::<L::Scalar>(slot!(Self::SLOTS, "inverse_mass"));
        let zero = L::Scalar::from_f64(0.0);
        for first in items.clone().step_by(BLOCK) {
            let count = BLOCK.min(items.end - first);
            let mut force = [[zero; BLOCK]; 3];
            for i in 0..count {
                let node = first + i;
                let gathered =
                    if node < first_thread { solid(hexes, node) } else { thread(beams, bends, node - first_thread) };
                for k in 0..3 {
                    force[k][i] = gathered[k];
                }
            }
            if CONTACT {
                Self::add_contact(io, &params, (first, count), &mut force);
            }
            if GRAVITY {
                let true_masses = &true_masses[first..][..count];
                for k in 0..3 {
                    let gravity = L::Scalar::from_f64(f64::from(params.gravity[k]));
                    for i in 0..count {
                        force[k][i] = force[k][i] + true_masses[i] * gravity;
                    }
                }
            }
            let mut mass = [zero; BLOCK];
            mass[..count].copy_from_slice(&masses[first..][..count]);
            if CONTACT {
                Self::weigh_contact(io, &params, (first, count), &mut mass);
            }
            let mut inverse_mass = [zero; BLOCK];
            for i in 0..count {
                inverse_mass[i] = L::Scalar::from_f64(1.0) / mass[i];
            }
            inverse.slice(0, first, count).copy_from_slice(&inverse_mass[..count]);
            for k in 0..3 {
                let acceleration = acceleration.slice(k, first, count);
                for i in 0..count {
                    acceleration[i] = force[k][i] * inverse_mass[i];
                }
            }
        }
    }
}

impl<const CONTACT: bool, const MASS_ADDED: bool, const BENDING: bool, const GRAVITY: bool>
    Assemble<CONTACT, MASS_ADDED, BENDING, GRAVITY>
{
    /// Adds the contact forces of nodes, and resets them.
    #[inline(always)]
    fn add_contact<R: Real>(io: &Io<R>, params: &Params, (first, count): (usize, usize), force: &mut [[R; BLOCK]; 3]) {
        let mut contact = io.own::<i32>(slot!(Self::SLOTS, "contact_force", CONTACT));
        let quantum = R::from_f64(f64::from(params.force_quantum));
        for k in 0..3 {
            let (quanta, force) = (contact.slice(k, first, count), &mut force[k]);
            if is_zero(quanta) {
                continue;
            }
            Self::check_range(io, first, quanta);
            for i in 0..count {
                let sum = force[i] + R::from_i32(quanta[i]) * quantum;
                force[i] = if quanta[i] == 0 { force[i] } else { sum };
            }
            quanta.fill(0);
        }
    }

    /// Records a node whose sum is out of range, among nodes from `first` on.
    #[inline(always)]
    fn check_range<R: Real>(io: &Io<R>, first: usize, sums: &[i32]) {
        let mut largest = 0;
        for sum in sums {
            largest = largest.max(sum.unsigned_abs());
        }
        if largest > MOST_SUM {
            let status = io.atomic_uints(slot!(Self::SLOTS, "status", CONTACT));
            status[status::FLAGS].fetch_or(status::FORCE_RANGE, Ordering::Relaxed);
            for (i, sum) in sums.iter().enumerate() {
                if sum.unsigned_abs() == largest {
                    status[status::CULPRIT].store((first + i) as u32, Ordering::Relaxed);
                }
            }
        }
    }

    /// Resets the contact stiffness of nodes, and adds the mass that it calls for or reports its rate.
    #[inline(always)]
    fn weigh_contact<R: Real>(io: &Io<R>, params: &Params, (first, count): (usize, usize), mass: &mut [R; BLOCK]) {
        let real = |x: f32| R::from_f64(f64::from(x));
        let zero = R::from_f64(0.0);
        let mut stiffness = io.own::<i32>(slot!(Self::SLOTS, "contact_stiffness", CONTACT));
        let quanta = stiffness.slice(0, first, count);
        let mut contact = [zero; BLOCK];
        let touches = !is_zero(quanta);
        if touches {
            let quantum = real(params.stiffness_quantum);
            for i in 0..count {
                contact[i] = R::from_i32(quanta[i]) * quantum;
            }
            quanta.fill(0);
        }
        if MASS_ADDED {
            let reach = real(params.mass_factor * 0.25) * io.row.dt * io.row.dt;
            let (least, memory) = (real(params.mass_per_stiffness), real(params.mass_memory));
            let elements = &io.scalars(slot!(Self::SLOTS, "element_stiffness", MASS_ADDED))[first..][..count];
            let mut added = io.own::<R>(slot!(Self::SLOTS, "added_mass", CONTACT && MASS_ADDED));
            let added = added.slice(0, first, count);
            for i in 0..count {
                let touching = if contact[i] > zero { (contact[i] + elements[i]) * reach } else { zero };
                let needed = touching.max(elements[i] * least) - mass[i];
                added[i] = needed.max(added[i] * memory);
                mass[i] = mass[i] + added[i];
            }
        } else if touches {
            let status = io.atomic_uints(slot!(Self::SLOTS, "status", CONTACT));
            for i in 0..count {
                if contact[i] > zero {
                    raise(&status[CONTACT_RATE], contact[i] / mass[i]);
                }
            }
        }
    }
}

/// Whether all numbers are zero.
#[inline(always)]
fn is_zero(numbers: &[i32]) -> bool {
    let mut bits = 0;
    for number in numbers {
        bits |= *number;
    }
    bits == 0
}

/// Force of hexahedra on a node of a solid: its slots, and forces in blocks of lanes.
#[inline(always)]
fn solid<R: Real>((slots, hexes): (&[u32], &[R]), node: usize) -> [R; 3] {
    let mut force = [R::from_f64(0.0); 3];
    for &slot in &slots[SOLID * node..][..SOLID] {
        if slot == NONE {
            break;
        }
        let slot = &hexes[slot as usize..][..2 * LANES + 1];
        force = [force[0] + slot[0], force[1] + slot[LANES], force[2] + slot[2 * LANES]];
    }
    force
}

/// Force of beams and bends on a node of a thread.
#[inline(always)]
fn thread<R: Real>((slots, beams): (&[u32], &[R]), bends: Option<(&[u32], &[R])>, node: usize) -> [R; 3] {
    let mut force = [R::from_f64(0.0); 3];
    // the node is the first of one beam and the second of another
    for (at, sign) in [(0, 1.0), (1, -1.0)].iter() {
        let slot = slots[THREAD * node + at];
        if slot != NONE {
            add(&mut force, &beams[3 * slot as usize..][..3], *sign);
        }
    }
    if let Some((slots, bends)) = bends {
        // of three bends: the first node, the middle node with both forces, and the last node
        for (at, end, sign) in [(0, 0, 1.0), (1, 0, -1.0), (1, 1, 1.0), (2, 1, -1.0)].iter() {
            let slot = slots[BENT * node + at];
            if slot != NONE {
                add(&mut force, &bends[6 * slot as usize + 3 * end..][..3], *sign);
            }
        }
    }
    force
}

#[inline(always)]
fn add<R: Real>(to: &mut [R; 3], force: &[R], sign: f64) {
    for (to, force) in to.iter_mut().zip(force) {
        *to = *to + *force * R::from_f64(sign);
    }
}
