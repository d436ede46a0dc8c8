// Kinetic energy, and strain energy of stretched threads, as totals.

#include "dynamics/totals"

#if ROOT
#if TOTAL
#include "kernel/row"
#include "kernel/position"
#endif

struct Params {
    count: u32,
    length: u32,
    into: u32,
    centre_x: i32,
    centre_y: i32,
    centre_z: i32,
}

@group(2) @binding(1) var<uniform> params: Params;

#if kinetic
fn kinetic(item: u32, local: u32) {
    let first = item * params.length;
    let end = min(first + params.length, params.count);
    let plane = arrayLength(&mass);
    var found = 0.0;
    for (var node = first + local; node < end; node += WORKGROUP) {
        var v = vec3<f32>(velocity[node], velocity[node + plane], velocity[node + 2u * plane]);
#if TOTAL
        let quanta = vec3<i32>(
            reference[node] - params.centre_x,
            reference[node + plane] - params.centre_y,
            reference[node + 2u * plane] - params.centre_z,
        );
        let x = vec3<f32>(quanta) * QUANTUM;
        let rate = rate();
        v = v + vec3<f32>(dot(rate[0], x), dot(rate[1], x), dot(rate[2], x));
#endif
        found = found + 0.5 * mass[node] * dot(v, v);
    }
    let total = add_up(found, local);
    if local == 0u {
        totals[params.into + item] = total;
    }
}
#endif

#if axial
fn axial(item: u32, local: u32) {
    let first = item * params.length;
    let end = min(first + params.length, params.count);
    var found = 0.0;
    for (var beam = first + local; beam < end; beam += WORKGROUP) {
        let length = beams[TABLE * beam + 3u];
        let stiffness = beams[TABLE * beam + 4u];
        found = found + 0.5 * tension[beam] * tension[beam] / stiffness * length;
    }
    let total = add_up(found, local);
    if local == 0u {
        totals[params.into + item] = total;
    }
}
#endif
#endif
