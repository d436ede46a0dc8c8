// Penalty contact of points with the closed surfaces of yarns, every step: points along the beams of a thread with THREAD, else the
// nodes of yarn surfaces. The energy is in the twin.
// What includes this for `add_sum` and `add_virial` defines PRESS and binds `sums`.

#if penalty
#define PRESS
#define STATUS
#define PAIRS
#define FACES
#define POINTS
#define VELOCITY
#include "contact/face"
#endif

#if PRESS
// Sums of a point or a beam, and where the stress starts among them.
const SUM_ENERGY: u32 = 0u;
const SUM_DAMPING: u32 = 1u;
const SUM_RADIUS: u32 = 2u;
#if FRICTION
#include "contact/friction"
const SUM_FRICTION: u32 = 3u;
const SUM_SLIP: u32 = 4u;
const SUM_VIRIAL: u32 = 5u;
#else
const SUM_VIRIAL: u32 = 3u;
#endif
#if PERIODIC
const SUMS: u32 = SUM_VIRIAL + 9u;
#else
const SUMS: u32 = SUM_VIRIAL;
#endif

// Adds to a sum of an item.
fn add_sum(item: u32, sum: u32, value: f32) {
    sums[SUMS * item + sum] = sums[SUMS * item + sum] + value;
}

#if PERIODIC
// Subtracts force ⊗ ΔX from the sum of an item that makes the homogenised stress.
fn add_virial(item: u32, push: vec3<f32>, apart: vec3<f32>) {
    for (var i = 0u; i < 3u; i++) {
        for (var j = 0u; j < 3u; j++) {
            add_sum(item, SUM_VIRIAL + 3u * i + j, -(push[i] * apart[j]));
        }
    }
}
#endif
#endif

#if ROOT
@group(1) @binding(0) var<storage, read> nodes: array<u32>;
@group(1) @binding(1) var<storage, read> points: array<f32>;
@group(1) @binding(2) var<storage, read> faces: array<u32>;
@group(1) @binding(3) var<storage, read> near: array<u32>;
@group(1) @binding(4) var<storage, read> reference: array<i32>;
@group(1) @binding(5) var<storage, read> quanta: array<i32>;
@group(1) @binding(6) var<storage, read> remainder: array<f32>;
@group(1) @binding(7) var<storage, read> velocity: array<f32>;
@group(1) @binding(8) var<storage, read> mass: array<f32>;
@group(1) @binding(9) var<storage, read_write> gaps: array<f32>;
@group(1) @binding(10) var<storage, read_write> keys: array<u32>;
@group(1) @binding(11) var<storage, read_write> touches: array<f32>;
@group(1) @binding(12) var<storage, read_write> sums: array<f32>;
@group(1) @binding(13) var<storage, read_write> forces: array<atomic<i32>>;
@group(1) @binding(14) var<storage, read_write> stiffness: array<atomic<i32>>;
@group(1) @binding(15) var<storage, read_write> status: array<atomic<u32>>;

// Numbers before the gaps of a point.
const LEAST: u32 = 0u;
const CLOSED: u32 = 1u;
const INNER: u32 = 2u;
const GAPS: u32 = 3u;
// More than rounding moves a gap, mm.
const GAP_ROUNDING: f32 = 1e-6;
// Numbers of a touch.
const NORMAL: u32 = 0u;
const DAMPED: u32 = 1u;
const ELASTIC: u32 = 2u;
#if FRICTION
const TOUCH: u32 = ELASTIC + 3u;
#else
const TOUCH: u32 = ELASTIC;
#endif
// Place of the kind in the status.
#if THREAD
const KIND: u32 = 0u;
#else
const KIND: u32 = 1u;
#endif

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

// A face, its closest point, and what acts on its corners, N.
struct Pressed {
    found: bool,
    nodes: vec4<u32>,
    reference: array<vec3<f32>, 4>,
    point: Closest,
    pull: array<vec3<f32>, 4>,
}

