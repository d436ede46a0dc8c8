// Penalty contact of slave nodes with the surfaces of yarns, every step, for the candidates of each slave that can touch:
// nodes of threads with THREAD, else of yarn surfaces.
// What includes this for `press` and `add_virial` defines PRESS and binds `sums`.

// Integers of a slave: node, own body (or EMPTY for a thread).
const SLAVE: u32 = 2u;
// Numbers of a slave: penalty, N/mm; radius, mm.
const SLAVE_VALUES: u32 = 2u;
// Integers of a slot: key, ring position, slice.
const SLOT_KEYS: u32 = 3u;
#if penalty
#define PRESS
#define STATUS
#define PAIRS
#define BODIES
#define TOUCH
#define VELOCITY
#include "contact/face"
#endif

#if PRESS
// Sums of a slave or a beam, and where the stress starts among them; numbers of a slot: normal force, N, or less what is sure
// to be left of the gap, mm; with friction then the elastic tangential displacement, mm (3).
const SUM_ENERGY: u32 = 0u;
const SUM_DAMPING: u32 = 1u;
const SUM_RADIUS: u32 = 2u;
#if FRICTION
#include "contact/friction"
const SUM_FRICTION: u32 = 3u;
const SUM_SLIP: u32 = 4u;
const SUM_VIRIAL: u32 = 5u;
const SLOT_STATE: u32 = 4u;
#else
const SUM_VIRIAL: u32 = 3u;
const SLOT_STATE: u32 = 1u;
#endif
#if PERIODIC
const SUMS: u32 = SUM_VIRIAL + 9u;
#else
const SUMS: u32 = SUM_VIRIAL;
#endif

// What presses two bodies apart.
struct Press {
    elastic_force: f32,
    pressing: f32,
    row_sum: f32,
}

// Penalty force of a pair at `depth` (mm) with `approach` (mm/s, negative when closing) and the inverse of its joint mass
// `inverse_mass` (1/tonne).
fn press(stiff: f32, depth: f32, inverse_mass: f32, approach: f32) -> Press {
    let viscosity = params.damping * 2.0 * sqrt(stiff / inverse_mass);
    let elastic_force = stiff * depth;
    return Press(
        elastic_force,
        max(elastic_force - viscosity * approach, 0.0),
        2.0 * (stiff + viscosity * (2.0 / row.dt)),
    );
}

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
@group(1) @binding(0) var<storage, read> slaves: array<u32>;
@group(1) @binding(1) var<storage, read> values: array<f32>;
@group(1) @binding(2) var<storage, read> bodies: array<u32>;
@group(1) @binding(3) var<storage, read> ring_lines: array<u32>;
@group(1) @binding(4) var<storage, read> reference: array<i32>;
@group(1) @binding(5) var<storage, read> quanta: array<i32>;
@group(1) @binding(6) var<storage, read> remainder: array<f32>;
@group(1) @binding(7) var<storage, read> velocity: array<f32>;
@group(1) @binding(8) var<storage, read> mass: array<f32>;
@group(1) @binding(9) var<storage, read_write> keys: array<u32>;
@group(1) @binding(10) var<storage, read_write> states: array<f32>;
@group(1) @binding(11) var<storage, read_write> sums: array<f32>;
@group(1) @binding(12) var<storage, read_write> forces: array<atomic<i32>>;
@group(1) @binding(13) var<storage, read_write> stiffness: array<atomic<i32>>;
@group(1) @binding(14) var<storage, read_write> status: array<atomic<u32>>;

// From the front, contact begins no deeper than two bodies approach in a step, with this margin, mm: what is first seen
// deeper inside an open yarn came in through its end, and no side pushes it out; nor does one that is found late, see the twin.
const ENTRY: f32 = 1e-3;
// Bound on approach from which on the scene is looked at before it moves, mm/s.
const AT_REST: f32 = 1e20;
// Force that stands for a touch without pressure, N.
const TOUCH: f32 = 1e-30;
// And the one that stands for a thread inside an open yarn, N.
const INSIDE: f32 = 4e-30;

// Whether slaves are nodes of threads.
#if THREAD
const IS_THREAD: bool = true;
#else
const IS_THREAD: bool = false;
#endif

