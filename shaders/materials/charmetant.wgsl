// Transversely isotropic hyperelastic law of fibre bundles, fibre along axis 1.

#include "materials/mod"
#include "kernel/math"

// State of the cross-section and of the fibre.
struct State {
    // C − I, the components 12 and 13.
    g2: f32,
    g3: f32,
    // 1/c.
    inv_c: f32,
    b22: f32,
    b33: f32,
    b23: f32,
    // 1/det C̃.
    inv_det: f32,
    i_elong: f32,
    i_comp: f32,
    // Half the difference of b22 and b33.
    dv: f32,
    u: f32,
}

fn state(h: Tensor) -> State {
    let h11 = h[0][0];
    let h12 = h[0][1];
    let h13 = h[0][2];
    let h21 = h[1][0];
    let h22 = h[1][1];
    let h23 = h[1][2];
    let h31 = h[2][0];
    let h32 = h[2][1];
    let h33 = h[2][2];
    let t11 = fma(h31, h31, fma(h21, h21, fma(h11, h11, h11 + h11)));
    let t22 = fma(h32, h32, fma(h22, h22, fma(h12, h12, h22 + h22)));
    let t33 = fma(h33, h33, fma(h23, h23, fma(h13, h13, h33 + h33)));
    let g2 = fma(h31, h32, fma(h21, h22, fma(h11, h12, h12 + h21)));
    let g3 = fma(h31, h33, fma(h21, h23, fma(h11, h13, h13 + h31)));
    let t23 = fma(h32, h33, fma(h22, h23, fma(h12, h13, h23 + h32)));
    let c = 1.0 + t11;
    let inv_c = 1.0 / c;
    let g2c = g2 * inv_c;
    let g3c = g3 * inv_c;
    let b22 = t22 - g2 * g2c;
    let b33 = t33 - g3 * g3c;
    let b23 = t23 - g2 * g3c;
    let sum = b22 + b33 + fma(b22, b33, -(b23 * b23));
    // near inversion the sum cancels; the determinant of F does not
    let j = jacobian(h);
    let det = select(1.0 + sum, max(j * j * inv_c, CRUSHED), sum < -0.7);
    let dm = select(sum, det - 1.0, sum < -0.7);
    let inv_det = 1.0 / det;
    let dv = 0.5 * (b22 - b33);
    let u = fma(dv, dv, b23 * b23) * inv_det;
    return State(g2, g3, inv_c, b22, b33, b23, inv_det, 0.5 * log1p(t11), 0.25 * log1p(dm), dv, u);
}

// |I_comp|^(p − 1).
fn compaction_power(p: array<f32, PARAMETERS>, i_comp: f32) -> f32 {
    return exp((p[P_COMP] - 1.0) * ln(max(abs(i_comp), TINY)));
}

fn stress(p: array<f32, PARAMETERS>, h: Tensor) -> Tensor {
    let s = state(h);
    let asinh = asinh_ratio(s.u);
    let wu = 0.125 * p[K_DIST] * asinh / sqrt(1.0 + s.u);
    let power = compaction_power(p, s.i_comp);
    let size = abs(s.i_comp);
    let slope = select(p[K_COMP] * p[P_COMP] * power, p[CAP_SLOPE] * size, size < p[CAP]);
    let wc = select(0.0, -slope, s.i_comp < 0.0);
    // T = wu (dev b/det − u C̃⁻¹) + (wc/4) C̃⁻¹
    let k1 = (0.25 * wc - wu * s.u) * s.inv_det;
    let k2 = wu * s.inv_det;
    let t22 = fma(k2, s.dv, k1 * (1.0 + s.b33));
    let t33 = fma(k1, 1.0 + s.b22, -(k2 * s.dv));
    let t23 = (k2 - k1) * s.b23;
    let k_sh = p[K_SH] * s.inv_c * s.inv_c;
    let v2 = fma(t22, s.g2, t23 * s.g3);
    let v3 = fma(t23, s.g2, t33 * s.g3);
    let s12 = fma(k_sh, s.g2, -(2.0 * v2 * s.inv_c));
    let s13 = fma(k_sh, s.g3, -(2.0 * v3 * s.inv_c));
    let g_tg = fma(s.g2, v2, s.g3 * v3);
    let g_g = fma(s.g2, s.g2, s.g3 * s.g3);
    let s11 = s.inv_c * fma(p[K_ELONG], s.i_elong, 2.0 * (g_tg * s.inv_c - k_sh * g_g));
    let pk2 = Tensor(
        vec3<f32>(s11, s12, s13),
        vec3<f32>(s12, 2.0 * t22, 2.0 * t23),
        vec3<f32>(s13, 2.0 * t23, 2.0 * t33),
    );
    return add_product(h, pk2);
}

fn energies(p: array<f32, PARAMETERS>, h: Tensor) -> vec4<f32> {
    let s = state(h);
    let asinh = asinh_ratio(s.u);
    let power = compaction_power(p, s.i_comp);
    let size = abs(s.i_comp);
    let capped = 0.5 * p[CAP_SLOPE] * size * size;
    let comp = select(fma(p[K_COMP] * power, size, p[CAP_ENERGY]), capped, size < p[CAP]);
    let g_g = fma(s.g2, s.g2, s.g3 * s.g3) * s.inv_c * s.inv_c;
    return vec4<f32>(
        0.5 * p[K_ELONG] * s.i_elong * s.i_elong,
        select(0.0, comp, s.i_comp < 0.0),
        0.125 * p[K_DIST] * asinh * asinh * s.u,
        0.5 * p[K_SH] * g_g,
    );
}

fn moduli(p: array<f32, PARAMETERS>, h: Tensor) -> Moduli {
    let s = state(h);
    let size = max(max(abs(s.i_comp), p[CAP]), 1e-6);
    let power = exp((p[P_COMP] - 1.0) * ln(size));
    let slope = p[K_COMP] * p[P_COMP] * power;
    let stressed = select(0.0, 0.5 * slope, s.i_comp < 0.0);
    let tangent = 0.25 * slope * (p[P_COMP] - 1.0) / size;
    let mean = 1.0 + 0.5 * (s.b22 + s.b33);
    let difference = sqrt(fma(s.dv, s.dv, s.b23 * s.b23));
    let smaller = max(mean - difference, 0.01);
    let across = (tangent + 0.25 * p[K_DIST] + stressed) / smaller;
    let g_g = fma(s.g2, s.g2, s.g3 * s.g3);
    let widest = (mean + difference + g_g * s.inv_c) * s.inv_c;
    let shear = p[K_SH] * s.inv_c * (max(1.0, widest) + sqrt(g_g) * s.inv_c);
    let along = p[K_ELONG] * max(1.0 - s.i_elong, 0.0) * s.inv_c;
    return Moduli(across, shear, along, max(p[K_ELONG] * s.i_elong * s.inv_c, 0.0));
}
