//! The limit of the time step, node by node: a row-sum bound K of all stiffness that is integrated explicitly gives
//! ω² ≤ max K/m (Gershgorin), hence dt ≤ 2 √(m/K).

use crate::elements::LANES;
use crate::kernel::lane::{Lane, Real};
use crate::kernel::shader::Shader;
use crate::kernel::stage::{Io, Kernel};
use bytemuck::{Pod, Zeroable};
use std::ops::Range;

use super::assemble::{NONE, SOLID};

/// Constants of the stage.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Params {
    /// First node of a thread.
    pub first_thread: u32,
}

/// For each solid node, where its corner bounds are.
pub const SOLID_BOUNDS: usize = 0;
pub const HEX_BOUND: usize = 1;
/// Stiffness of a node that does not change: thread axial and bending, and fibres where lines do not cover them, N/mm.
pub const CONSTANT: usize = 2;
pub const MASS: usize = 3;
/// Row sum of element stiffness, N/mm, and K/m, 1/s² (2 planes).
const LIMIT: usize = 4;

/// Assembles the row sums of element stiffness.
pub struct ElementLimit;

impl Kernel for ElementLimit {
    const SHADER: Shader = Shader::new("dynamics/time_step", "element_limit");

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let Params { first_thread } = io.params();
        let (slots, bounds) = (io.uints(SOLID_BOUNDS), io.scalars(HEX_BOUND));
        let (constant, masses) = (io.scalars(CONSTANT), io.scalars(MASS));
        let mut limits = io.own::<L::Scalar>(LIMIT);
        debug_assert!(bounds.len() % LANES == 0);
        for node in items {
            let mut k = constant[node];
            if node < first_thread as usize {
                for &slot in slots[SOLID * node..][..SOLID].iter().filter(|slot| **slot != NONE) {
                    k = k + bounds[slot as usize];
                }
            }
            *limits.at(0, node) = k;
            *limits.at(1, node) = k / masses[node];
        }
    }
}

/// Largest stable step for K/m in 1/s².
pub fn limit<R: Real>(stiffness_over_mass: R) -> f64 {
    2.0 / libm::sqrt(stiffness_over_mass.to_f64().max(1e-300))
}
