//! The limit of the time step, node by node: a row-sum bound R of the stiffness not covered by fibre lines gives dt ≤ 2 √(m/R).
//!
//! With the mass matrix A = M + β dt² K_l of fibre lines, a step is stable while dt² K ≤ 4 A. If K ≤ 4β K_l + R, then dt² R ≤ 4
//! M is sufficient, and by Gershgorin's theorem R may be the diagonal matrix of row sums. K_l is the part of the fibre
//! stiffness along the lines, all of it if the edges of an element are parallel. The stiffness of a fibre along d, (d·e)² for
//! the difference e of displacements along an edge, is at most 4β times its part along the edge plus 4β/(4β − 1) times its part
//! across the edge. R contains this part across, the stiffness of the section, longitudinal shear, the tension of fibres and
//! threads, and bending.
//!
//! A light node between heavy ones, as at the rim of a yarn, vibrates by itself, but its row sum includes the coupling to
//! neighbours that do not. For any weights v > 0, ω² is at most the largest Σ|K_ab| v_b / (m_a v_a) (Collatz and Wielandt).
//! With v = R/m this is the mean of R/m over a node and its neighbours, weighted by |K_ab|. It never exceeds the largest R/m.
//!
//! Rows with mass scaling (see [`super::assemble`]) are not weighed: a mass would count in its own weight.
//!
//! Mass added by contact counts: it decays more slowly than the limit is updated. The stiffness of contact itself is covered by
//! it, see [`super::assemble`].
//!
//! A bend of energy S (T − T₀)², T = tan(θ/2), is (1 + T²)(1 + T² + 2 T (T − T₀)) times as stiff as a straight one. T follows
//! from its force on a beam of length l, S (T − T₀)(1 + T²)/l, and its energy.

use super::assemble::{self, BENT, NONE, SOLID, THREAD};
use crate::elements::beam2::{self, TABLE};
use crate::elements::bend::{self, BEND};
use crate::kernel::buffer::Kind::{Scalar, Uint};
use crate::kernel::interface::{Constant, Slot, constants, joined, slot};
use crate::kernel::io::Io;
use crate::kernel::lane::{Lane, Real};
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::Kernel;
use crate::kernel::vector::norm;
use bytemuck::{Pod, Zeroable};
use std::ops::Range;

/// Constants of the stage.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Params {
    /// First node of a thread.
    pub first_thread: u32,
    /// See [`super::assemble::Params`]: mass added for the stiffness of elements counts.
    pub mass_per_stiffness: f32,
    /// 1 if no fibre lines go along threads, 0 if they do.
    pub axial: f32,
}

/// Inputs of the row sums; with `bending` also those of bends.
const fn rows(bending: bool) -> [Slot; 11] {
    [
        // for each solid node, the indices of its corner bounds
        Slot::read("solid_bounds", Uint),
        Slot::read("hex_bound", Scalar),
        // axial stiffness of closed lines that are too short for fibre lines, N/mm
        Slot::read("constant", Scalar),
        Slot::read("thread_slots", Uint),
        Slot::read("beam_force", Scalar),
        Slot::read("beams", Scalar),
        Slot::read("bend_slots", Uint).when(bending),
        Slot::read("bends", Scalar).when(bending),
        Slot::read("bend_energy", Scalar).when(bending),
        Slot::read("bend_force", Scalar).when(bending),
        Slot::read("bend_rows", Scalar).when(bending),
    ]
}
/// Numbers per bend in its row sums: row sums of its three nodes while straight, N/mm; length of its first beam, mm.
pub const ROWS: usize = 4;

/// Factor on the fibre stiffness across the edge, for lines of strength β.
pub fn left(beta: f64) -> f64 {
    4.0 * beta / (4.0 * beta - 1.0).max(0.01)
}

/// Difference of T and T₀ below which they count as equal.
const AT_REST: f64 = 1e-3;

/// Constants shared with the twin.
const CONSTANTS: &[&[Constant]] =
    &[&beam2::CONSTANTS, &bend::CONSTANTS, &assemble::CONSTANTS, &constants![uint: ROWS; scalar: AT_REST]];

/// Stiffness of a bend relative to a straight one.
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

