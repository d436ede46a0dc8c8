//! Prescribed motion: the velocity of chosen components follows the amplitude of the schedule exactly.

use crate::dynamics::integrate::factors;
use crate::kernel::buffer::Kind::{Scalar, Uint};
use crate::kernel::interface::{Slot, slot};
use crate::kernel::io::Io;
use crate::kernel::lane::{Lane, Real};
use crate::kernel::position;
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::Kernel;
use bytemuck::{Pod, Zeroable};
use std::ops::Range;

/// Constants of the stages.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Params {
    /// First node of a thread.
    pub first_thread: u32,
}

/// Replaces the accelerations of prescribed components before the fibre lines use them; `DAMPING` as for the integration; with
/// `ARCS` nodes move along arcs as well.
pub struct Prescribed<const DAMPING: bool, const ARCS: bool>;

impl<const DAMPING: bool, const ARCS: bool> Kernel for Prescribed<DAMPING, ARCS> {
    const SHADER: Shader = Shader {
        defines: &[when(DAMPING, "DAMPING"), when(ARCS, "ARCS")],
        constants: &[&position::CONSTANTS],
        ..Shader::new("conditions/prescribed", "prescribed")
    };
    const SLOTS: &'static [Slot] = &[
        // node and mask of components (bit k for component k), 2 numbers per condition
        Slot::read("nodes", Uint),
        // displacement at full amplitude, mm (3)
        Slot::read("targets", Scalar),
        // displacement by cos γ/2 − 1 (3) and by sin γ/2 (3), mm
        Slot::read("arcs", Scalar).when(ARCS),
        Slot::read("velocity", Scalar),
        Slot::read("mass", Scalar),
        Slot::scatter("acceleration", Scalar),
        Slot::scatter("inverse_mass", Scalar),
        // work of the reaction, mJ
        Slot::row("work", Scalar, 1),
        // force of the scene on the prescribed components, N, including weight
        Slot::row("reactions", Scalar, 3),
    ];
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let Params { first_thread } = io.params();
        let (nodes, targets) = (io.uints(slot!(Self::SLOTS, "nodes")), io.scalars(slot!(Self::SLOTS, "targets")));
        let arcs = if ARCS { io.scalars(slot!(Self::SLOTS, "arcs", ARCS)) } else { &[] };
        let velocity = io.view::<L::Scalar>(slot!(Self::SLOTS, "velocity"));
        let mass = io.scalars(slot!(Self::SLOTS, "mass"));
        let plane = mass.len();
        let mut acceleration = io.scatter::<L::Scalar>(slot!(Self::SLOTS, "acceleration"));
        let mut inverse = io.scatter::<L::Scalar>(slot!(Self::SLOTS, "inverse_mass"));
        let mut works = io.own::<L::Scalar>(slot!(Self::SLOTS, "work"));
        let mut reactions = io.own::<L::Scalar>(slot!(Self::SLOTS, "reactions"));
        let row = io.row;
        let zero = L::Scalar::from_f64(0.0);
        for item in items {
            let (node, mask) = (nodes[2 * item] as usize, nodes[2 * item + 1]);
            let damping = if node < first_thread as usize { row.damping_solid } else { row.damping_thread };
            let (keep, gain) = factors::<_, DAMPING>(damping, row.dt_mid);
            for k in 0..3 {
                if mask >> k & 1 == 0 {
                    continue;
                }
                let place = node + k * plane;
                let v = velocity.get(place);
                let force = acceleration.get(place) / inverse.get(node);
                let mut target = targets[3 * item + k] * row.motion;
                if ARCS {
                    target = target + arcs[6 * item + k] * row.cosine + arcs[6 * item + 3 + k] * row.sine;
                }
                let a = (target - v * keep) / gain;
                acceleration.set(place, a);
                let mean = (v + target) * L::Scalar::from_f64(0.5);
                // a fully prescribed node carries no added mass
                let inertia = if mask == 7 { mass[node] } else { L::Scalar::from_f64(1.0) / inverse.get(node) };
                let reaction = inertia * a - force;
                let work = works.at(0, item);
                *work = *work + reaction * mean * row.dt_mid;
                reactions.item(0, item)[k] = force;
            }
            if mask == 7 {
                inverse.set(node, zero);
            }
        }
    }
}
