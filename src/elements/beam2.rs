//! Axial part of a 2-node beam: N = EA (l/L₀ − 1 − ε_th), with the additive thermal strain of Eq. 14 of Zheng et al.
//!
//! The strain is formed from the change of the beam's vector, ε = (2 D·δ + δ·δ)/(L₀ (l + L₀)) with d = D + δ, which keeps its
//! relative accuracy at small strain.

use crate::kernel::lane::{Lane, Real};
use crate::kernel::node::Displacements;
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::{Io, Kernel};
use crate::kernel::vector::{add, apply, dot, norm, scale};
use std::ops::Range;

/// Numbers of a beam in the table: vector D in mm (3), length L₀ in mm, EA in N.
pub const TABLE: usize = 5;

pub const ENDS: usize = 0;
pub const BEAMS: usize = 1;
pub const QUANTA: usize = 2;
pub const REMAINDER: usize = 3;
/// Thermal strain, only with `THERMAL`; without it, all writes are one number earlier.
pub const THERMAL_STRAIN: usize = 4;
/// Force along the beam, on its first node, N (3); the second node gets the opposite.
const FORCE: usize = 5;
/// Axial force N, in N.
const TENSION: usize = 6;
/// Sum of force ⊗ D over steps, N·mm (9), for periodic scenes.
const VIRIAL: usize = 7;

/// Axial forces; with `PERIODIC`, also their part of the homogenised stress; with `THERMAL`, of strained threads, also the
/// thermal work −∫ N L₀ dε_th, mJ, which is written last.
pub struct Beam2<const PERIODIC: bool, const THERMAL: bool>;

/// A beam's reference vector and its change, mm.
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
        ..Shader::new("elements/beam2", "force")
    };

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let w = Displacements::new(io, QUANTA, REMAINDER);
        let (ends, table) = (io.uints(ENDS), io.scalars(BEAMS));
        let missing = usize::from(!THERMAL);
        let mut forces = io.own::<L::Scalar>(FORCE - missing);
        let mut tensions = io.own::<L::Scalar>(TENSION - missing);
        let mut virials = PERIODIC.then(|| io.own::<L::Scalar>(VIRIAL - missing));
        let mut thermal =
            THERMAL.then(|| (io.scalars(THERMAL_STRAIN), io.own::<L::Scalar>(VIRIAL + usize::from(PERIODIC))));
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
