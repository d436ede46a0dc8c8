// Contact of beams with beams: every step the forces of the touching pairs, from the integral over the lines of both threads,
// with damping and friction at the point of action.

#define PAIRS
#define VELOCITY
#include "contact/sums"
#if FRICTION
#include "contact/friction"
#endif
#include "contact/pairs"

#if ROOT
// Two touching beams: their nodes and weights, the penalty times their lengths, N/mm, and their reference pieces.
struct Pair {
    nodes: array<vec4<u32>, 2>,
    weights: array<array<vec4<f32>, 2>, 2>,
    strengths: vec2<f32>,
    rest: Segments,
}

// Whether beam `a` subtracts the joint at the first end of `b`: it does if it also forms a pair with the beam before `b`.
fn owns(a: u32, b: u32, image: vec2<i32>) -> bool {
    let before = before_of(b, image);
    return before.body != b && before.body > a && !are_near(a, before.body, before.image, params.self_arc);
}

// Distance at which threads touch, mm.
fn reach_now() -> f32 {
    return 2.0 * params.thread_radius * row.radius;
}

// Increment of that distance since the previous step, mm.
fn growth_now() -> f32 {
    return 2.0 * params.thread_radius * row.radius_increment;
}

// Time since the previous step, s.
fn elapsed() -> f32 {
    return row.dt_mid + row.dt_mid - row.dt;
}

// Reduces the gap counters, and tells whether one of a beam's pairs can touch.
fn can_touch(beam: u32) -> bool {
    let slots = params.beam_slots;
    let weights = most_weights(beam);
    var touches = false;
    for (var slot = slots * beam; slot < slots * (beam + 1u); slot++) {
        if keys[slot] == EMPTY {
            break;
        }
        let s = SLOT_STATE * slot;
        if states[s] < 0.0 {
            let mean = 0.5 * (weights + most_weights(of_key(keys[slot]).body));
            states[s] = states[s] + row.closing * (2.0 * speed_of(1u) + row.affine) * mean * elapsed() + growth_now();
        }
        touches = touches || !(states[s] < 0.0);
    }
    return touches;
}

#if FRICTION
// Tangential stiffness of a beam's pairs, N/mm, for a contact length equal to the beam length or the thread diameter, whichever
// is less.
fn tangential_of(beam: u32) -> f32 {
    return params.thread_thread * min(beams[TABLE * beam + 3u], 2.0 * params.thread_radius) * params.tangential;
}
#endif

// Releases the elastic tangential displacement of friction.
fn release(beam: u32, s: u32) {
#if FRICTION
    let elastic = vec3<f32>(states[s + 1u], states[s + 2u], states[s + 3u]);
    add_sum(beam, SUM_FRICTION, 0.5 * tangential_of(beam) * dot(elastic, elastic));
    states[s + 1u] = 0.0;
    states[s + 2u] = 0.0;
    states[s + 3u] = 0.0;
#endif
}

// Separation velocity of points of two pieces, mm/s, and the squared frequency of the touching lengths, 1/s².
struct Relative {
    motion: vec3<f32>,
    square: f32,
}

fn add_relative(to: Relative, nodes: vec4<u32>, weights: vec4<f32>, sign: f32, strength: f32) -> Relative {
    var sum = to;
    for (var i = 0u; i < 4u; i++) {
        sum.motion = velocity_at(nodes[i]) * (sign * weights[i]) + sum.motion;
        sum.square = sum.square + (strength + strength) * weights[i] * weights[i] / mass[nodes[i]];
    }
    return sum;
}

fn relative(pair: Pair, s: f32, t: f32) -> Relative {
    let own = pair.weights[0][0] * (1.0 - s) + pair.weights[0][1] * s;
    let others = pair.weights[1][0] * (1.0 - t) + pair.weights[1][1] * t;
    var sum = add_relative(Relative(vec3<f32>(0.0), 0.0), pair.nodes[0], own, 1.0, pair.strengths.x);
    sum = add_relative(sum, pair.nodes[1], others, -1.0, pair.strengths.y);
#if PERIODIC
    sum.motion = sum.motion + apply(rate(), pair.rest.along * s - (pair.rest.other * t + pair.rest.start));
#endif
    return sum;
}

