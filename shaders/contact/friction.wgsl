// Coulomb friction with true stick.

#include "kernel/vector"

// Result of one friction step.
struct Slide {
    elastic: vec3<f32>,
    slip: f32,
    dissipated: f32,
}

// Tangential part of a vector for a unit normal.
fn flat_part(normal: vec3<f32>, a: vec3<f32>) -> vec3<f32> {
    return normal * -dot(normal, a) + a;
}

// Advances the tangential displacement `elastic` by `motion` (mm) on a surface with unit normal `normal`, tangential stiffness
// `tangential` (N/mm) and largest force `limit` (N).
fn slide(elastic: vec3<f32>, motion: vec3<f32>, normal: vec3<f32>, tangential: f32, limit: f32) -> Slide {
    let turned = flat_part(normal, elastic);
    let trial = turned + flat_part(normal, motion);
    let size = norm(trial);
    let held = size * tangential;
    let half_stiffness = 0.5 * tangential;
    var new_elastic = trial;
    if held > limit {
        new_elastic = trial * (limit / held);
    }
    let gone = trial - new_elastic;
    // work over the step with the mean of the old and new forces, minus the stored energy
    let lost = (dot(elastic, elastic) - dot(turned, turned)) + dot(turned + new_elastic, gone);
    return Slide(new_elastic, norm(gone), half_stiffness * lost);
}
