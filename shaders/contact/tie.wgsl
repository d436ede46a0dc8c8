// Ties: springs that hold a node at a point of another body's surface.

#include "kernel/vector"
#include "kernel/node"
#define STATUS
#define PARAMS
#define PAIRS
#include "contact/mod"

#if ROOT
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
    // from the tied node to its point on the face
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
