//! Fully integrated 8-node hexahedron, total Lagrangian, 2 × 2 × 2 Gauss points.
//!
//! Hexahedra are stored in blocks of sixteen, lane by lane; straight extruded yarns share few reference shapes, so a block
//! names a *shape* (inverse Jacobians and volumes of its sixteen lanes) instead of keeping one. The derivatives of the
//! trilinear shape functions are products of one-dimensional factors: they are taken direction by direction (sum
//! factorisation), which costs a third of the textbook sum over corners.
//!
//! Displacements enter as differences to the first corner, turned into the fibre's frame; a macroscopic gradient F̄ − I is
//! added to H. Corner order in registers is binary, `i + 2 j + 4 k` for (ξ, η, ζ).

use crate::kernel::lane::{Lane, Real};
use crate::kernel::position::difference;
use crate::kernel::stage::{Io, Kernel};
use crate::materials::{Material, PARAMETERS, Tensor, jacobian};
use bytemuck::{Pod, Zeroable};
use std::marker::PhantomData;
use std::ops::Range;

/// Hexahedra in a block.
pub const LANES: usize = 16;
/// Numbers of a shape: at each Gauss point, 9 of the inverse Jacobian (halved) and the volume; times lanes.
pub const SHAPE: usize = 8 * 10 * LANES;
/// Corner slots of a block: 8 corners × 3 components × lanes.
pub const SLOTS: usize = 24 * LANES;
/// Numbers of a block's stress sum Σ w P, N·mm.
pub const VIRIAL: usize = 9 * LANES;
/// Numbers of a block's energies by mode (4), mJ, and smallest Jacobian (1).
pub const ENERGY: usize = 5 * LANES;
/// Numbers of a block's corner stiffness bounds, N/mm.
pub const BOUND: usize = 8 * LANES;

/// Binary corner index of each corner in mesh order.
pub const BINARY: [usize; 8] = [0, 1, 3, 2, 4, 5, 7, 6];

/// What the kernels need to know of a block.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable, PartialEq, Eq)]
pub struct Header {
    /// Row of the material table.
    pub material: u32,
    /// Row of the table of fibre frames.
    pub frame: u32,
    /// Shape.
    pub shape: u32,
    /// 1 if every corner's nodes are consecutive over the lanes.
    pub contiguous: u32,
}

/// Constants of the stages.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Params {
    /// First block of the stage's law.
    pub first: u32,
    /// Nodes in a plane of the position buffers.
    pub nodes: u32,
}

/// Reads, in binding order.
pub const HEADERS: usize = 0;
pub const CORNERS: usize = 1;
pub const QUANTA: usize = 2;
pub const REMAINDER: usize = 3;
pub const SHAPES: usize = 4;
pub const FRAMES: usize = 5;
pub const MATERIALS: usize = 6;
/// The first write.
const OUT: usize = 7;
/// The stress sum, for periodic scenes.
const OUT_VIRIAL: usize = 8;

/// One-dimensional shape function at its own and at the opposite Gauss point.
const NEAR: f64 = 0.788_675_134_594_812_9;
const FAR: f64 = 0.211_324_865_405_187_13;

/// Derivatives of three components with respect to (ξ, η, ζ), each at the four points of the other two directions.
type Derivatives<L> = [[[L; 4]; 3]; 3];

/// Nodal forces of hexahedra; with `PERIODIC`, also the sum of stress for the homogenised first Piola stress.
pub struct Force<M, const PERIODIC: bool>(PhantomData<M>);
/// Energies by mode and smallest Jacobian.
pub struct Energy<M>(PhantomData<M>);
/// Row sums of the stiffness that fibre lines do not cover.
pub struct Bound<M>(PhantomData<M>);

/// A block and one register of its lanes.
struct Lanes<'a, L: Lane> {
    header: Header,
    corners: &'a [u32],
    shape: &'a [L::Scalar],
    lane: usize,
    life: PhantomData<L>,
}

