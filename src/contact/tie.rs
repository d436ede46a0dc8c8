//! Ties: a node that is held at a point of another body's surface by a spring, for cut threads whose ends stay caught between the
//! fibres. The spring pulls on the difference of displacements, hence not at the start.

use super::{Params, add_pair, add_stiffness};
use crate::kernel::lane::{Lane, Real};
use crate::kernel::node::Displacements;
use crate::kernel::shader::Shader;
use crate::kernel::stage::{Io, Kernel};
use crate::kernel::vector::{dot, fma, scale};
use std::ops::Range;

/// Nodes of a tie: the one that is held, and the corners of the face that holds it.
pub const NODES: usize = 5;
/// Numbers of a tie: weights of the corners; stiffness, N/mm.
pub const VALUES: usize = 5;

pub const TIES: usize = 0;
pub const TABLE: usize = 1;
pub const QUANTA: usize = 2;
pub const REMAINDER: usize = 3;
/// Elastic energy now, mJ.
const ENERGY: usize = 4;
const FORCE: usize = 5;
const STIFFNESS: usize = 6;
const STATUS: usize = 7;

/// Forces of ties.
pub struct Tie;

impl Kernel for Tie {
    const SHADER: Shader = Shader::new("contact/tie", "tie");

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let params: Params = io.params();
        let real = |x: f32| L::Scalar::from_f64(f64::from(x));
        let constant = L::Scalar::from_f64;
        let (ties, table) = (io.uints(TIES), io.scalars(TABLE));
        let displacement = Displacements::new(io, QUANTA, REMAINDER);
        let mut energies = io.own::<L::Scalar>(ENERGY);
        let (forces, stiffness, flags) = (io.atomics(FORCE), io.atomics(STIFFNESS), io.atomic_uints(STATUS));
        for item in items {
            let (nodes, values) = (&ties[NODES * item..][..NODES], &table[VALUES * item..][..VALUES]);
            let held = nodes[0] as usize;
            let corners = [0, 1, 2, 3].map(|a| (nodes[a + 1] as usize, values[a]));
            let spring = values[4];
            // from the held node to its place on the face
            let mut gap = [constant(0.0); 3];
            for (node, weight) in corners {
                gap = fma(displacement.between(node, held), weight, gap);
            }
            *energies.at(0, item) = constant(0.5) * spring * dot(gap, gap);
            let one = (held, constant(1.0));
            add_pair(forces, flags, scale(gap, spring), real(params.force_quantum), [one], corners);
            let row_sum = constant(2.0) * spring;
            let nodes = corners.into_iter().chain([one]);
            add_stiffness(stiffness, row_sum, real(params.stiffness_quantum), nodes);
        }
    }
}
