// Pairs of nearby beams: found by the grid, each with the line pieces of its beams.

#define STATUS
#if pairs
#define BOXES
#endif
#include "contact/grid"
#include "contact/arc_offset"
#include "contact/segments"

// Two pieces in the reference and current states.
struct Pieces {
    rest: Segments,
    now: Segments,
}

fn segments_of(own: array<vec3<f32>, 2>, apart: vec3<f32>, other: array<vec3<f32>, 2>) -> Segments {
    return Segments(own[1] - own[0], apart + (other[0] - own[0]), other[1] - other[0]);
}

// The pieces of the known beam `a` and of `b` in an image.
fn pieces(a: u32, own: Piece, b: u32, image: vec2<i32>) -> Pieces {
    let apart = from_node(Imaged(ends[2u * b], image), ends[2u * a]);
    let other = piece(b);
    return Pieces(segments_of(own.rest, apart.reference, other.rest), segments_of(own.now, apart.current, other.now));
}

#if ROOT
// Cells from the first to the last along x and y.
struct Cells {
    x: vec2<i32>,
    y: vec2<i32>,
}

// The cells of a beam's piece, whose first node is at `node`.
fn cells_of(node: vec2<f32>, line: Piece, back: Inverse) -> Cells {
    let a = node + pull_back(back, line.now[0]);
    let b = node + pull_back(back, line.now[1]);
    let low = min(a, b);
    let high = max(a, b);
    return Cells(cells(0u, low.x, high.x), cells(1u, low.y, high.y));
}

// Whether a cell is full, and whether a beam of a higher number has moved relative to this one since the last full search.
struct Moved {
    full: bool,
    moved: bool,
}

fn moved_in(item: u32, at: Cells) -> Moved {
    let own = motion_of(item);
    var found = Moved(false, false);
    for (var y = at.y.x; y <= at.y.y; y++) {
        for (var x = at.x.x; x <= at.x.y; x++) {
            let cell = cell_index(x, y);
            found.full = found.full || counts[cell] > params.capacity;
            for (var i = 0u; i < counts[cell] && !(found.moved || found.full); i++) {
                let near = lists[cell * params.capacity + i];
                found.moved = near > item && has_moved(near, own, f32(params.apart));
            }
        }
    }
    return found;
}

// The image of an item nearest to another.
fn image_of(item: u32, near: u32) -> vec2<i32> {
    var image = vec2<i32>(0);
#if PERIODIC
    let period = vec2<f32>(params.period) * QUANTUM;
    let apart = vec2<f32>(boxes[BOX * item] - boxes[BOX * near], boxes[BOX * item + 1u] - boxes[BOX * near + 1u]);
    if params.period.x != 0 {
        image.x = to_i32(apart.x / period.x);
    }
    if params.period.y != 0 {
        image.y = to_i32(apart.y / period.y);
    }
#endif
    return image;
}

// Whether a pair is within reach.
fn is_near(beam: u32, line: Piece, other: u32, image: vec2<i32>) -> bool {
    return distance_of(pieces(beam, line, other, image).now) < 2.0 * params.thread_radius + params.skin;
}

// Moves a slot with all its data to another slot.
fn move_slot(slot: u32, to: u32) {
    keys[to] = keys[slot];
    for (var i = 0u; i < bound(params.state, arrayLength(&states)); i++) {
        states[params.state * to + i] = states[params.state * slot + i];
    }
}

// Removes pairs out of reach from a beam's list; returns the number left.
fn keep(beam: u32, line: Piece) -> u32 {
    let slots = params.beam_slots;
    let first = slots * beam;
    var count = 0u;
    for (var slot = first; slot < first + slots; slot++) {
        let known = keys[slot];
        if known == EMPTY {
            break;
        }
        let candidate = of_key(known);
        if is_near(beam, line, candidate.body, candidate.image) {
            move_slot(slot, first + count);
            count++;
        }
    }
    for (var slot = first + count; slot < first + slots; slot++) {
        keys[slot] = EMPTY;
    }
    return count;
}

// Inserts a pair within reach into a beam's list of `count`, in ascending order, if it is new; returns the new count, which
// exceeds the capacity by one if there is no room.
fn insert(beam: u32, line: Piece, near: u32, count: u32) -> u32 {
    let slots = params.beam_slots;
    let first = slots * beam;
    let other = near - params.slabs;
    let image = image_of(params.slabs + beam, near);
    let pair = key(other, image);
    var place = 0u;
    while place < count && keys[first + place] < pair {
        place++;
    }
    if place < count && keys[first + place] == pair {
        return count;
    }
    if are_near(beam, other, image, params.self_arc) || !is_near(beam, line, other, image) {
        return count;
    }
    if count < slots {
        for (var to = count; to > place; to--) {
            move_slot(first + to - 1u, first + to);
        }
        keys[first + place] = pair;
        for (var i = 0u; i < bound(params.state, arrayLength(&states)); i++) {
            states[params.state * (first + place) + i] = 0.0;
        }
    }
    return count + 1u;
}

fn pairs(beam: u32) {
    let back = inverse();
    let line = piece(beam);
    let node = absolute(back, ends[2u * beam]).xy;
    if !(is_finite(node.x) && is_finite(node.y)) {
        atomicOr(&status[FLAGS], NOT_FINITE);
        return;
    }
    let at = cells_of(node, line, back);
    let found_at = found_when[beam];
    let moved = moved_in(params.slabs + beam, at);
    // an overflow keeps the known pairs and triggers a new search with larger tables
    if moved.full || !moved.moved && found_at == WITH_ALL {
        return;
    }
    var count = keep(beam, line);
    for (var y = at.y.x; y <= at.y.y; y++) {
        for (var x = at.x.x; x <= at.x.y; x++) {
            let cell = cell_index(x, y);
            let listed = counts[cell];
            for (var i = 0u; i < listed; i++) {
                let near = lists[cell * params.capacity + i];
                if near > params.slabs + beam {
                    count = insert(beam, line, near, count);
                }
                if count > params.beam_slots {
                    atomicOr(&status[FLAGS], SLOTS_FULL);
                    return;
                }
            }
        }
    }
    found_when[beam] = select(SINCE, WITH_ALL, found_at == NEVER);
    atomicAdd(&status[SEARCHED], 1u);
}
#endif
