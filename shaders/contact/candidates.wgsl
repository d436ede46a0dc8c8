// Broad-phase candidates: for each carrier of contact points, the faces of other bodies whose box lies within reach of the box
// of its points.

#define STATUS
#define FACES
#define POINTS
#define BEFORE
#define BOXES
#include "contact/grid"

#if ROOT
// The extent of the points of a carrier, see the twin.
struct Place {
    low: vec3<f32>,
    high: vec3<f32>,
    middle: vec2<f32>,
    half: vec2<f32>,
    heights: vec2<f32>,
}

fn place_of(carrier: u32, base: u32, back: Inverse) -> Place {
    let first = carriers[CARRIER * carrier];
    var low = vec3<f32>(1e9);
    var high = vec3<f32>(-1e9);
    var low_back = vec2<f32>(1e9);
    var high_back = vec2<f32>(-1e9);
    for (var k = 0u; k < carriers[CARRIER * carrier + 1u]; k++) {
        let offset = point_of(first + k).current;
        low = min(low, offset);
        high = max(high, offset);
        let pulled = pull_back(back, offset);
        low_back = min(low_back, pulled);
        high_back = max(high_back, pulled);
    }
    let from_base = absolute(back, base);
    return Place(
        low,
        high,
        from_base.xy + 0.5 * (low_back + high_back),
        0.5 * (high_back - low_back),
        vec2<f32>(from_base.z + low.z, from_base.z + high.z),
    );
}

// The image of a slab whose box is within reach, if any.
struct Within {
    yes: bool,
    image: vec2<i32>,
}

fn image_within(place: Place, slab: u32, reach: f32, stretched: vec2<f32>) -> Within {
    let b = BOX * slab;
    if place.heights.y < boxes[b + 2u] - reach || place.heights.x > boxes[b + 3u] + reach {
        return Within(false, vec2<i32>(0));
    }
    var image = vec2<i32>(0);
    var apart = place.middle - vec2<f32>(boxes[b], boxes[b + 1u]);
#if PERIODIC
    let period = vec2<f32>(params.period) * QUANTUM;
    if params.period.x > 0 {
        image.x = to_i32(apart.x / period.x);
        apart.x = apart.x - f32(image.x) * period.x;
    }
    if params.period.y > 0 {
        image.y = to_i32(apart.y / period.y);
        apart.y = apart.y - f32(image.y) * period.y;
    }
#endif
    let room = place.half + vec2<f32>(boxes[b + 4u], boxes[b + 5u]) + reach * stretched;
    return Within(!any(abs(apart) > room), image);
}

// Whether the box of a face of a slab is within reach; `offset` is the slab's first node relative to the carrier's.
fn is_near(place: Place, slab: u32, face: u32, offset: vec3<f32>, reach: f32) -> bool {
    let b = FACE_BOXES * slab + face;
    let low = vec3<f32>(face_boxes[b], face_boxes[b + SLAB_FACES], face_boxes[b + 2u * SLAB_FACES]);
    let high = vec3<f32>(
        face_boxes[b + 3u * SLAB_FACES],
        face_boxes[b + 4u * SLAB_FACES],
        face_boxes[b + 5u * SLAB_FACES],
    );
    let gap = max(max(low - (place.high - offset), (place.low - offset) - high), vec3<f32>(0.0));
    let most = reach + ROUNDING;
    return dot(gap, gap) <= most * most;
}