// Adds damping and friction to an elastic force of size `pressed` (N), at its point of action; see the twin.
fn resist(beam: u32, slot: u32, pair: Pair, pressed: f32, push: ptr<function, Push>) {
    let s = (*push).at.x / (*push).weight;
    let t = (*push).at.y / (*push).weight;
    let normal = ((*push).own[0] + (*push).own[1]) * (1.0 / pressed);
    let between = relative(pair, s, t);
    let frequency = sqrt(between.square);
    let contact = max((*push).stiffness, pair.strengths.x * LEAST);
    let half_step = 0.5 * row.dt_mid * between.square / contact;
    let approach = dot(between.motion, normal);
    let free = approach + half_step * pressed;
    var mean = approach;
    if !(approach > 0.0) {
        mean = min(free, 0.0);
    }
    let viscosity = 2.0 * params.damping * contact / frequency;
    let held = viscosity / (1.0 + params.damping * frequency * row.dt_mid);
    let normal_force = max(pressed - held * mean, 0.0);
    let drag = pressed - normal_force;
    add_sum(beam, SUM_DAMPING, drag * (0.5 * (approach + free) - half_step * drag) * row.dt_mid);
    var force = normal * -drag;
    var row_sum = held * (2.0 / row.dt);
#if FRICTION
    let at = SLOT_STATE * slot;
    let tangential = tangential_of(beam);
    let elastic = vec3<f32>(states[at + 1u], states[at + 2u], states[at + 3u]);
    let limit = params.friction * normal_force;
    let slid = slide(elastic, between.motion * elapsed(), normal, tangential, limit);
    add_sum(beam, SUM_FRICTION, slid.dissipated);
    add_sum(beam, SUM_SLIP, slid.slip);
    add_sum(beam, SUM_ENERGY, 0.5 * tangential * dot(slid.elastic, slid.elastic));
    states[at + 1u] = slid.elastic.x;
    states[at + 2u] = slid.elastic.y;
    states[at + 3u] = slid.elastic.z;
    force = force - slid.elastic * tangential;
    row_sum = row_sum + max(tangential - (*push).stiffness, 0.0);
#endif
    (*push).own[0] = force * (1.0 - s) + (*push).own[0];
    (*push).own[1] = force * s + (*push).own[1];
    (*push).others[0] = force * (t - 1.0) + (*push).others[0];
    (*push).others[1] = force * -t + (*push).others[1];
    (*push).own_rows = (*push).own_rows + row_sum * vec2<f32>(1.0 - s, s);
    (*push).other_rows = (*push).other_rows + row_sum * vec2<f32>(1.0 - t, t);
}

// Whether the components of a force fit their integers; else records the node.
fn is_in_range(force_quanta: vec3<f32>, node: u32) -> bool {
    let fits = all(abs(force_quanta) < vec3<f32>(MOST_QUANTA));
    if !fits || !(is_finite(force_quanta.x) && is_finite(force_quanta.y) && is_finite(force_quanta.z)) {
        atomicOr(&status[FLAGS], FORCE_RANGE);
        atomicStore(&status[CULPRIT], node);
        return false;
    }
    return true;
}

// Adds a force in quanta to a node.
fn add_force(node: u32, whole: vec3<i32>) {
    let plane = arrayLength(&forces) / 3u;
    atomicAdd(&forces[node], whole.x);
    atomicAdd(&forces[node + plane], whole.y);
    atomicAdd(&forces[node + 2u * plane], whole.z);
}

