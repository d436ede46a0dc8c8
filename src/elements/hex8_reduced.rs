//! 8-node hexahedron with one Gauss point and hourglass control, total Lagrangian.
//!
//! The displacement gradient is the element mean (Flanagan and Belytschko 1981), in the reference configuration:
//!
//! ```text
//! H = Σ_a u_a ⊗ B_a,   B_a = (1/V) ∫ ∇N_a dV       so that Σ_a X_a ⊗ B_a = I on any shape
//! q_α = Σ_a γ_αa u_a,   γ_αa = h_αa − B_a · Σ_b h_αb X_b,   h = ηζ, ξζ, ξη, ξηζ at the corners
//! W = V w(H) + ½ Σ_α k_α |q_α|²,   f_a = −∂W/∂u_a
//! ```
//!
//! A uniform stress gives the forces of the fully integrated element: the patch test holds on any shape. H does not see the
//! twelve hourglass modes u = q h_α; only their stiffness k_α, based on the shear modulus of the material law, resists them. No
//! γ_α sees a linear displacement. Hence k_α changes no uniform deformation, a macroscopic displacement gradient is added to H
//! only, and a rotation rotates q and leaves W unchanged. The hourglass modes bend fibres within an element, where the fibre
//! stiffness does not contribute.

use super::LANES;
use super::block::{
    BINARY, Bounding, Element, Lanes, Params, bound_slots, dot, energy_slots, force_slots, shader, total,
    weighed_shader,
};
use crate::kernel::interface::{Constant, Slot, constants, slot};
use crate::kernel::io::Io;
use crate::kernel::lane::{Lane, Real, Work};
use crate::kernel::shader::Shader;
use crate::kernel::stage::Kernel;
use crate::materials::{Material, Tensor, jacobian};
use std::marker::PhantomData;
use std::ops::Range;

/// Numbers per shape: half the difference and half the sum of the B at both ends of each edge along ξ (3 each), the volume, Σ
/// h_α X of each mode (3), k_α of each mode; times lanes.
pub const SHAPE: usize = (STIFFNESS + 4) * LANES;
/// Their start indices.
const VOLUME: usize = 24;
const MOMENTS: usize = 25;
const STIFFNESS: usize = 37;

/// The hourglass modes ηζ, ξζ, ξη and ξηζ at the binary corners.
pub const MODES: [[f64; 8]; 4] = [
    [1.0, 1.0, -1.0, -1.0, -1.0, -1.0, 1.0, 1.0],
    [1.0, -1.0, 1.0, -1.0, -1.0, 1.0, -1.0, 1.0],
    [1.0, -1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0],
    [-1.0, 1.0, 1.0, -1.0, 1.0, -1.0, -1.0, 1.0],
];

/// Hourglass energies per block, mJ.
pub const HOURGLASS: usize = LANES;

/// The element.
pub struct Hex8Reduced;

impl Element for Hex8Reduced {
    const CONSTANTS: &'static [Constant] = &constants![uint: SHAPE, VOLUME, MOMENTS, STIFFNESS, HOURGLASS];
}

/// Nodal forces of hexahedra; with `PERIODIC`, also the virial stress sum for the homogenised first Piola–Kirchhoff stress.
pub struct Force<M, const PERIODIC: bool>(PhantomData<M>);
/// Energies by mode, and the smallest Jacobian; hourglass energy.
pub struct Energy<M, const PERIODIC: bool>(PhantomData<M>);
/// Row sums of the stiffness matrix that fibre lines do not cover, with `WEIGHED` weighted by R/m of the nodes: see
/// [`crate::dynamics::time_step`].
pub struct Bound<M, const PERIODIC: bool, const WEIGHED: bool>(PhantomData<M>);

/// Half the difference and half the sum of B at both ends of an edge along ξ: fibre strain is computed from differences of near
/// nodes, which are exact in f32.
#[inline(always)]
fn slopes<L: Lane>(lanes: &Lanes<L>, edge: usize) -> [[L; 3]; 2] {
    let first = 6 * edge;
    [
        [lanes.shape(first), lanes.shape(first + 1), lanes.shape(first + 2)],
        [lanes.shape(first + 3), lanes.shape(first + 4), lanes.shape(first + 5)],
    ]
}

/// B of a binary corner.
#[inline(always)]
fn slope<L: Lane>(lanes: &Lanes<L>, corner: usize) -> [L; 3] {
    let [d, s] = slopes(lanes, corner / 2);
    if corner % 2 == 1 { [s[0] + d[0], s[1] + d[1], s[2] + d[2]] } else { [s[0] - d[0], s[1] - d[1], s[2] - d[2]] }
}

/// Σ h_α X of a mode.
#[inline(always)]
fn moment<L: Lane>(lanes: &Lanes<L>, mode: usize) -> [L; 3] {
    let first = MOMENTS + 3 * mode;
    [lanes.shape(first), lanes.shape(first + 1), lanes.shape(first + 2)]
}