impl<'a, L: Lane> Lanes<'a, L> {
    #[inline(always)]
    fn new(io: &'a Io<L::Scalar>, block: usize, lane: usize) -> Self {
        let header: Header = bytemuck::pod_read_unaligned(bytemuck::cast_slice(&io.uints(HEADERS)[4 * block..][..4]));
        Self {
            header,
            corners: &io.uints(CORNERS)[8 * LANES * block..][..8 * LANES],
            shape: &io.scalars(SHAPES)[SHAPE * header.shape as usize..][..SHAPE],
            lane,
            life: PhantomData,
        }
    }

    #[inline(always)]
    fn shape(&self, point: usize, entry: usize) -> L {
        L::load(&self.shape[(10 * point + entry) * LANES + self.lane..])
    }

    #[inline(always)]
    fn frame(&self, io: &Io<L::Scalar>) -> Tensor<L::Scalar> {
        let q = &io.scalars(FRAMES)[9 * self.header.frame as usize..][..9];
        std::array::from_fn(|i| std::array::from_fn(|j| q[3 * i + j]))
    }

    #[inline(always)]
    fn material(&self, io: &Io<L::Scalar>) -> [L; PARAMETERS] {
        let row = &io.scalars(MATERIALS)[PARAMETERS * self.header.material as usize..][..PARAMETERS];
        std::array::from_fn(|k| L::splat(row[k]))
    }

    /// Displacements of the corners relative to the first, in the fibre's frame, by component and binary corner.
    #[inline(always)]
    fn displacements(&self, io: &Io<L::Scalar>, frame: &Tensor<L::Scalar>, nodes: usize) -> [[L; 8]; 3] {
        let (quanta, remainder) = (io.ints(QUANTA), io.scalars(REMAINDER));
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
        let q: Tensor<L> = std::array::from_fn(|i| std::array::from_fn(|j| L::splat(frame[i][j])));
        std::array::from_fn(|j| {
            std::array::from_fn(|a| q[2][j].fma(global[2][a], q[1][j].fma(global[1][a], q[0][j] * global[0][a])))
        })
    }

    /// Displacement gradient at a Gauss point, without the macroscopic part.
    #[inline(always)]
    fn gradient(&self, point: usize, d: &Derivatives<L>) -> Tensor<L> {
        let at = others(point);
        let inverse: Tensor<L> = std::array::from_fn(|k| std::array::from_fn(|j| self.shape(point, 3 * k + j)));
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                d[i][2][at[2]].fma(inverse[2][j], d[i][1][at[1]].fma(inverse[1][j], d[i][0][at[0]] * inverse[0][j]))
            })
        })
    }
}

/// For each direction, which of the four points of the other two directions a Gauss point is.
#[inline(always)]
fn others(point: usize) -> [usize; 3] {
    let (i, j, k) = (point & 1, point >> 1 & 1, point >> 2);
    [j + 2 * k, i + 2 * k, i + 2 * j]
}

/// For each direction, the binary corner at its low end for the four corners of the other two directions, and the step to the high end.
const EDGES: [([usize; 4], usize); 3] = [([0, 2, 4, 6], 1), ([0, 1, 4, 5], 2), ([0, 1, 2, 3], 4)];

/// Differences of corner values along each direction (twice the derivative), interpolated to the Gauss points of the others.
#[inline(always)]
fn derivatives<L: Lane>(u: &[L; 8]) -> [[L; 4]; 3] {
    let (near, far) = (L::new(NEAR), L::new(FAR));
    EDGES.map(|(low, step)| {
        let d = low.map(|a| u[a + step] - u[a]);
        let first = [
            near.fma(d[0], far * d[1]),
            far.fma(d[0], near * d[1]),
            near.fma(d[2], far * d[3]),
            far.fma(d[2], near * d[3]),
        ];
        [
            near.fma(first[0], far * first[2]),
            near.fma(first[1], far * first[3]),
            far.fma(first[0], near * first[2]),
            far.fma(first[1], near * first[3]),
        ]
    })
}