// Adds forces on the ends of both pieces to their nodes, as integers whose sum is zero.
fn add_forces(pair: Pair, push: Push) {
    var left = vec3<i32>(0);
    for (var n = 0u; n < 8u; n++) {
        var node = pair.nodes[0][n & 3u];
        var force = push.own[0] * pair.weights[0][0][n & 3u] + push.own[1] * pair.weights[0][1][n & 3u];
        if n > 3u {
            node = pair.nodes[1][n & 3u];
            force = push.others[0] * pair.weights[1][0][n & 3u] + push.others[1] * pair.weights[1][1][n & 3u];
        }
        let force_quanta = force * (1.0 / params.force_quantum);
        if !is_in_range(force_quanta, node) {
            return;
        }
        var whole = left;
        if n < 7u {
            whole = vec3<i32>(to_i32(force_quanta.x), to_i32(force_quanta.y), to_i32(force_quanta.z));
        }
        left = left - whole;
        add_force(node, whole);
    }
}

// Adds bounds of the stiffness at the ends of both pieces, times the sum of the weights of both.
fn add_rows(pair: Pair, push: Push, weights: f32) {
    add_stiffness(push.own_rows.x * weights, Weighted(4u, pair.nodes[0], pair.weights[0][0]));
    add_stiffness(push.own_rows.y * weights, Weighted(4u, pair.nodes[0], pair.weights[0][1]));
    add_stiffness(push.other_rows.x * weights, Weighted(4u, pair.nodes[1], pair.weights[1][0]));
    add_stiffness(push.other_rows.y * weights, Weighted(4u, pair.nodes[1], pair.weights[1][1]));
}

// Forces between a known beam piece and the beam of a slot; whether they touch.
fn touches_pair(beam: u32, own: Piece, slot: u32) -> bool {
    let candidate = of_key(keys[slot]);
    let other = candidate.body;
    let lines = pieces(beam, own, other, candidate.image);
    let reach = reach_now();
    let strengths = params.thread_thread * vec2<f32>(beams[TABLE * beam + 3u], beams[TABLE * other + 3u]);
    let depth = reach - distance_of(lines.now);
    var push: Push;
    if depth > 0.0 {
        push = push_of(lines.now, reach, strengths.x, owns(beam, other, candidate.image));
    }
    let s = SLOT_STATE * slot;
    if !(push.weight > 0.0) {
        release(beam, s);
        states[s] = min(depth + GAP_ROUNDING, 0.0);
        return false;
    }
    add_sum(beam, SUM_ENERGY, push.energy);
    add_sum(beam, SUM_RADIUS, push.growth * growth_now());
    let pair = Pair(
        array<vec4<u32>, 2>(nodes_of(beam), nodes_of(other)),
        array<array<vec4<f32>, 2>, 2>(weights_of(beam), weights_of(other)),
        strengths,
        lines.rest,
    );
    let pressed = norm(push.own[0] + push.own[1]);
    if pressed > 0.0 {
        resist(beam, slot, pair, pressed, &push);
    } else {
        release(beam, s);
    }
    states[s] = pressed;
#if PERIODIC
    add_virial(beam, push.own[1], lines.rest.along);
    add_virial(beam, push.others[0], lines.rest.start);
    add_virial(beam, push.others[1], lines.rest.start + lines.rest.other);
#endif
    add_forces(pair, push);
    add_rows(pair, push, most_weights(beam) + most_weights(other));
    raise(PENETRATION + 2u, depth);
    return true;
}

fn force(beam: u32) {
    let slots = params.beam_slots;
    let first = slots * beam;
    if keys[first] == EMPTY {
        return;
    }
    sums[SUMS * beam + SUM_ENERGY] = 0.0;
    if !can_touch(beam) {
        return;
    }
    let own = piece(beam);
    var touches = false;
    for (var slot = first; slot < first + slots; slot++) {
        if keys[slot] == EMPTY {
            break;
        }
        if !(states[SLOT_STATE * slot] < 0.0) {
            touches = touches_pair(beam, own, slot) || touches;
        }
    }
    if touches {
        atomicAdd(&status[TOUCHING + 2u], 1u);
    }
}
#endif
