//! Axial part of a 2-node beam: N = EA (l/L₀ − 1 − ε_th), with the additive thermal strain of Eq. 14 of Zheng et al.
//!
//! The strain is formed from the change of the beam's vector, ε = (2 D·δ + δ·δ)/(L₀ (l + L₀)) with d = D + δ, which keeps its
//! relative accuracy at small strain.

use crate::kernel::lane::{Lane, Real};
use crate::kernel::node::Displacements;
use crate::kernel::shader::Shader;
use crate::kernel::stage::{Io, Kernel};
use crate::kernel::vector::{add, apply, dot, norm, scale};
use std::ops::Range;

/// Numbers of a beam in the table: vector D in mm (3), length L₀ in mm, EA in N, thermal strain.
pub const TABLE: usize = 6;

pub const ENDS: usize = 0;
pub const BEAMS: usize = 1;
pub const QUANTA: usize = 2;
pub const REMAINDER: usize = 3;
/// Force along the beam, on its first node, N (3); the second node gets the opposite.
const FORCE: usize = 4;
/// Axial force N, in N.
const TENSION: usize = 5;
/// Thermal work −∫ N L₀ dε_th, mJ.
const WORK: usize = 6;
/// Sum of force ⊗ D over steps, N·mm (9), for periodic scenes.
const VIRIAL: usize = 7;

/// Axial forces; with `PERIODIC`, also their part of the homogenised stress.
pub struct Beam2<const PERIODIC: bool>;

/// A beam's reference vector and its change, mm.
#[inline(always)]
pub fn vector<R: Real>(
    table: &[R],
    ends: &[u32],
    beam: usize,
    w: &Displacements<R>,
    gradient: &[[R; 3]; 3],
) -> ([R; 3], [R; 3]) {
    let row = &table[TABLE * beam..][..TABLE];
    let reference = [row[0], row[1], row[2]];
    let fluctuation = w.between(ends[2 * beam + 1] as usize, ends[2 * beam] as usize);
    (reference, add(apply(gradient, reference), fluctuation))
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

impl<const PERIODIC: bool> Kernel for Beam2<PERIODIC> {
    const SHADER: Shader =
        Shader { defines: if PERIODIC { &["PERIODIC"] } else { &[] }, ..Shader::new("elements/beam2", "force") };

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let w = Displacements::new(io, QUANTA, REMAINDER);
        let (ends, table) = (io.uints(ENDS), io.scalars(BEAMS));
        let mut forces = io.own::<L::Scalar>(FORCE);
        let mut tensions = io.own::<L::Scalar>(TENSION);
        let mut works = io.own::<L::Scalar>(WORK);
        let mut virials = PERIODIC.then(|| io.own::<L::Scalar>(VIRIAL));
        let two = L::Scalar::from_f64(2.0);
        for beam in items {
            let (reference, change) = vector(table, ends, beam, &w, &io.row.gradient);
            let row = &table[TABLE * beam..][..TABLE];
            let (rest, axial, thermal) = (row[3], row[4], row[5]);
            let current = add(reference, change);
            let length = norm(current);
            let strain = (two * dot(reference, change) + dot(change, change)) / (rest * (length + rest));
            let tension = axial * (strain - thermal * io.row.thermal);
            let force = scale(current, tension / length);
            forces.item(0, beam).copy_from_slice(&force);
            *tensions.at(0, beam) = tension;
            let work = works.at(0, beam);
            *work = *work - tension * rest * thermal * io.row.thermal_increment;
            if let Some(virials) = &mut virials {
                add_virial(virials.item(0, beam), force, reference);
            }
        }
    }
}
