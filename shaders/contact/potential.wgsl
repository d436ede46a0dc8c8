// The potential of a point near the closed surface of a body, and what pushes the point; see the twin.

#include "contact/surface"
#include "contact/face"

// How much farther than what is nearest, at a `distance`, a face may be and still count as equally near, with room, mm.
fn margin(distance: f32) -> f32 {
    return 2.0 * TIE * distance + GAP_ROUNDING;
}

// A point that may touch something.
struct Point {
    item: u32,
    base: u32,
    aside: Offset,
    stiff: f32,
    full_radius: f32,
    radius: f32,
    size: f32,
}

// Where the surface of a body is nearest to a point: the entry of its face, unit vector from there, distance, height above the face.
struct Nearest {
    found: bool,
    entry: u32,
    away: vec3<f32>,
    distance: f32,
    height: f32,
}

// How a face, with the edges and corners that it owns, pushes a point: what acts on its corners; energy, sum of forces, features.
struct Push {
    pull: array<vec3<f32>, 4>,
    energy: f32,
    pressing: f32,
    count: f32,
}

// A face of a list that was looked at.
struct Seen {
    entry: u32,
    corners: Corners,
    point: Closest,
    push: Push,
}

// What a body does to a point, see the twin.
struct Pushed {
    nearest: Nearest,
    last: Seen,
    inside: bool,
    push: vec3<f32>,
    energy: f32,
    pressing: f32,
    features: f32,
    shared_force: f32,
    motion: vec3<f32>,
    apart: vec3<f32>,
    inverse_mass: f32,
}

// Whether a place is nearer than what is known.
fn is_nearer(pushed: ptr<function, Pushed>, point: Closest) -> bool {
    let known = (*pushed).nearest;
    let tie = known.distance * TIE + 0.1 * GAP_ROUNDING;
    let apart = point.distance - known.distance;
    return !known.found || apart < -tie || apart <= tie && abs(point.height) > abs(known.height);
}

// Whether the point is behind the nearest place that is known, no deeper than what is pushed out, nor than `most`, which it can have
// come to since it was looked at: at a corner of a crumpled surface, a point in front may look as if it were behind.
fn is_behind(pushed: ptr<function, Pushed>, most: f32) -> bool {
    let known = (*pushed).nearest;
    return known.found && known.height < 0.0 && known.distance < min(most, params.depth);
}

// Distance from which on a face cannot change what is nearest, mm.
fn beyond(pushed: ptr<function, Pushed>) -> f32 {
    return (*pushed).nearest.distance * (1.0 - 2.0 * TIE) - 0.2 * GAP_ROUNDING;
}

// Adds a force on the point, `away` from a place by weights of the corners, and its energy.
fn add_push(push: ptr<function, Push>, weights: vec4<f32>, away: vec3<f32>, size: f32, energy: f32) {
    (*push).energy = (*push).energy + energy;
    (*push).pressing = (*push).pressing + size;
    for (var a = 0u; a < 4u; a++) {
        (*push).pull[a] = away * -(size * weights[a]) + (*push).pull[a];
    }
}

// Adds an edge or a corner within the radius, with its sign in the sum.
fn add_border(push: ptr<function, Push>, here: Point, border: OnEdge, side: f32) {
    if border.square < here.radius * here.radius {
        let distance = sqrt(border.square);
        let depth = here.radius - distance;
        let size = side * (here.stiff * depth);
        let away = border.offset * (1.0 / max(distance, 1e-12));
        add_push(push, border.weights, away, size, 0.5 * size * depth);
        (*push).count = (*push).count + max(side, 0.0);
    }
}

// How a face pushes, by its marks.
fn push_of_face(here: Point, q: array<vec3<f32>, 4>, bits: u32, point: Closest) -> Push {
    var push = Push(array<vec3<f32>, 4>(), 0.0, 0.0, 0.0);
    let depth = here.radius - point.distance;
    if !(depth > 0.0) {
        return push;
    }
    let size = here.stiff * depth;
    add_push(&push, point.weights, point.away, size, 0.5 * size * depth);
    push.count = 1.0;
    for (var a = 0u; a < 4u; a++) {
        if (bits >> a & 1u) == 1u {
            add_border(&push, here, on_edge(q, a), -1.0);
        }
        if (bits >> (4u + a) & 1u) == 1u {
            add_border(&push, here, on_corner(q, a), 1.0);
        }
    }
    return push;
}

// Force and energy that push a point out that is inside and so far from the surface.
fn out_force(here: Point, depth: f32) -> f32 {
    return here.stiff * ((here.radius + depth) + max(here.radius - depth, 0.0));
}

fn out_energy(here: Point, depth: f32) -> f32 {
    let whole = here.radius + depth;
    let outside = max(here.radius - depth, 0.0);
    return 0.5 * here.stiff * (whole * whole - outside * outside);
}

// Adds what pushes a point out that is inside; returns how deep it is, mm.
fn push_out(here: Point, pushed: ptr<function, Pushed>) -> f32 {
    let known = (*pushed).nearest;
    let size = out_force(here, known.distance);
    (*pushed).inside = true;
    (*pushed).push = known.away * -size + (*pushed).push;
    (*pushed).energy = (*pushed).energy + out_energy(here, known.distance);
    (*pushed).pressing = (*pushed).pressing + size;
    (*pushed).features = (*pushed).features + 1.0;
    return known.distance;
}