/// Row sums of the element stiffness at nodes.
struct RowSums<'a, R> {
    first_thread: usize,
    axial: R,
    slots: &'a [u32],
    bounds: &'a [R],
    constant: &'a [R],
    thread: &'a [u32],
    forces: &'a [R],
    beams: &'a [R],
    bends: Option<Bends<'a, R>>,
    weights: Option<Weights<'a, R>>,
}
/// Stiffness data of bends.
struct Bends<'a, R> {
    slots: &'a [u32],
    table: &'a [R],
    energy: &'a [R],
    force: &'a [R],
    rows: &'a [R],
}
/// Weights of the rows: R/m of nodes, and the nodes of beams and bends.
struct Weights<'a, R> {
    rates: &'a [R],
    ends: &'a [u32],
    pairs: &'a [u32],
}

impl<'a, R: Real> RowSums<'a, R> {
    #[inline(always)]
    fn new<const BENDING: bool>(io: &'a Io<R>, params: Params, weights: Option<Weights<'a, R>>) -> Self {
        Self {
            first_thread: params.first_thread as usize,
            axial: R::from_f64(f64::from(params.axial)),
            slots: io.uints(slot!(&rows(false), "solid_bounds")),
            bounds: io.scalars(slot!(&rows(false), "hex_bound")),
            constant: io.scalars(slot!(&rows(false), "constant")),
            thread: io.uints(slot!(&rows(false), "thread_slots")),
            forces: io.scalars(slot!(&rows(false), "beam_force")),
            beams: io.scalars(slot!(&rows(false), "beams")),
            bends: if BENDING { Some(Bends::new(io)) } else { None },
            weights,
        }
    }

    /// The row sum of a node, weighed if there are weights; the bounds of hexahedra are already weighed.
    #[inline(always)]
    fn of(&self, node: usize) -> R {
        let one = R::from_f64(1.0);
        // the nodes of short lines have equal weights
        let weight = if let Some(weights) = &self.weights { weights.rates[node] } else { one };
        let mut k = self.constant[node] * weight;
        if node < self.first_thread {
            for &slot in &self.slots[SOLID * node..][..SOLID] {
                if slot != NONE {
                    k = k + self.bounds[slot as usize];
                }
            }
            return k;
        }
        let item = node - self.first_thread;
        for &slot in &self.thread[THREAD * item..][..THREAD] {
            if slot == NONE {
                continue;
            }
            let slot = slot as usize;
            let both = if let Some(weights) = &self.weights {
                weights.rates[weights.end(slot, 0)] + weights.rates[weights.end(slot, 1)]
            } else {
                one + one
            };
            let [length, axial] = [self.beams[TABLE * slot + 3], self.axial * self.beams[TABLE * slot + 4]];
            k = k + both * (size(&self.forces[3 * slot..][..3]) + axial) / length;
        }
        if let Some(Bends { slots, table, energy, force, rows }) = &self.bends {
            let slots = &slots[BENT * item..][..BENT];
            for place in 0..BENT {
                if slots[place] == NONE {
                    continue;
                }
                let slot = slots[place] as usize;
                let rows = &rows[ROWS * slot..][..ROWS];
                let bend = [table[BEND * slot], table[BEND * slot + 1]];
                let force = size(&force[6 * slot..][..3]);
                let row = rows[place] * stiffening(bend, energy[slot], force, rows[3]);
                k = k + if let Some(weights) = &self.weights { row * weights.mean(slot, rows) } else { row };
            }
        }
        k
    }
}

/// Size of a force.
#[inline(always)]
fn size<R: Real>(force: &[R]) -> R {
    norm([force[0], force[1], force[2]])
}

impl<'a, R: Real> Bends<'a, R> {
    #[inline(always)]
    fn new(io: &'a Io<R>) -> Self {
        Self {
            slots: io.uints(slot!(&rows(true), "bend_slots")),
            table: io.scalars(slot!(&rows(true), "bends")),
            energy: io.scalars(slot!(&rows(true), "bend_energy")),
            force: io.scalars(slot!(&rows(true), "bend_force")),
            rows: io.scalars(slot!(&rows(true), "bend_rows")),
        }
    }
}

impl<R: Real> Weights<'_, R> {
    /// A node of a beam.
    #[inline(always)]
    fn end(&self, beam: usize, end: usize) -> usize {
        self.ends[2 * beam + end] as usize
    }

    /// Mean weight over the nodes of a bend, weighted by its row sums.
    #[inline(always)]
    fn mean(&self, bend: usize, rows: &[R]) -> R {
        let [first, second] = [self.pairs[2 * bend] as usize, self.pairs[2 * bend + 1] as usize];
        let (a, b, c) =
            (self.rates[self.end(first, 0)], self.rates[self.end(first, 1)], self.rates[self.end(second, 1)]);
        (rows[0] * a + rows[1] * b + rows[2] * c) / (rows[0] + rows[1] + rows[2])
    }
}