// A slave, and the faces of one body that push it: their normal forces, and what friction needs of the first one.
struct Touch {
    item: u32,
    slave: u32,
    stiff: f32,
    full_radius: f32,
    radius: f32,
    open: bool,
    enters: bool,
    came_in: bool,
    before: f32,
    elapsed: f32,
    push: vec3<f32>,
    normal_force: f32,
    energy: f32,
    touched: bool,
#if FRICTION
    motion: vec3<f32>,
    apart: vec3<f32>,
    masters: Weighted,
#endif
}

// One node with weight 1.
fn single(node: u32) -> Weighted {
    return Weighted(1u, vec4<u32>(node, 0u, 0u, 0u), vec4<f32>(1.0, 0.0, 0.0, 0.0));
}

// Adds the normal force of a face.
fn touch(all: ptr<function, Touch>, corners: Corners, point: Closest) {
    let slave = (*all).slave;
    let side = normal_and_distance(point, IS_THREAD);
    if !side.faces {
        return;
    }
    let depth = (*all).radius - side.distance;
    if depth <= 0.0 || -side.distance >= params.depth {
        return;
    }
    let weights = weights(point);
    var motion = velocity_at(slave);
    var apart = vec3<f32>(0.0);
    var inverse_mass = 1.0 / mass[slave];
    for (var a = 0u; a < 4u; a++) {
        motion = velocity_at(corners.nodes[a]) * -weights[a] + motion;
        inverse_mass = inverse_mass + weights[a] * weights[a] / mass[corners.nodes[a]];
    }
    apart = corners.reference[0] * -weights[0] + apart;
    apart = corners.reference[1] * -weights[1] + apart;
    apart = corners.reference[2] * -weights[2] + apart;
    apart = corners.reference[3] * -weights[3] + apart;
#if PERIODIC
    motion = motion + apply(rate(), apart);
#endif
    let approach = dot(motion, side.normal);
    let entry = ENTRY - 2.0 * min(approach, 0.0) * (*all).elapsed;
    let late = IS_THREAD && (*all).open && depth > 0.5 * (*all).radius;
    if ((*all).enters || late) && depth > (*all).before + entry {
        (*all).came_in = (*all).came_in || (*all).enters;
        return;
    }
    let pressed = press((*all).stiff, depth, inverse_mass, approach);
    let item = (*all).item;
    add_sum(item, SUM_DAMPING, (pressed.elastic_force - pressed.pressing) * approach * (*all).elapsed);
    add_sum(item, SUM_RADIUS, pressed.elastic_force * (*all).full_radius * row.radius_increment);
    (*all).energy = (*all).energy + 0.5 * pressed.elastic_force * depth;
    let push = side.normal * pressed.pressing;
    (*all).push = (*all).push + push;
    (*all).normal_force = (*all).normal_force + pressed.pressing;
#if PERIODIC
    add_virial(item, push, apart);
#endif
    let masters = Weighted(4u, corners.nodes, weights);
    add_pair(push, single(slave), masters);
    add_stiffness(pressed.row_sum, masters);
    add_stiffness(pressed.row_sum, single(slave));
    raise(PENETRATION + select(1u, 0u, IS_THREAD), depth);
#if FRICTION
    if !(*all).touched {
        (*all).motion = motion;
        (*all).apart = apart;
        (*all).masters = masters;
    }
#endif
    (*all).touched = true;
}

