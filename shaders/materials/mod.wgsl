// What constitutive laws share. A law has `stress`, `energies` (by mode; `energy` is an entry point) and `moduli`.

// A 3 × 3 tensor; element [i] is row i, so that `v * t` is the tensor times v.
alias Tensor = mat3x3<f32>;

// Upper estimates of tangent stiffness: of the section, in longitudinal shear, of the fibre, and of its tension.
struct Moduli {
    across: f32,
    shear: f32,
    along: f32,
    tension: f32,
}

// Row sum of a corner's stiffness per volume, less that of the fibre: from the sizes of the derivatives of its shape function
// along each axis and across the fibre, and their sums over all corners.
fn moduli_rows(m: Moduli, slope: vec3<f32>, across: f32, sum: vec3<f32>, sum_across: f32) -> f32 {
    // motion of the corner across the fibre, and along it
    let along = slope.x * (m.shear * (sum.x + sum_across) + m.tension * sum.x);
    let sideways = fma(m.across * across, sum_across, along);
    let lengthways = m.shear * fma(across, sum.x, fma(slope.y, sum.y, slope.z * sum.z));
    return max(sideways, lengthways);
}

// Determinant of I + H.
fn jacobian(h: Tensor) -> f32 {
    let a = 1.0 + h[0][0];
    let b = 1.0 + h[1][1];
    let c = 1.0 + h[2][2];
    let x = b * c - h[1][2] * h[2][1];
    let y = h[1][0] * c - h[1][2] * h[2][0];
    let z = h[1][0] * h[2][1] - b * h[2][0];
    return a * x - h[0][1] * y + h[0][2] * z;
}

// (I + H) S.
fn add_product(h: Tensor, s: Tensor) -> Tensor {
    return Tensor(add_row(h[0], s, s[0]), add_row(h[1], s, s[1]), add_row(h[2], s, s[2]));
}

fn add_row(h: vec3<f32>, s: Tensor, to: vec3<f32>) -> vec3<f32> {
    return fma(vec3<f32>(h.z), s[2], fma(vec3<f32>(h.y), s[1], fma(vec3<f32>(h.x), s[0], to)));
}
