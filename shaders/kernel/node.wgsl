// Access to nodal state: three planes (x, y, z) per buffer. Bound as `quanta` and `remainder`, with REFERENCE also
// `reference`, with VELOCITY also `velocity`.

#include "kernel/position"

// Displacement of `a` minus displacement of `b`, mm.
fn displacement_between(a: u32, b: u32) -> vec3<f32> {
    let plane = arrayLength(&remainder) / 3u;
    let ay = a + plane;
    let az = ay + plane;
    let by = b + plane;
    let bz = by + plane;
    return vec3<f32>(
        difference(quanta[a], remainder[a], quanta[b], remainder[b]),
        difference(quanta[ay], remainder[ay], quanta[by], remainder[by]),
        difference(quanta[az], remainder[az], quanta[bz], remainder[bz]),
    );
}

#if VELOCITY
// Velocity of a node, mm/s.
fn velocity_at(node: u32) -> vec3<f32> {
    let plane = arrayLength(&velocity) / 3u;
    return vec3<f32>(velocity[node], velocity[node + plane], velocity[node + 2u * plane]);
}
#endif

#if REFERENCE
// Reference position of `a` minus that of `b`, plus whole quanta `shift` along x and y, mm.
fn lattice_between(a: u32, b: u32, shift: vec2<i32>) -> vec3<f32> {
    let plane = arrayLength(&reference) / 3u;
    let base = vec3<i32>(reference[b], reference[b + plane], reference[b + 2u * plane]);
    let to = vec3<i32>(reference[a], reference[a + plane], reference[a + 2u * plane]);
    return vec3<f32>(to - base + vec3<i32>(shift, 0)) * QUANTUM;
}
#endif
