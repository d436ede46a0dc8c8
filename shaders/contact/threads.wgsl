// Contact of beams with beams: closest points of two segments, the beams' lines, penalty and friction as for faces.

#define STATUS
#if pairs
#define BOXES
#endif
#if force
#define PRESS
#define PAIRS
#define VELOCITY
#endif
#include "contact/grid"
#include "contact/penalty"
#include "contact/bow"

// Numbers of a beam's place on its thread: arc length of its middle, mm; its length, mm; length of a closed thread, mm, else 0.
const ARC: u32 = 3u;

// Coordinates (0 to 1) of the closest points of segment `0 → d1` and segment `start → start + d2`.
fn closest_points(d1: vec3<f32>, d2: vec3<f32>, start: vec3<f32>) -> vec2<f32> {
    let a = dot(d1, d1);
    let e = dot(d2, d2);
    let b = dot(d1, d2);
    let c = -dot(d1, start);
    let f = -dot(d2, start);
    let determinant = a * e - b * b;
    var s: f32;
    if determinant > a * e * 1e-6 {
        s = unit((b * f - c * e) / determinant);
    } else {
        // parallel: the middle of the overlap
        let p = dot(d1, start) / a;
        let q = dot(d1, start + d2) / a;
        s = unit(0.5 * (max(min(p, q), 0.0) + min(max(p, q), 1.0)));
    }
    let t = (b * s + f) / e;
    if t < 0.0 {
        return vec2<f32>(unit(-c / a), 0.0);
    }
    if t > 1.0 {
        return vec2<f32>(unit((b - c) / a), 1.0);
    }
    return vec2<f32>(s, t);
}

fn unit(x: f32) -> f32 {
    return min(max(x, 0.0), 1.0);
}

#if ROOT
@group(1) @binding(0) var<storage, read> ends: array<u32>;
@group(1) @binding(1) var<storage, read> beams: array<f32>;
@group(1) @binding(2) var<storage, read> reference: array<i32>;
@group(1) @binding(3) var<storage, read> quanta: array<i32>;
@group(1) @binding(4) var<storage, read> remainder: array<f32>;
@group(1) @binding(5) var<storage, read> neighbours: array<u32>;
@group(1) @binding(6) var<storage, read> shares: array<f32>;

// From the line of beam `a`, which lies `aside` of its chord, to that of `b` in an image, in the reference and now.
fn between(a: u32, aside: Bow, b: u32, image: vec2<i32>) -> FromSlave {
#if PERIODIC
    let chords = from_slave(ends[2u * a], Imaged(ends[2u * b], image * params.period));
#else
    let chords = from_slave(ends[2u * a], Imaged(ends[2u * b], image));
#endif
    let other = bow(b);
    return FromSlave(chords.reference + (other.reference - aside.reference), chords.current + (other.current - aside.current));
}

#if pairs
@group(1) @binding(7) var<storage, read> threads: array<u32>;
@group(1) @binding(8) var<storage, read> arcs: array<f32>;
@group(1) @binding(9) var<storage, read> counts: array<u32>;
@group(1) @binding(10) var<storage, read> lists: array<u32>;
@group(1) @binding(11) var<storage, read> boxes: array<f32>;
@group(1) @binding(12) var<storage, read_write> keys: array<u32>;
@group(1) @binding(13) var<storage, read_write> states: array<f32>;
@group(1) @binding(14) var<storage, read_write> found_when: array<u32>;
@group(1) @binding(15) var<storage, read_write> status: array<atomic<u32>>;

// Pairs that a beam can have.
const MOST_PAIRS: u32 = 64u;

// Whether two beams are neighbours on one thread.
fn are_neighbours(a: u32, b: u32) -> bool {
    if threads[a] != threads[b] {
        return false;
    }
    let direct = abs(arcs[ARC * a] - arcs[ARC * b]);
    let thread = arcs[ARC * a + 2u];
    let around = select(direct, min(direct, thread - direct), thread > 0.0);
    return around - 0.5 * (arcs[ARC * a + 1u] + arcs[ARC * b + 1u]) < params.self_arc;
}

