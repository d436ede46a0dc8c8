// A face of a yarn's closed surface, seen from a point that may touch it: a bilinear quadrilateral, its edges and its corners.
// What includes this binds `reference`, `quanta` and `remainder`; with FACES also `faces`, and with POINTS `nodes` and `points`.

#include "kernel/row"
#include "kernel/vector"
#define REFERENCE
#include "kernel/node"
#define PARAMS
#include "contact/mod"

// Integers of a face: four coded corners, counter-clockwise seen from outside; its marks.
const FACE: u32 = 5u;

// A node in an image.
struct Imaged {
    node: u32,
    image: vec2<i32>,
}

// Node and image of a coded one.
fn of_coded(coded: u32) -> Imaged {
    return Imaged(coded & 67108863u, vec2<i32>(i32(coded >> 26u & 3u) - 1, i32(coded >> 28u) - 1));
}

// A place relative to another one, in the reference and now.
struct Offset {
    reference: vec3<f32>,
    current: vec3<f32>,
}

// The corners of a face relative to a point.
struct Corners {
    nodes: vec4<u32>,
    reference: array<vec3<f32>, 4>,
    current: array<vec3<f32>, 4>,
}

// Remainder of a division by a positive number, rounded down.
fn rem_euclid(a: i32, n: i32) -> i32 {
    let r = a % n;
    return select(r, r + n, r < 0);
}

// Reference and current position of a node in an image relative to another one.
fn from_node(seen: Imaged, base: u32) -> Offset {
#if PERIODIC
    let rest = lattice_between(seen.node, base, seen.image * params.period);
    return Offset(rest, (rest + apply(gradient(), rest)) + displacement_between(seen.node, base));
#else
    let rest = lattice_between(seen.node, base, vec2<i32>(0));
    return Offset(rest, rest + displacement_between(seen.node, base));
#endif
}

#if FACES
// Marks of a face: owned edges and corners, along which of x and y its body goes on, and the body.
fn marks(face: u32) -> u32 {
    return faces[FACE * face + 4u];
}

// Key of the body and the lateral image that an entry belongs to.
fn body_of(entry: u32) -> u32 {
    let seen = of_key(entry);
    let bits = marks(seen.body);
    let lateral = vec2<i32>(select(seen.image.x, 0, (bits >> 8u & 1u) == 1u), select(seen.image.y, 0, (bits >> 9u & 1u) == 1u));
    return key(bits >> 10u, lateral);
}

// A corner of a face in an image, seen from a point that lies `aside` beside a node.
fn corner(face: u32, a: u32, image: vec2<i32>, base: u32, aside: Offset) -> Offset {
    let own = of_coded(faces[FACE * face + a]);
    let seen = from_node(Imaged(own.node, image + own.image), base);
    return Offset(seen.reference - aside.reference, seen.current - aside.current);
}

// The corners of a face in an image, seen from there.
fn corners(face: u32, image: vec2<i32>, base: u32, aside: Offset) -> Corners {
    let c0 = corner(face, 0u, image, base, aside);
    let c1 = corner(face, 1u, image, base, aside);
    let c2 = corner(face, 2u, image, base, aside);
    let c3 = corner(face, 3u, image, base, aside);
    let f = FACE * face;
    return Corners(
        vec4<u32>(faces[f], faces[f + 1u], faces[f + 2u], faces[f + 3u]) & vec4<u32>(67108863u),
        array<vec3<f32>, 4>(c0.reference, c1.reference, c2.reference, c3.reference),
        array<vec3<f32>, 4>(c0.current, c1.current, c2.current, c3.current),
    );
}
#endif

#if POINTS
// Integers and numbers of a point, and integers before the entries of a list and before the keys of a point, see the twin of
// `contact/penalty`.
const CARRIED: u32 = 5u;
const POINT: u32 = 6u;
const MADE: u32 = 1u;
// Nodes that carry a point.
#if THREAD
const CARRIED_BY: u32 = 4u;
#else
const CARRIED_BY: u32 = 1u;
#endif

// A node that carries a point.
fn carried_by(item: u32, a: u32) -> u32 {
    return of_coded(nodes[CARRIED * item + a]).node;
}

// A point, relative to its first node, in the reference and now.
fn point_of(item: u32) -> Offset {
    let base = carried_by(item, 0u);
    var at = Offset(vec3<f32>(0.0), vec3<f32>(0.0));
    for (var a = 1u; a < CARRIED_BY; a++) {
        let seen = from_node(of_coded(nodes[CARRIED * item + a]), base);
        let weight = points[POINT * item + a];
        at = Offset(seen.reference * weight + at.reference, seen.current * weight + at.current);
    }
    return at;
}
#endif

// Middle and derivatives of a bilinear face.
struct Patch {
    middle: vec3<f32>,
    along: vec3<f32>,
    across: vec3<f32>,
    twist: vec3<f32>,
}