/// The transpose of [`derivatives`]: forces on the corners.
#[inline(always)]
fn corner_forces<L: Lane>(g: &[[L; 4]; 3]) -> [L; 8] {
    let (near, far) = (L::new(NEAR), L::new(FAR));
    let mut f = [L::new(0.0); 8];
    for (g, (low, step)) in g.iter().zip(EDGES) {
        let first = [
            near.fma(g[0], far * g[2]),
            near.fma(g[1], far * g[3]),
            far.fma(g[0], near * g[2]),
            far.fma(g[1], near * g[3]),
        ];
        let d = [
            near.fma(first[0], far * first[1]),
            far.fma(first[0], near * first[1]),
            near.fma(first[2], far * first[3]),
            far.fma(first[2], near * first[3]),
        ];
        for (a, d) in low.into_iter().zip(d) {
            f[a + step] = f[a + step] + d;
            f[a] = f[a] - d;
        }
    }
    f
}

/// Qᵀ A Q.
#[inline(always)]
fn into_frame<R: Real>(q: &Tensor<R>, a: &Tensor<R>) -> Tensor<R> {
    let aq: Tensor<R> =
        std::array::from_fn(|i| std::array::from_fn(|j| a[i][0] * q[0][j] + a[i][1] * q[1][j] + a[i][2] * q[2][j]));
    std::array::from_fn(|i| std::array::from_fn(|j| q[0][i] * aq[0][j] + q[1][i] * aq[1][j] + q[2][i] * aq[2][j]))
}

/// Visits the Gauss points of one register of hexahedra with H, and with the volume of the point.
#[inline(always)]
fn visit<L: Lane>(io: &Io<L::Scalar>, lanes: &Lanes<L>, nodes: usize, mut each: impl FnMut(usize, &Tensor<L>, L)) {
    let frame = lanes.frame(io);
    let u = lanes.displacements(io, &frame, nodes);
    let d: Derivatives<L> = std::array::from_fn(|i| derivatives(&u[i]));
    let macroscopic = into_frame(&frame, &io.row.gradient);
    for point in 0..8 {
        let mut h = lanes.gradient(point, &d);
        for i in 0..3 {
            for j in 0..3 {
                h[i][j] = h[i][j] + L::splat(macroscopic[i][j]);
            }
        }
        each(point, &h, lanes.shape(point, 9));
    }
}

impl<M: Material, const PERIODIC: bool> Kernel for Force<M, PERIODIC> {
    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let Params { first, nodes } = io.params();
        let mut slots = io.own::<L::Scalar>(OUT);
        let mut virials = PERIODIC.then(|| io.own::<L::Scalar>(OUT_VIRIAL));
        for item in items {
            for lane in (0..LANES).step_by(L::WIDTH) {
                let lanes = Lanes::<L>::new(io, item + first as usize, lane);
                let material = lanes.material(io);
                let mut forces: Derivatives<L> = [[[L::new(0.0); 4]; 3]; 3];
                let mut sum: Tensor<L> = [[L::new(0.0); 3]; 3];
                visit(io, &lanes, nodes as usize, |point, h, volume| {
                    let p = M::stress(&material, h);
                    let at = others(point);
                    for i in 0..3 {
                        let p = p[i].map(|p| p * volume);
                        for k in 0..3 {
                            let inverse = [0, 1, 2].map(|j| lanes.shape(point, 3 * k + j));
                            let g = p[2].fma(inverse[2], p[1].fma(inverse[1], p[0] * inverse[0]));
                            forces[i][k][at[k]] = forces[i][k][at[k]] - g;
                        }
                        if PERIODIC {
                            for j in 0..3 {
                                sum[i][j] = sum[i][j] + p[j];
                            }
                        }
                    }
                });
                let q: Tensor<L> = lanes.frame(io).map(|row| row.map(L::splat));
                let local: [[L; 8]; 3] = std::array::from_fn(|i| corner_forces(&forces[i]));
                let out = slots.item(0, item);
                for (corner, &binary) in BINARY.iter().enumerate() {
                    for i in 0..3 {
                        let f =
                            q[i][2].fma(local[2][binary], q[i][1].fma(local[1][binary], q[i][0] * local[0][binary]));
                        f.store(&mut out[(3 * corner + i) * LANES + lane..]);
                    }
                }
                if let Some(virials) = &mut virials {
                    let out = virials.item(0, item);
                    let half: Tensor<L> = std::array::from_fn(|i| {
                        std::array::from_fn(|j| q[j][2].fma(sum[i][2], q[j][1].fma(sum[i][1], q[j][0] * sum[i][0])))
                    });
                    for i in 0..3 {
                        for j in 0..3 {
                            let v = q[i][2].fma(half[2][j], q[i][1].fma(half[1][j], q[i][0] * half[0][j]));
                            let place = &mut out[(3 * i + j) * LANES + lane..];
                            (L::load(place) + v).store(place);
                        }
                    }
                }
            }
        }
    }
}