fn pairs(beam: u32) {
    let back = inverse();
#if PERIODIC
    let period = vec2<f32>(params.period) * QUANTUM;
#endif
    let reach = 2.0 * params.thread_radius + params.skin;
#if PERIODIC
    let at_box = BOX * (params.slabs + beam);
    let middle = vec2<f32>(boxes[at_box], boxes[at_box + 1u]);
#endif
    let own = vector(beam);
    let along = own.reference + own.change;
    let aside = bow(beam);
    let start = absolute(back, ends[2u * beam]).xy + pull_back(back, aside.current);
    let end = start + pull_back(back, along);
    let xs = cells(0u, min(start.x, end.x), max(start.x, end.x));
    let ys = cells(1u, min(start.y, end.y), max(start.y, end.y));
    if !(is_finite(start.x) && is_finite(start.y)) {
        atomicOr(&status[FLAGS], NOT_FINITE);
        return;
    }
    let found_at = found_when[beam];
    let own_motion = motion_of(params.slabs + beam);
    var searches = found_at != WITH_ALL;
    var full = false;
    for (var y = ys.x; y <= ys.y; y++) {
        for (var x = xs.x; x <= xs.y; x++) {
            let cell = cell_index(x, y);
            full = full || counts[cell] > params.capacity;
            for (var i = 0u; i < counts[cell] && !(searches || full); i++) {
                let near = lists[cell * params.capacity + i];
                searches = near > params.slabs + beam && has_moved(near, own_motion, f32(params.apart));
            }
        }
    }
    // overflow keeps what was known, and is searched again with larger tables
    if !searches || full {
        return;
    }
    // in ascending order
    var found: array<u32, MOST_PAIRS>;
    var count = 0u;
    for (var y = ys.x; y <= ys.y; y++) {
        for (var x = xs.x; x <= xs.y; x++) {
            let cell = cell_index(x, y);
            let listed = counts[cell];
            for (var i = 0u; i < listed; i++) {
                let near = lists[cell * params.capacity + i];
                if near < params.slabs + beam + 1u {
                    continue;
                }
                let other = near - params.slabs;
                if are_neighbours(beam, other) {
                    continue;
                }
                var image = vec2<i32>(0);
#if PERIODIC
                if params.period.x != 0 {
                    image.x = to_i32((middle.x - boxes[BOX * near]) / period.x);
                }
                if params.period.y != 0 {
                    image.y = to_i32((middle.y - boxes[BOX * near + 1u]) / period.y);
                }
#endif
                let apart = between(beam, aside, other, image).current;
                let theirs = vector(other);
                let direction = theirs.reference + theirs.change;
                let st = closest_points(along, direction, apart);
                let offset = along * st.x - (direction * st.y + apart);
                if !(norm(offset) < reach) {
                    continue;
                }
                let pair = key(other, image);
                var place = 0u;
                while place < count && found[place] < pair {
                    place++;
                }
                if place < count && found[place] == pair {
                    continue;
                }
                if count == MOST_PAIRS {
                    full = true;
                    continue;
                }
                for (var to = count; to > place; to--) {
                    found[to] = found[to - 1u];
                }
                found[place] = pair;
                count++;
            }
        }
    }
    let slots = params.beam_slots;
    if full || count > slots {
        atomicOr(&status[FLAGS], SLOTS_FULL);
        return;
    }
    let size = params.state;
    var old: array<u32, MOST_PAIRS>;
    var old_state: array<vec4<f32>, MOST_PAIRS>;
    for (var slot = 0u; slot < slots; slot++) {
        old[slot] = keys[slots * beam + slot];
        for (var i = 0u; i < size; i++) {
            old_state[slot][i] = states[size * (slots * beam + slot) + i];
        }
    }
    for (var slot = 0u; slot < slots; slot++) {
        var pair = EMPTY;
        var state = vec4<f32>(0.0);
        if slot < count {
            pair = found[slot];
            for (var i = 0u; i < slots; i++) {
                if old[i] == pair {
                    state = old_state[i];
                    break;
                }
            }
        }
        keys[slots * beam + slot] = pair;
        for (var i = 0u; i < size; i++) {
            states[size * (slots * beam + slot) + i] = state[i];
        }
    }
    found_when[beam] = select(SINCE, WITH_ALL, found_at == NEVER);
    atomicAdd(&status[SEARCHED], 1u);
}
#endif

#if force
@group(1) @binding(7) var<storage, read> velocity: array<f32>;
@group(1) @binding(8) var<storage, read> mass: array<f32>;
@group(1) @binding(9) var<storage, read_write> keys: array<u32>;
@group(1) @binding(10) var<storage, read_write> states: array<f32>;
@group(1) @binding(11) var<storage, read_write> sums: array<f32>;
@group(1) @binding(12) var<storage, read_write> forces: array<atomic<i32>>;
@group(1) @binding(13) var<storage, read_write> stiffness: array<atomic<i32>>;
@group(1) @binding(14) var<storage, read_write> status: array<atomic<u32>>;

// Mean of the sums of the sizes of the weights of two lines.
fn mean_weights(a: u32, b: u32) -> f32 {
    return 0.5 * (line_weights(a) + line_weights(b));
}

