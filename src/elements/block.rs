//! Common to all hexahedra: blocks of sixteen lanes, displacements of corners, the frame of the fibre, output slots.
//!
//! Hexahedra are stored in blocks of sixteen, lane by lane. Straight extruded yarns have few different reference shapes, so a
//! block refers to a *shape* (the reference data of its sixteen lanes) instead of storing its own. Displacements are relative
//! to the first corner. Corner order in registers is binary, `i + 2 j + 4 k` for (ξ, η, ζ).

use super::LANES;
use crate::kernel::buffer::Kind::{Int, Scalar, Uint};
use crate::kernel::interface::{Constant, Slot, constants, joined, slot};
use crate::kernel::io::{Io, Own};
use crate::kernel::lane::{Lane, Real};
use crate::kernel::math;
use crate::kernel::position::{self, difference};
use crate::kernel::shader::{Shader, Share, when};
use crate::materials::{self, Material, PARAMETERS, Tensor};
use bytemuck::{Pod, Zeroable};
use std::marker::PhantomData;
use std::ops::Range;

/// Corner slots per block: 8 corners × 3 components × lanes.
pub const SLOTS: usize = 24 * LANES;
/// Numbers per block of the virial stress sum Σ w P, N·mm.
pub const VIRIAL: usize = 9 * LANES;
/// Numbers per block of the energies by mode (4), mJ, and the smallest Jacobian (1).
pub const ENERGY: usize = 5 * LANES;
/// Numbers per block of the corner stiffness bounds, N/mm.
pub const BOUND: usize = 8 * LANES;

/// Binary corner index of each corner in mesh order.
pub const BINARY: [usize; 8] = [0, 1, 3, 2, 4, 5, 7, 6];

/// Constants of blocks shared with the twins.
pub const CONSTANTS: [Constant; 4] = constants![uint: SLOTS, VIRIAL, ENERGY, BOUND];

/// The constants of an element shared with its twin.
pub trait Element: 'static {
    const CONSTANTS: &'static [Constant];
}

/// The twin of an element kernel for a material law, one lane per invocation.
pub const fn shader<E: Element, M: Material, const PERIODIC: bool>(file: &'static str, kernel: &'static str) -> Shader {
    Shader {
        law: Some(M::SHADER),
        share: Share::Invocations(LANES),
        defines: const { &[when(PERIODIC, "PERIODIC")] },
        constants: const {
            &[
                &super::CONSTANTS,
                &position::CONSTANTS,
                &math::CONSTANTS,
                &materials::CONSTANTS,
                M::CONSTANTS,
                &CONSTANTS,
                E::CONSTANTS,
            ]
        },
        ..Shader::new(file, kernel)
    }
}

/// The twin of a bound kernel, weighed or not.
pub const fn weighed_shader<E: Element, M: Material, const PERIODIC: bool, const WEIGHED: bool>(
    file: &'static str,
    kernel: &'static str,
) -> Shader {
    Shader {
        defines: const { &[when(PERIODIC, "PERIODIC"), when(WEIGHED, "WEIGHED")] },
        ..shader::<E, M, PERIODIC>(file, kernel)
    }
}

/// Header of a block for the kernels.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable, PartialEq, Eq)]
pub struct Header {
    /// Row of the material table.
    pub material: u32,
    /// Row of the table of fibre frames.
    pub frame: u32,
    /// Index of the shape.
    pub shape: u32,
    /// 1 if the nodes of every corner are consecutive over the lanes.
    pub contiguous: u32,
}

/// Constants of the stages.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Params {
    /// Nodes in a plane of the position buffers.
    pub nodes: u32,
    /// Factor on the axial fibre stiffness across the fibre lines, see [`crate::dynamics::time_step::left`]; 0 without lines.
    pub left: f32,
}

/// Inputs of all hexahedron kernels; displacements are quanta and remainder.
const READS: [Slot; 7] = [
    Slot::read("headers", Uint),
    Slot::read("corners", Uint),
    Slot::read("quanta", Int),
    Slot::read("remainder", Scalar),
    Slot::read("shapes", Scalar),
    Slot::read("frames", Scalar),
    Slot::read("materials", Scalar),
];

/// The slots of forces; the virial stress sum exists only in periodic scenes.
pub const fn force_slots(periodic: bool) -> [Slot; 9] {
    joined(&READS, &[Slot::row("out", Scalar, SLOTS), Slot::row("out_virial", Scalar, VIRIAL).when(periodic)])
}

/// The slots of energies; hourglass energies exist only with reduced integration.
pub const fn energy_slots(reduced: bool) -> [Slot; 9] {
    joined(&READS, &[Slot::row("out", Scalar, ENERGY), Slot::row("out_hourglass", Scalar, LANES).when(reduced)])
}

