// Ties: a node that is held at a point of another body's surface by a spring.

#include "kernel/vector"
#include "kernel/node"
#define STATUS
#define PARAMS
#define PAIRS
#include "contact/mod"

// Nodes of a tie: the one that is held, and the corners of the face that holds it.
const NODES: u32 = 5u;
// Numbers of a tie: weights of the corners; stiffness, N/mm.
const VALUES: u32 = 5u;

#if ROOT
@group(1) @binding(0) var<storage, read> ties: array<u32>;
@group(1) @binding(1) var<storage, read> values: array<f32>;
@group(1) @binding(2) var<storage, read> quanta: array<i32>;
@group(1) @binding(3) var<storage, read> remainder: array<f32>;
@group(1) @binding(4) var<storage, read_write> energies: array<f32>;
@group(1) @binding(5) var<storage, read_write> forces: array<atomic<i32>>;
@group(1) @binding(6) var<storage, read_write> stiffness: array<atomic<i32>>;
@group(1) @binding(7) var<storage, read_write> status: array<atomic<u32>>;

// Forces of ties.
fn tie(item: u32) {
    let n = NODES * item;
    let v = VALUES * item;
    let held = ties[n];
    let corners = Weighted(
        4u,
        vec4<u32>(ties[n + 1u], ties[n + 2u], ties[n + 3u], ties[n + 4u]),
        vec4<f32>(values[v], values[v + 1u], values[v + 2u], values[v + 3u]),
    );
    let spring = values[v + 4u];
    // from the held node to its place on the face
    var gap = vec3<f32>(0.0);
    for (var a = 0u; a < 4u; a++) {
        gap = displacement_between(corners.nodes[a], held) * corners.weights[a] + gap;
    }
    energies[item] = 0.5 * spring * dot(gap, gap);
    let one = Weighted(1u, vec4<u32>(held, 0u, 0u, 0u), vec4<f32>(1.0, 0.0, 0.0, 0.0));
    add_pair(gap * spring, one, corners);
    add_stiffness(2.0 * spring, corners);
    add_stiffness(2.0 * spring, one);
}
#endif
