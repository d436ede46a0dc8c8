// The grid of the broad phase: slabs of faces and beams, each in every cell that its box touches.

#if clear
#if ROOT
fn clear(cell: u32) {
    counts[cell] = 0u;
}
#endif
#else
#if fill_slabs
#define STATUS
#define FACES
#define BEFORE
#endif
#if fill_beams
#define STATUS
#define BEFORE
#endif
#include "contact/surface"
#if fill_beams
#include "contact/arc_offset"
#endif

// The in-plane inverse of F̄, and a vector in the pulled-back plane.
struct Inverse {
    x: vec2<f32>,
    y: vec2<f32>,
}

fn inverse() -> Inverse {
#if PERIODIC
    let a = 1.0 + row.gradient_xx;
    let b = row.gradient_xy;
    let c = row.gradient_yx;
    let d = 1.0 + row.gradient_yy;
    let scale = 1.0 / (a * d - b * c);
    return Inverse(vec2<f32>(d * scale, -(b * scale)), vec2<f32>(-(c * scale), a * scale));
#else
    return Inverse(vec2<f32>(1.0, 0.0), vec2<f32>(0.0, 1.0));
#endif
}

fn pull_back(back: Inverse, v: vec3<f32>) -> vec2<f32> {
    return vec2<f32>(dot(back.x, v.xy), dot(back.y, v.xy));
}

// Factor by which a distance in space can grow in the pulled-back plane, along its axes.
fn stretch(back: Inverse) -> vec2<f32> {
    return vec2<f32>(sqrt(dot(back.x, back.x)), sqrt(dot(back.y, back.y)));
}

// Node position: pulled-back plane and height, mm. For the grid only; contact uses position differences.
fn absolute(back: Inverse, node: u32) -> vec3<f32> {
    let plane = arrayLength(&remainder) / 3u;
    let y = node + plane;
    let z = y + plane;
    let q = vec3<f32>(vec3<i32>(quanta[node], quanta[y], quanta[z])) * QUANTUM;
    let w = q + vec3<f32>(remainder[node], remainder[y], remainder[z]);
    let at_rest = vec3<f32>(vec3<i32>(reference[node], reference[y], reference[z])) * QUANTUM;
    return at_rest + vec3<f32>(pull_back(back, w), w.z);
}

// First and last cell along one axis for an interval of the pulled-back plane; the last may exceed the first by whole periods.
fn cells(axis: u32, low: f32, high: f32) -> vec2<i32> {
    let x = (vec2<f32>(low, high) - params.origin[axis]) / params.cell[axis];
    let cell = vec2<i32>(floor(clamp(x, vec2<f32>(-1e6), vec2<f32>(1e6))));
    let last = i32(params.cells[axis]) - 1;
#if PERIODIC
    if params.period[axis] != 0 {
        return vec2<i32>(cell.x, min(cell.y, cell.x + last));
    }
#endif
    return clamp(cell, vec2<i32>(0), vec2<i32>(last));
}

// Index of a cell.
fn cell_index(x: i32, y: i32) -> u32 {
    let n = vec2<i32>(params.cells);
    return u32(rem_euclid(y, n.y) * n.x + rem_euclid(x, n.x));
}

#if BEFORE
// Displacement of a node since the last full search, quanta; the including file binds the displacement at that search as `before`.
fn motion(node: u32) -> vec3<i32> {
    let plane = arrayLength(&remainder) / 3u;
    let y = node + plane;
    let z = y + plane;
    let rest = vec3<f32>(remainder[node], remainder[y], remainder[z]) * (1.0 / QUANTUM);
    let now = vec3<i32>(quanta[node], quanta[y], quanta[z]) + vec3<i32>(to_i32(rest.x), to_i32(rest.y), to_i32(rest.z));
    return clamp(now - vec3<i32>(before[node], before[y], before[z]), vec3<i32>(-MOST_MOTION), vec3<i32>(MOST_MOTION));
}
#endif

#if BOXES
// Bounds of the motion of an item.
struct Motion {
    least: vec3<f32>,
    greatest: vec3<f32>,
}

// Motion stored in a box; the including file binds `boxes`.
fn motion_of(item: u32) -> Motion {
    let at = BOX * item + MOTION;
    return Motion(
        vec3<f32>(boxes[at], boxes[at + 1u], boxes[at + 2u]),
        vec3<f32>(boxes[at + 3u], boxes[at + 4u], boxes[at + 5u]),
    );
}