/// Assembles the row sums of the element stiffness, including bends: N/mm, and R/m, 1/s² (2 planes).
pub struct ElementLimit<const BENDING: bool, const MASS_ADDED: bool>;
/// Excludes fully prescribed nodes, which do not vibrate.
pub struct HeldLimit;
/// The weighted mean of R/m over each node and its neighbours, 1/s².
pub struct WeighedLimit<const BENDING: bool>;

impl<const BENDING: bool, const MASS_ADDED: bool> Kernel for ElementLimit<BENDING, MASS_ADDED> {
    const SHADER: Shader = Shader {
        defines: &[when(BENDING, "BENDING"), when(MASS_ADDED, "MASS_ADDED")],
        constants: CONSTANTS,
        ..Shader::new("dynamics/time_step", "element_limit")
    };
    const SLOTS: &'static [Slot] = &joined::<14>(
        &rows(BENDING),
        &[
            Slot::read("mass", Scalar),
            Slot::read("added_mass", Scalar).when(MASS_ADDED),
            // row sums, N/mm, and R/m, 1/s²
            Slot::planes("limit", Scalar, 2),
        ],
    );
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let params: Params = io.params();
        let least = L::Scalar::from_f64(f64::from(params.mass_per_stiffness));
        let rows = RowSums::new::<BENDING>(io, params, None);
        let masses = io.scalars(slot!(Self::SLOTS, "mass"));
        let added = if MASS_ADDED { io.scalars(slot!(Self::SLOTS, "added_mass", MASS_ADDED)) } else { &[] };
        let mut limits = io.own::<L::Scalar>(slot!(Self::SLOTS, "limit"));
        for node in items {
            let k = rows.of(node);
            *limits.at(0, node) = k;
            let mass = if MASS_ADDED { masses[node] + added[node] } else { masses[node] };
            *limits.at(1, node) = k / mass.max(k * least);
        }
    }
}

impl<const BENDING: bool> Kernel for WeighedLimit<BENDING> {
    const SHADER: Shader = Shader {
        defines: &[when(BENDING, "BENDING")],
        constants: CONSTANTS,
        ..Shader::new("dynamics/time_step", "weighed_limit")
    };
    const SLOTS: &'static [Slot] = &joined::<15>(
        &rows(BENDING),
        &[
            Slot::read("limit", Scalar),
            Slot::read("ends", Uint),
            Slot::read("pairs", Uint).when(BENDING),
            Slot::row("out", Scalar, 1),
        ],
    );
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let limits = io.scalars(slot!(Self::SLOTS, "limit"));
        let (sums, rates) = limits.split_at(limits.len() / 2);
        let pairs = if BENDING { io.uints(slot!(Self::SLOTS, "pairs", BENDING)) } else { &[] };
        let weights = Weights { rates, ends: io.uints(slot!(Self::SLOTS, "ends")), pairs };
        let rows = RowSums::new::<BENDING>(io, io.params(), Some(weights));
        let mut out = io.own::<L::Scalar>(slot!(Self::SLOTS, "out"));
        let zero = L::Scalar::from_f64(0.0);
        for node in items {
            // fully prescribed nodes are excluded
            *out.at(0, node) = if rates[node] > zero { rows.of(node) / sums[node] } else { zero };
        }
    }
}

impl Kernel for HeldLimit {
    const SHADER: Shader = Shader { constants: CONSTANTS, ..Shader::new("dynamics/time_step", "held_limit") };
    const SLOTS: &'static [Slot] = &[Slot::read("conditions", Uint), Slot::scatter("limit", Scalar)];
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let conditions = io.uints(slot!(Self::SLOTS, "conditions"));
        let mut limits = io.scatter::<L::Scalar>(slot!(Self::SLOTS, "limit"));
        let plane = limits.len() / 2;
        for item in items {
            if conditions[2 * item + 1] == 7 {
                limits.set(plane + conditions[2 * item] as usize, L::Scalar::from_f64(0.0));
            }
        }
    }
}

/// Largest stable time step, s, for R/m in 1/s².
pub fn limit<R: Real>(stiffness_over_mass: R) -> f64 {
    2.0 / libm::sqrt(stiffness_over_mass.to_f64().max(1e-300))
}
