// Compressible neo-Hookean solid.

#include "materials/mod"
#include "kernel/math"

// Strain of a volume: C − I, tr cof t + det t, det F, ln J, and φ(x).
struct Strain {
    t: Tensor,
    second: f32,
    j: f32,
    log: f32,
    rest: f32,
}

fn cofactors(a: Tensor) -> Tensor {
    return Tensor(cross(a[1], a[2]), cross(a[2], a[0]), cross(a[0], a[1]));
}

fn strain(h: Tensor) -> Strain {
    // row i of a product a * b in this layout is that of b a
    let t = symmetric(h + transpose(h) + h * transpose(h));
    let c = cofactors(t);
    let second = c[0][0] + c[1][1] + c[2][2] + dot(t[0], c[0]);
    let x = t[0][0] + t[1][1] + t[2][2] + second;
    let j = max(jacobian(h), CRUSHED);
    let log = select(0.5 * log1p(max(x, -0.5)), ln(j), x < -0.5);
    var series = 0.0;
    for (var n = i32(TERMS); n >= 2; n--) {
        series = fma(series, x, select(-1.0, 1.0, n % 2 == 0) / f32(n));
    }
    return Strain(t, second, j, log, select(x - (log + log), series * x * x, abs(x) < SMALL));
}

fn stress(p: array<f32, PARAMETERS>, h: Tensor) -> Tensor {
    let s = strain(h);
    let one = Tensor(vec3<f32>(1.0, 0.0, 0.0), vec3<f32>(0.0, 1.0, 0.0), vec3<f32>(0.0, 0.0, 1.0));
    let c = cofactors(one + s.t);
    let square = s.j * s.j;
    return add_product(h, symmetric((p[MU] / square) * (s.t * c) + (p[LAMBDA] * s.log / square) * c));
}

// The upper triangle on both sides.
fn symmetric(a: Tensor) -> Tensor {
    return Tensor(a[0], vec3<f32>(a[0].y, a[1].yz), vec3<f32>(a[0].z, a[1].z, a[2].z));
}

fn energies(p: array<f32, PARAMETERS>, h: Tensor) -> vec4<f32> {
    let s = strain(h);
    return vec4<f32>(0.5 * (p[MU] * (s.rest - s.second) + p[LAMBDA] * s.log * s.log), 0.0, 0.0, 0.0);
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
