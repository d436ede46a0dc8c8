// The surfaces of yarns as tables of faces, and points carried by nodes: positions are relative to a node.
// The including file binds `reference`, `quanta` and `remainder`; with FACES also `faces`, and with POINTS `nodes` and `points`.

#include "kernel/row"
#include "kernel/vector"
#define REFERENCE
#include "kernel/node"
#define PARAMS
#include "contact/mod"

// A node in an image.
struct Imaged {
    node: u32,
    image: vec2<i32>,
}

// Decodes a coded node and its image.
fn of_coded(coded: u32) -> Imaged {
    return Imaged(coded & 67108863u, vec2<i32>(i32(coded >> 26u & 3u) - 1, i32(coded >> 28u) - 1));
}

// A position relative to another, in the reference and current states.
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

// Reference and current position of a node in an image relative to another node.
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
// Marks of a face: owned edges and corners, the axes x and y along which its body continues, and the body.
fn marks(face: u32) -> u32 {
    return faces[FACE * face + 4u];
}

// Key of the body and lateral image of an entry.
fn body_of(entry: u32) -> u32 {
    let seen = of_key(entry);
    let bits = marks(seen.body);
    let lateral = vec2<i32>(select(seen.image.x, 0, (bits >> 8u & 1u) == 1u), select(seen.image.y, 0, (bits >> 9u & 1u) == 1u));
    return key(bits >> 10u, lateral);
}

// A corner of a face in an image, relative to a point at the offset `aside` from a node.
fn corner(face: u32, a: u32, image: vec2<i32>, base: u32, aside: Offset) -> Offset {
    let own = of_coded(faces[FACE * face + a]);
    let seen = from_node(Imaged(own.node, image + own.image), base);
    return Offset(seen.reference - aside.reference, seen.current - aside.current);
}

// The corners of a face in an image, relative to the same point.
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
// A node that carries a point.
fn carried_by(item: u32, a: u32) -> u32 {
    return of_coded(nodes[CARRIED * item + a]).node;
}

// A point, relative to its first node, in the reference and current states.
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
