//! Ties: springs that hold a node at a point of another body's surface, for cut threads whose ends stay caught between the
//! fibres. The spring acts on the difference of displacements, so it is free of force at the start.

use super::{Params, add_pair, add_stiffness, status};
use crate::kernel::buffer::Kind::{Int, Scalar, Uint};
use crate::kernel::interface::{Slot, constants, slot};
use crate::kernel::io::Io;
use crate::kernel::lane::{Lane, Real};
use crate::kernel::node::Displacements;
use crate::kernel::position;
use crate::kernel::shader::Shader;
use crate::kernel::stage::Kernel;
use crate::kernel::vector::{dot, fma, scale};
use std::ops::Range;

/// Nodes of a tie: the tied node, and the corners of the face.
const NODES: usize = 5;
/// Numbers per tie: weights of the corners; stiffness, N/mm.
const VALUES: usize = 5;

/// Forces of ties.
pub struct Tie;

impl Kernel for Tie {
    const SHADER: Shader = Shader {
        constants: &[&position::CONSTANTS, &status::CONSTANTS, &super::CONSTANTS, &constants![uint: NODES, VALUES]],
        light: true,
        ..Shader::new("contact/tie", "tie")
    };
    const SLOTS: &'static [Slot] = &[
        Slot::read("ties", Uint),
        Slot::read("values", Scalar),
        Slot::read("quanta", Int),
        Slot::read("remainder", Scalar),
        // current elastic energy, mJ
        Slot::row("energies", Scalar, 1),
        Slot::atomic("forces", Int),
        Slot::atomic("stiffness", Int),
        Slot::atomic("status", Uint),
    ];
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let params: Params = io.params();
        let real = |x: f32| L::Scalar::from_f64(f64::from(x));
        let constant = L::Scalar::from_f64;
        let (ties, table) = (io.uints(slot!(Self::SLOTS, "ties")), io.scalars(slot!(Self::SLOTS, "values")));
        let displacement = Displacements::new(io, slot!(Self::SLOTS, "quanta"), slot!(Self::SLOTS, "remainder"));
        let mut energies = io.own::<L::Scalar>(slot!(Self::SLOTS, "energies"));
        let (forces, stiffness) =
            (io.atomics(slot!(Self::SLOTS, "forces")), io.atomics(slot!(Self::SLOTS, "stiffness")));
        let flags = io.atomic_uints(slot!(Self::SLOTS, "status"));
        for item in items {
            let (nodes, values) = (&ties[NODES * item..][..NODES], &table[VALUES * item..][..VALUES]);
            let held = nodes[0] as usize;
            let mut corners = [(held, constant(0.0)); 4];
            for a in 0..4 {
                corners[a] = (nodes[a + 1] as usize, values[a]);
            }
            let spring = values[4];
            // from the tied node to its point on the face
            let mut gap = [constant(0.0); 3];
            for &(node, weight) in &corners {
                gap = fma(displacement.between(node, held), weight, gap);
            }
            *energies.at(0, item) = constant(0.5) * spring * dot(gap, gap);
            let one = (held, constant(1.0));
            add_pair(forces, flags, scale(gap, spring), real(params.force_quantum), [one], corners);
            let row_sum = constant(2.0) * spring;
            let nodes = [corners[0], corners[1], corners[2], corners[3], one];
            add_stiffness(stiffness, row_sum, real(params.stiffness_quantum), nodes);
        }
    }
}
