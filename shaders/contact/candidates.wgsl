// Candidates of each slave node: for every body and image within reach, the face that is closest.

#define STATUS
#define BODIES
#define BEFORE
#define BOXES
#include "contact/grid"
#include "contact/penalty"

#if ROOT
@group(1) @binding(0) var<storage, read> slaves: array<u32>;
@group(1) @binding(1) var<storage, read> values: array<f32>;
@group(1) @binding(2) var<storage, read> slabs: array<u32>;
@group(1) @binding(3) var<storage, read> bodies: array<u32>;
@group(1) @binding(4) var<storage, read> ring_lines: array<u32>;
@group(1) @binding(5) var<storage, read> reference: array<i32>;
@group(1) @binding(6) var<storage, read> quanta: array<i32>;
@group(1) @binding(7) var<storage, read> remainder: array<f32>;
@group(1) @binding(8) var<storage, read> counts: array<u32>;
@group(1) @binding(9) var<storage, read> lists: array<u32>;
@group(1) @binding(10) var<storage, read> boxes: array<f32>;
@group(1) @binding(11) var<storage, read> before: array<i32>;
@group(1) @binding(12) var<storage, read_write> keys: array<u32>;
@group(1) @binding(13) var<storage, read_write> states: array<f32>;
@group(1) @binding(14) var<storage, read_write> found_when: array<u32>;
@group(1) @binding(15) var<storage, read_write> status: array<atomic<u32>>;

// Bodies that one slave can be near to before the search gives up.
const MOST: u32 = 16u;
// A face behind which the slave lies must be closer than one in front by this, mm.
const CLEARLY: f32 = 0.01;
// Farther than anything, mm.
const FAR: f32 = 1e9;

// A face and its distance, mm.
struct Near {
    distance: f32,
    place: Place,
}

// The best faces of one body found so far.
struct Best {
    key: u32,
    in_front: Near,
    behind: Near,
}

// Whether slaves are nodes of threads.
#if THREAD
const IS_THREAD: bool = true;
#else
const IS_THREAD: bool = false;
#endif

// A slot: key, ring position, slice, state.
struct Slot {
    key: u32,
    ring: u32,
    slice: u32,
    state: vec4<f32>,
}

// The nearer of two faces; of equally near ones that with the smaller number, so that the order of visits does not matter.
fn nearer(a: Near, b: Near) -> Near {
    let smaller = b.place.slice < a.place.slice || (b.place.slice == a.place.slice && b.place.ring < a.place.ring);
    if b.distance < a.distance || (b.distance == a.distance && smaller) {
        return b;
    }
    return a;
}

// The ends of the edge between two faces of a slice, seen from the slave.
struct Edge {
    low: vec3<f32>,
    high: vec3<f32>,
}

fn across(slave: u32, body: u32, image: vec2<i32>, ring: i32, slice: i32) -> Edge {
    return Edge(
        from_slave(slave, node(body, image, Place(ring, slice))).current,
        from_slave(slave, node(body, image, Place(ring, slice + 1))).current,
    );
}

// The best faces of a slab, whose first one is at `first` around the ring.
fn best_of(slave: u32, body: u32, image: vec2<i32>, slice: i32, first: i32, reach: f32) -> Best {
    let nowhere = Near(FAR, Place(0, 0));
    var best = Best(key(body, image), nowhere, nowhere);
    var here = across(slave, body, image, first, slice);
    for (var ring = first; ring < min(first + SLAB_FACES, ring_of(body)); ring++) {
        let next = across(slave, body, image, ring + 1, slice);
        let corners = array<vec3<f32>, 4>(here.low, here.high, next.high, next.low);
        here = next;
        let middle = ((corners[0] + corners[1]) + (corners[2] + corners[3])) * 0.25;
        let spread = 0.5 * max(norm(corners[2] - corners[0]), norm(corners[3] - corners[1]));
        if norm(middle) > reach + spread * 1.1 {
            continue;
        }
        let point = closest(corners);
        if point.distance > reach {
            continue;
        }
        let face = Near(point.distance, Place(ring, slice));
        if height(point) >= 0.0 || IS_THREAD && !point.interior {
            best.in_front = nearer(best.in_front, face);
        } else if normal_and_distance(point, IS_THREAD).faces && !is_rim(body, face.place, point) {
            best.behind = nearer(best.behind, face);
        }
    }
    return best;
}

// An image of a slab within reach of a slave.
struct Within {
    yes: bool,
    image: vec2<i32>,
}

fn within(near: u32, position: vec3<f32>, reach: f32, stretched: vec2<f32>) -> Within {
    if position.z < boxes[BOX * near + 2u] - reach || position.z > boxes[BOX * near + 3u] + reach {
        return Within(false, vec2<i32>(0));
    }
    let middle = vec2<f32>(boxes[BOX * near], boxes[BOX * near + 1u]);
    var image = vec2<i32>(0);
#if PERIODIC
    let period = vec2<f32>(params.period) * QUANTUM;
    if params.period.x != 0 {
        image.x = to_i32((position.x - middle.x) / period.x);
    }
    if params.period.y != 0 {
        image.y = to_i32((position.y - middle.y) / period.y);
    }
    let from_middle = abs(position.xy - middle - vec2<f32>(image) * period);
#else
    let from_middle = abs(position.xy - middle);
#endif
    let room = vec2<f32>(boxes[BOX * near + 4u], boxes[BOX * near + 5u]) + reach * stretched;
    return Within(!any(from_middle > room), image);
}

