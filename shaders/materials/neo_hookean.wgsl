// Compressible neo-Hookean solid.

#include "materials/mod"
#include "kernel/math"

const MU: u32 = 0u;
const LAMBDA: u32 = 1u;

// Smallest determinant of F that the logarithm is taken of.
const CRUSHED: f32 = 1e-3;

// |J − 1| below which J − 1 − ln J is taken from its series.
const SMALL: f32 = 0.05;

// How volume changes.
struct Volume {
    // Cofactors of H.
    cofactors: Tensor,
    // tr cof H + det H.
    second: f32,
    j: f32,
    // ln J, and J − 1 − ln J.
    log: f32,
    rest: f32,
}

fn volume_of(h: Tensor) -> Volume {
    let c = Tensor(cross(h[1], h[2]), cross(h[2], h[0]), cross(h[0], h[1]));
    let second = c[0][0] + c[1][1] + c[2][2] + dot(h[0], c[0]);
    let x = h[0][0] + h[1][1] + h[2][2] + second;
    let j = max(jacobian(h), CRUSHED);
    let log = select(log1p(max(x, -0.5)), ln(j), x < -0.5);
    var series = 0.0;
    for (var n = 13; n >= 2; n--) {
        series = fma(series, x, select(-1.0, 1.0, n % 2 == 0) / f32(n));
    }
    return Volume(c, second, j, log, select(j - 1.0 - log, series * x * x, abs(x) < SMALL));
}

fn stress(p: array<f32, PARAMETERS>, h: Tensor) -> Tensor {
    let v = volume_of(h);
    let turned = transpose(h);
    let one = Tensor(vec3<f32>(1.0, 0.0, 0.0), vec3<f32>(0.0, 1.0, 0.0), vec3<f32>(0.0, 0.0, 1.0));
    let shear = v.j * h + turned - v.cofactors + v.second * one;
    let normal = v.cofactors - turned + (1.0 + h[0][0] + h[1][1] + h[2][2]) * one;
    return (p[MU] * shear + (p[LAMBDA] * v.log) * normal) * (1.0 / v.j);
}

fn energies(p: array<f32, PARAMETERS>, h: Tensor) -> vec4<f32> {
    let v = volume_of(h);
    let square = dot(h[0], h[0]) + dot(h[1], h[1]) + dot(h[2], h[2]);
    return vec4<f32>(p[MU] * (0.5 * square - v.second + v.rest) + 0.5 * p[LAMBDA] * v.log * v.log, 0.0, 0.0, 0.0);
}

fn moduli(p: array<f32, PARAMETERS>, h: Tensor) -> Moduli {
    let j = max(jacobian(h), 0.05);
    let square = 1.0 / (j * j);
    let longitudinal = p[LAMBDA] + p[MU] + p[MU];
    let h11 = h[0][0];
    let h21 = h[1][0];
    let h31 = h[2][0];
    let stretch = 1.0 + fma(h31, h31, fma(h21, h21, fma(h11, h11, h11 + h11)));
    return Moduli(
        (longitudinal + p[LAMBDA] * p[LAMBDA] / longitudinal) * square,
        (p[MU] - p[LAMBDA] * ln(min(j, 1.0))) * square,
        longitudinal * square,
        max(p[MU] + (p[LAMBDA] * ln(j) - p[MU]) / stretch, 0.0),
    );
}
