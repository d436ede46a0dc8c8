//! Elementary functions as polynomials: the same statements, hence the same bits, on every processor, and a WGSL twin, since
//! WGSL has no log1p and guarantees little about ln and exp.

use super::interface::{Constant, constants};
use super::lane::{Lane, Real, SQRT_HALF_F32};
use std::f64::consts::LOG2_E;

const LN2_HIGH: f64 = 0.693_145_751_953_125; // 15 bits: exact products with exponents
const LN2_LOW: f64 = 1.428_606_820_309_417_2e-6;
/// Constants shared with the twin, including the bits of √½ and of 1 in f32.
pub const CONSTANTS: [Constant; 5] =
    constants![scalar: LN2_HIGH, LN2_LOW, LOG2_E; uint: SQRT_HALF = SQRT_HALF_F32, BIAS = 1f32.to_bits()];

/// Natural logarithm of a positive normal number; relative error of a few ulp, also next to 1.
#[inline(always)]
pub fn ln<L: Lane>(x: L) -> L {
    let (m, e) = x.mantissa_exponent();
    logarithm(m - L::new(1.0), e)
}

/// ln(1 + x) for x > −1, accurate for small x: as long as 1 + x has the exponent of 1, its mantissa minus 1 is x itself,
/// without the rounding error of the sum.
#[inline(always)]
pub fn log1p<L: Lane>(x: L) -> L {
    let (m, e) = (L::new(1.0) + x).mantissa_exponent();
    logarithm(L::select(e.abs().lt(L::new(0.5)), x, m - L::new(1.0)), e)
}

/// ln(1 + f) + e ln 2, the first as 2 atanh(f/(f + 2)), the second in two parts.
#[inline(always)]
fn logarithm<L: Lane>(f: L, e: L) -> L {
    let s = f / (f + L::new(2.0));
    let z = s * s;
    let terms = L::Scalar::LN_TERMS;
    let mut p = L::new(1.0 / (2 * terms + 1) as f64);
    for k in (0..terms).rev() {
        p = p.fma(z, L::new(1.0 / (2 * k + 1) as f64));
    }
    e.fma(L::new(LN2_HIGH), (s + s).fma(p, e * L::new(LN2_LOW)))
}

/// e^x for |x| below 80.
#[inline(always)]
pub fn exp<L: Lane>(x: L) -> L {
    let n = (x * L::new(LOG2_E)).round();
    let r = n.fma(L::new(-LN2_LOW), n.fma(L::new(-LN2_HIGH), x));
    let terms = L::Scalar::EXP_TERMS;
    let mut p = L::new(EXP[terms]);
    for k in (0..terms).rev() {
        p = p.fma(r, L::new(EXP[k]));
    }
    p * n.exp2_whole()
}

/// Coefficients 1/n! of the series of e^x.
const EXP: [f64; 15] = {
    let mut coefficients = [1.0; 15];
    let (mut factorial, mut n) = (1.0, 2);
    while n < coefficients.len() {
        factorial *= n as f64;
        coefficients[n] = 1.0 / factorial;
        n += 1;
    }
    coefficients
};

/// asinh(√u)/√u for u ≥ 0, without the singular derivatives of its factors at zero.
#[inline(always)]
pub fn asinh_ratio<L: Lane>(u: L) -> L {
    let terms = L::Scalar::ASINH_TERMS;
    let mut series = L::new(ASINH[terms]);
    for k in (0..terms).rev() {
        series = series.fma(u, L::new(ASINH[k]));
    }
    let is_near = u.lt(L::new(0.01));
    if L::all(is_near) {
        return series;
    }
    let one = L::new(1.0);
    let s = u.max(L::new(1e-30)).sqrt();
    let q = (one + u).sqrt();
    let far = log1p(s + u / (one + q)) / s;
    L::select(is_near, series, far)
}

/// Coefficients (−1)ⁿ (2n)!/(4ⁿ n!² (2n + 1)) of the series of asinh(√u)/√u.
const ASINH: [f64; 10] = {
    let mut coefficients = [0.0; 10];
    let (mut c, mut n) = (1.0, 0);
    while n < coefficients.len() {
        coefficients[n] = c / (2 * n + 1) as f64;
        c *= -((2 * n + 1) as f64) / (2 * n + 2) as f64;
        n += 1;
    }
    coefficients
};

/// Smooth step from 0 to 1 with zero slope at both ends: t²(3 − 2t), constant outside.
pub fn smooth(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn worst<R: Real>(points: impl Iterator<Item = f64>, f: impl Fn(R) -> R, exact: impl Fn(f64) -> f64) -> f64 {
        points.map(|x| R::from_f64(x)).map(|x| (f(x).to_f64() / exact(x.to_f64()) - 1.0).abs()).fold(0.0, f64::max)
    }

    fn powers() -> impl Iterator<Item = f64> {
        (0..4000).map(|i| libm::pow(10.0, -7.0 + 0.00225 * i as f64))
    }

    #[test]
    fn logarithms_hold_their_relative_error() {
        let (f, d) = (worst::<f32>(powers(), ln, libm::log), worst::<f64>(powers(), ln, libm::log));
        println!("ln: relative error {f:.1e} (f32) {d:.1e} (f64)");
        assert!(f < 3e-7 && d < 6e-16, "{f:e} {d:e}");
        let small = || powers().chain(powers().map(|x| -x.min(0.99)));
        let (f, d) = (worst::<f32>(small(), log1p, libm::log1p), worst::<f64>(small(), log1p, libm::log1p));
        println!("log1p: relative error {f:.1e} (f32) {d:.1e} (f64)");
        assert!(f < 5e-7 && d < 1e-15, "{f:e} {d:e}");
    }

    #[test]
    fn exponential_and_asinh_hold_their_relative_error() {
        let points = || (-3000..3000).map(|i| i as f64 * 0.01);
        let (f, d) = (worst::<f32>(points(), exp, libm::exp), worst::<f64>(points(), exp, libm::exp));
        println!("exp: relative error {f:.1e} (f32) {d:.1e} (f64)");
        assert!(f < 3e-7 && d < 6e-16, "{f:e} {d:e}");
        let exact = |u: f64| libm::asinh(libm::sqrt(u)) / libm::sqrt(u);
        let (f, d) = (worst::<f32>(powers(), asinh_ratio, exact), worst::<f64>(powers(), asinh_ratio, exact));
        println!("asinh(√u)/√u: relative error {f:.1e} (f32) {d:.1e} (f64)");
        assert!(f < 5e-7 && d < 1e-15, "{f:e} {d:e}");
    }
}