// What a body does to a point: where its surface is nearest; resultant, energy and number of the features that push.
struct Pushed {
    nearest: Pressed,
    push: vec3<f32>,
    energy: f32,
    pressing: f32,
    features: f32,
}

// What acts on a point, in quanta.
var<private> own: vec3<i32>;

// Whether a place is nearer than what is known.
fn is_nearer(pushed: ptr<function, Pushed>, point: Closest) -> bool {
    let known = (*pushed).nearest.point;
    let tie = known.distance * 1e-4 + 1e-7;
    let apart = point.distance - known.distance;
    return !(*pushed).nearest.found || apart < -tie || apart <= tie && abs(point.height) > abs(known.height);
}

// Whether the point is behind the nearest place that is known, no deeper than what is pushed out.
fn is_behind(pushed: ptr<function, Pushed>) -> bool {
    let point = (*pushed).nearest.point;
    return (*pushed).nearest.found && point.height < 0.0 && point.distance < params.depth;
}

// Distance from which on a face cannot change what is nearest, mm.
fn beyond(pushed: ptr<function, Pushed>) -> f32 {
    return (*pushed).nearest.point.distance * (1.0 - 2e-4) - 2e-7;
}

// Adds an elastic force of a feature and its energy on the point; notes its opposite on the corners of its face.
fn add_push(
    pushed: ptr<function, Pushed>,
    pulls: ptr<function, array<vec3<f32>, 4>>,
    weights: vec4<f32>,
    away: vec3<f32>,
    push: f32,
    energy: f32,
) {
    (*pushed).push = away * push + (*pushed).push;
    (*pushed).energy = (*pushed).energy + energy;
    (*pushed).pressing = (*pushed).pressing + push;
    for (var a = 0u; a < 4u; a++) {
        (*pulls)[a] = away * -(push * weights[a]) + (*pulls)[a];
    }
}

// Adds an edge or a corner within the radius, with its sign in the sum.
fn add_border(
    pushed: ptr<function, Pushed>,
    pulls: ptr<function, array<vec3<f32>, 4>>,
    here: Point,
    border: OnEdge,
    side: f32,
) {
    if border.square < here.radius * here.radius {
        let distance = sqrt(border.square);
        let depth = here.radius - distance;
        let push = side * (here.stiff * depth);
        let away = border.offset * (1.0 / max(distance, 1e-12));
        add_push(pushed, pulls, border.weights, away, push, 0.5 * push * depth);
        (*pushed).features = (*pushed).features + max(side, 0.0);
    }
}

// Adds forces to the corners of a face, and their opposite to what acts on the point, as integers whose sum is zero.
fn pull(item: u32, face: Pressed) {
    var pulls = face.pull;
    var places = face.reference;
    let plane = arrayLength(&forces) / 3u;
    let sum = ((pulls[0] + pulls[1]) + (pulls[2] + pulls[3])) / params.force_quantum;
    let fits = is_finite(sum.x) && is_finite(sum.y) && is_finite(sum.z);
    if !fits || any(abs(sum) >= vec3<f32>(134217728.0)) {
        atomicOr(&status[FLAGS], FORCE_RANGE);
        atomicStore(&status[CULPRIT], face.nodes[0]);
        return;
    }
    var rest = vec3<i32>(to_i32(sum.x), to_i32(sum.y), to_i32(sum.z));
    own = own - rest;
    for (var a = 0u; a < 4u; a++) {
        var part = rest;
        if a != 3u {
            let quanta_of = pulls[a] / params.force_quantum;
            part = vec3<i32>(to_i32(quanta_of.x), to_i32(quanta_of.y), to_i32(quanta_of.z));
        }
        rest = rest - part;
        for (var k = 0u; k < 3u; k++) {
            atomicAdd(&forces[face.nodes[a] + k * plane], part[k]);
        }
#if PERIODIC
        add_virial(item, pulls[a], places[a]);
#endif
    }
}