/// Differences and sums of corner values over the edges along ξ.
#[inline(always)]
fn edges<L: Lane>(u: &[L; 8]) -> [[L; 4]; 2] {
    let d = [u[1] - u[0], u[3] - u[2], u[5] - u[4], u[7] - u[6]];
    [d, [u[0] + u[1], u[2] + u[3], u[4] + u[5], u[6] + u[7]]]
}

/// Σ_a h_αa u_a of each mode, from [`edges`].
#[inline(always)]
fn sums<L: Lane>([d, s]: &[[L; 4]; 2]) -> [L; 4] {
    let (low, high) = (d[1] - d[0], d[3] - d[2]);
    [(s[0] - s[1]) + (s[3] - s[2]), (d[2] + d[3]) - (d[0] + d[1]), low + high, high - low]
}

/// The transpose of [`sums`] of [`edges`]: Σ_α h_αa g_α of each corner.
#[inline(always)]
fn spread<L: Lane>(g: [L; 4]) -> [L; 8] {
    let (plus, minus) = (g[2] + g[3], g[3] - g[2]);
    let along = [minus - g[1], -(minus + g[1]), g[1] - plus, g[1] + plus];
    [
        g[0] - along[0],
        g[0] + along[0],
        -(g[0] + along[1]),
        along[1] - g[0],
        -(g[0] + along[2]),
        along[2] - g[0],
        g[0] - along[3],
        g[0] + along[3],
    ]
}

/// Deformation of one register of hexahedra.
struct Deformation<L> {
    /// Mean displacement gradient in the fibre's frame.
    h: Tensor<L>,
    /// q by mode and component, along global axes.
    modes: [[L; 3]; 4],
}

#[inline(always)]
fn deformation<L: Lane, const PERIODIC: bool>(io: &Io<L::Scalar>, lanes: &Lanes<L>, nodes: usize) -> Deformation<L> {
    let zero = L::new(0.0);
    let u = lanes.displacements(io, nodes);
    let edges = [edges(&u[0]), edges(&u[1]), edges(&u[2])];
    // components along global axes, derivatives along those of the fibre
    let mut mixed = [[zero; 3]; 3];
    for edge in 0..4 {
        let [difference, sum] = slopes(lanes, edge);
        for i in 0..3 {
            let [d, s] = &edges[i];
            for j in 0..3 {
                mixed[i][j] = s[edge].fma(sum[j], d[edge].fma(difference[j], mixed[i][j]));
            }
        }
    }
    let seen = [sums(&edges[0]), sums(&edges[1]), sums(&edges[2])];
    let mut modes = [[zero; 3]; 4];
    for (mode, q) in modes.iter_mut().enumerate() {
        let moment = moment(lanes, mode);
        for i in 0..3 {
            q[i] = seen[i][mode] - dot(&mixed[i], &moment);
        }
    }
    let q = lanes.frame(io);
    let mut h = [[zero; 3]; 3];
    if let Some(macroscopic) = lanes.macroscopic::<PERIODIC>(io) {
        h = macroscopic;
    }
    for i in 0..3 {
        for j in 0..3 {
            for k in 0..3 {
                h[i][j] = q[k][i].fma(mixed[k][j], h[i][j]);
            }
        }
    }
    Deformation { h, modes }
}

impl<M: Material, const PERIODIC: bool> Kernel for Force<M, PERIODIC> {
    const SHADER: Shader = shader::<Hex8Reduced, M, PERIODIC>("elements/hex8_reduced", "force");
    const SLOTS: &'static [Slot] = &force_slots(PERIODIC);

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let Params { nodes, .. } = io.params();
        let mut slots = io.own::<L::Scalar>(slot!(Self::SLOTS, "out"));
        for item in items {
            for lane in (0..LANES).step_by(L::WIDTH) {
                let lanes = Lanes::<L>::new(io, SHAPE, item, lane);
                let state = deformation::<_, PERIODIC>(io, &lanes, nodes as usize);
                let volume = lanes.shape(VOLUME);
                let mut stress = M::stress(&lanes.material(io), &state.h);
                for p in stress.as_flattened_mut() {
                    *p = *p * volume;
                }
                let q = lanes.frame(io);
                let out = slots.item(0, item);
                for i in 0..3 {
                    // conjugate to the gradient: stress, minus the response of the hourglass modes to linear displacements
                    let mut conjugate = [L::new(0.0); 3];
                    for j in 0..3 {
                        for k in 0..3 {
                            conjugate[j] = q[i][k].fma(stress[k][j], conjugate[j]);
                        }
                    }
                    let mut held = [L::new(0.0); 4];
                    for mode in 0..4 {
                        held[mode] = lanes.shape(STIFFNESS + mode) * state.modes[mode][i];
                        let moment = moment(&lanes, mode);
                        for j in 0..3 {
                            conjugate[j] = conjugate[j] - held[mode] * moment[j];
                        }
                    }
                    let mut f = spread(held);
                    for edge in 0..4 {
                        let [difference, sum] = slopes(&lanes, edge);
                        let (d, s) = (dot(&conjugate, &difference), dot(&conjugate, &sum));
                        f[2 * edge] = d - (s + f[2 * edge]);
                        f[2 * edge + 1] = -d - (s + f[2 * edge + 1]);
                    }
                    for (corner, &binary) in BINARY.iter().enumerate() {
                        lanes.store_force(out, corner, i, f[binary]);
                    }
                }
                if PERIODIC {
                    lanes.add_virial(io, item, &q, &stress);
                }
            }
        }
    }
}

