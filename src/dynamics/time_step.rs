//! The limit of the time step, node by node: a row-sum bound R of the stiffness that fibre lines leave gives dt ≤ 2 √(m/R).
//!
//! With the mass matrix A = M + β dt² K_l of fibre lines, a step is stable while dt² K ≤ 4 A. Let K ≤ 4β K_l + R: then dt² R ≤ 4 M
//! is enough, and by Gershgorin's theorem R may be the diagonal of row sums. K_l along the lines is part of the stiffness of
//! fibres, all of it where the edges of an element are parallel: the stiffness of a fibre along d, (d·e)² for the difference e
//! of displacements along an edge, is at most 4β times the part along the edge and 4β/(4β − 1) times the part across it. R holds
//! that part across, the stiffness of the section, longitudinal shear, the tension of fibres and threads, and bending.
//!
//! The part across takes the directions of all fibres to differ in the one way that swings fastest. They do not, and a share of
//! [`COHERENT`] is kept: measured by power iteration, the sheared cell, yarns that are twisted or spread evenly, and one that buckles
//! need 0.07 to 0.32.
//!
//! Mass that contact has added counts: it goes slower than the limit is looked at again. What contact itself calls for is covered by
//! it, see [`super::assemble`].
//!
//! A bend of energy S (T − T₀)², T = tan(θ/2), is (1 + T²)(1 + T² + 2 T (T − T₀)) times as stiff as one that is straight. T comes
//! from its force on a beam of length l, S (T − T₀)(1 + T²)/l, and its energy.

use crate::elements::LANES;
use crate::kernel::lane::{Lane, Real};
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::{Io, Kernel};
use crate::kernel::vector::norm;
use bytemuck::{Pod, Zeroable};
use std::ops::Range;

use super::assemble::{BENT, NONE, SOLID, THREAD};
use crate::elements::beam2::TABLE;
use crate::elements::bend::BEND;

/// Constants of the stage.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Params {
    /// First node of a thread.
    pub first_thread: u32,
    /// See [`super::assemble::Params`]: mass that is added for the stiffness of elements counts.
    pub mass_per_stiffness: f32,
}

/// For each solid node, where its corner bounds are.
pub const SOLID_BOUNDS: usize = 0;
pub const HEX_BOUND: usize = 1;
/// Axial stiffness that neither lines nor the bounds of hexahedra cover, N/mm.
pub const CONSTANT: usize = 2;
pub const MASS: usize = 3;
/// Slots of thread nodes, forces of beams and their table.
pub const THREAD_SLOTS: usize = 4;
pub const BEAM_FORCE: usize = 5;
pub const BEAMS: usize = 6;
/// With `BENDING`: bends of thread nodes; their table, energies and forces, and their row sums.
pub const BEND_SLOTS: usize = 7;
pub const BENDS: usize = 8;
pub const BEND_ENERGY: usize = 9;
pub const BEND_FORCE: usize = 10;
pub const BEND_ROWS: usize = 11;
/// Numbers of a bend's row sums: of its three nodes while it is straight, N/mm; length of its first beam, mm.
pub const ROWS: usize = 4;
/// Added mass, tonne, only with `MASS_ADDED`; without `BENDING` it takes the place of its slots.
const ADDED_MASS: usize = 12;

/// Share of the part across of fibres that is kept.
pub const COHERENT: f64 = 0.375;

/// Factor on the part across of fibres, for lines of strength β.
pub fn left(beta: f64) -> f64 {
    COHERENT * 4.0 * beta / (4.0 * beta - 1.0).max(0.01)
}

/// Difference of T and T₀ below which they count as equal.
const AT_REST: f64 = 1e-3;

/// How much stiffer a bend is than a straight one.
#[inline(always)]
fn stiffening<R: Real>([stiffness, rest]: [R; 2], energy: R, force: R, length: R) -> R {
    let (zero, one) = (R::from_f64(0.0), R::from_f64(1.0));
    let away = (energy / stiffness).sqrt();
    let near = away < R::from_f64(AT_REST);
    let t = if near { rest } else { (force * length / (stiffness * away) - one).max(zero).sqrt() };
    let square = one + t * t;
    let further = if t > rest { away } else { zero };
    square * (square + (t + t) * further)
}