/// The slots of bounds; weighed bounds read R/m of nodes in the second plane of the weights.
pub const fn bound_slots(weighed: bool) -> [Slot; 9] {
    joined(&READS, &[Slot::read("weights", Scalar).when(weighed), Slot::row("out", Scalar, BOUND)])
}

/// The bounds of some blocks, weighed by R/m of the nodes or not: both share their code.
pub struct Bounding<'a, R: Real, K> {
    pub io: &'a Io<'a, R>,
    pub items: Range<usize>,
    /// R/m of the nodes.
    pub limits: Option<&'a [R]>,
    pub out: Own<'a, R>,
    element: PhantomData<K>,
}

impl<'a, R: Real, K> Bounding<'a, R, K> {
    /// From the bindings of a kernel.
    #[inline(always)]
    pub fn new<const WEIGHED: bool>(io: &'a Io<'a, R>, items: Range<usize>) -> Self {
        let Params { nodes, .. } = io.params();
        let limits = if WEIGHED {
            Some(&io.scalars(slot!(&bound_slots(WEIGHED), "weights", WEIGHED))[nodes as usize..])
        } else {
            None
        };
        Self { io, items, limits, out: io.own(slot!(&bound_slots(WEIGHED), "out")), element: PhantomData }
    }
}

/// A block, and one register of its lanes.
pub struct Lanes<'a, L: Lane> {
    header: Header,
    corners: &'a [u32],
    shape: &'a [L::Scalar],
    lane: usize,
    life: PhantomData<L>,
}

impl<'a, L: Lane> Lanes<'a, L> {
    /// The lanes of a block from `lane` on; `size` is the length of a shape.
    #[inline(always)]
    pub fn new(io: &'a Io<L::Scalar>, size: usize, block: usize, lane: usize) -> Self {
        let header: Header =
            bytemuck::pod_read_unaligned(bytemuck::cast_slice(&io.uints(slot!(&READS, "headers"))[4 * block..][..4]));
        Self {
            header,
            corners: &io.uints(slot!(&READS, "corners"))[8 * LANES * block..][..8 * LANES],
            shape: &io.scalars(slot!(&READS, "shapes"))[size * header.shape as usize..][..size],
            lane,
            life: PhantomData,
        }
    }

    /// A number of the shape.
    #[inline(always)]
    pub fn shape(&self, entry: usize) -> L {
        L::load(&self.shape[entry * LANES + self.lane..])
    }

    /// The axes of the fibre's frame, one per column.
    #[inline(always)]
    pub fn frame(&self, io: &Io<L::Scalar>) -> Tensor<L> {
        splat_tensor(&self.scalar_frame(io))
    }

    #[inline(always)]
    fn scalar_frame(&self, io: &Io<L::Scalar>) -> Tensor<L::Scalar> {
        let q = &io.scalars(slot!(&READS, "frames"))[9 * self.header.frame as usize..][..9];
        [[q[0], q[1], q[2]], [q[3], q[4], q[5]], [q[6], q[7], q[8]]]
    }

    /// The macroscopic displacement gradient F̄ − I in the fibre's frame, in a periodic scene.
    #[inline(always)]
    pub fn macroscopic<const PERIODIC: bool>(&self, io: &Io<L::Scalar>) -> Option<Tensor<L>> {
        if PERIODIC { Some(splat_tensor(&turn(&self.scalar_frame(io), &io.row.gradient, false))) } else { None }
    }

    #[inline(always)]
    pub fn material(&self, io: &Io<L::Scalar>) -> [L; PARAMETERS] {
        let row = &io.scalars(slot!(&READS, "materials"))[PARAMETERS * self.header.material as usize..][..PARAMETERS];
        let mut parameters = [L::splat(row[0]); PARAMETERS];
        for (parameter, value) in parameters.iter_mut().zip(row) {
            *parameter = L::splat(*value);
        }
        parameters
    }