fn candidates(item: u32) {
    let back = inverse();
    let stretched = stretch(back);
    let slave = slaves[SLAVE * item];
#if THREAD
#else
    let own = slaves[SLAVE * item + 1u];
#endif
    let reach = values[SLAVE_VALUES * item + 1u] + params.skin;
    let position = absolute(back, slave);
    if !(is_finite(position.x) && is_finite(position.y) && is_finite(position.z)) {
        atomicOr(&status[FLAGS], NOT_FINITE);
        return;
    }
    let cell = cell_index(cells(0u, position.x, position.x).x, cells(1u, position.y, position.y).x);
    let listed = counts[cell];
    // overflow keeps what was known, and is searched again with larger tables
    if listed > params.capacity {
        return;
    }
    let found_at = found_when[item];
    if found_at == WITH_ALL {
        let own_motion = vec3<f32>(motion(slave));
        var searches = false;
        for (var i = 0u; i < listed && !searches; i++) {
            let near = lists[cell * params.capacity + i];
            searches = near < params.slabs && has_moved(near, Motion(own_motion, own_motion), f32(params.apart))
                && within(near, position, reach, stretched).yes;
        }
        if !searches {
            return;
        }
    }
    var found: array<Best, MOST>;
    var count = 0u;
    var full = false;
    for (var i = 0u; i < listed; i++) {
        let near = lists[cell * params.capacity + i];
        if near >= params.slabs {
            continue;
        }
        let body = slabs[SLAB * near];
#if THREAD
#else
        if body == own {
            continue;
        }
#endif
        let seen = within(near, position, reach, stretched);
        if !seen.yes {
            continue;
        }
        var image = seen.image;
        var slice = i32(slabs[SLAB * near + 1u]);
#if PERIODIC
        // a closed yarn goes on through its own images: count its slices on instead
        let turns = image.x * wrap_of(body).x + image.y * wrap_of(body).y;
        image = image - turns * wrap_of(body);
        slice = slice + turns * slices_of(body);
#endif
        let first = i32(slabs[SLAB * near + 2u]);
        let best = best_of(slave, body, image, slice, first, reach);
        if best.in_front.distance == FAR && best.behind.distance == FAR {
            continue;
        }
        var known = 0u;
        while known < count && found[known].key != best.key {
            known++;
        }
        if known < count {
            found[known].in_front = nearer(found[known].in_front, best.in_front);
            found[known].behind = nearer(found[known].behind, best.behind);
        } else if count < MOST {
            found[count] = best;
            count++;
        } else {
            full = true;
        }
    }
    if full || count > params.slots {
        atomicOr(&status[FLAGS], SLOTS_FULL);
        return;
    }
    // sorted by key
    for (var i = 1u; i < count; i++) {
        let best = found[i];
        var to = i;
        while to > 0u && found[to - 1u].key > best.key {
            found[to] = found[to - 1u];
            to--;
        }
        found[to] = best;
    }
    // new candidates go into the slots; known ones keep their state, and their face while they touch
    let size = params.state;
    let first_slot = params.slots * item;
    var old: array<Slot, MOST>;
    let known_slots = min(params.slots, MOST);
    for (var slot = 0u; slot < known_slots; slot++) {
        let k = SLOT_KEYS * (first_slot + slot);
        var state = vec4<f32>(0.0);
        for (var i = 0u; i < size; i++) {
            state[i] = states[size * (first_slot + slot) + i];
        }
        old[slot] = Slot(keys[k], keys[k + 1u], keys[k + 2u], state);
    }
    for (var slot = 0u; slot < params.slots; slot++) {
        var now = Slot(EMPTY, EMPTY, EMPTY, vec4<f32>(0.0));
        if slot < count {
            let best = found[slot];
            var place = best.in_front.place;
            if best.behind.distance + CLEARLY < best.in_front.distance {
                place = best.behind.place;
            }
            now = Slot(best.key, u32(place.ring), u32(place.slice), vec4<f32>(0.0));
            for (var i = 0u; i < known_slots; i++) {
                if old[i].key == best.key {
                    now.state = old[i].state;
                    if old[i].state.x > 0.0 {
                        now.ring = old[i].ring;
                        now.slice = old[i].slice;
                    }
                    break;
                }
            }
        }
        let k = SLOT_KEYS * (first_slot + slot);
        keys[k] = now.key;
        keys[k + 1u] = now.ring;
        keys[k + 2u] = now.slice;
        for (var i = 0u; i < size; i++) {
            states[size * (first_slot + slot) + i] = now.state[i];
        }
    }
    found_when[item] = select(SINCE, WITH_ALL, found_at == NEVER);
    atomicAdd(&status[SEARCHED], 1u);
}
#endif
