//! Energies not computed with the forces: kinetic energy, and strain energy of stretched threads, as [totals](super::totals).

use super::totals::{add_up, part};
use crate::elements::beam2::{self, TABLE};
use crate::kernel::buffer::Kind::{Int, Scalar};
use crate::kernel::interface::{Slot, slot};
use crate::kernel::io::Io;
use crate::kernel::lane::{Lane, Real};
use crate::kernel::node::Field;
use crate::kernel::position::{self, QUANTUM};
use crate::kernel::shader::{Shader, Share, when};
use crate::kernel::stage::Kernel;
use crate::kernel::vector::{add, apply, dot};
use bytemuck::{Pod, Zeroable};
use std::ops::Range;

/// Constants of the stage.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Params {
    /// Number of nodes or beams.
    pub count: u32,
    /// Items per part.
    pub length: u32,
    /// Start of the sums of the parts.
    pub into: u32,
    /// Reference centre of mass, in quanta.
    pub centre: [i32; 3],
}

/// ½ Σ m v²; with `TOTAL`, v includes the affine motion Ḟ̄ (X − X_c) relative to the centre of mass.
pub struct Kinetic<const TOTAL: bool>;

impl<const TOTAL: bool> Kernel for Kinetic<TOTAL> {
    const SHADER: Shader = Shader {
        // only a periodic cell has a macroscopic deformation
        defines: &[when(TOTAL, "TOTAL"), when(TOTAL, "PERIODIC")],
        share: Share::Workgroups(1),
        constants: &[&position::CONSTANTS],
        ..Shader::new("dynamics/energy", "kinetic")
    };
    const SLOTS: &'static [Slot] = &[
        Slot::read("velocity", Scalar),
        Slot::read("mass", Scalar),
        Slot::read("reference", Int).when(TOTAL),
        Slot::scatter("totals", Scalar),
    ];
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let params: Params = io.params();
        let (velocity, mass) = (Field::new(io, slot!(Self::SLOTS, "velocity")), io.scalars(slot!(Self::SLOTS, "mass")));
        let reference = if TOTAL { io.ints(slot!(Self::SLOTS, "reference", TOTAL)) } else { &[] };
        let plane = mass.len();
        let (half, quantum) = (L::Scalar::from_f64(0.5), L::Scalar::from_f64(QUANTUM));
        let mut totals = io.scatter::<L::Scalar>(slot!(Self::SLOTS, "totals"));
        for item in items {
            let sum = add_up(part(item, params.length, params.count), |node| {
                let mut v = velocity.at(node);
                if TOTAL {
                    let mut x = [quantum; 3];
                    for k in 0..3 {
                        let whole = reference[node + k * plane].wrapping_sub(params.centre[k]);
                        x[k] = L::Scalar::from_i32(whole) * quantum;
                    }
                    v = add(v, apply(&io.row.rate, x));
                }
                half * mass[node] * dot(v, v)
            });
            totals.set(params.into as usize + item, sum);
        }
    }
}

/// ½ Σ N² L₀/EA of beams.
pub struct Axial;

impl Kernel for Axial {
    const SHADER: Shader = Shader {
        share: Share::Workgroups(1),
        constants: &[&beam2::CONSTANTS],
        ..Shader::new("dynamics/energy", "axial")
    };
    const SLOTS: &'static [Slot] =
        &[Slot::read("tension", Scalar), Slot::read("beams", Scalar), Slot::scatter("totals", Scalar)];
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let params: Params = io.params();
        let (tension, beams) = (io.scalars(slot!(Self::SLOTS, "tension")), io.scalars(slot!(Self::SLOTS, "beams")));
        let half = L::Scalar::from_f64(0.5);
        let mut totals = io.scatter::<L::Scalar>(slot!(Self::SLOTS, "totals"));
        for item in items {
            let sum = add_up(part(item, params.length, params.count), |beam| {
                let (length, stiffness) = (beams[TABLE * beam + 3], beams[TABLE * beam + 4]);
                half * tension[beam] * tension[beam] / stiffness * length
            });
            totals.set(params.into as usize + item, sum);
        }
    }
}