    /// Displacements of the corners relative to the first, by component and binary corner.
    #[inline(always)]
    pub fn displacements(&self, io: &Io<L::Scalar>, nodes: usize) -> [[L; 8]; 3] {
        let (quanta, remainder) = (io.ints(slot!(&READS, "quanta")), io.scalars(slot!(&READS, "remainder")));
        let zero = L::Scalar::from_f64(0.0);
        let mut global = [[L::splat(zero); 8]; 3];
        for (component, row) in global.iter_mut().enumerate() {
            let (quanta, remainder) = (&quanta[component * nodes..][..nodes], &remainder[component * nodes..][..nodes]);
            let mut first = ([0i32; LANES], [zero; LANES]);
            let mut buffer = [zero; LANES];
            for (corner, &binary) in BINARY.iter().enumerate() {
                let ids = &self.corners[corner * LANES + self.lane..][..L::WIDTH];
                if self.header.contiguous == 1 {
                    let start = ids[0] as usize;
                    let (q, r) = (&quanta[start..][..L::WIDTH], &remainder[start..][..L::WIDTH]);
                    if corner == 0 {
                        first.0[..L::WIDTH].copy_from_slice(q);
                        first.1[..L::WIDTH].copy_from_slice(r);
                        continue;
                    }
                    for l in 0..L::WIDTH {
                        buffer[l] = difference(q[l], r[l], first.0[l], first.1[l]);
                    }
                } else {
                    for (l, &id) in ids.iter().enumerate() {
                        let (q, r) = (quanta[id as usize], remainder[id as usize]);
                        if corner == 0 {
                            (first.0[l], first.1[l]) = (q, r);
                        }
                        buffer[l] = difference(q, r, first.0[l], first.1[l]);
                    }
                }
                row[binary] = L::load(&buffer);
            }
        }
        global
    }

    /// Weights of the stiffness rows at the binary corners: R/m of the nodes if it is given, else one.
    #[inline(always)]
    pub fn weights(&self, limits: Option<&[L::Scalar]>) -> [L; 8] {
        let mut weights = [L::new(1.0); 8];
        if let Some(limits) = limits {
            let mut buffer = [L::Scalar::from_f64(0.0); LANES];
            for (corner, &binary) in BINARY.iter().enumerate() {
                let ids = &self.corners[corner * LANES + self.lane..][..L::WIDTH];
                for (weight, id) in buffer.iter_mut().zip(ids) {
                    *weight = limits[*id as usize];
                }
                weights[binary] = L::load(&buffer);
            }
        }
        weights
    }

    /// Writes a force component of a corner (in mesh order).
    #[inline(always)]
    pub fn store_force(&self, slots: &mut [L::Scalar], corner: usize, component: usize, force: L) {
        force.store(&mut slots[(3 * corner + component) * LANES + self.lane..]);
    }

    /// Writes the stiffness row sums of the binary corners of a block.
    #[inline(always)]
    pub fn store_rows(&self, out: &mut [L::Scalar], rows: &[L; 8]) {
        for (corner, &binary) in BINARY.iter().enumerate() {
            rows[binary].store(&mut out[corner * LANES + self.lane..]);
        }
    }

    /// Adds V P, in the fibre's frame, to the virial stress sum of a block.
    #[inline(always)]
    pub fn add_virial(&self, io: &Io<L::Scalar>, block: usize, q: &Tensor<L>, stress: &Tensor<L>) {
        let sum = turn(q, stress, true);
        let mut virials = io.own::<L::Scalar>(slot!(&force_slots(true), "out_virial"));
        let out = virials.item(0, block);
        for i in 0..3 {
            for j in 0..3 {
                let place = &mut out[(3 * i + j) * LANES + self.lane..];
                (L::load(place) + sum[i][j]).store(place);
            }
        }
    }
}

/// The same tensor in every lane.
#[inline(always)]
pub fn splat_tensor<L: Lane>(a: &Tensor<L::Scalar>) -> Tensor<L> {
    let mut splat = [[L::splat(a[0][0]); 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            splat[i][j] = L::splat(a[i][j]);
        }
    }
    splat
}

/// Qᵀ A Q, or Q A Qᵀ if `out`.
#[inline(always)]
fn turn<L: Lane>(q: &Tensor<L>, a: &Tensor<L>, out: bool) -> Tensor<L> {
    let zero = L::new(0.0);
    let (mut half, mut full) = ([[zero; 3]; 3], [[zero; 3]; 3]);
    for i in 0..3 {
        for j in 0..3 {
            for k in 0..3 {
                half[i][j] = a[i][k].fma(if out { q[j][k] } else { q[k][j] }, half[i][j]);
            }
        }
    }
    for i in 0..3 {
        for j in 0..3 {
            for k in 0..3 {
                full[i][j] = half[k][j].fma(if out { q[i][k] } else { q[k][i] }, full[i][j]);
            }
        }
    }
    full
}

#[inline(always)]
pub fn dot<L: Lane>(a: &[L; 3], b: &[L; 3]) -> L {
    a[2].fma(b[2], a[1].fma(b[1], a[0] * b[0]))
}

#[inline(always)]
pub fn cross<L: Lane>(a: &[L; 3], b: &[L; 3]) -> [L; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Weighted sum of eight numbers, in order.
#[inline(always)]
pub fn total<L: Lane>(numbers: &[L; 8], weights: &[L; 8]) -> L {
    let mut sum = numbers[0] * weights[0];
    for k in 1..8 {
        sum = numbers[k].fma(weights[k], sum);
    }
    sum
}
