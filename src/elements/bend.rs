//! Bending between two consecutive beams, without rotational degrees of freedom: E = (2 EI/l̄)(T − T₀)², T = tan(θ/2) of the
//! turning angle θ, with l̄ the mean length of the two beams. T = |t₁ × t₂|/(1 + t₁·t₂) is smoothed to √(T² + T_ε²), since its
//! gradient has no direction for a straight thread with a curved rest state. A bend that is straight at rest needs no smoothing
//! and must not have it, because it would lose its stiffness. Only the magnitude of the rest curvature is kept, not its plane:
//! a thread has no torsional stiffness here.

use super::beam2::{self, TABLE, add_virial, vector};
use crate::kernel::buffer::Kind::{Int, Scalar, Uint};
use crate::kernel::interface::{Constant, Slot, constants, slot};
use crate::kernel::io::Io;
use crate::kernel::lane::{Lane, Real};
use crate::kernel::node::Displacements;
use crate::kernel::position;
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::Kernel;
use crate::kernel::vector::{add, cross, dot, norm, scale, sub};
use std::ops::Range;

/// Numbers per bend in the table: 2 EI/l̄ in N·mm, smoothed rest value of T.
pub const BEND: usize = 2;
/// Largest smoothing T_ε of tan(θ/2): a turning angle of 0.6 degrees. It is at most half the smoothed rest value, so that the
/// stiffness of a straightened bend is never below minus the stiffness of a straight one.
pub const SMOOTHING: f64 = 0.005;
/// Constants of bends shared with the twins.
pub const CONSTANTS: [Constant; 2] = constants![uint: BEND; scalar: SMOOTHING];

/// Bending forces; with `PERIODIC`, also their virial for the homogenised stress.
pub struct Bend<const PERIODIC: bool>;

/// √(T² + T_ε²) of a rest value T, with T_ε the smaller of [`SMOOTHING`] and half the result.
pub fn smoothed(t: f64) -> f64 {
    libm::sqrt(t * t + SMOOTHING * SMOOTHING).min(t * 2.0 / libm::sqrt(3.0))
}

impl<const PERIODIC: bool> Kernel for Bend<PERIODIC> {
    const SHADER: Shader = Shader {
        defines: &[when(PERIODIC, "PERIODIC")],
        constants: &[&position::CONSTANTS, &beam2::CONSTANTS, &CONSTANTS],
        light: true,
        ..Shader::new("elements/bend", "force")
    };
    const SLOTS: &'static [Slot] = &[
        // the two beams of each bend
        Slot::read("pairs", Uint),
        Slot::read("bends", Scalar),
        Slot::read("ends", Uint),
        Slot::read("beams", Scalar),
        Slot::read("quanta", Int),
        Slot::read("remainder", Scalar),
        // force along each of the two beams on its first node, N (2 × 3); its second node gets the opposite force
        Slot::row("forces", Scalar, 6),
        // energy, mJ
        Slot::row("energies", Scalar, 1),
        // sum of force ⊗ D over steps, N·mm
        Slot::row("virial", Scalar, 9).when(PERIODIC),
    ];
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let w = Displacements::new(io, slot!(Self::SLOTS, "quanta"), slot!(Self::SLOTS, "remainder"));
        let (pairs, bends) = (io.uints(slot!(Self::SLOTS, "pairs")), io.scalars(slot!(Self::SLOTS, "bends")));
        let (ends, table) = (io.uints(slot!(Self::SLOTS, "ends")), io.scalars(slot!(Self::SLOTS, "beams")));
        let mut forces = io.own::<L::Scalar>(slot!(Self::SLOTS, "forces"));
        let mut energies = io.own::<L::Scalar>(slot!(Self::SLOTS, "energies"));
        let mut virials =
            if PERIODIC { Some(io.own::<L::Scalar>(slot!(Self::SLOTS, "virial", PERIODIC))) } else { None };
        let constant = L::Scalar::from_f64;
        debug_assert!(table.len() % TABLE == 0);
        for bend in items {
            let beams = [pairs[2 * bend] as usize, pairs[2 * bend + 1] as usize];
            let (stiffness, rest) = (bends[BEND * bend], bends[BEND * bend + 1]);
            let mut reference = [[constant(0.0); 3]; 2];
            let mut tangent = [[constant(0.0); 3]; 2];
            let mut inverse = [constant(0.0); 2];
            for k in 0..2 {
                let (d, change) = vector::<_, PERIODIC>(table, ends, beams[k], &w, &io.row.gradient);
                let current = add(d, change);
                reference[k] = d;
                inverse[k] = constant(1.0) / norm(current);
                tangent[k] = scale(current, inverse[k]);
            }
            let cosine = dot(tangent[0], tangent[1]);
            // a thread folded onto itself: tan(θ/2) is limited to 10
            let opening = (constant(1.0) + cosine).max(constant(0.02));
            let turned = cross(tangent[0], tangent[1]);
            let smoothing = constant(SMOOTHING).min(constant(0.5) * rest);
            let t = (dot(turned, turned) / (opening * opening) + smoothing * smoothing).sqrt();
            let t = t.max(constant(1e-12));
            let slope = constant(-2.0) * stiffness * (constant(1.0) - rest / t) / (opening * opening);
            let g = [
                scale(sub(tangent[1], scale(tangent[0], cosine)), slope * inverse[0]),
                scale(sub(tangent[0], scale(tangent[1], cosine)), slope * inverse[1]),
            ];
            let out = forces.item(0, bend);
            out[..3].copy_from_slice(&g[0]);
            out[3..].copy_from_slice(&g[1]);
            *energies.at(0, bend) = stiffness * (t - rest) * (t - rest);
            if let Some(virials) = &mut virials {
                for k in 0..2 {
                    add_virial(virials.item(0, bend), g[k], reference[k]);
                }
            }
        }
    }
}
