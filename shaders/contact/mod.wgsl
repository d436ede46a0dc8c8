// Common to all contact stages: parameters, places and flags of the status buffer, keys of candidates, integer sums of forces.
// STATUS requires the binding `status`, PAIRS also `forces` and `stiffness`; PARAMS requires the parameters.

// Whether a number is finite; tested by its bits, since compilers may assume that every number is.
fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

#if STATUS
#include "kernel/row"

// Raises a shared maximum of non-negative numbers, stored as the bits of an f32.
fn raise(place: u32, value: f32) {
    let bits = bitcast<u32>(value);
    if bits > atomicLoad(&status[place]) {
        atomicMax(&status[place], bits);
    }
}

// The places of a step (NOW), of the step before (BEFORE) or of the next (NEXT).
fn turn(which: u32) -> u32 {
    return FASTEST + 2u * ((u32(row.turn) + which) % 3u);
}

// Largest speed of the nodes of yarns (0) or threads (1) in the last step, mm/s.
fn speed_of(kind: u32) -> f32 {
    return bitcast<f32>(atomicLoad(&status[turn(BEFORE) + kind]));
}
#endif

#if PARAMS
// Constants that all contact stages share; units as in Rust.
struct Params {
    period: vec2<i32>,
    cells: vec2<u32>,
    capacity: u32,
    faces: u32,
    slots: u32,
    beam_slots: u32,
    slabs: u32,
    state: u32,
    origin: vec2<f32>,
    cell: vec2<f32>,
    skin: f32,
    friction: f32,
    tangential: f32,
    damping: f32,
    force_quantum: f32,
    stiffness_quantum: f32,
    thread_radius: f32,
    thread_thread: f32,
    self_arc: f32,
    depth: f32,
    apart: u32,
}

@group(2) @binding(1) var<uniform> params: Params;

// Bound of a loop of at most `most` rounds, the length of the array it runs over. Mesa's software device would treat a bound
// that depends only on uniforms as a constant, unroll the loop, and recompile the shader for every dispatch.
fn bound(count: u32, most: u32) -> u32 {
    return min(count, most);
}

// The decoded key.
struct Keyed {
    body: u32,
    image: vec2<i32>,
}

// Key of a candidate: the touched body or beam and its lateral image, −8 to 7 periods along x and y.
fn key(body: u32, image: vec2<i32>) -> u32 {
    return body << 8u | (u32(image.x + 8) & 15u) << 4u | (u32(image.y + 8) & 15u);
}

// Body and image of a key.
fn of_key(key: u32) -> Keyed {
    return Keyed(key >> 8u, vec2<i32>(i32(key >> 4u & 15u) - 8, i32(key & 15u) - 8));
}
#endif

#if PAIRS
// Up to four nodes with weights.
struct Weighted {
    count: u32,
    nodes: vec4<u32>,
    weights: vec4<f32>,
}

// Adds a force to some nodes and its opposite to others, by weights: as integers, so that the sum is exactly zero.
fn add_pair(push: vec3<f32>, to: Weighted, back_to: Weighted) {
    let plane = arrayLength(&forces) / 3u;
    for (var k = 0u; k < 3u; k++) {
        let force_quanta = push[k] / params.force_quantum;
        if !is_finite(force_quanta) || abs(force_quanta) >= MOST_QUANTA {
            atomicOr(&status[FLAGS], FORCE_RANGE);
            atomicStore(&status[CULPRIT], to.nodes[0]);
            return;
        }
        var rest = to_i32(force_quanta);
        var back = rest;
        for (var i = 0u; i < to.count; i++) {
            var part = rest;
            if i + 1u != to.count {
                part = to_i32(force_quanta * to.weights[i]);
            }
            rest = rest - part;
            atomicAdd(&forces[to.nodes[i] + k * plane], part);
        }
        for (var i = 0u; i < back_to.count; i++) {
            var part = back;
            if i + 1u != back_to.count {
                part = to_i32(force_quanta * back_to.weights[i]);
            }
            back = back - part;
            atomicSub(&forces[back_to.nodes[i] + k * plane], part);
        }
    }
}

// Adds stiffness to nodes by weights.
fn add_stiffness(row_sum: f32, to: Weighted) {
    let stiffness_quanta = row_sum / params.stiffness_quantum;
    for (var i = 0u; i < to.count; i++) {
        atomicAdd(&stiffness[to.nodes[i]], to_i32(stiffness_quanta * abs(to.weights[i])));
    }
}
#endif
