//! Contact sums per point and beam: energies, slip, and the virial for the homogenised stress.

use crate::kernel::interface::{Constant, constants};
use crate::kernel::lane::Real;
use crate::kernel::vector::Vector;

/// Sums of a point or a beam: current elastic energy, mJ; accumulated over steps, energy lost to contact damping, and work of
/// the growing radius, mJ.
pub const SUM_ENERGY: usize = 0;
pub const SUM_DAMPING: usize = 1;
pub const SUM_RADIUS: usize = 2;
/// With friction: energy lost to friction, mJ, and slip, mm.
pub const SUM_FRICTION: usize = 3;
pub const SUM_SLIP: usize = 4;

/// Start of the virial force ⊗ ΔX, N·mm (9), in the sums of a periodic scene.
pub const fn virial(friction: bool) -> usize {
    if friction { SUM_SLIP + 1 } else { SUM_RADIUS + 1 }
}
/// Number of the sums.
pub const fn sums(friction: bool, periodic: bool) -> usize {
    virial(friction) + if periodic { 9 } else { 0 }
}

/// Constants of the sums shared with the twins.
pub const fn shared(friction: bool, periodic: bool) -> [Constant; 7] {
    constants![
        uint: SUM_ENERGY, SUM_DAMPING, SUM_RADIUS, SUM_FRICTION, SUM_SLIP, SUM_VIRIAL = virial(friction),
            SUMS = sums(friction, periodic)
    ]
}

/// Subtracts force ⊗ ΔX from the nine virial sums of the homogenised stress.
#[inline(always)]
pub fn add_virial<R: Real>(sum: &mut [R], force: Vector<R>, apart: Vector<R>) {
    for i in 0..3 {
        for j in 0..3 {
            let v = &mut sum[3 * i + j];
            *v = *v - force[i] * apart[j];
        }
    }
}
