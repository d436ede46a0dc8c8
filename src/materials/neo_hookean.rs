//! Compressible neo-Hookean solid, w = μ/2 (tr C − 3) − μ ln J + λ/2 (ln J)², for verification scenes.
//!
//! At small strain both parts of μ cancel to first order. With J − 1 = tr H + m, m = tr cof H + det H, they are written without
//! what cancels: w = μ (½ H:H − m + φ(J − 1)) + …, φ(x) = x − ln(1 + x), and P = (μ (m I + J H + Hᵀ − cof H) + λ ln J cof F)/J.

use super::{Material, Moduli, PARAMETERS, Tensor, jacobian};
use crate::kernel::lane::Lane;
use crate::kernel::math::{ln, log1p};

/// The law.
pub struct NeoHookean;

const MU: usize = 0;
const LAMBDA: usize = 1;

/// Row of the material table, from Young's modulus (MPa) and Poisson's ratio.
pub fn parameters(young: f64, poisson: f64) -> [f64; PARAMETERS] {
    let mu = young / (2.0 * (1.0 + poisson));
    let lambda = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
    [mu, lambda, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
}

/// Uniaxial-strain modulus λ + 2μ, MPa.
pub fn longitudinal(young: f64, poisson: f64) -> f64 {
    let p = parameters(young, poisson);
    p[LAMBDA] + 2.0 * p[MU]
}

/// Smallest determinant of F that the logarithm is taken of.
const CRUSHED: f64 = 1e-3;
/// |J − 1| below which J − 1 − ln J is taken from its series, and the last power there.
const SMALL: f64 = 0.05;
const TERMS: usize = 13;

/// How volume changes.
struct Volume<L> {
    /// Cofactors of H.
    cofactors: Tensor<L>,
    /// tr cof H + det H.
    second: L,
    j: L,
    /// ln J, and J − 1 − ln J.
    log: L,
    rest: L,
}

#[inline(always)]
fn volume<L: Lane>(h: &Tensor<L>) -> Volume<L> {
    let mut cofactors = *h;
    for (i, row) in cofactors.iter_mut().enumerate() {
        for (k, cofactor) in row.iter_mut().enumerate() {
            let ([a, b], [c, d]) = (others(i), others(k));
            *cofactor = h[a][c] * h[b][d] - h[a][d] * h[b][c];
        }
    }
    let c = &cofactors;
    let determinant = h[0][2].fma(c[0][2], h[0][1].fma(c[0][1], h[0][0] * c[0][0]));
    let second = c[0][0] + c[1][1] + c[2][2] + determinant;
    let x = h[0][0] + h[1][1] + h[2][2] + second;
    let j = jacobian(h).max(L::new(CRUSHED));
    let log = L::select(x.lt(L::new(-0.5)), ln(j), log1p(x.max(L::new(-0.5))));
    // Σ (−x)ⁿ/n from n = 2
    let mut series = L::new(0.0);
    for n in (2..=TERMS).rev() {
        let sign = if n % 2 == 0 { 1.0 } else { -1.0 };
        series = series.fma(x, L::new(sign / n as f64));
    }
    let rest = L::select(x.abs().lt(L::new(SMALL)), series * x * x, j - L::new(1.0) - log);
    Volume { cofactors, second, j, log, rest }
}

impl Material for NeoHookean {
    const SHADER: &'static str = "materials/neo_hookean";

    #[inline(always)]
    fn stress<L: Lane>(p: &[L; PARAMETERS], h: &Tensor<L>) -> Tensor<L> {
        let one = L::new(1.0);
        let v = volume(h);
        let (inverse, pressure) = (one / v.j, p[LAMBDA] * v.log);
        let trace = h[0][0] + h[1][1] + h[2][2];
        let mut stress = *h;
        for i in 0..3 {
            for k in 0..3 {
                let cofactor = v.cofactors[i][k];
                let (mut shear, mut normal) = (v.j.fma(h[i][k], h[k][i] - cofactor), cofactor - h[k][i]);
                if i == k {
                    (shear, normal) = (shear + v.second, normal + one + trace);
                }
                stress[i][k] = p[MU].fma(shear, pressure * normal) * inverse;
            }
        }
        stress
    }

    #[inline(always)]
    fn energy<L: Lane>(p: &[L; PARAMETERS], h: &Tensor<L>) -> [L; 4] {
        let (zero, half) = (L::new(0.0), L::new(0.5));
        let v = volume(h);
        let mut square = zero;
        for row in h {
            for entry in row {
                square = entry.fma(*entry, square);
            }
        }
        [p[MU] * (half * square - v.second + v.rest) + half * p[LAMBDA] * v.log * v.log, zero, zero, zero]
    }

    #[inline(always)]
    fn moduli<L: Lane>(p: &[L; PARAMETERS], h: &Tensor<L>) -> Moduli<L> {
        let (zero, one) = (L::new(0.0), L::new(1.0));
        let j = jacobian(h).max(L::new(0.05));
        let square = one / (j * j);
        let longitudinal = p[LAMBDA] + p[MU] + p[MU];
        let [h11, h21, h31] = [h[0][0], h[1][0], h[2][0]];
        let stretch = one + h31.fma(h31, h21.fma(h21, h11.fma(h11, h11 + h11)));
        Moduli {
            // the section is coupled to the fibre direction by λ
            across: (longitudinal + p[LAMBDA] * p[LAMBDA] / longitudinal) * square,
            shear: (p[MU] - p[LAMBDA] * ln(j.min(one))) * square,
            along: longitudinal * square,
            tension: (p[MU] + (p[LAMBDA] * ln(j) - p[MU]) / stretch).max(zero),
        }
    }
}

/// The two other axes, in cyclic order.
#[inline(always)]
fn others(i: usize) -> [usize; 2] {
    [(i + 1) % 3, (i + 2) % 3]
}