fn force(beam: u32) {
    let slots = params.beam_slots;
    if keys[slots * beam] == EMPTY {
        return;
    }
    let radius = params.thread_radius * row.radius;
    let elapsed = row.dt_mid + row.dt_mid - row.dt;
#if FRICTION
    let tangential = params.thread_thread * params.tangential;
#endif
    let growth = 2.0 * params.thread_radius * row.radius_increment;
    var can_touch = false;
    for (var slot = 0u; slot < slots; slot++) {
        let pair = keys[slots * beam + slot];
        if pair == EMPTY {
            break;
        }
        let s = SLOT_STATE * (slots * beam + slot);
        if states[s] < 0.0 {
            states[s] = states[s] + row.approach * mean_weights(beam, of_key(pair).body) * elapsed + growth;
        }
        can_touch = can_touch || !(states[s] < 0.0);
    }
    sums[SUMS * beam + SUM_ENERGY] = 0.0;
    if !can_touch {
        return;
    }
    var energy = 0.0;
    var touches = false;
    let own = vector(beam);
    let along = own.reference + own.change;
    let aside = bow(beam);
    for (var slot = 0u; slot < slots; slot++) {
        let pair = keys[slots * beam + slot];
        if pair == EMPTY {
            break;
        }
        let candidate = of_key(pair);
        let other = candidate.body;
        let s = SLOT_STATE * (slots * beam + slot);
        if states[s] < 0.0 {
            continue;
        }
        let apart = between(beam, aside, other, candidate.image);
        let theirs = vector(other);
        let direction = theirs.reference + theirs.change;
        let st = closest_points(along, direction, apart.current);
        let offset = along * st.x - (direction * st.y + apart.current);
        let distance = norm(offset);
        let depth = radius + radius - distance;
#if FRICTION
        let elastic = vec3<f32>(states[s + 1u], states[s + 2u], states[s + 3u]);
#endif
        if depth <= 0.0 || distance < 1e-6 {
            states[s] = min(depth, 0.0);
#if FRICTION
            add_sum(beam, SUM_FRICTION, 0.5 * tangential * dot(elastic, elastic));
            states[s + 1u] = 0.0;
            states[s + 2u] = 0.0;
            states[s + 3u] = 0.0;
#endif
            continue;
        }
        touches = true;
        let normal = offset * (1.0 / distance);
        let nodes = line_nodes(beam, st.x);
        let others = line_nodes(other, st.y);
        var motion = vec3<f32>(0.0);
        var inverse_mass = 0.0;
        for (var i = 0u; i < 4u; i++) {
            motion = velocity_at(nodes.nodes[i]) * nodes.weights[i] + motion;
            inverse_mass = inverse_mass + nodes.weights[i] * nodes.weights[i] / mass[nodes.nodes[i]];
        }
        for (var i = 0u; i < 4u; i++) {
            motion = velocity_at(others.nodes[i]) * -others.weights[i] + motion;
            inverse_mass = inverse_mass + others.weights[i] * others.weights[i] / mass[others.nodes[i]];
        }
        let rest = own.reference * st.x - (theirs.reference * st.y + apart.reference);
#if PERIODIC
        motion = motion + apply(rate(), rest);
#endif
        let approach = dot(motion, normal);
        let pressed = press(params.thread_thread, depth, inverse_mass, approach);
        add_sum(beam, SUM_DAMPING, (pressed.elastic_force - pressed.pressing) * approach * elapsed);
        add_sum(beam, SUM_RADIUS, pressed.elastic_force * growth);
        states[s] = pressed.pressing;
        var stored = pressed.elastic_force * depth;
        var push = normal * pressed.pressing;
#if FRICTION
        let limit = params.friction * pressed.pressing;
        let slid = slide(elastic, motion * elapsed, normal, tangential, limit);
        add_sum(beam, SUM_FRICTION, slid.dissipated);
        add_sum(beam, SUM_SLIP, slid.slip);
        states[s + 1u] = slid.elastic.x;
        states[s + 2u] = slid.elastic.y;
        states[s + 3u] = slid.elastic.z;
        stored = stored + tangential * dot(slid.elastic, slid.elastic);
        push = push - slid.elastic * tangential;
#endif
        energy = energy + 0.5 * stored;
#if PERIODIC
        add_virial(beam, push, rest);
#endif
        add_pair(push, nodes, others);
        let row_sum = pressed.row_sum * mean_weights(beam, other);
        add_stiffness(row_sum, nodes);
        add_stiffness(row_sum, others);
        raise(PENETRATION + 2u, depth);
    }
    sums[SUMS * beam + SUM_ENERGY] = energy;
    if touches {
        atomicAdd(&status[TOUCHING + 2u], 1u);
    }
}
#endif
#endif