// Whether an item, by its box, has moved by more than `apart` relative to another, or whether either motion exceeds the range
// of a box.
fn has_moved(item: u32, other: Motion, apart: f32) -> bool {
    let own = motion_of(item);
    let most = vec3<f32>(f32(MOST_MOTION));
    let is_far = any(min(own.least, other.least) <= -most) || any(max(own.greatest, other.greatest) >= most);
    return is_far || any(max(own.greatest - other.least, other.greatest - own.least) > vec3<f32>(apart));
}
#endif

#if ROOT
// The box of an item, relative to its first node, and the motion of its nodes.
struct Bounds {
    low: vec3<f32>,
    high: vec3<f32>,
    least: vec3<i32>,
    greatest: vec3<i32>,
}

fn no_bounds() -> Bounds {
    return Bounds(vec3<f32>(0.0), vec3<f32>(0.0), vec3<i32>(MOST_MOTION), vec3<i32>(-MOST_MOTION));
}

fn grow(bounds: Bounds, back: Inverse, v: vec3<f32>) -> Bounds {
    let x = vec3<f32>(pull_back(back, v), v.z);
    return Bounds(min(bounds.low, x), max(bounds.high, x), bounds.least, bounds.greatest);
}

fn moves(bounds: Bounds, motion: vec3<i32>) -> Bounds {
    return Bounds(bounds.low, bounds.high, min(bounds.least, motion), max(bounds.greatest, motion));
}

// Puts an item into every cell that its box touches, `reach` around.
fn put(item: u32, origin: u32, back: Inverse, bounds: Bounds, reach: f32) {
    let base = absolute(back, origin);
    let low = bounds.low;
    let high = bounds.high;
    boxes[BOX * item] = base.x + 0.5 * (low.x + high.x);
    boxes[BOX * item + 1u] = base.y + 0.5 * (low.y + high.y);
    boxes[BOX * item + 2u] = base.z + low.z;
    boxes[BOX * item + 3u] = base.z + high.z;
    boxes[BOX * item + 4u] = 0.5 * (high.x - low.x);
    boxes[BOX * item + 5u] = 0.5 * (high.y - low.y);
    for (var k = 0u; k < 3u; k++) {
        boxes[BOX * item + MOTION + k] = f32(bounds.least[k]);
        boxes[BOX * item + MOTION + 3u + k] = f32(bounds.greatest[k]);
    }
    let room = reach * stretch(back) + ROUNDING;
    let xs = cells(0u, base.x + low.x - room.x, base.x + high.x + room.x);
    let ys = cells(1u, base.y + low.y - room.y, base.y + high.y + room.y);
    for (var y = ys.x; y <= ys.y; y++) {
        for (var x = xs.x; x <= xs.y; x++) {
            let cell = cell_index(x, y);
            let place = atomicAdd(&counts[cell], 1u);
            if place < params.capacity {
                lists[cell * params.capacity + place] = item;
            } else {
                atomicOr(&status[FLAGS], CELL_FULL);
            }
        }
    }
}

#if fill_slabs
fn fill_slabs(item: u32) {
    let back = inverse();
    var bounds = no_bounds();
    let first = slabs[SLAB * item];
    let origin = of_coded(faces[FACE * first]).node;
    let nowhere = Offset(vec3<f32>(0.0), vec3<f32>(0.0));
    for (var place = 0u; place < slabs[SLAB * item + 1u]; place++) {
        let face = first + place;
        var low = vec3<f32>(1e9);
        var high = vec3<f32>(-1e9);
        for (var a = 0u; a < 4u; a++) {
            let now = corner(face, a, vec2<i32>(0), origin, nowhere).current;
            bounds = grow(bounds, back, now);
            bounds = moves(bounds, motion(of_coded(faces[FACE * face + a]).node));
            low = min(low, now);
            high = max(high, now);
        }
        for (var k = 0u; k < 3u; k++) {
            face_boxes[FACE_BOXES * item + SLAB_FACES * k + place] = low[k];
            face_boxes[FACE_BOXES * item + SLAB_FACES * (3u + k) + place] = high[k];
        }
    }
    put(item, origin, back, bounds, params.thread_radius + params.skin);
}
#endif

#if fill_beams
fn fill_beams(item: u32) {
    let back = inverse();
    let beam = item - params.slabs;
    let line = piece(beam).now;
    var bounds = grow(grow(no_bounds(), back, line[0]), back, line[1]);
    let first = ends[2u * beam];
    bounds = moves(moves(bounds, motion(first)), motion(ends[2u * beam + 1u]));
    put(item, first, back, bounds, 2.0 * params.thread_radius + params.skin);
}
#endif
#endif
#endif
