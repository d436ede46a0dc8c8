//! Accelerations: each node gathers its corner slots in a fixed order, adds contact forces and weight, and divides by its mass.
//!
//! Gravity acts on the true mass only, not on mass added by the mass floor, a minimum time step or contact: a body at rest
//! presses with its true weight.
//!
//! With contact-aware mass scaling, a node in contact has at least the mass of a stable step, m ≥ dt²/4 · K, with K the row sum
//! of the stiffness of contact and elements at the node; added mass decays once contact is lost. A minimum time step does the
//! same for elements alone, so that a few slivers at cut edges do not limit a scene. Without contact-aware mass scaling, the
//! largest K/m of contact is reported for the choice of the time step.

use crate::contact::status::{self, CONTACT_RATE};
use crate::elements::{self, LANES};
use crate::kernel::buffer::Kind::{Int, Scalar, Uint};
use crate::kernel::interface::{Constant, Slot, constants, slot};
use crate::kernel::lane::{Lane, Real};
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::{Io, Kernel, raise};
use bytemuck::{Pod, Zeroable};
use std::ops::Range;

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
        constants: &[&elements::CONSTANTS, &status::CONSTANTS, &CONSTANTS],
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
        Slot::atomic("status", Uint).when(CONTACT && !MASS_ADDED),
    ];

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let params: Params = io.params();
        let first_thread = params.first_thread as usize;
        let (solid, hexes) = (io.uints(slot!(Self::SLOTS, "solid_slots")), io.scalars(slot!(Self::SLOTS, "hex_force")));
        let (thread, beams) =
            (io.uints(slot!(Self::SLOTS, "thread_slots")), io.scalars(slot!(Self::SLOTS, "beam_force")));
        let bends = BENDING.then(|| {
            let slots = io.uints(slot!(Self::SLOTS, "bend_slots", BENDING));
            (slots, io.scalars(slot!(Self::SLOTS, "bend_force", BENDING)))
        });
        let masses = io.scalars(slot!(Self::SLOTS, "mass"));
        let true_masses = if GRAVITY { io.scalars(slot!(Self::SLOTS, "true_mass", GRAVITY)) } else { &[] };
        let mut acceleration = io.own::<L::Scalar>(slot!(Self::SLOTS, "acceleration"));
        let mut inverse = io.own::<L::Scalar>(slot!(Self::SLOTS, "inverse_mass"));
        let mut contact_force = CONTACT.then(|| io.own::<i32>(slot!(Self::SLOTS, "contact_force", CONTACT)));
        let mut contact_stiffness = CONTACT.then(|| io.own::<i32>(slot!(Self::SLOTS, "contact_stiffness", CONTACT)));
        let elements = if MASS_ADDED { io.scalars(slot!(Self::SLOTS, "element_stiffness", MASS_ADDED)) } else { &[] };
        let mut added =
            MASS_ADDED.then(|| io.own::<L::Scalar>(slot!(Self::SLOTS, "added_mass", CONTACT && MASS_ADDED)));
        let zero = L::Scalar::from_f64(0.0);
        let real = |x: f32| L::Scalar::from_f64(f64::from(x));
        let reach = real(params.mass_factor * 0.25) * io.row.dt * io.row.dt;
        let least = real(params.mass_per_stiffness);
        for node in items {
            let mut force = [zero; 3];
            if node < first_thread {
                for &slot in &solid[SOLID * node..][..SOLID] {
                    if slot == NONE {
                        break;
                    }
                    let slot = &hexes[slot as usize..][..2 * LANES + 1];
                    force = [force[0] + slot[0], force[1] + slot[LANES], force[2] + slot[2 * LANES]];
                }
            } else {
                let slots = &thread[THREAD * (node - first_thread)..][..THREAD];
                // the node is the first of one beam and the second of another
                for (slot, sign) in slots.iter().zip([1.0, -1.0]) {
                    if *slot != NONE {
                        add(&mut force, &beams[3 * *slot as usize..][..3], sign);
                    }
                }
                if let Some((bent, bends)) = bends {
                    let slots = &bent[BENT * (node - first_thread)..][..BENT];
                    for (slot, signs) in slots.iter().zip([[1.0, 0.0], [-1.0, 1.0], [0.0, -1.0]]) {
                        if *slot != NONE {
                            for (k, sign) in signs.into_iter().enumerate().filter(|(_, s)| *s != 0.0) {
                                add(&mut force, &bends[6 * *slot as usize + 3 * k..][..3], sign);
                            }
                        }
                    }
                }
            }
            if let Some(contact) = &mut contact_force {
                for (k, force) in force.iter_mut().enumerate() {
                    let quanta = contact.at(k, node);
                    if *quanta != 0 {
                        *force = *force + L::Scalar::from_i32(*quanta) * real(params.force_quantum);
                        *quanta = 0;
                    }
                }
            }
            if GRAVITY {
                for (force, gravity) in force.iter_mut().zip(params.gravity) {
                    *force = *force + true_masses[node] * real(gravity);
                }
            }
            let mut mass = masses[node];
            if let Some(stiffness) = &mut contact_stiffness {
                let quanta = stiffness.at(0, node);
                let contact = L::Scalar::from_i32(*quanta) * real(params.stiffness_quantum);
                *quanta = 0;
                if let Some(added) = &mut added {
                    let touching = if contact > zero { (contact + elements[node]) * reach } else { zero };
                    let needed = touching.max(elements[node] * least) - mass;
                    let added = added.at(0, node);
                    *added = needed.max(*added * real(params.mass_memory));
                    mass = mass + *added;
                } else if contact > zero {
                    let status = io.atomic_uints(slot!(Self::SLOTS, "status", CONTACT && !MASS_ADDED));
                    raise(&status[CONTACT_RATE], contact / mass);
                }
            }
            let inverse_mass = L::Scalar::from_f64(1.0) / mass;
            *inverse.at(0, node) = inverse_mass;
            for (k, force) in force.into_iter().enumerate() {
                *acceleration.at(k, node) = force * inverse_mass;
            }
        }
    }
}

#[inline(always)]
fn add<R: Real>(to: &mut [R; 3], force: &[R], sign: f64) {
    for (to, force) in to.iter_mut().zip(force) {
        *to = *to + *force * R::from_f64(sign);
    }
}
