// Where a beam is in contact with other beams: its chord, moved out by the mean height of the arc that it stands for.
// What includes this binds `neighbours` and `shares`, and what `elements/beam2` asks for.

#include "contact/mod"
#include "elements/beam2"

// From a beam's chord to its line, in the reference and now, mm.
struct Bow {
    reference: vec3<f32>,
    current: vec3<f32>,
}

fn bow(beam: u32) -> Bow {
    let before = vector(neighbours[2u * beam]);
    let behind = vector(neighbours[2u * beam + 1u]);
    let p = shares[2u * beam];
    let q = shares[2u * beam + 1u];
    let rest = before.reference * p - behind.reference * q;
    return Bow(rest, rest + (before.change * p - behind.change * q));
}

#if PAIRS
// Nodes of a point at `s` (0 to 1) on a beam's line, with its weights.
fn line_nodes(beam: u32, s: f32) -> Weighted {
    let p = shares[2u * beam];
    let q = shares[2u * beam + 1u];
    let first = ends[2u * neighbours[2u * beam]];
    let last = ends[2u * neighbours[2u * beam + 1u] + 1u];
    let nodes = vec4<u32>(first, ends[2u * beam], ends[2u * beam + 1u], last);
    return Weighted(4u, nodes, vec4<f32>(-p, 1.0 - s + p, s + q, -q));
}

// The sum of the sizes of these weights.
fn line_weights(beam: u32) -> f32 {
    let sum = shares[2u * beam] + shares[2u * beam + 1u];
    return 1.0 + sum + sum;
}
#endif
