//! Fully integrated 8-node hexahedron, total Lagrangian, 2 × 2 × 2 Gauss points.
//!
//! The derivatives of the trilinear shape functions are products of one-dimensional factors. They are evaluated direction by
//! direction (sum factorisation), at a third of the cost of the textbook sum over corners. Displacements are rotated into the
//! fibre's frame first; in periodic scenes the macroscopic displacement gradient F̄ − I is added to H.

use super::LANES;
use super::block::{
    BINARY, Bounding, Element, Lanes, Params, bound_slots, cross, dot, energy_slots, force_slots, shader, total,
    weighed_shader,
};
use crate::kernel::interface::{Constant, Slot, constants, slot};
use crate::kernel::io::Io;
use crate::kernel::lane::{Lane, Real, Work};
use crate::kernel::shader::Shader;
use crate::kernel::stage::Kernel;
use crate::kernel::two::Two;
use crate::materials::{Material, PARAMETERS, Tensor, jacobian};
use std::marker::PhantomData;
use std::ops::Range;

/// Numbers per shape: at each Gauss point, 9 of the inverse Jacobian (halved) and the volume; times lanes.
pub const SHAPE: usize = 8 * POINT * LANES;
/// Numbers per Gauss point in a shape, and the index of the volume.
pub const POINT: usize = 10;
const VOLUME: usize = 9;

/// One-dimensional shape function at the near and at the far Gauss point.
const NEAR: f64 = 0.788_675_134_594_812_9;
const FAR: f64 = 0.211_324_865_405_187_13;

/// Derivatives of three components with respect to (ξ, η, ζ), each at the four points of the other two directions.
type Derivatives<L> = [[[L; 4]; 3]; 3];

/// The element.
pub struct Hex8;

impl Element for Hex8 {
    const CONSTANTS: &'static [Constant] = &constants![uint: SHAPE; scalar: NEAR, FAR];
}

/// Nodal forces of hexahedra; with `PERIODIC`, also the virial stress sum for the homogenised first Piola–Kirchhoff stress.
pub struct Force<M, const PERIODIC: bool>(PhantomData<M>);
/// Energies by mode, and the smallest Jacobian.
pub struct Energy<M, const PERIODIC: bool>(PhantomData<M>);
/// Row sums of the stiffness matrix that fibre lines do not cover, with `WEIGHED` weighted by R/m of the nodes: see
/// [`crate::dynamics::time_step`].
pub struct Bound<M, const PERIODIC: bool, const WEIGHED: bool>(PhantomData<M>);

/// Displacements of the corners relative to the first, in the fibre's frame, by component and binary corner.
#[inline(always)]
fn local_displacements<L: Lane>(io: &Io<L::Scalar>, lanes: &Lanes<L>, nodes: usize) -> [[L; 8]; 3] {
    let q = lanes.frame(io);
    let global = lanes.displacements(io, nodes);
    let mut local = global;
    for j in 0..3 {
        for a in 0..8 {
            local[j][a] = q[2][j].fma(global[2][a], q[1][j].fma(global[1][a], q[0][j] * global[0][a]));
        }
    }
    local
}

/// Row k of the inverse Jacobian at a Gauss point, halved.
#[inline(always)]
fn inverse<L: Lane>(lanes: &Lanes<L>, point: usize, k: usize) -> [L; 3] {
    let first = POINT * point + 3 * k;
    [lanes.shape(first), lanes.shape(first + 1), lanes.shape(first + 2)]
}

/// Displacement gradient at a Gauss point, without the macroscopic part.
#[inline(always)]
fn gradient<L: Lane>(lanes: &Lanes<L>, point: usize, d: &Derivatives<L>) -> Tensor<L> {
    let at = others(point);
    let (a, b, c) = (inverse(lanes, point, 0), inverse(lanes, point, 1), inverse(lanes, point, 2));
    let mut h = [[L::new(0.0); 3]; 3];
    for j in 0..3 {
        for i in 0..3 {
            h[i][j] = d[i][2][at[2]].fma(c[j], d[i][1][at[1]].fma(b[j], d[i][0][at[0]] * a[j]));
        }
    }
    h
}

/// Index of a Gauss point among the four points of the other two directions, for each direction.
#[inline(always)]
fn others(point: usize) -> [usize; 3] {
    let (i, j, k) = (point & 1, point >> 1 & 1, point >> 2);
    [j + 2 * k, i + 2 * k, i + 2 * j]
}

