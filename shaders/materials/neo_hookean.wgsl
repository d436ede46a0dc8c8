// Compressible neo-Hookean solid.

#include "materials/mod"
#include "kernel/math"

const MU: u32 = 0u;
const LAMBDA: u32 = 1u;

// Smallest determinant of F that the logarithm is taken of.
const CRUSHED: f32 = 1e-3;

fn stress(p: array<f32, PARAMETERS>, h: Tensor) -> Tensor {
    let f = Tensor(h[0] + vec3<f32>(1.0, 0.0, 0.0), h[1] + vec3<f32>(0.0, 1.0, 0.0), h[2] + vec3<f32>(0.0, 0.0, 1.0));
    let j = max(jacobian(h), CRUSHED);
    let k = (p[LAMBDA] * ln(j) - p[MU]) / j;
    let mu = vec3<f32>(p[MU]);
    // rows of cofactors
    return Tensor(
        fma(mu, f[0], k * cross(f[1], f[2])),
        fma(mu, f[1], k * cross(f[2], f[0])),
        fma(mu, f[2], k * cross(f[0], f[1])),
    );
}

fn energies(p: array<f32, PARAMETERS>, h: Tensor) -> vec4<f32> {
    let log = ln(max(jacobian(h), CRUSHED));
    let trace = h[0][0] + h[1][1] + h[2][2];
    let strain = 2.0 * trace + dot(h[0], h[0]) + dot(h[1], h[1]) + dot(h[2], h[2]);
    return vec4<f32>(p[MU] * (0.5 * strain - log) + 0.5 * p[LAMBDA] * log * log, 0.0, 0.0, 0.0);
}

fn stiffness(p: array<f32, PARAMETERS>, h: Tensor) -> f32 {
    let j = max(jacobian(h), 0.05);
    return (p[LAMBDA] + p[MU] + p[MU]) / (j * j);
}

fn along(p: array<f32, PARAMETERS>) -> f32 {
    return p[LAMBDA] + p[MU] + p[MU];
}