// Adds what a face does to a point, with the edges and corners that it owns; returns the gap, or as much as is sure to be left.
fn face_push(here: Point, entry: u32, most: f32, pushed: ptr<function, Pushed>) -> f32 {
    let seen = of_key(entry);
    let around = corners(seen.body, seen.image, here.base, here.aside);
    let q = around.current;
    let shape = patch_of(q);
    let sure = nearest(shape) - here.radius;
    if sure > most {
        return sure;
    }
    let point = closest(q, shape);
    let gap = point.distance - here.radius;
    let pushes = gap < 0.0;
    var pulls = array<vec3<f32>, 4>();
    if pushes {
        let bits = marks(seen.body);
        let push = here.stiff * -gap;
        add_push(pushed, &pulls, point.weights, point.away, push, -0.5 * push * gap);
        (*pushed).features = (*pushed).features + 1.0;
        for (var a = 0u; a < 4u; a++) {
            if (bits >> a & 1u) == 1u {
                add_border(pushed, &pulls, here, on_edge(q, a), -1.0);
            }
            if (bits >> (4u + a) & 1u) == 1u {
                add_border(pushed, &pulls, here, on_corner(q, a), 1.0);
            }
        }
    }
    let face = Pressed(true, around.nodes, around.reference, point, pulls);
    if is_nearer(pushed, point) {
        let known = (*pushed).nearest;
        (*pushed).nearest = face;
        if known.found && known.point.distance < here.radius {
            pull(here.item, known);
        }
    } else if pushes {
        pull(here.item, face);
    }
    return gap;
}

// What a body does to a point, by its entries and their gaps: those that are no larger than `most` are looked at. Returns the least.
fn look(here: Point, list: u32, first_gap: u32, part: vec2<u32>, most: f32, pushed: ptr<function, Pushed>) -> f32 {
    for (var i = part.x; i < part.y; i++) {
        if gaps[first_gap + i] <= most {
            gaps[first_gap + i] = face_push(here, near[list + i], most, pushed);
        }
    }
    // it is inside only if no other face is nearer
    let looks = is_behind(pushed);
    var least = params.skin;
    for (var i = part.x; i < part.y; i++) {
        let far = beyond(pushed) - here.radius;
        if looks && gaps[first_gap + i] < far {
            gaps[first_gap + i] = face_push(here, near[list + i], far, pushed);
        }
        least = min(least, gaps[first_gap + i]);
    }
    return least;
}

// Pushes a point out of a body that it is inside of; returns how deep it is, mm.
fn push_out(here: Point, pushed: ptr<function, Pushed>) -> f32 {
    if !is_behind(pushed) {
        return 0.0;
    }
    let point = (*pushed).nearest.point;
    var pulls = (*pushed).nearest.pull;
    let depth = point.distance;
    let whole = here.radius + depth;
    let outside = max(here.radius - depth, 0.0);
    let energy = 0.5 * here.stiff * (whole * whole - outside * outside);
    add_push(pushed, &pulls, point.weights, point.away * -1.0, here.stiff * (whole + outside), energy);
    (*pushed).features = (*pushed).features + 1.0;
    (*pushed).nearest.pull = pulls;
    return depth;
}

// Viscosity that damps a spring between masses of joint inverse `inverse_mass`.
fn viscosity(stiff: f32, inverse_mass: f32) -> f32 {
    return params.damping * 2.0 * sqrt(stiff / inverse_mass);
}

