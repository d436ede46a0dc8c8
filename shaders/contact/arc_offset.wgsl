// The contact line of a thread against other threads: a line through its nodes, offset to the mean of the arcs that its beams
// represent.
// The including file binds `neighbours` and `shares`, and the buffers that `elements/beam2` requires.

#include "contact/mod"
#include "elements/beam2"

// A piece of the line: vectors from the first node of its beam to both its ends, in the reference and current states, mm.
struct Piece {
    rest: array<vec3<f32>, 2>,
    now: array<vec3<f32>, 2>,
}

fn shares_of(beam: u32) -> vec4<f32> {
    let at = SHARES * beam;
    return vec4<f32>(shares[at], shares[at + 1u], shares[at + 2u], shares[at + 3u]);
}

fn piece_ends(share: vec4<f32>, before: vec3<f32>, own: vec3<f32>, behind: vec3<f32>) -> array<vec3<f32>, 2> {
    let first = before * share.x - own * share.y;
    let second = own * share.z - behind * share.w;
    return array<vec3<f32>, 2>(first, own + second);
}

// The piece of a beam.
fn piece(beam: u32) -> Piece {
    let share = shares_of(beam);
    let before = vector(neighbours[NEIGHBOURS * beam]);
    let own = vector(beam);
    let behind = vector(neighbours[NEIGHBOURS * beam + 1u]);
    let rest = piece_ends(share, before.reference, own.reference, behind.reference);
    let change = piece_ends(share, before.change, own.change, behind.change);
    return Piece(rest, array<vec3<f32>, 2>(rest[0] + change[0], rest[1] + change[1]));
}

// Whether two beams belong to the same thread here, with a distance along it below `arc`, after a number of turns of a closed
// thread.
fn are_near_after(turns: i32, a: u32, b: u32, image: vec2<i32>, arc: f32) -> bool {
    let wrap = vec2<i32>(i32(neighbours[NEIGHBOURS * a + 3u]), i32(neighbours[NEIGHBOURS * a + 4u]));
    let p = SHARES * a + ARC;
    let q = SHARES * b + ARC;
    let reach = arc + 0.5 * (shares[p + 1u] + shares[q + 1u]);
    return all(wrap * turns == image) && abs(shares[q] - shares[p] + f32(turns) * shares[p + 2u]) < reach;
}

// Whether two beams, the second in an image, belong to the same thread here, with a distance along it below `arc` from end to end.
fn are_near(a: u32, b: u32, image: vec2<i32>, arc: f32) -> bool {
    let is_same = neighbours[NEIGHBOURS * a + 2u] == neighbours[NEIGHBOURS * b + 2u];
    return is_same
        && (are_near_after(0, a, b, image, arc) || are_near_after(1, a, b, image, arc) || are_near_after(-1, a, b, image, arc));
}

#if PAIRS
// The four nodes that carry a piece.
fn nodes_of(beam: u32) -> vec4<u32> {
    let first = ends[2u * neighbours[NEIGHBOURS * beam]];
    let last = ends[2u * neighbours[NEIGHBOURS * beam + 1u] + 1u];
    return vec4<u32>(first, ends[2u * beam], ends[2u * beam + 1u], last);
}

// Weights of these nodes at both ends of the piece.
fn weights_of(beam: u32) -> array<vec4<f32>, 2> {
    let share = shares_of(beam);
    return array<vec4<f32>, 2>(
        vec4<f32>(-share.x, 1.0 + share.x + share.y, -share.y, 0.0),
        vec4<f32>(0.0, -share.z, 1.0 + share.z + share.w, -share.w),
    );
}

// The largest sum of the absolute values of these weights.
fn most_weights(beam: u32) -> f32 {
    let share = shares_of(beam);
    let largest = max(share.x + share.y, share.z + share.w);
    return 1.0 + largest + largest;
}

// The beam before another beam in an image, and its image; itself at the start of a thread.
fn before_of(beam: u32, image: vec2<i32>) -> Keyed {
    let at = NEIGHBOURS * beam;
    let before = neighbours[at];
    if before > beam {
        // the first beam of a closed thread follows the last
        return Keyed(before, image - vec2<i32>(i32(neighbours[at + 3u]), i32(neighbours[at + 4u])));
    }
    return Keyed(before, image);
}
#endif
