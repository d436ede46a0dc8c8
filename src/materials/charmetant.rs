//! Transversely isotropic hyperelastic law of fibre bundles (Charmetant et al.; Eqs 2 to 7 of Zheng et al.), fibre along axis 1.
//!
//! With t = C − I = H + Hᵀ + HᵀH, c = 1 + t₁₁ = I₄ and g = (t₁₂, t₁₃), the Schur complement C̃ = I₂ + b,
//! b_ab = t_ab − g_a g_b/c, carries all that happens in the cross-section: I₃/I₄ = det C̃, and (I₁I₄ − I₅)/√(I₃I₄) = tr C̃/√det C̃.
//! The four invariants of the paper become
//!
//! - I_elong = ½ ln c,
//! - I_comp = ¼ ln det C̃,
//! - I_sh² = |g|²/c²,
//! - I_dist = ½ asinh √u, with u = |dev b|²/det C̃ and dev b = ((b₂₂ − b₃₃)/2, b₂₃),
//!
//! none of which needs a difference of nearly equal numbers. Neither I_sh nor I_dist has a derivative at rest; their squares do,
//! and those are what the energy holds. The exponent p < 2 of compaction makes the tangent infinite at I_comp → 0⁻: below the
//! cap the power is continued by the parabola with the same slope.

use super::{Material, Moduli, PARAMETERS, Tensor, add_product, jacobian};
use crate::kernel::interface::{Constant, constants};
use crate::kernel::lane::Lane;
use crate::kernel::math::{asinh_ratio, exp, ln, log1p};

/// The law.
pub struct Charmetant;

const K_ELONG: usize = 0;
const K_COMP: usize = 1;
const P_COMP: usize = 2;
const K_DIST: usize = 3;
const K_SH: usize = 4;
const CAP: usize = 5;
/// Slope of dw_comp/d|I_comp| below the cap: K p cap^(p−2).
const CAP_SLOPE: usize = 6;
/// What makes the energy continuous at the cap: K cap^p (p/2 − 1).
const CAP_ENERGY: usize = 7;

/// Smallest |I_comp| whose power is taken when the cap is off.
const TINY: f64 = 1e-30;
/// Smallest det C̃: a cross-section crushed to 1 % of its area.
const CRUSHED: f64 = 1e-4;

/// Row of the material table. MPa, MPa, –, MPa, MPa, –.
pub fn parameters(k_elong: f64, k_comp: f64, p: f64, k_dist: f64, k_sh: f64, cap: f64) -> [f64; PARAMETERS] {
    let (slope, energy) = if cap > 0.0 {
        (k_comp * p * libm::pow(cap, p - 2.0), k_comp * libm::pow(cap, p) * (0.5 * p - 1.0))
    } else {
        (0.0, 0.0)
    };
    [k_elong, k_comp, p, k_dist, k_sh, cap, slope, energy]
}

/// State of the cross-section and of the fibre.
struct State<L> {
    /// C − I, the components 12 and 13.
    g2: L,
    g3: L,
    /// 1/c.
    inv_c: L,
    b22: L,
    b33: L,
    b23: L,
    /// 1/det C̃.
    inv_det: L,
    i_elong: L,
    i_comp: L,
    /// Half the difference of b22 and b33.
    dv: L,
    u: L,
}

#[inline(always)]
fn state<L: Lane>(h: &Tensor<L>) -> State<L> {
    let [[h11, h12, h13], [h21, h22, h23], [h31, h32, h33]] = *h;
    let (one, half) = (L::new(1.0), L::new(0.5));
    let t11 = h31.fma(h31, h21.fma(h21, h11.fma(h11, h11 + h11)));
    let t22 = h32.fma(h32, h22.fma(h22, h12.fma(h12, h22 + h22)));
    let t33 = h33.fma(h33, h23.fma(h23, h13.fma(h13, h33 + h33)));
    let g2 = h31.fma(h32, h21.fma(h22, h11.fma(h12, h12 + h21)));
    let g3 = h31.fma(h33, h21.fma(h23, h11.fma(h13, h13 + h31)));
    let t23 = h32.fma(h33, h22.fma(h23, h12.fma(h13, h23 + h32)));
    let c = one + t11;
    let inv_c = one / c;
    let (g2c, g3c) = (g2 * inv_c, g3 * inv_c);
    let b22 = t22 - g2 * g2c;
    let b33 = t33 - g3 * g3c;
    let b23 = t23 - g2 * g3c;
    let dm = b22 + b33 + b22.fma(b33, -(b23 * b23));
    // near inversion the sum cancels; the determinant of F does not
    let j = jacobian(h);
    let det = L::select(dm.lt(L::new(-0.7)), (j * j * inv_c).max(L::new(CRUSHED)), one + dm);
    let dm = L::select(dm.lt(L::new(-0.7)), det - one, dm);
    let inv_det = one / det;
    let dv = half * (b22 - b33);
    let u = dv.fma(dv, b23 * b23) * inv_det;
    State { g2, g3, inv_c, b22, b33, b23, inv_det, i_elong: half * log1p(t11), i_comp: L::new(0.25) * log1p(dm), dv, u }
}