fn patch_of(q: array<vec3<f32>, 4>) -> Patch {
    let s01 = q[0] + q[1];
    let s23 = q[2] + q[3];
    let d01 = q[1] - q[0];
    let d32 = q[2] - q[3];
    return Patch((s01 + s23) * 0.25, (d01 + d32) * 0.25, (s23 - s01) * 0.25, (d32 - d01) * 0.25);
}

// No point of the face is nearer to the origin than this, mm; negative if some may be anywhere.
fn nearest(p: Patch) -> f32 {
    let a = p.along + p.across;
    let b = p.along - p.across;
    return norm(p.middle) - sqrt(max(dot(a, a), dot(b, b))) - norm(p.twist);
}

fn at(p: Patch, xi: f32, eta: f32) -> vec3<f32> {
    return p.twist * (xi * eta) + (p.across * eta + (p.along * xi + p.middle));
}

// Coordinates of the point of the unbounded patch that is closest to the origin, see the twin.
fn project(p: Patch) -> vec2<f32> {
    var xi = 0.0;
    var eta = 0.0;
    for (var i = 0; i < 6; i++) {
        let t1 = p.twist * eta + p.along;
        let t2 = p.twist * xi + p.across;
        let r = at(p, xi, eta);
        let g11 = dot(t1, t1);
        let flat = dot(t1, t2);
        let g22 = dot(t2, t2);
        let warped = flat + dot(p.twist, r);
        let g12 = select(flat, warped, warped * warped < 0.9 * (g11 * g22));
        let b1 = dot(t1, r);
        let b2 = dot(t2, r);
        let inverse = 1.0 / max(g11 * g22 - g12 * g12, 1e-30);
        let dx = (g12 * b2 - g22 * b1) * inverse;
        let dy = (g12 * b1 - g11 * b2) * inverse;
        xi = max(min(xi + dx, 2.0), -2.0);
        eta = max(min(eta + dy, 2.0), -2.0);
        if abs(dx) + abs(dy) < 1e-5 {
            break;
        }
    }
    return vec2<f32>(xi, eta);
}

// The point of a face closest to the origin.
struct Closest {
    weights: vec4<f32>,
    away: vec3<f32>,
    distance: f32,
    height: f32,
    interior: bool,
}

// The point of an edge closest to the origin, or a corner.
struct OnEdge {
    weights: vec4<f32>,
    offset: vec3<f32>,
    square: f32,
}

// The closest point of the edge from corner `a` to the next one.
fn on_edge(q: array<vec3<f32>, 4>, a: u32) -> OnEdge {
    var places = q;
    let b = (a + 1u) % 4u;
    let along = places[b] - places[a];
    let share = min(max(-dot(places[a], along) / dot(along, along), 0.0), 1.0);
    var weights = vec4<f32>(0.0);
    weights[a] = 1.0 - share;
    weights[b] = share;
    let offset = (along * share + places[a]) * -1.0;
    return OnEdge(weights, offset, dot(offset, offset));
}

// A corner.
fn on_corner(q: array<vec3<f32>, 4>, a: u32) -> OnEdge {
    var places = q;
    var weights = vec4<f32>(0.0);
    weights[a] = 1.0;
    let offset = places[a] * -1.0;
    return OnEdge(weights, offset, dot(offset, offset));
}

// The closest point of a face: where the origin projects into it, else on the nearest of its edges.
fn closest(q: array<vec3<f32>, 4>, p: Patch) -> Closest {
    let on = project(p);
    if abs(on.x) <= 1.0 && abs(on.y) <= 1.0 {
        let n = cross(p.twist * on.y + p.along, p.twist * on.x + p.across);
        let normal = n * (1.0 / max(norm(n), 1e-20));
        let height = -dot(at(p, on.x, on.y), normal);
        let a = 1.0 - on.x;
        let b = 1.0 + on.x;
        let c = 1.0 - on.y;
        let d = 1.0 + on.y;
        let weights = vec4<f32>(0.25 * a * c, 0.25 * b * c, 0.25 * b * d, 0.25 * a * d);
        return Closest(weights, select(normal, normal * -1.0, height < 0.0), abs(height), height, true);
    }
    var best = on_edge(q, 0u);
    for (var a = 1u; a < 4u; a++) {
        let other = on_edge(q, a);
        if other.square < best.square {
            best = other;
        }
    }
    let w = best.weights;
    let xi = 2.0 * (w[1] + w[2]) - 1.0;
    let eta = 2.0 * (w[2] + w[3]) - 1.0;
    let n = cross(p.twist * eta + p.along, p.twist * xi + p.across);
    let distance = sqrt(best.square);
    let away = best.offset * (1.0 / max(distance, 1e-12));
    return Closest(w, away, distance, dot(best.offset, n) / max(norm(n), 1e-20), false);
}
