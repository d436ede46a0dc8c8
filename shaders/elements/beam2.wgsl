// Axial part of a 2-node beam. The including file binds `ends`, `beams`, `quanta` and `remainder`, and with VIRIAL in periodic
// scenes also `virial`.

#if ROOT
#define VIRIAL
#endif

#include "kernel/row"
#include "kernel/node"
#include "kernel/vector"

// The reference vector of a beam and its change, mm.
struct Beam {
    reference: vec3<f32>,
    change: vec3<f32>,
}

fn vector(beam: u32) -> Beam {
    let at = TABLE * beam;
    let reference = vec3<f32>(beams[at], beams[at + 1u], beams[at + 2u]);
    let fluctuation = displacement_between(ends[2u * beam + 1u], ends[2u * beam]);
#if PERIODIC
    return Beam(reference, apply(gradient(), reference) + fluctuation);
#else
    return Beam(reference, fluctuation);
#endif
}

#if VIRIAL
#if PERIODIC
// Adds `force ⊗ reference` to the nine numbers of an item in the buffer bound as `virial`.
fn add_virial(item: u32, force: vec3<f32>, reference: vec3<f32>) {
    add_row(9u * item, force.x * reference);
    add_row(9u * item + 3u, force.y * reference);
    add_row(9u * item + 6u, force.z * reference);
}

fn add_row(at: u32, row: vec3<f32>) {
    virial[at] = virial[at] + row.x;
    virial[at + 1u] = virial[at + 1u] + row.y;
    virial[at + 2u] = virial[at + 2u] + row.z;
}
#endif
#endif

#if ROOT
fn force(beam: u32) {
    let b = vector(beam);
    let rest = beams[TABLE * beam + 3u];
    let axial = beams[TABLE * beam + 4u];
    let current = b.reference + b.change;
    let length = norm(current);
    var strain = (2.0 * dot(b.reference, b.change) + dot(b.change, b.change)) / (rest * (length + rest));
#if THERMAL
    strain = strain - thermal_strain[beam] * row.thermal;
#endif
    let tension = axial * strain;
    let along = current * (tension / length);
    forces[3u * beam] = along.x;
    forces[3u * beam + 1u] = along.y;
    forces[3u * beam + 2u] = along.z;
    tensions[beam] = tension;
#if THERMAL
    work[beam] = work[beam] - tension * rest * thermal_strain[beam] * row.thermal_increment;
#endif
#if PERIODIC
    add_virial(beam, along, b.reference);
#endif
}
#endif