// What damping and friction take, once for a point and a body, where the surface is nearest: a touch goes on.
fn rub(here: Point, pushed: ptr<function, Pushed>, touch: u32) {
    let face = (*pushed).nearest;
    var places = face.reference;
    let weights = face.point.weights;
    let elapsed = row.dt_mid + row.dt_mid - row.dt;
    var motion = vec3<f32>(0.0);
    var apart = vec3<f32>(0.0);
    var inverse_mass = 0.0;
    for (var a = 0u; a < CARRIED_BY; a++) {
        let node = carried_by(here.item, a);
        let weight = points[POINT * here.item + a];
        motion = velocity_at(node) * weight + motion;
        inverse_mass = inverse_mass + weight * weight / mass[node];
    }
    for (var a = 0u; a < 4u; a++) {
        motion = velocity_at(face.nodes[a]) * -weights[a] + motion;
        apart = places[a] * -weights[a] + apart;
        inverse_mass = inverse_mass + weights[a] * weights[a] / mass[face.nodes[a]];
    }
#if PERIODIC
    motion = motion + apply(rate(), apart);
#endif
    let size = norm((*pushed).push);
    var normal = face.point.away;
    if size > 0.0 {
        normal = (*pushed).push * (1.0 / size);
    }
    let approach = dot(motion, normal);
    let viscous = viscosity(here.stiff, inverse_mass);
    let pressing = max(size - viscous * approach, 0.0);
    // over the way since the positions before, with the mean of the forces before and now
    let damped = size - pressing;
    add_sum(here.item, SUM_DAMPING, 0.5 * (touches[touch + DAMPED] + damped) * approach * elapsed);
    touches[touch + NORMAL] = pressing;
    touches[touch + DAMPED] = damped;
    var push = normal * -damped;
#if FRICTION
    let tangential = here.stiff * params.tangential;
    let limit = params.friction * pressing;
    let elastic = vec3<f32>(touches[touch + ELASTIC], touches[touch + ELASTIC + 1u], touches[touch + ELASTIC + 2u]);
    let slid = slide(elastic, motion * elapsed, normal, tangential, limit);
    add_sum(here.item, SUM_FRICTION, slid.dissipated);
    add_sum(here.item, SUM_SLIP, slid.slip);
    touches[touch + ELASTIC] = slid.elastic.x;
    touches[touch + ELASTIC + 1u] = slid.elastic.y;
    touches[touch + ELASTIC + 2u] = slid.elastic.z;
    (*pushed).energy = (*pushed).energy + 0.5 * tangential * dot(slid.elastic, slid.elastic);
    push = slid.elastic * -tangential + push;
#endif
    var pulls = face.pull;
    for (var a = 0u; a < 4u; a++) {
        pulls[a] = push * -weights[a] + pulls[a];
    }
    (*pushed).nearest.pull = pulls;
    let rows = (1.0 + here.size) * (here.stiff * (*pushed).features + viscous * (2.0 / row.dt));
    let stiffness_quanta = rows / params.stiffness_quantum;
    for (var a = 0u; a < 4u; a++) {
        atomicAdd(&stiffness[face.nodes[a]], to_i32(stiffness_quanta * abs(weights[a])));
    }
    for (var a = 0u; a < CARRIED_BY; a++) {
        let node = carried_by(here.item, a);
        atomicAdd(&stiffness[node], to_i32(stiffness_quanta * abs(points[POINT * here.item + a])));
    }
}

// Adds what acts on a point to its nodes.
fn share_out(here: Point) {
    let plane = arrayLength(&forces) / 3u;
    var rest = own;
    for (var a = 0u; a < CARRIED_BY; a++) {
        var part = rest;
        if a + 1u != CARRIED_BY {
            let share = vec3<f32>(own) * points[POINT * here.item + a];
            part = vec3<i32>(to_i32(share.x), to_i32(share.y), to_i32(share.z));
        }
        rest = rest - part;
        let node = carried_by(here.item, a);
        for (var k = 0u; k < 3u; k++) {
            atomicAdd(&forces[node + k * plane], part[k]);
        }
    }
}

// The place of a body among the touches of a point; if it `begins` to touch, a free one; else `params.slots`.
fn place_of(item: u32, body: u32, begins: bool) -> u32 {
    var free = params.slots;
    for (var slot = 0u; slot < params.slots; slot++) {
        let known = keys[(MADE + params.slots) * item + MADE + slot];
        if known == body {
            return slot;
        }
        if begins && known == EMPTY && free == params.slots {
            free = slot;
        }
    }
    return free;
}