// Adds an entry of a body, if it is new, to a list of `count` that starts at `first`; returns the required number of entries,
// even without room.
fn add_entry(first: u32, count: u32, body: u32, entry: u32) -> u32 {
    // the first entry that is not smaller
    var low = 0u;
    var high = count;
    while low < high {
        let middle = (low + high) / 2u;
        let known = near[first + middle];
#if PERIODIC
        let known_body = body_of(known);
        let is_before = known_body < body || known_body == body && known < entry;
#else
        // faces are numbered body by body: without images, entries are in the order of bodies
        let is_before = known < entry;
#endif
        if is_before {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    if low < count && near[first + low] == entry {
        return count;
    }
    if count < params.faces {
        for (var to = count; to > low; to--) {
            near[first + to] = near[first + to - 1u];
        }
        near[first + low] = entry;
    }
    return count + 1u;
}

// Number of bodies in a list.
fn bodies_in(first: u32, count: u32) -> u32 {
    var bodies = 0u;
    var last = EMPTY;
    for (var i = 0u; i < count; i++) {
        let body = body_of(near[first + i]);
        bodies = bodies + select(0u, 1u, body != last);
        last = body;
    }
    return bodies;
}

// Whether a slab belongs to another body and is within reach; its image.
fn sees(slab: u32, own: u32, place: Place, reach: f32, stretched: vec2<f32>) -> Within {
    if slab >= params.slabs {
        return Within(false, vec2<i32>(0));
    }
    let within = image_within(place, slab, reach, stretched);
    return Within(within.yes && marks(slabs[SLAB * slab]) >> 10u != own, within.image);
}

// Whether anything within reach has moved relative to the carrier since the last full search.
fn searches(carrier: u32, place: Place, xs: vec2<i32>, ys: vec2<i32>, reach: f32, stretched: vec2<f32>) -> bool {
    let first = carriers[CARRIER * carrier];
    let own = carriers[CARRIER * carrier + 2u];
    let moved = motion(carried_by(first, 0u));
    var least = moved;
    var greatest = moved;
    for (var a = 1u; a < CARRIED_BY; a++) {
        let also = motion(carried_by(first, a));
        least = min(least, also);
        greatest = max(greatest, also);
    }
    let bounds = Motion(vec3<f32>(least), vec3<f32>(greatest));
    for (var y = ys.x; y <= ys.y; y++) {
        for (var x = xs.x; x <= xs.y; x++) {
            let cell = cell_index(x, y);
            for (var i = 0u; i < counts[cell]; i++) {
                let slab = lists[cell * params.capacity + i];
                if has_moved(slab, bounds, f32(params.apart)) && sees(slab, own, place, reach, stretched).yes {
                    return true;
                }
            }
        }
    }
    return false;
}

// Lists the faces within reach; returns their number.
fn list_faces(carrier: u32, base: u32, place: Place, xs: vec2<i32>, ys: vec2<i32>, reach: f32, stretched: vec2<f32>) -> u32 {
    let own = carriers[CARRIER * carrier + 2u];
    let first = (MADE + params.faces) * carrier + MADE;
    var count = 0u;
    for (var y = ys.x; y <= ys.y; y++) {
        for (var x = xs.x; x <= xs.y; x++) {
            let cell = cell_index(x, y);
            for (var i = 0u; i < counts[cell]; i++) {
                let slab = lists[cell * params.capacity + i];
                let seen = sees(slab, own, place, reach, stretched);
                if !seen.yes {
                    continue;
                }
                let first_face = slabs[SLAB * slab];
                let origin = of_coded(faces[FACE * first_face]).node;
                let offset = from_node(Imaged(origin, seen.image), base).current;
                let body = body_of(key(first_face, seen.image));
                for (var face = 0u; face < slabs[SLAB * slab + 1u]; face++) {
                    if is_near(place, slab, face, offset, reach) {
                        let known = count;
                        count = add_entry(first, count, body, key(first_face + face, seen.image));
                        if count > params.faces {
                            return count;
                        }
                        // a slab with a known face was in an earlier cell, too
                        if count == known {
                            break;
                        }
                    }
                }
            }
        }
    }
    return count;
}

fn candidates(item: u32) {
    let back = inverse();
    let stretched = stretch(back);
    let base = carried_by(carriers[CARRIER * item], 0u);
    let reach = points[POINT * carriers[CARRIER * item] + 5u] + params.skin;
    let place = place_of(item, base, back);
    if !(is_finite(place.middle.x) && is_finite(place.middle.y) && is_finite(place.heights.x)) {
        atomicOr(&status[FLAGS], NOT_FINITE);
        return;
    }
    let xs = cells(0u, place.middle.x - place.half.x, place.middle.x + place.half.x);
    let ys = cells(1u, place.middle.y - place.half.y, place.middle.y + place.half.y);
    // an overflow triggers a new search with larger tables
    for (var y = ys.x; y <= ys.y; y++) {
        for (var x = xs.x; x <= xs.y; x++) {
            if counts[cell_index(x, y)] > params.capacity {
                return;
            }
        }
    }
    let found_at = found_when[item];
    if found_at == WITH_ALL && !searches(item, place, xs, ys, reach, stretched) {
        return;
    }
    let first = (MADE + params.faces) * item + MADE;
    let count = list_faces(item, base, place, xs, ys, reach, stretched);
    if count > params.faces || bodies_in(first, count) > params.slots {
        found_when[item] = NEVER;
        atomicOr(&status[FLAGS], SLOTS_FULL);
        return;
    }
    for (var i = count; i < bound(params.faces, arrayLength(&near)); i++) {
        near[first + i] = EMPTY;
    }
    near[first - MADE] = near[first - MADE] + 1u;
    found_when[item] = select(SINCE, WITH_ALL, found_at == NEVER);
    atomicAdd(&status[SEARCHED], 1u);
}
#endif