/// For each direction: the low binary corner of each of its four edges, and the step to the high end.
const EDGES: [([usize; 4], usize); 3] = [([0, 2, 4, 6], 1), ([0, 1, 4, 5], 2), ([0, 1, 2, 3], 4)];

/// Differences of corner values along each direction (twice the derivative), interpolated to the Gauss points of the others.
#[inline(always)]
fn derivatives<L: Lane>(u: &[L; 8]) -> [[L; 4]; 3] {
    let (near, far) = (L::new(NEAR), L::new(FAR));
    let mut all = [[near; 4]; 3];
    for k in 0..3 {
        let (low, step) = EDGES[k];
        let mut d = [near; 4];
        for edge in 0..4 {
            d[edge] = u[low[edge] + step] - u[low[edge]];
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
    for k in 0..3 {
        let (g, (low, step)) = (&g[k], EDGES[k]);
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
        for edge in 0..4 {
            let a = low[edge];
            f[a + step] = f[a + step] + d[edge];
            f[a] = f[a] - d[edge];
        }
    }
    f
}

/// An operation at each Gauss point of one register of hexahedra, which is given two points at a time.
trait Visitor<L: Lane> {
    fn points(&mut self, lanes: &Lanes<L>, points: [usize; 2], h: &Tensor<Two<L>>, volume: Two<L>);
}

/// The same numbers at both points.
#[inline(always)]
fn both<L: Lane, const N: usize>(numbers: &[L; N]) -> [Two<L>; N] {
    let mut pairs = [Two(numbers[0], numbers[0]); N];
    for i in 0..N {
        pairs[i] = Two(numbers[i], numbers[i]);
    }
    pairs
}

/// A tensor at each of two points.
#[inline(always)]
fn apart<L: Lane>(a: &Tensor<Two<L>>) -> [Tensor<L>; 2] {
    let mut tensors = [[[a[0][0].0; 3]; 3]; 2];
    for i in 0..3 {
        for j in 0..3 {
            (tensors[0][i][j], tensors[1][i][j]) = (a[i][j].0, a[i][j].1);
        }
    }
    tensors
}

/// Visits the Gauss points of one register of hexahedra, with H and the volume of the point.
#[inline(always)]
fn visit<L: Lane, const PERIODIC: bool>(
    io: &Io<L::Scalar>,
    lanes: &Lanes<L>,
    nodes: usize,
    visitor: &mut impl Visitor<L>,
) {
    let u = local_displacements(io, lanes, nodes);
    let d = [derivatives(&u[0]), derivatives(&u[1]), derivatives(&u[2])];
    let macroscopic = lanes.macroscopic::<PERIODIC>(io);
    for point in (0..8).step_by(2) {
        let (first, second) = (gradient(lanes, point, &d), gradient(lanes, point + 1, &d));
        let mut h = [[Two(first[0][0], second[0][0]); 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                h[i][j] = Two(first[i][j], second[i][j]);
                if let Some(macroscopic) = &macroscopic {
                    h[i][j] = h[i][j] + Two(macroscopic[i][j], macroscopic[i][j]);
                }
            }
        }
        let volume = |point: usize| lanes.shape(POINT * point + VOLUME);
        visitor.points(lanes, [point, point + 1], &h, Two(volume(point), volume(point + 1)));
    }
}

/// Sums stress into forces conjugate to the derivatives, and for periodic scenes into V P̄.
struct Stress<L: Lane, M, const PERIODIC: bool> {
    material: [L; PARAMETERS],
    forces: Derivatives<L>,
    sum: Tensor<L>,
    law: PhantomData<M>,
}

impl<L: Lane, M: Material, const PERIODIC: bool> Visitor<L> for Stress<L, M, PERIODIC> {
    #[inline(always)]
    fn points(&mut self, lanes: &Lanes<L>, points: [usize; 2], h: &Tensor<Two<L>>, volume: Two<L>) {
        let mut p = M::stress(&both(&self.material), h);
        for i in 0..3 {
            for j in 0..3 {
                p[i][j] = p[i][j] * volume;
                if PERIODIC {
                    self.sum[i][j] = self.sum[i][j] + p[i][j].0 + p[i][j].1;
                }
            }
        }
        let p = apart(&p);
        for point in 0..2 {
            let (p, at) = (&p[point], others(points[point]));
            for k in 0..3 {
                let inverse = inverse(lanes, points[point], k);
                for i in 0..3 {
                    let g = p[i][2].fma(inverse[2], p[i][1].fma(inverse[1], p[i][0] * inverse[0]));
                    self.forces[i][k][at[k]] = self.forces[i][k][at[k]] - g;
                }
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
    fn points(&mut self, _: &Lanes<L>, _: [usize; 2], h: &Tensor<Two<L>>, volume: Two<L>) {
        let energy = M::energy(&both(&self.material), h);
        for mode in 0..4 {
            self.sum[mode] = energy[mode].1.fma(volume.1, energy[mode].0.fma(volume.0, self.sum[mode]));
        }
        let j = jacobian(h);
        self.smallest = self.smallest.min(j.0).min(j.1);
    }
}

/// Differences along the four edges along ξ.
#[inline(always)]
fn edges<L: Lane>(u: &[L; 8]) -> [L; 4] {
    [u[1] - u[0], u[3] - u[2], u[5] - u[4], u[7] - u[6]]
}

/// Sums the stiffness bound of each corner, modulus × |∂N_a| × Σ|∂N|, from the section, longitudinal shear, tension, and the
/// part of the fibre stiffness that fibre lines do not cover.
struct Bounds<L: Lane, M> {
    material: [L; PARAMETERS],
    rows: [L; 8],
    weights: [L; 8],
    /// Displacement of the high corner relative to the low corner of the four edges along ξ, by component.
    edges: [[L; 4]; 3],
    macroscopic: Option<Tensor<L>>,
    /// See [`super::block::Params::left`].
    left: f32,
    law: PhantomData<M>,
}

impl<L: Lane, M: Material> Bounds<L, M> {
    /// Magnitudes of the derivatives along the fibre that lines do not cover. A line acts along its own edge, and the fibre at
    /// the Gauss point may have another direction if the four edges have turned away from each other.
    #[inline(always)]
    fn uncovered(&self, lanes: &Lanes<L>, point: usize, h: &Tensor<L>, along: &[L; 8]) -> [L; 8] {
        let mut sizes = *along;
        for size in &mut sizes {
            *size = size.abs();
        }
        if self.left == 0.0 {
            return sizes;
        }
        let (one, half) = (L::new(1.0), L::new(0.5));
        let fibre = [one + h[0][0], h[1][0], h[2][0]];
        let (first, rest) = (inverse(lanes, point, 0), cross(&inverse(lanes, point, 1), &inverse(lanes, point, 2)));
        let scale = one / dot(&first, &rest);
        let rest = [rest[0] * scale, rest[1] * scale, rest[2] * scale];
        for edge in 0..4 {
            let mut now = rest;
            for i in 0..3 {
                let mut change = self.edges[i][edge];
                if let Some(macroscopic) = &self.macroscopic {
                    let m = &macroscopic[i];
                    change = m[2].fma(rest[2], m[1].fma(rest[1], m[0].fma(rest[0], change)));
                }
                now[i] = rest[i] + change;
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

impl<L: Lane, M: Material> Visitor<L> for Bounds<L, M> {
    #[inline(always)]
    fn points(&mut self, lanes: &Lanes<L>, points: [usize; 2], h: &Tensor<Two<L>>, volume: Two<L>) {
        let h = apart(h);
        self.point(lanes, points[0], &h[0], volume.0);
        self.point(lanes, points[1], &h[1], volume.1);
    }
}

impl<L: Lane, M: Material> Bounds<L, M> {
    #[inline(always)]
    fn point(&mut self, lanes: &Lanes<L>, point: usize, h: &Tensor<L>, volume: L) {
        let inverse = [inverse(lanes, point, 0), inverse(lanes, point, 1), inverse(lanes, point, 2)];
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
                slopes[a] = slope[2].fma(inverse[2][j], slope[1].fma(inverse[1][j], slope[0] * inverse[0][j]));
            }
        }
        let left = self.uncovered(lanes, point, h, &slopes[0]);
        for slopes in &mut slopes {
            for slope in slopes {
                *slope = slope.abs();
            }
        }
        let mut across = slopes[1];
        for a in 0..8 {
            across[a] = slopes[2][a].fma(slopes[2][a], slopes[1][a] * slopes[1][a]).sqrt();
        }
        let w = &self.weights;
        let sums = [total(&slopes[0], w), total(&slopes[1], w), total(&slopes[2], w)];
        let (sum_across, sum_left) = (total(&across, w), total(&left, w));
        let m = M::moduli(&self.material, h);
        let fibres = m.along * L::new(if self.left == 0.0 { 1.0 } else { f64::from(self.left) });
        for a in 0..8 {
            let others = m.rows([slopes[0][a], slopes[1][a], slopes[2][a]], across[a], sums, sum_across);
            let row = (fibres * left[a]).fma(sum_left, others);
            self.rows[a] = row.fma(volume, self.rows[a]);
        }
    }
}

impl<M: Material, const PERIODIC: bool> Kernel for Force<M, PERIODIC> {
    const SHADER: Shader = shader::<Hex8, M, PERIODIC>("elements/hex8", "force");
    const SLOTS: &'static [Slot] = &force_slots(PERIODIC);

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let Params { nodes, .. } = io.params();
        let mut slots = io.own::<L::Scalar>(slot!(Self::SLOTS, "out"));
        for item in items {
            for lane in (0..LANES).step_by(L::WIDTH) {
                let lanes = Lanes::<L>::new(io, SHAPE, item, lane);
                let zero = L::new(0.0);
                let mut stress = Stress::<L, M, PERIODIC> {
                    material: lanes.material(io),
                    forces: [[[zero; 4]; 3]; 3],
                    sum: [[zero; 3]; 3],
                    law: PhantomData,
                };
                visit::<_, PERIODIC>(io, &lanes, nodes as usize, &mut stress);
                let q = lanes.frame(io);
                let f = &stress.forces;
                let local = [corner_forces(&f[0]), corner_forces(&f[1]), corner_forces(&f[2])];
                let out = slots.item(0, item);
                for (corner, &binary) in BINARY.iter().enumerate() {
                    for i in 0..3 {
                        let f =
                            q[i][2].fma(local[2][binary], q[i][1].fma(local[1][binary], q[i][0] * local[0][binary]));
                        lanes.store_force(out, corner, i, f);
                    }
                }
                if PERIODIC {
                    lanes.add_virial(io, item, &q, &stress.sum);
                }
            }
        }
    }
}

impl<M: Material, const PERIODIC: bool> Kernel for Energy<M, PERIODIC> {
    const SHADER: Shader = shader::<Hex8, M, PERIODIC>("elements/hex8", "energy");
    const SLOTS: &'static [Slot] = &energy_slots(false);

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let Params { nodes, .. } = io.params();
        let mut out = io.own::<L::Scalar>(slot!(Self::SLOTS, "out"));
        for item in items {
            for lane in (0..LANES).step_by(L::WIDTH) {
                let lanes = Lanes::<L>::new(io, SHAPE, item, lane);
                let mut energies = Energies::<L, M> {
                    material: lanes.material(io),
                    sum: [L::new(0.0); 4],
                    smallest: L::new(1e30),
                    law: PhantomData,
                };
                visit::<_, PERIODIC>(io, &lanes, nodes as usize, &mut energies);
                let out = out.item(0, item);
                for (mode, sum) in energies.sum.iter().enumerate() {
                    sum.store(&mut out[mode * LANES + lane..]);
                }
                energies.smallest.store(&mut out[4 * LANES + lane..]);
            }
        }
    }
}

impl<M: Material, const PERIODIC: bool, const WEIGHED: bool> Kernel for Bound<M, PERIODIC, WEIGHED> {
    const SHADER: Shader = weighed_shader::<Hex8, M, PERIODIC, WEIGHED>("elements/hex8", "bound");
    const SLOTS: &'static [Slot] = &bound_slots(WEIGHED);
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let bounding = Bounding::<_, Bound<M, PERIODIC, true>>::new::<WEIGHED>(io, items);
        L::Scalar::dispatch(io.isa, bounding);
    }
}

impl<R: Real, M: Material, const PERIODIC: bool> Work<R> for Bounding<'_, R, Bound<M, PERIODIC, true>> {
    const WIDE: bool = true;
    #[inline(always)]
    fn run<L: Lane<Scalar = R>>(self) {
        let Self { io, items, limits, mut out, .. } = self;
        let Params { nodes, left } = io.params();
        for item in items {
            for lane in (0..LANES).step_by(L::WIDTH) {
                let lanes = Lanes::<L>::new(io, SHAPE, item, lane);
                let u = local_displacements(io, &lanes, nodes as usize);
                let mut bounds = Bounds::<L, M> {
                    material: lanes.material(io),
                    rows: [L::new(0.0); 8],
                    weights: lanes.weights(limits),
                    edges: [edges(&u[0]), edges(&u[1]), edges(&u[2])],
                    macroscopic: lanes.macroscopic::<PERIODIC>(io),
                    left,
                    law: PhantomData,
                };
                visit::<_, PERIODIC>(io, &lanes, nodes as usize, &mut bounds);
                lanes.store_rows(out.item(0, item), &bounds.rows);
            }
        }
    }
}