impl<M: Material, const PERIODIC: bool> Kernel for Energy<M, PERIODIC> {
    const SHADER: Shader = shader::<Hex8Reduced, M, PERIODIC>("elements/hex8_reduced", "energy");
    const SLOTS: &'static [Slot] = &energy_slots(true);

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let Params { nodes, .. } = io.params();
        let mut out = io.own::<L::Scalar>(slot!(Self::SLOTS, "out"));
        let mut hourglass = io.own::<L::Scalar>(slot!(Self::SLOTS, "out_hourglass"));
        for item in items {
            for lane in (0..LANES).step_by(L::WIDTH) {
                let lanes = Lanes::<L>::new(io, SHAPE, item, lane);
                let state = deformation::<_, PERIODIC>(io, &lanes, nodes as usize);
                let out = out.item(0, item);
                let energy = M::energy(&lanes.material(io), &state.h);
                for mode in 0..4 {
                    (energy[mode] * lanes.shape(VOLUME)).store(&mut out[mode * LANES + lane..]);
                }
                jacobian(&state.h).store(&mut out[4 * LANES + lane..]);
                let mut sum = L::new(0.0);
                for (mode, q) in state.modes.iter().enumerate() {
                    sum = lanes.shape(STIFFNESS + mode).fma(dot(q, q), sum);
                }
                (L::new(0.5) * sum).store(&mut hourglass.item(0, item)[lane..]);
            }
        }
    }
}

/// Adds the row sums of a stiffness matrix bounded by k times the products of its corner magnitudes.
#[inline(always)]
fn add_rows<L: Lane>(rows: &mut [L; 8], k_total: L, sizes: &[L; 8]) {
    for corner in 0..8 {
        rows[corner] = k_total.fma(sizes[corner], rows[corner]);
    }
}

impl<M: Material, const PERIODIC: bool, const WEIGHED: bool> Kernel for Bound<M, PERIODIC, WEIGHED> {
    const SHADER: Shader = weighed_shader::<Hex8Reduced, M, PERIODIC, WEIGHED>("elements/hex8_reduced", "bound");
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
                let Deformation { h, modes } = deformation::<_, PERIODIC>(io, &lanes, nodes as usize);
                let zero = L::new(0.0);
                let mut rows = [zero; 8];
                // modulus × V |B_a| Σ|B|
                let mut slopes = [[zero; 8]; 3];
                let mut across = [zero; 8];
                for corner in 0..8 {
                    let b = slope(&lanes, corner);
                    for k in 0..3 {
                        slopes[k][corner] = b[k].abs();
                    }
                    across[corner] = b[2].fma(b[2], b[1] * b[1]).sqrt();
                }
                let weights = lanes.weights(limits);
                let sums = [total(&slopes[0], &weights), total(&slopes[1], &weights), total(&slopes[2], &weights)];
                let sum_across = total(&across, &weights);
                let volume = lanes.shape(VOLUME);
                let m = M::moduli(&lanes.material(io), &h);
                for (corner, row) in rows.iter_mut().enumerate() {
                    let slopes = [slopes[0][corner], slopes[1][corner], slopes[2][corner]];
                    *row = volume * m.rows(slopes, across[corner], sums, sum_across);
                }
                if left == 0.0 {
                    add_rows(&mut rows, m.along * volume * sums[0], &slopes[0]);
                } else {
                    // fibre stiffness acts along the mean fibre, fibre lines along each edge: the difference between these
                    // directions is not covered, (d + e)² ≤ 2 d² + 2 e²
                    let mut sizes = [zero; 8];
                    for (corner, size) in sizes.iter_mut().enumerate() {
                        let along = slope(&lanes, corner)[0].abs();
                        let mut square = zero;
                        for i in 0..3 {
                            let mut apart = zero;
                            for mode in 1..4 {
                                // derivative along ξ: the sign of ξ itself does not matter
                                apart = apart + L::new(MODES[mode][corner]) * modes[mode][i];
                            }
                            square = apart.fma(apart, square);
                        }
                        *size = along * along * square.sqrt();
                    }
                    add_rows(&mut rows, L::new(2.0) * m.along * volume * total(&sizes, &weights), &sizes);
                }
                // k |γ_a| Σ|γ|
                for mode in 0..4 {
                    let moment = moment(&lanes, mode);
                    let mut sizes = [zero; 8];
                    for (corner, size) in sizes.iter_mut().enumerate() {
                        *size = (L::new(MODES[mode][corner]) - dot(&moment, &slope(&lanes, corner))).abs();
                    }
                    add_rows(&mut rows, lanes.shape(STIFFNESS + mode) * total(&sizes, &weights), &sizes);
                }
                lanes.store_rows(out.item(0, item), &rows);
            }
        }
    }
}