/// Assembles the row sums of element stiffness, with those of bends: N/mm, and R/m, 1/s² (2 planes).
pub struct ElementLimit<const BENDING: bool, const MASS_ADDED: bool>;
/// What bends say of their stiffness.
#[derive(Clone, Copy)]
struct Bends<'a, R> {
    slots: &'a [u32],
    table: &'a [R],
    energy: &'a [R],
    force: &'a [R],
    rows: &'a [R],
}

/// Leaves out nodes that are held altogether: they do not swing.
pub struct HeldLimit;

impl<const BENDING: bool, const MASS_ADDED: bool> Kernel for ElementLimit<BENDING, MASS_ADDED> {
    const SHADER: Shader = Shader {
        defines: &[when(BENDING, "BENDING"), when(MASS_ADDED, "MASS_ADDED")],
        ..Shader::new("dynamics/time_step", "element_limit")
    };

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let Params { first_thread, mass_per_stiffness } = io.params();
        let least = L::Scalar::from_f64(f64::from(mass_per_stiffness));
        let (slots, bounds) = (io.uints(SOLID_BOUNDS), io.scalars(HEX_BOUND));
        let (constant, masses) = (io.scalars(CONSTANT), io.scalars(MASS));
        let (thread, forces, beams) = (io.uints(THREAD_SLOTS), io.scalars(BEAM_FORCE), io.scalars(BEAMS));
        let bends = BENDING.then(|| Bends {
            slots: io.uints(BEND_SLOTS),
            table: io.scalars(BENDS),
            energy: io.scalars(BEND_ENERGY),
            force: io.scalars(BEND_FORCE),
            rows: io.scalars(BEND_ROWS),
        });
        let size = |force: &[L::Scalar]| norm([force[0], force[1], force[2]]);
        let added_at = if BENDING { ADDED_MASS } else { BEND_SLOTS };
        let added = MASS_ADDED.then(|| io.scalars(added_at));
        let mut limits = io.own::<L::Scalar>(added_at + usize::from(MASS_ADDED));
        debug_assert!(bounds.len() % LANES == 0);
        let two = L::Scalar::from_f64(2.0);
        for node in items {
            let mut k = constant[node];
            if node < first_thread as usize {
                for &slot in slots[SOLID * node..][..SOLID].iter().filter(|slot| **slot != NONE) {
                    k = k + bounds[slot as usize];
                }
            } else {
                let item = node - first_thread as usize;
                for &slot in thread[THREAD * item..][..THREAD].iter().filter(|slot| **slot != NONE) {
                    let slot = slot as usize;
                    k = k + two * size(&forces[3 * slot..][..3]) / beams[TABLE * slot + 3];
                }
                if let Some(Bends { slots, table, energy, force, rows }) = bends {
                    let slots = slots[BENT * item..][..BENT].iter().enumerate();
                    for (place, &slot) in slots.filter(|(_, slot)| **slot != NONE) {
                        let slot = slot as usize;
                        let rows = &rows[ROWS * slot..][..ROWS];
                        let bend = [table[BEND * slot], table[BEND * slot + 1]];
                        let force = size(&force[6 * slot..][..3]);
                        k = k + rows[place] * stiffening(bend, energy[slot], force, rows[3]);
                    }
                }
            }
            *limits.at(0, node) = k;
            let mass = added.map_or(masses[node], |added| masses[node] + added[node]);
            *limits.at(1, node) = k / mass.max(k * least);
        }
    }
}

impl Kernel for HeldLimit {
    const SHADER: Shader = Shader::new("dynamics/time_step", "held_limit");

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let conditions = io.uints(0);
        let mut limits = io.scatter::<L::Scalar>(1);
        let plane = limits.len() / 2;
        for item in items.filter(|item| conditions[2 * item + 1] == 7) {
            limits.set(plane + conditions[2 * item] as usize, L::Scalar::from_f64(0.0));
        }
    }
}

/// Largest stable step for R/m in 1/s².
pub fn limit<R: Real>(stiffness_over_mass: R) -> f64 {
    2.0 / libm::sqrt(stiffness_over_mass.to_f64().max(1e-300))
}
