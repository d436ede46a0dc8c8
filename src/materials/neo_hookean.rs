//! Compressible neo-Hookean solid, w = μ/2 (tr C − 3) − μ ln J + λ/2 (ln J)², for verification scenes.

use super::{Material, PARAMETERS, Tensor, jacobian};
use crate::kernel::lane::Lane;
use crate::kernel::math::ln;

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

impl Material for NeoHookean {
    const SHADER: &'static str = "materials/neo_hookean";

    #[inline(always)]
    fn stress<L: Lane>(p: &[L; PARAMETERS], h: &Tensor<L>) -> Tensor<L> {
        let one = L::new(1.0);
        let mut f = *h;
        for (i, row) in f.iter_mut().enumerate() {
            row[i] = one + row[i];
        }
        let j = jacobian(h).max(L::new(CRUSHED));
        let k = (p[LAMBDA] * ln(j) - p[MU]) / j;
        let mut stress = f;
        for i in 0..3 {
            for jj in 0..3 {
                let ([a, b], [c, d]) = (others(i), others(jj));
                let cofactor = f[a][c] * f[b][d] - f[a][d] * f[b][c];
                stress[i][jj] = p[MU].fma(f[i][jj], k * cofactor);
            }
        }
        stress
    }

    #[inline(always)]
    fn energy<L: Lane>(p: &[L; PARAMETERS], h: &Tensor<L>) -> [L; 4] {
        let (zero, half) = (L::new(0.0), L::new(0.5));
        let log = ln(jacobian(h).max(L::new(CRUSHED)));
        let mut strain = zero;
        for i in 0..3 {
            strain = strain + h[i][i] + h[i][i];
            for j in 0..3 {
                strain = h[i][j].fma(h[i][j], strain);
            }
        }
        [p[MU] * (half * strain - log) + half * p[LAMBDA] * log * log, zero, zero, zero]
    }

    #[inline(always)]
    fn stiffness<L: Lane>(p: &[L; PARAMETERS], h: &Tensor<L>) -> L {
        let j = jacobian(h).max(L::new(0.05));
        (p[LAMBDA] + p[MU] + p[MU]) / (j * j)
    }

    #[inline(always)]
    fn along<L: Lane>(p: &[L; PARAMETERS]) -> L {
        p[LAMBDA] + p[MU] + p[MU]
    }
}

/// The two other axes, in cyclic order.
#[inline(always)]
fn others(i: usize) -> [usize; 2] {
    [(i + 1) % 3, (i + 2) % 3]
}