/// |I_comp|^(p − 1), and |I_comp| kept from zero.
#[inline(always)]
fn compaction_power<L: Lane>(p: &[L; PARAMETERS], i_comp: L) -> (L, L) {
    let size = i_comp.abs();
    let power = exp((p[P_COMP] - L::new(1.0)) * ln(size.max(L::new(TINY))));
    (power, size)
}

impl Material for Charmetant {
    const SHADER: &'static str = "materials/charmetant";
    const CONSTANTS: &'static [Constant] = &constants![
        uint: K_ELONG, K_COMP, P_COMP, K_DIST, K_SH, CAP, CAP_SLOPE, CAP_ENERGY;
        scalar: TINY, CRUSHED
    ];

    #[inline(always)]
    fn stress<L: Lane>(p: &[L; PARAMETERS], h: &Tensor<L>) -> Tensor<L> {
        let (zero, one, two) = (L::new(0.0), L::new(1.0), L::new(2.0));
        let s = state(h);
        let asinh = asinh_ratio(s.u);
        let wu = L::new(0.125) * p[K_DIST] * asinh / (one + s.u).sqrt();
        let (power, size) = compaction_power(p, s.i_comp);
        let slope = L::select(size.lt(p[CAP]), p[CAP_SLOPE] * size, p[K_COMP] * p[P_COMP] * power);
        let wc = L::select(s.i_comp.lt(zero), -slope, zero);
        // T = wu (dev b/det − u C̃⁻¹) + (wc/4) C̃⁻¹
        let k1 = (L::new(0.25) * wc - wu * s.u) * s.inv_det;
        let k2 = wu * s.inv_det;
        let t22 = k2.fma(s.dv, k1 * (one + s.b33));
        let t33 = k1.fma(one + s.b22, -(k2 * s.dv));
        let t23 = (k2 - k1) * s.b23;
        let k_sh = p[K_SH] * s.inv_c * s.inv_c;
        let (v2, v3) = (t22.fma(s.g2, t23 * s.g3), t23.fma(s.g2, t33 * s.g3));
        let s12 = k_sh.fma(s.g2, -(two * v2 * s.inv_c));
        let s13 = k_sh.fma(s.g3, -(two * v3 * s.inv_c));
        let g_tg = s.g2.fma(v2, s.g3 * v3);
        let g_g = s.g2.fma(s.g2, s.g3 * s.g3);
        let s11 = s.inv_c * (p[K_ELONG].fma(s.i_elong, two * (g_tg * s.inv_c - k_sh * g_g)));
        let pk2 = [[s11, s12, s13], [s12, two * t22, two * t23], [s13, two * t23, two * t33]];
        add_product(h, &pk2)
    }

    #[inline(always)]
    fn energy<L: Lane>(p: &[L; PARAMETERS], h: &Tensor<L>) -> [L; 4] {
        let (zero, half) = (L::new(0.0), L::new(0.5));
        let s = state(h);
        let asinh = asinh_ratio(s.u);
        let (power, size) = compaction_power(p, s.i_comp);
        let capped = half * p[CAP_SLOPE] * size * size;
        let comp = L::select(size.lt(p[CAP]), capped, (p[K_COMP] * power).fma(size, p[CAP_ENERGY]));
        let g_g = s.g2.fma(s.g2, s.g3 * s.g3) * s.inv_c * s.inv_c;
        [
            half * p[K_ELONG] * s.i_elong * s.i_elong,
            L::select(s.i_comp.lt(zero), comp, zero),
            L::new(0.125) * p[K_DIST] * asinh * asinh * s.u,
            half * p[K_SH] * g_g,
        ]
    }

    #[inline(always)]
    fn moduli<L: Lane>(p: &[L; PARAMETERS], h: &Tensor<L>) -> Moduli<L> {
        // In the cross-section: compaction (its tangent falls with |I_comp|, hence at least the cap's) and its stress,
        // and distortion; all grow with the inverse of the smaller stretch of the section.
        let (zero, one, half) = (L::new(0.0), L::new(1.0), L::new(0.5));
        let s = state(h);
        let size = s.i_comp.abs().max(p[CAP]).max(L::new(1e-6));
        let power = exp((p[P_COMP] - L::new(1.0)) * ln(size));
        let slope = p[K_COMP] * p[P_COMP] * power;
        let stressed = L::select(s.i_comp.lt(zero), half * slope, zero);
        let tangent = L::new(0.25) * slope * (p[P_COMP] - one) / size;
        let mean = one + half * (s.b22 + s.b33);
        let difference = s.dv.fma(s.dv, s.b23 * s.b23).sqrt();
        let smaller = (mean - difference).max(L::new(0.01));
        let across = (tangent + L::new(0.25) * p[K_DIST] + stressed) / smaller;
        // Shear |g|/c is driven by the fibre and by the widest direction of the section as they are stretched now; and its
        // stress turns with both.
        let g_g = s.g2.fma(s.g2, s.g3 * s.g3);
        let widest = (mean + difference + g_g * s.inv_c) * s.inv_c;
        let shear = p[K_SH] * s.inv_c * (one.max(widest) + g_g.sqrt() * s.inv_c);
        let along = p[K_ELONG] * (one - s.i_elong).max(zero) * s.inv_c;
        let tension = (p[K_ELONG] * s.i_elong * s.inv_c).max(zero);
        Moduli { across, shear, along, tension }
    }
}
