//! Compressible neo-Hookean solid, w = μ/2 (tr C − 3) − μ ln J + λ/2 (ln J)², for verification scenes.
//!
//! At small strain both μ terms cancel to first order. They are therefore written without the cancelling parts, from t = C − I =
//! H + Hᵀ + HᵀH, which is invariant to rotation: det C − 1 = x = tr t + m, m = tr cof t + det t, and
//!
//! - w = μ/2 (φ(x) − m) + λ/8 ln² (1 + x), φ(x) = x − ln(1 + x),
//! - S = (μ cof C t + λ ln J cof C)/J², symmetric to the last bit.

use super::{Material, Moduli, PARAMETERS, Tensor, add_product, jacobian};
use crate::kernel::interface::{Constant, constants};
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

/// Smallest det F whose logarithm is taken.
const CRUSHED: f64 = 1e-3;
/// |x| below which a series gives φ(x), and its last power.
const SMALL: f64 = 0.05;
const TERMS: usize = 13;

/// Strain measures at a point.
struct Strain<L> {
    t: Tensor<L>,
    /// m.
    second: L,
    j: L,
    /// ln J, and φ(x).
    log: L,
    rest: L,
}

#[inline(always)]
fn strain<L: Lane>(h: &Tensor<L>) -> Strain<L> {
    let mut t = *h;
    for i in 0..3 {
        for k in i..3 {
            let sum = h[i][k] + h[k][i];
            t[i][k] = h[2][i].fma(h[2][k], h[1][i].fma(h[1][k], h[0][i].fma(h[0][k], sum)));
            t[k][i] = t[i][k];
        }
    }
    let row = cofactors(&t, 0);
    let determinant = t[0][2].fma(row[2], t[0][1].fma(row[1], t[0][0] * row[0]));
    let second = row[0] + cofactor(&t, 1, 1) + cofactor(&t, 2, 2) + determinant;
    let x = t[0][0] + t[1][1] + t[2][2] + second;
    let j = jacobian(h).max(L::new(CRUSHED));
    let (large, half) = (L::new(-0.5), L::new(0.5));
    let log = L::select(x.lt(large), ln(j), half * log1p(x.max(large)));
    // Σ (−x)ⁿ/n from n = 2
    let mut series = L::new(0.0);
    for n in (2..=TERMS).rev() {
        let sign = if n % 2 == 0 { 1.0 } else { -1.0 };
        series = series.fma(x, L::new(sign / n as f64));
    }
    let rest = L::select(x.abs().lt(L::new(SMALL)), series * x * x, x - (log + log));
    Strain { t, second, j, log, rest }
}

impl Material for NeoHookean {
    const SHADER: &'static str = "materials/neo_hookean";
    const CONSTANTS: &'static [Constant] = &constants![uint: MU, LAMBDA, TERMS; scalar: CRUSHED, SMALL];

    #[inline(always)]
    fn stress<L: Lane>(p: &[L; PARAMETERS], h: &Tensor<L>) -> Tensor<L> {
        let Strain { t, j, log, .. } = strain(h);
        let square = j * j;
        let (mu, pressure) = (p[MU] / square, p[LAMBDA] * log / square);
        let mut c = t;
        for (i, row) in c.iter_mut().enumerate() {
            row[i] = row[i] + L::new(1.0);
        }
        let mut pk2 = t;
        for i in 0..3 {
            let row = cofactors(&c, i);
            for k in i..3 {
                let strained = row[2].fma(t[2][k], row[1].fma(t[1][k], row[0] * t[0][k]));
                pk2[i][k] = mu.fma(strained, pressure * row[k]);
                pk2[k][i] = pk2[i][k];
            }
        }
        add_product(h, &pk2)
    }

    #[inline(always)]
    fn energy<L: Lane>(p: &[L; PARAMETERS], h: &Tensor<L>) -> [L; 4] {
        let (zero, half) = (L::new(0.0), L::new(0.5));
        let s = strain(h);
        [half * (p[MU] * (s.rest - s.second) + p[LAMBDA] * s.log * s.log), zero, zero, zero]
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

/// A row of cofactors of a tensor.
#[inline(always)]
fn cofactors<L: Lane>(a: &Tensor<L>, row: usize) -> [L; 3] {
    [cofactor(a, row, 0), cofactor(a, row, 1), cofactor(a, row, 2)]
}

/// A cofactor of a tensor.
#[inline(always)]
fn cofactor<L: Lane>(a: &Tensor<L>, row: usize, column: usize) -> L {
    let [i, j, k, l] = [(row + 1) % 3, (row + 2) % 3, (column + 1) % 3, (column + 2) % 3];
    a[i][k] * a[j][l] - a[i][l] * a[j][k]
}
