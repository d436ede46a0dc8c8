// The contact potential of a point near the closed surface of a body, and its forces on the point; see the twin.

#include "contact/surface"
#include "contact/face"

// Tolerance within which a face counts as nearest at a `distance`, with a safety margin, mm.
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

// The nearest point of a body's surface: the entry of its face, unit vector from there to the point, distance, height above the
// face.
struct Nearest {
    found: bool,
    entry: u32,
    away: vec3<f32>,
    distance: f32,
    height: f32,
}

// Forces of a face on a point, with the edges and corners that it owns: forces on its corners; energy, sum of forces; bound of the
// stiffness at each corner, in penalties.
struct Push {
    pull: array<vec3<f32>, 4>,
    energy: f32,
    pressing: f32,
    stiff: vec4<f32>,
}

// An evaluated face of a list.
struct Seen {
    entry: u32,
    corners: Corners,
    point: Closest,
    push: Push,
}

// Forces of a body on a point, see the twin.
struct Pushed {
    nearest: Nearest,
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

// Whether a place is nearer than the known one.
fn is_nearer(pushed: ptr<function, Pushed>, point: Closest) -> bool {
    let known = (*pushed).nearest;
    let tie = known.distance * TIE + 0.1 * GAP_ROUNDING;
    let apart = point.distance - known.distance;
    return !known.found || apart < -tie || apart <= tie && abs(point.height) > abs(known.height);
}

// Whether the point is behind the nearest known place, within the depth that is pushed out, and within `most`, the largest
// depth it can have reached since its last evaluation: at a corner of a crumpled surface, a point in front may appear to be
// behind.
fn is_behind(pushed: ptr<function, Pushed>, most: f32) -> bool {
    let known = (*pushed).nearest;
    return known.found && known.height < 0.0 && known.distance < min(most, params.depth);
}

// Distance beyond which a face cannot change the nearest place, mm.
fn beyond(pushed: ptr<function, Pushed>) -> f32 {
    return (*pushed).nearest.distance * (1.0 - 2.0 * TIE) - 0.2 * GAP_ROUNDING;
}

// Adds a force on the point in the direction `away` from a place given by corner weights, and its energy.
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
        (*push).stiff = (*push).stiff + border.weights * max(side, 0.0);
    }
}

// Forces of a face, with the edges and corners in its marks.
fn push_of_face(here: Point, q: array<vec3<f32>, 4>, bits: u32, point: Closest) -> Push {
    var push = Push(array<vec3<f32>, 4>(), 0.0, 0.0, vec4<f32>());
    let depth = here.radius - point.distance;
    if !(depth > 0.0) {
        return push;
    }
    let size = here.stiff * depth;
    add_push(&push, point.weights, point.away, size, 0.5 * size * depth);
    push.stiff = point.weights;
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

// Force and energy on a point inside, for its depth below the surface.
fn out_force(here: Point, depth: f32) -> f32 {
    return here.stiff * ((here.radius + depth) + max(here.radius - depth, 0.0));
}

fn out_energy(here: Point, depth: f32) -> f32 {
    let whole = here.radius + depth;
    let outside = max(here.radius - depth, 0.0);
    return 0.5 * here.stiff * (whole * whole - outside * outside);
}

// Adds the force that pushes out a point inside; returns its depth, mm.
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
