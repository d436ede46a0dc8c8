// Vectors of three numbers.

fn norm(a: vec3<f32>) -> f32 {
    return sqrt(dot(a, a));
}

// Matrix, given by its rows, times vector.
fn apply(m: array<vec3<f32>, 3>, a: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(dot(m[0], a), dot(m[1], a), dot(m[2], a));
}