fn penalty(item: u32) {
    let first_key = SLOT_KEYS * params.slots * item;
    if keys[first_key] == EMPTY {
        return;
    }
    var all: Touch;
    all.item = item;
    all.slave = slaves[SLAVE * item];
    all.stiff = values[SLAVE_VALUES * item];
    all.full_radius = values[SLAVE_VALUES * item + 1u];
    all.radius = all.full_radius * row.radius;
    all.elapsed = row.dt_mid + row.dt_mid - row.dt;
    let slave = all.slave;
#if FRICTION
    let tangential = all.stiff * params.tangential;
#endif
    let closing = row.approach * all.elapsed + all.full_radius * row.radius_increment;
    var touches = false;
    for (var slot = 0u; slot < params.slots; slot++) {
        let k = first_key + SLOT_KEYS * slot;
        if keys[k] == EMPTY {
            break;
        }
        let candidate = of_key(keys[k]);
        let s = SLOT_STATE * (params.slots * item + slot);
        if states[s] < 0.0 {
            let gap = states[s] + closing;
            states[s] = gap;
            if gap < 0.0 {
                continue;
            }
#if THREAD
#else
            // until now it was in front
            states[s] = 0.0;
#endif
        }
        let from_place = Place(i32(keys[k + 1u]), i32(keys[k + 2u]));
        var open = true;
#if PERIODIC
        open = !is_closed(candidate.body);
#endif
        var found = walk(slave, candidate.body, candidate.image, from_place);
#if THREAD
        if open && is_rim(candidate.body, found.place, found.point) {
            found = around(slave, candidate.body, candidate.image, found);
        }
        if found.point.distance >= all.radius && !is_behind(found.point) {
            found = beside(slave, candidate.body, candidate.image, found);
        }
#endif
        let point = found.point;
        keys[k + 1u] = u32(found.place.ring);
        keys[k + 2u] = u32(found.place.slice);
        let moves = row.approach < AT_REST;
#if THREAD
        var inside = false;
        if open && moves {
            let was = states[s] == INSIDE;
            let comes = point.interior && (states[s] <= 0.0 || is_end(candidate.body, found.place));
            let stays = was && !is_rim(candidate.body, found.place, point);
            inside = height(point) < 0.0 && (comes || stays);
            if was && !inside {
                states[s] = 0.0;
            }
        }
#endif
        all.open = open && moves;
        all.enters = all.open && states[s] <= 0.0;
        all.before = max(states[s], 0.0) / all.stiff;
        all.push = vec3<f32>(0.0);
        all.normal_force = 0.0;
        all.touched = false;
        all.came_in = false;
#if THREAD
        if !inside {
            touch(&all, found.corners, point);
            if point.distance < all.radius {
                faces_within(&all, slave, candidate.body, candidate.image, found, all.radius);
            }
        }
#else
        // what is behind the border of a cut end is before the end, and not in the yarn
        if !(height(point) < 0.0 && is_rim(candidate.body, found.place, point)) {
            touch(&all, found.corners, point);
        }
#endif
        let size = norm(all.push);
#if FRICTION
        let elastic = vec3<f32>(states[s + 1u], states[s + 2u], states[s + 3u]);
#endif
        if !(all.touched && size > 0.0) {
#if FRICTION
            add_sum(item, SUM_FRICTION, 0.5 * tangential * dot(elastic, elastic));
            states[s + 1u] = 0.0;
            states[s + 2u] = 0.0;
            states[s + 3u] = 0.0;
#endif
#if THREAD
            if inside {
                add_sum(item, SUM_DAMPING, 0.5 * all.stiff * all.before * all.before);
                states[s] = INSIDE;
                continue;
            }
#endif
            // a point behind a face keeps being looked at
            let gap = select(0.0, point.distance - all.radius, IS_THREAD || height(point) > 0.0);
            states[s] = select(-max(gap, 0.0), TOUCH, open && all.touched);
            continue;
        }
        touches = true;
        states[s] = select(all.normal_force, 0.0, all.came_in);
#if FRICTION
        let limit = params.friction * all.normal_force;
        let slid = slide(elastic, all.motion * all.elapsed, all.push * (1.0 / size), tangential, limit);
        add_sum(item, SUM_FRICTION, slid.dissipated);
        add_sum(item, SUM_SLIP, slid.slip);
        states[s + 1u] = slid.elastic.x;
        states[s + 2u] = slid.elastic.y;
        states[s + 3u] = slid.elastic.z;
        all.energy = all.energy + 0.5 * tangential * dot(slid.elastic, slid.elastic);
        let drag = slid.elastic * -tangential;
#if PERIODIC
        add_virial(item, drag, all.apart);
#endif
        add_pair(drag, single(slave), all.masters);
#endif
    }
    sums[SUMS * item + SUM_ENERGY] = all.energy;
    if touches {
        atomicAdd(&status[TOUCHING + select(1u, 0u, IS_THREAD)], 1u);
    }
}
#endif
