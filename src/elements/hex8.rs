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
use crate::kernel::shader::{Shader, Share};
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
    /// Nodes in a plane of the position buffers.
    pub nodes: u32,
    /// Factor on the axial stiffness of fibres across their lines, see [`crate::dynamics::time_step::left`]; 0 without lines.
    pub left: f32,
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
/// Row sums of the stiffness that fibre lines do not cover, see [`crate::dynamics::time_step`].
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
        [[q[0], q[1], q[2]], [q[3], q[4], q[5]], [q[6], q[7], q[8]]]
    }

    #[inline(always)]
    fn material(&self, io: &Io<L::Scalar>) -> [L; PARAMETERS] {
        let row = &io.scalars(MATERIALS)[PARAMETERS * self.header.material as usize..][..PARAMETERS];
        let mut parameters = [L::splat(row[0]); PARAMETERS];
        for (parameter, value) in parameters.iter_mut().zip(row) {
            *parameter = L::splat(*value);
        }
        parameters
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
        let q = splat_tensor::<L>(frame);
        let mut local = global;
        for j in 0..3 {
            for a in 0..8 {
                local[j][a] = q[2][j].fma(global[2][a], q[1][j].fma(global[1][a], q[0][j] * global[0][a]));
            }
        }
        local
    }

    /// Displacement gradient at a Gauss point, without the macroscopic part.
    #[inline(always)]
    fn gradient(&self, point: usize, d: &Derivatives<L>) -> Tensor<L> {
        let at = others(point);
        let mut h = [[L::new(0.0); 3]; 3];
        for j in 0..3 {
            let inverse = [self.shape(point, j), self.shape(point, 3 + j), self.shape(point, 6 + j)];
            for i in 0..3 {
                h[i][j] = d[i][2][at[2]].fma(inverse[2], d[i][1][at[1]].fma(inverse[1], d[i][0][at[0]] * inverse[0]));
            }
        }
        h
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
    let mut all = [[near; 4]; 3];
    for k in 0..3 {
        let (low, step) = EDGES[k];
        let mut d = [near; 4];
        for (d, a) in d.iter_mut().zip(low) {
            *d = u[a + step] - u[a];
        }
        let first = [
            near.fma(d[0], far * d[1]),
            far.fma(d[0], near * d[1]),
            near.fma(d[2], far * d[3]),
            far.fma(d[2], near * d[3]),
        ];
        all[k] = [
            near.fma(first[0], far * first[2]),
            near.fma(first[1], far * first[3]),
            far.fma(first[0], near * first[2]),
            far.fma(first[1], near * first[3]),
        ];
    }
    all
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

/// The same tensor in every lane.
#[inline(always)]
fn splat_tensor<L: Lane>(a: &Tensor<L::Scalar>) -> Tensor<L> {
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

/// The twin of a kernel for a law, one lane an invocation.
const fn shader<M: Material>(kernel: &'static str) -> Shader {
    Shader { law: Some(M::SHADER), share: Share::Invocations(LANES), ..Shader::new("elements/hex8", kernel) }
}

/// Something to do at each Gauss point of one register of hexahedra.
trait Visitor<L: Lane> {
    fn point(&mut self, lanes: &Lanes<L>, point: usize, h: &Tensor<L>, volume: L);
}

/// Visits the Gauss points of one register of hexahedra with H, and with the volume of the point.
#[inline(always)]
fn visit<L: Lane>(io: &Io<L::Scalar>, lanes: &Lanes<L>, nodes: usize, visitor: &mut impl Visitor<L>) {
    let frame = lanes.frame(io);
    let u = lanes.displacements(io, &frame, nodes);
    let d = [derivatives(&u[0]), derivatives(&u[1]), derivatives(&u[2])];
    let macroscopic = splat_tensor::<L>(&turn(&frame, &io.row.gradient, false));
    for point in 0..8 {
        let mut h = lanes.gradient(point, &d);
        for i in 0..3 {
            for j in 0..3 {
                h[i][j] = h[i][j] + macroscopic[i][j];
            }
        }
        visitor.point(lanes, point, &h, lanes.shape(point, 9));
    }
}

/// Sums stress into forces conjugate to derivatives, and for periodic scenes into V P̄.
struct Stress<L: Lane, M, const PERIODIC: bool> {
    material: [L; PARAMETERS],
    forces: Derivatives<L>,
    sum: Tensor<L>,
    law: PhantomData<M>,
}

impl<L: Lane, M: Material, const PERIODIC: bool> Visitor<L> for Stress<L, M, PERIODIC> {
    #[inline(always)]
    fn point(&mut self, lanes: &Lanes<L>, point: usize, h: &Tensor<L>, volume: L) {
        let mut p = M::stress(&self.material, h);
        let at = others(point);
        for i in 0..3 {
            for j in 0..3 {
                p[i][j] = p[i][j] * volume;
                if PERIODIC {
                    self.sum[i][j] = self.sum[i][j] + p[i][j];
                }
            }
        }
        for k in 0..3 {
            let inverse = [lanes.shape(point, 3 * k), lanes.shape(point, 3 * k + 1), lanes.shape(point, 3 * k + 2)];
            for i in 0..3 {
                let g = p[i][2].fma(inverse[2], p[i][1].fma(inverse[1], p[i][0] * inverse[0]));
                self.forces[i][k][at[k]] = self.forces[i][k][at[k]] - g;
            }
        }
    }
}

/// Sums energies by mode and finds the smallest Jacobian.
struct Energies<L: Lane, M> {
    material: [L; PARAMETERS],
    sum: [L; 4],
    smallest: L,
    law: PhantomData<M>,
}

impl<L: Lane, M: Material> Visitor<L> for Energies<L, M> {
    #[inline(always)]
    fn point(&mut self, _: &Lanes<L>, _: usize, h: &Tensor<L>, volume: L) {
        for (sum, w) in self.sum.iter_mut().zip(M::energy(&self.material, h)) {
            *sum = w.fma(volume, *sum);
        }
        self.smallest = self.smallest.min(jacobian(h));
    }
}

/// Sums the bound of each corner's stiffness, modulus × |∂N_a| × Σ|∂N|: across the fibre, in longitudinal shear, of tension,
/// and of the fibre as far as lines do not cover it.
struct Bounds<L: Lane, M> {
    material: [L; PARAMETERS],
    rows: [L; 8],
    /// Displacement of the high against the low corner of the four edges along ξ, by component.
    edges: [[L; 4]; 3],
    macroscopic: Tensor<L>,
    /// See [`Params::left`].
    left: f32,
    law: PhantomData<M>,
}

impl<L: Lane, M: Material> Bounds<L, M> {
    /// Sizes of the derivatives along the fibre that lines do not cover. A line acts along its own edge, and a fibre at the
    /// Gauss point may have another direction, where the four edges have turned away from each other.
    #[inline(always)]
    fn uncovered(&self, lanes: &Lanes<L>, point: usize, h: &Tensor<L>, along: &[L; 8]) -> [L; 8] {
        let mut sizes = along.map(|slope| slope.abs());
        if self.left == 0.0 {
            return sizes;
        }
        let (one, half) = (L::new(1.0), L::new(0.5));
        let fibre = [one + h[0][0], h[1][0], h[2][0]];
        let row = |d: usize| [lanes.shape(point, 3 * d), lanes.shape(point, 3 * d + 1), lanes.shape(point, 3 * d + 2)];
        let (first, rest) = (row(0), cross(&row(1), &row(2)));
        let scale = one / dot(&first, &rest);
        let rest = [rest[0] * scale, rest[1] * scale, rest[2] * scale];
        for edge in 0..4 {
            let mut now = rest;
            for i in 0..3 {
                let m = &self.macroscopic[i];
                now[i] = rest[i] + m[2].fma(rest[2], m[1].fma(rest[1], m[0].fma(rest[0], self.edges[i][edge])));
            }
            let turned = cross(&now, &fibre);
            let sine = (dot(&turned, &turned) / (dot(&now, &now) * dot(&fibre, &fibre))).sqrt();
            let (low, high) = (along[2 * edge], along[2 * edge + 1]);
            let size = sine.fma((half * (high - low)).abs(), (half * (high + low)).abs());
            (sizes[2 * edge], sizes[2 * edge + 1]) = (size, size);
        }
        sizes
    }
}

#[inline(always)]
fn dot<L: Lane>(a: &[L; 3], b: &[L; 3]) -> L {
    a[2].fma(b[2], a[1].fma(b[1], a[0] * b[0]))
}

#[inline(always)]
fn cross<L: Lane>(a: &[L; 3], b: &[L; 3]) -> [L; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Sum of eight numbers, in order.
#[inline(always)]
fn total<L: Lane>(numbers: &[L; 8]) -> L {
    let mut sum = numbers[0];
    for number in &numbers[1..] {
        sum = sum + *number;
    }
    sum
}

impl<L: Lane, M: Material> Visitor<L> for Bounds<L, M> {
    #[inline(always)]
    fn point(&mut self, lanes: &Lanes<L>, point: usize, h: &Tensor<L>, volume: L) {
        let zero = L::new(0.0);
        let mut slopes = [[zero; 8]; 3];
        for a in 0..8 {
            let (mut n, mut sign) = ([L::new(FAR); 3], [L::new(-1.0); 3]);
            for k in 0..3 {
                if a >> k & 1 == point >> k & 1 {
                    n[k] = L::new(NEAR);
                }
                if a >> k & 1 == 1 {
                    sign[k] = L::new(1.0);
                }
            }
            let slope = [sign[0] * n[1] * n[2], sign[1] * n[0] * n[2], sign[2] * n[0] * n[1]];
            for (j, slopes) in slopes.iter_mut().enumerate() {
                slopes[a] = slope[2].fma(
                    lanes.shape(point, 6 + j),
                    slope[1].fma(lanes.shape(point, 3 + j), slope[0] * lanes.shape(point, j)),
                );
            }
        }
        let left = self.uncovered(lanes, point, h, &slopes[0]);
        let slopes = slopes.map(|slopes| slopes.map(|slope| slope.abs()));
        let mut across = slopes[1];
        for (across, other) in across.iter_mut().zip(&slopes[2]) {
            *across = other.fma(*other, *across * *across).sqrt();
        }
        let sums = [total(&slopes[0]), total(&slopes[1]), total(&slopes[2])];
        let (sum_across, sum_left) = (total(&across), total(&left));
        let m = M::moduli(&self.material, h);
        let fibres = m.along * L::new(if self.left == 0.0 { 1.0 } else { f64::from(self.left) });
        for a in 0..8 {
            let [along, second, third] = [slopes[0][a], slopes[1][a], slopes[2][a]];
            // motion of the corner across the fibre, and along it
            let sideways = (m.across * across[a])
                .fma(sum_across, along * (m.shear * (sums[0] + sum_across) + m.tension * sums[0]));
            let lengthways = m.shear * across[a].fma(sums[0], second.fma(sums[1], third * sums[2]));
            let row = (fibres * left[a]).fma(sum_left, sideways.max(lengthways));
            self.rows[a] = row.fma(volume, self.rows[a]);
        }
    }
}

impl<M: Material, const PERIODIC: bool> Kernel for Force<M, PERIODIC> {
    const SHADER: Shader = Shader { defines: if PERIODIC { &["PERIODIC"] } else { &[] }, ..shader::<M>("force") };

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let Params { nodes, .. } = io.params();
        let mut slots = io.own::<L::Scalar>(OUT);
        for item in items {
            for lane in (0..LANES).step_by(L::WIDTH) {
                let lanes = Lanes::<L>::new(io, item, lane);
                let zero = L::new(0.0);
                let mut stress = Stress::<L, M, PERIODIC> {
                    material: lanes.material(io),
                    forces: [[[zero; 4]; 3]; 3],
                    sum: [[zero; 3]; 3],
                    law: PhantomData,
                };
                visit(io, &lanes, nodes as usize, &mut stress);
                let q = splat_tensor::<L>(&lanes.frame(io));
                let f = &stress.forces;
                let local = [corner_forces(&f[0]), corner_forces(&f[1]), corner_forces(&f[2])];
                let out = slots.item(0, item);
                for (corner, &binary) in BINARY.iter().enumerate() {
                    for i in 0..3 {
                        let f =
                            q[i][2].fma(local[2][binary], q[i][1].fma(local[1][binary], q[i][0] * local[0][binary]));
                        f.store(&mut out[(3 * corner + i) * LANES + lane..]);
                    }
                }
                if PERIODIC {
                    let sum = turn(&q, &stress.sum, true);
                    let mut virials = io.own::<L::Scalar>(OUT_VIRIAL);
                    let out = virials.item(0, item);
                    for i in 0..3 {
                        for j in 0..3 {
                            let place = &mut out[(3 * i + j) * LANES + lane..];
                            (L::load(place) + sum[i][j]).store(place);
                        }
                    }
                }
            }
        }
    }
}

impl<M: Material> Kernel for Energy<M> {
    const SHADER: Shader = shader::<M>("energy");

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let Params { nodes, .. } = io.params();
        let mut out = io.own::<L::Scalar>(OUT);
        for item in items {
            for lane in (0..LANES).step_by(L::WIDTH) {
                let lanes = Lanes::<L>::new(io, item, lane);
                let mut energies = Energies::<L, M> {
                    material: lanes.material(io),
                    sum: [L::new(0.0); 4],
                    smallest: L::new(1e30),
                    law: PhantomData,
                };
                visit(io, &lanes, nodes as usize, &mut energies);
                let out = out.item(0, item);
                for (mode, sum) in energies.sum.iter().enumerate() {
                    sum.store(&mut out[mode * LANES + lane..]);
                }
                energies.smallest.store(&mut out[4 * LANES + lane..]);
            }
        }
    }
}

impl<M: Material> Kernel for Bound<M> {
    const SHADER: Shader = shader::<M>("bound");

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let Params { nodes, left } = io.params();
        let mut out = io.own::<L::Scalar>(OUT);
        for item in items {
            for lane in (0..LANES).step_by(L::WIDTH) {
                let lanes = Lanes::<L>::new(io, item, lane);
                let frame = lanes.frame(io);
                let u = lanes.displacements(io, &frame, nodes as usize);
                let mut bounds = Bounds::<L, M> {
                    material: lanes.material(io),
                    rows: [L::new(0.0); 8],
                    edges: u.map(|u| [u[1] - u[0], u[3] - u[2], u[5] - u[4], u[7] - u[6]]),
                    macroscopic: splat_tensor::<L>(&turn(&frame, &io.row.gradient, false)),
                    left,
                    law: PhantomData,
                };
                visit(io, &lanes, nodes as usize, &mut bounds);
                let out = out.item(0, item);
                for (corner, &binary) in BINARY.iter().enumerate() {
                    bounds.rows[binary].store(&mut out[corner * LANES + lane..]);
                }
            }
        }
    }
}
