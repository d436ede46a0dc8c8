// A face of a yarn's surface, seen from a contact point: a bilinear quadrilateral, its edges and its corners.

#include "kernel/vector"

// Centre and derivatives of a bilinear face.
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

// Lower bound of the distance of the face from the origin, mm; negative if there is no bound.
fn nearest(p: Patch) -> f32 {
    let a = p.along + p.across;
    let b = p.along - p.across;
    return norm(p.middle) - sqrt(max(dot(a, a), dot(b, b))) - norm(p.twist);
}

fn at(p: Patch, xi: f32, eta: f32) -> vec3<f32> {
    return p.twist * (xi * eta) + (p.across * eta + (p.along * xi + p.middle));
}

// Closest-point projection of the origin onto the unbounded patch, see the twin.
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
}

// The point of an edge closest to the origin, or a corner.
struct OnEdge {
    weights: vec4<f32>,
    offset: vec3<f32>,
    square: f32,
}

// The place of corner `a`. An array that is indexed by a variable would be memory.
fn place(q: array<vec3<f32>, 4>, a: u32) -> vec3<f32> {
    return select(select(q[0], q[1], a == 1u), select(q[2], q[3], a == 3u), a > 1u);
}

// A weight for corner `a` alone.
fn only(a: u32, weight: f32) -> vec4<f32> {
    return select(vec4<f32>(), vec4<f32>(weight), vec4<u32>(0u, 1u, 2u, 3u) == vec4<u32>(a));
}

// The closest point of the edge from corner `a` to the next one.
fn on_edge(q: array<vec3<f32>, 4>, a: u32) -> OnEdge {
    let b = (a + 1u) % 4u;
    let start = place(q, a);
    let along = place(q, b) - start;
    let share = min(max(-dot(start, along) / dot(along, along), 0.0), 1.0);
    let offset = (along * share + start) * -1.0;
    return OnEdge(only(a, 1.0 - share) + only(b, share), offset, dot(offset, offset));
}

// A corner.
fn on_corner(q: array<vec3<f32>, 4>, a: u32) -> OnEdge {
    let offset = place(q, a) * -1.0;
    return OnEdge(only(a, 1.0), offset, dot(offset, offset));
}

// The closest point of a face: the projection of the origin if it lies inside, else the closest point of the nearest edge.
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
        return Closest(weights, select(normal, normal * -1.0, height < 0.0), abs(height), height);
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
    return Closest(w, away, distance, dot(best.offset, n) / max(norm(n), 1e-20));
}