impl<M: Material> Kernel for Energy<M> {
    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let Params { first, nodes } = io.params();
        let mut energies = io.own::<L::Scalar>(OUT);
        for item in items {
            for lane in (0..LANES).step_by(L::WIDTH) {
                let lanes = Lanes::<L>::new(io, item + first as usize, lane);
                let material = lanes.material(io);
                let mut sum = [L::new(0.0); 4];
                let mut smallest = L::new(1e30);
                visit(io, &lanes, nodes as usize, |_, h, volume| {
                    for (sum, w) in sum.iter_mut().zip(M::energy(&material, h)) {
                        *sum = w.fma(volume, *sum);
                    }
                    smallest = smallest.min(jacobian(h));
                });
                let out = energies.item(0, item);
                for (mode, sum) in sum.into_iter().chain([smallest]).enumerate() {
                    sum.store(&mut out[mode * LANES + lane..]);
                }
            }
        }
    }
}

impl<M: Material> Kernel for Bound<M> {
    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let Params { first, nodes } = io.params();
        let mut bounds = io.own::<L::Scalar>(OUT);
        for item in items {
            for lane in (0..LANES).step_by(L::WIDTH) {
                let lanes = Lanes::<L>::new(io, item + first as usize, lane);
                let material = lanes.material(io);
                let mut rows = [L::new(0.0); 8];
                visit(io, &lanes, nodes as usize, |point, h, volume| {
                    // size of each corner's shape gradient across the fibre
                    let mut sizes = [L::new(0.0); 8];
                    let mut total = L::new(0.0);
                    for (a, size) in sizes.iter_mut().enumerate() {
                        let n = |direction: usize| {
                            if a >> direction & 1 == point >> direction & 1 { L::new(NEAR) } else { L::new(FAR) }
                        };
                        let sign = |direction: usize| if a >> direction & 1 == 1 { L::new(1.0) } else { L::new(-1.0) };
                        let slope = [sign(0) * n(1) * n(2), sign(1) * n(0) * n(2), sign(2) * n(0) * n(1)];
                        let across = |j: usize| {
                            slope[2].fma(
                                lanes.shape(point, 6 + j),
                                slope[1].fma(lanes.shape(point, 3 + j), slope[0] * lanes.shape(point, j)),
                            )
                        };
                        let (y, z) = (across(1), across(2));
                        *size = y.fma(y, z * z).sqrt();
                        total = total + *size;
                    }
                    let k = M::stiffness(&material, h) * volume * total;
                    for (row, size) in rows.iter_mut().zip(sizes) {
                        *row = k.fma(size, *row);
                    }
                });
                let out = bounds.item(0, item);
                for (corner, &binary) in BINARY.iter().enumerate() {
                    rows[binary].store(&mut out[corner * LANES + lane..]);
                }
            }
        }
    }
}