// What a body has done to a point: damping, friction, and what is left of the touch. Returns how deep the point is inside.
fn settle(here: Point, body: u32, pushed: ptr<function, Pushed>, touching: ptr<function, bool>) -> f32 {
    let depth = push_out(here, pushed);
    let begins = (*pushed).features > 0.0;
    let slot = place_of(here.item, body, begins);
    if slot == params.slots {
        return depth;
    }
    let touch = TOUCH * (params.slots * here.item + slot);
    let place = (MADE + params.slots) * here.item + MADE + slot;
    rub(here, pushed, touch);
    pull(here.item, (*pushed).nearest);
    add_sum(here.item, SUM_RADIUS, (*pushed).pressing * here.full_radius * row.radius_increment);
    add_sum(here.item, SUM_ENERGY, (*pushed).energy);
    if begins {
        *touching = true;
        keys[place] = body;
        let outside = max(here.radius - (*pushed).nearest.point.distance, 0.0);
        raise(PENETRATION + KIND, select(outside, here.radius + depth, depth > 0.0));
    } else {
        keys[place] = EMPTY;
        for (var i = 0u; i < TOUCH; i++) {
            touches[touch + i] = 0.0;
        }
    }
    return depth;
}

fn penalty(item: u32) {
    let first = (MADE + params.faces) * nodes[CARRIED * item + CARRIED - 1u];
    let full_radius = points[POINT * item + 5u];
    var size = 0.0;
    for (var a = 0u; a < CARRIED_BY; a++) {
        size = size + abs(points[POINT * item + a]);
    }
    let elapsed = row.dt_mid + row.dt_mid - row.dt;
    let closing = row.approach * (0.5 * (1.0 + size)) * elapsed + full_radius * row.radius_increment;
    let first_gap = (GAPS + params.faces) * item;
    let made = (MADE + params.slots) * item;
    if keys[made] != near[first] {
        // a new list: all faces are looked at, wherever the point may be
        keys[made] = near[first];
        for (var i = 0u; i < GAPS + params.faces; i++) {
            gaps[first_gap + i] = 0.0;
        }
        gaps[first_gap + INNER] = params.depth;
    }
    let closed = gaps[first_gap + CLOSED] + closing;
    if closed < gaps[first_gap + LEAST] {
        gaps[first_gap + CLOSED] = closed;
        return;
    }
    let stiff = points[POINT * item + 4u];
    let radius = full_radius * row.radius;
    let here = Point(item, carried_by(item, 0u), point_of(item), stiff, full_radius, radius, size);
    // a point that was inside is no deeper than this now
    let most = gaps[first_gap + INNER] + closing + GAP_ROUNDING;
    var least = params.skin;
    var inner = 0.0;
    var touching = false;
    own = vec3<i32>(0);
    sums[SUMS * item + SUM_ENERGY] = 0.0;
    let list = first + MADE;
    var end = 0u;
    while end < params.faces && near[list + end] != EMPTY {
        let start = end;
        let body = body_of(near[list + end]);
        var gap = params.skin;
        while end < params.faces && near[list + end] != EMPTY && body_of(near[list + end]) == body {
            let left = gaps[first_gap + GAPS + end] - closed;
            gaps[first_gap + GAPS + end] = left;
            gap = min(gap, left);
            end++;
        }
        if gap > most {
            least = min(least, gap);
            continue;
        }
        var pushed = Pushed();
        least = min(least, look(here, list, first_gap + GAPS, vec2<u32>(start, end), most, &pushed));
        inner = max(inner, settle(here, body, &pushed, &touching));
    }
    gaps[first_gap + LEAST] = least - inner - GAP_ROUNDING;
    gaps[first_gap + CLOSED] = 0.0;
    gaps[first_gap + INNER] = inner;
    if any(own != vec3<i32>(0)) {
        share_out(here);
    }
    if touching {
        atomicAdd(&status[TOUCHING + KIND], 1u);
    }
}
#endif
