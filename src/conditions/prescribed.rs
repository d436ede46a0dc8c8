//! Prescribed motion: the velocity of chosen components follows the amplitude of the schedule exactly.

use crate::dynamics::integrate::factors;
use crate::kernel::lane::{Lane, Real};
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::{Io, Kernel};
use bytemuck::{Pod, Zeroable};
use std::ops::Range;

/// Constants of the stages.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Params {
    /// First node of a thread.
    pub first_thread: u32,
}

/// Node and mask of components (bit k for component k), 2 numbers a condition.
pub const NODES: usize = 0;
/// Displacement at full amplitude, mm (3).
pub const TARGETS: usize = 1;
pub const VELOCITY: usize = 2;
pub const MASS: usize = 3;
const ACCELERATION: usize = 4;
const INVERSE_MASS: usize = 5;
/// Work of the reaction, mJ.
const WORK: usize = 6;
/// Force that the scene exerts on the prescribed components, N (3), weight included.
const REACTION: usize = 7;

/// Replaces accelerations of prescribed components, before fibre lines see them; `DAMPING` as for the integration.
pub struct Prescribed<const DAMPING: bool>;
/// Takes back what fibre lines did to prescribed components.
pub struct Hold;

impl<const DAMPING: bool> Kernel for Prescribed<DAMPING> {
    const SHADER: Shader =
        Shader { defines: &[when(DAMPING, "DAMPING")], ..Shader::new("conditions/prescribed", "prescribed") };

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let Params { first_thread } = io.params();
        let (nodes, targets, velocity, mass) =
            (io.uints(NODES), io.scalars(TARGETS), io.scalars(VELOCITY), io.scalars(MASS));
        let plane = mass.len();
        let mut acceleration = io.scatter::<L::Scalar>(ACCELERATION);
        let mut inverse = io.scatter::<L::Scalar>(INVERSE_MASS);
        let mut works = io.own::<L::Scalar>(WORK);
        let mut reactions = io.own::<L::Scalar>(REACTION);
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
                let (place, v) = (node + k * plane, velocity[node + k * plane]);
                let force = acceleration.get(place) / inverse.get(node);
                let target = targets[3 * item + k] * row.motion;
                let a = (target - v * keep) / gain;
                acceleration.set(place, a);
                let mean = (v + target) * L::Scalar::from_f64(0.5);
                // a node that is held altogether carries no added mass
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

impl Kernel for Hold {
    const SHADER: Shader = Shader::new("conditions/prescribed", "hold");

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let nodes = io.uints(NODES);
        let mut correction = io.scatter::<L::Scalar>(1);
        let plane = correction.len() / 3;
        for item in items {
            for k in (0..3).filter(|k| nodes[2 * item + 1] >> k & 1 == 1) {
                correction.set(nodes[2 * item] as usize + k * plane, L::Scalar::from_f64(0.0));
            }
        }
    }
}
