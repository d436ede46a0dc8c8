//! Axial part of a 2-node beam: N = EA (l/L₀ − 1 − ε_th), with the additive thermal strain of Eq. 14 of Zheng et al.
//!
//! The strain is computed from the change of the beam's vector, ε = (2 D·δ + δ·δ)/(L₀ (l + L₀)) with d = D + δ, which preserves
//! relative accuracy at small strain.

use crate::kernel::buffer::Kind::{Int, Scalar, Uint};
use crate::kernel::interface::{Constant, Slot, constants, slot};
use crate::kernel::io::Io;
use crate::kernel::lane::{Lane, Real};
use crate::kernel::node::Displacements;
use crate::kernel::position;
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::Kernel;
use crate::kernel::vector::{add, apply, dot, norm, scale};
use std::ops::Range;

/// Numbers per beam in the table: vector D in mm (3), length L₀ in mm, EA in N.
pub const TABLE: usize = 5;

/// Constants of beams shared with the twins.
pub const CONSTANTS: [Constant; 1] = constants![uint: TABLE];

/// Axial forces; with `PERIODIC`, also their virial for the homogenised stress; with `THERMAL`, for threads with thermal
/// strain, also the thermal work −∫ N L₀ dε_th, mJ.
pub struct Beam2<const PERIODIC: bool, const THERMAL: bool>;

/// The reference vector of a beam and its change, mm.
#[inline(always)]
pub fn vector<R: Real, const PERIODIC: bool>(
    table: &[R],
    ends: &[u32],
    beam: usize,
    w: &Displacements<R>,
    gradient: &[[R; 3]; 3],
) -> ([R; 3], [R; 3]) {
    let row = &table[TABLE * beam..][..TABLE];
    let reference = [row[0], row[1], row[2]];
    let fluctuation = w.between(ends[2 * beam + 1] as usize, ends[2 * beam] as usize);
    (reference, if PERIODIC { add(apply(gradient, reference), fluctuation) } else { fluctuation })
}

/// Adds `force ⊗ reference` to nine numbers.
#[inline(always)]
pub fn add_virial<R: Real>(to: &mut [R], force: [R; 3], reference: [R; 3]) {
    for i in 0..3 {
        for j in 0..3 {
            to[3 * i + j] = to[3 * i + j] + force[i] * reference[j];
        }
    }
}

impl<const PERIODIC: bool, const THERMAL: bool> Kernel for Beam2<PERIODIC, THERMAL> {
    const SHADER: Shader = Shader {
        defines: &[when(PERIODIC, "PERIODIC"), when(THERMAL, "THERMAL")],
        constants: &[&position::CONSTANTS, &CONSTANTS],
        light: true,
        ..Shader::new("elements/beam2", "force")
    };
    const SLOTS: &'static [Slot] = &[
        Slot::read("ends", Uint),
        Slot::read("beams", Scalar),
        Slot::read("quanta", Int),
        Slot::read("remainder", Scalar),
        Slot::read("thermal_strain", Scalar).when(THERMAL),
        // force along the beam on its first node, N; the second node gets the opposite force
        Slot::row("forces", Scalar, 3),
        // axial force N, N
        Slot::row("tensions", Scalar, 1),
        // sum of force ⊗ D over steps, N·mm
        Slot::row("virial", Scalar, 9).when(PERIODIC),
        Slot::row("work", Scalar, 1).when(THERMAL),
    ];
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let w = Displacements::new(io, slot!(Self::SLOTS, "quanta"), slot!(Self::SLOTS, "remainder"));
        let (ends, table) = (io.uints(slot!(Self::SLOTS, "ends")), io.scalars(slot!(Self::SLOTS, "beams")));
        let mut forces = io.own::<L::Scalar>(slot!(Self::SLOTS, "forces"));
        let mut tensions = io.own::<L::Scalar>(slot!(Self::SLOTS, "tensions"));
        let mut virials =
            if PERIODIC { Some(io.own::<L::Scalar>(slot!(Self::SLOTS, "virial", PERIODIC))) } else { None };
        let mut thermal = if THERMAL {
            let strains = io.scalars(slot!(Self::SLOTS, "thermal_strain", THERMAL));
            Some((strains, io.own::<L::Scalar>(slot!(Self::SLOTS, "work", THERMAL))))
        } else {
            None
        };
        let two = L::Scalar::from_f64(2.0);
        for beam in items {
            let (reference, change) = vector::<_, PERIODIC>(table, ends, beam, &w, &io.row.gradient);
            let row = &table[TABLE * beam..][..TABLE];
            let (rest, axial) = (row[3], row[4]);
            let current = add(reference, change);
            let length = norm(current);
            let mut strain = (two * dot(reference, change) + dot(change, change)) / (rest * (length + rest));
            if let Some((strains, _)) = &thermal {
                strain = strain - strains[beam] * io.row.thermal;
            }
            let tension = axial * strain;
            let force = scale(current, tension / length);
            forces.item(0, beam).copy_from_slice(&force);
            *tensions.at(0, beam) = tension;
            if let Some((strains, works)) = &mut thermal {
                let work = works.at(0, beam);
                *work = *work - tension * rest * strains[beam] * io.row.thermal_increment;
            }
            if let Some(virials) = &mut virials {
                add_virial(virials.item(0, beam), force, reference);
            }
        }
    }
}
