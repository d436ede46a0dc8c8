// A face of a structured surface seen from a slave point: closest point on a bilinear patch, and the walk over the surface.
// What includes this binds `reference`, `quanta` and `remainder`; with BODIES, for the nodes of surfaces, also `bodies` and
// `ring_lines`. With TOUCH it defines `fn touch(all: ptr<function, Touch>, corners: Corners, point: Closest)` for the faces
// that are found; nodes of threads (THREAD) may touch several.

#include "kernel/row"
#include "kernel/vector"
#define REFERENCE
#include "kernel/node"
#define PARAMS
#include "contact/mod"

// Integers of a body in the table: start of its ring, nodes on the ring, slices, whether closed, image behind the last slice.
const BODY: u32 = 6u;

// Where on a surface: ring position, and slice counted on through periodic images.
struct Place {
    ring: i32,
    slice: i32,
}

// A node in an image: shift in quanta.
struct Imaged {
    node: u32,
    shift: vec2<i32>,
}

// Reference and current position relative to the slave.
struct FromSlave {
    reference: vec3<f32>,
    current: vec3<f32>,
}

// The corners of a face relative to the slave, in the order (r, s), (r, s+1), (r+1, s+1), (r+1, s).
struct Corners {
    nodes: vec4<u32>,
    reference: array<vec3<f32>, 4>,
    current: array<vec3<f32>, 4>,
}

// The point of a face closest to the slave.
struct Closest {
    xi: f32,
    eta: f32,
    offset: vec3<f32>,
    distance: f32,
    normal: vec3<f32>,
    interior: bool,
}

// Where a walk ends.
struct Walked {
    place: Place,
    corners: Corners,
    point: Closest,
}

// Remainder and quotient by a positive number, rounded down.
fn rem_euclid(a: i32, n: i32) -> i32 {
    let r = a % n;
    return select(r, r + n, r < 0);
}

fn div_euclid(a: i32, n: i32) -> i32 {
    return (a - rem_euclid(a, n)) / n;
}

// Reference and current position of a surface node relative to the slave node.
fn from_slave(slave: u32, seen: Imaged) -> FromSlave {
    let rest = lattice_between(seen.node, slave, seen.shift);
#if PERIODIC
    return FromSlave(rest, (rest + apply(gradient(), rest)) + displacement_between(seen.node, slave));
#else
    return FromSlave(rest, rest + displacement_between(seen.node, slave));
#endif
}

#if BODIES
fn ring_of(body: u32) -> i32 {
    return i32(bodies[BODY * body + 1u]);
}

fn slices_of(body: u32) -> i32 {
    return i32(bodies[BODY * body + 2u]);
}

#if PERIODIC
fn is_closed(body: u32) -> bool {
    return bodies[BODY * body + 3u] == 1u;
}

fn wrap_of(body: u32) -> vec2<i32> {
    return vec2<i32>(bitcast<i32>(bodies[BODY * body + 4u]), bitcast<i32>(bodies[BODY * body + 5u]));
}
#endif

// A node of a body's surface, and its image shift in quanta.
fn node(body: u32, image: vec2<i32>, place: Place) -> Imaged {
    let line = ring_lines[bodies[BODY * body] + u32(rem_euclid(place.ring, ring_of(body)))];
#if PERIODIC
    var shown = image;
    var slice = place.slice;
    if is_closed(body) {
        let turns = div_euclid(slice, slices_of(body));
        slice = slice - turns * slices_of(body);
        shown = image + turns * wrap_of(body);
    }
    return Imaged(line + u32(slice), shown * params.period);
#else
    return Imaged(line + u32(place.slice), image);
#endif
}

// The corners of a face.
fn corners(slave: u32, body: u32, image: vec2<i32>, place: Place) -> Corners {
    let n0 = node(body, image, place);
    let n1 = node(body, image, Place(place.ring, place.slice + 1));
    let n2 = node(body, image, Place(place.ring + 1, place.slice + 1));
    let n3 = node(body, image, Place(place.ring + 1, place.slice));
    let c0 = from_slave(slave, n0);
    let c1 = from_slave(slave, n1);
    let c2 = from_slave(slave, n2);
    let c3 = from_slave(slave, n3);
    return Corners(
        vec4<u32>(n0.node, n1.node, n2.node, n3.node),
        array<vec3<f32>, 4>(c0.reference, c1.reference, c2.reference, c3.reference),
        array<vec3<f32>, 4>(c0.current, c1.current, c2.current, c3.current),
    );
}

// Whether a slice of faces is on the body.
fn has_slice(body: u32, slice: i32) -> bool {
#if PERIODIC
    if is_closed(body) {
        return true;
    }
#endif
    return slice >= 0 && slice < slices_of(body);
}

// Whether a face is in the first or last slice of an open body.
fn is_end(body: u32, place: Place) -> bool {
    return !(has_slice(body, place.slice - 1) && has_slice(body, place.slice + 1));
}

// Whether the point closest to a slave is on the rim of an open end.
fn is_rim(body: u32, place: Place, point: Closest) -> bool {
    let ahead = point.xi >= 1.0 && !has_slice(body, place.slice + 1);
    return ahead || (point.xi <= -1.0 && !has_slice(body, place.slice - 1));
}
#endif

// Middle and derivatives of a bilinear patch.
fn patch_of(q: array<vec3<f32>, 4>) -> array<vec3<f32>, 4> {
    let s01 = q[0] + q[1];
    let s23 = q[2] + q[3];
    let d01 = q[1] - q[0];
    let d32 = q[2] - q[3];
    return array<vec3<f32>, 4>((s01 + s23) * 0.25, (d01 + d32) * 0.25, (s23 - s01) * 0.25, (d32 - d01) * 0.25);
}

// Point of a patch.
fn at(p: array<vec3<f32>, 4>, xi: f32, eta: f32) -> vec3<f32> {
    return p[3] * (xi * eta) + (p[2] * eta + (p[1] * xi + p[0]));
}

// Coordinates of the closest point of the unbounded patch to the origin, kept within ±2.
fn project(p: array<vec3<f32>, 4>) -> vec2<f32> {
    var x = vec2<f32>(0.0);
    for (var i = 0; i < 3; i++) {
        let t1 = p[3] * x.y + p[1];
        let t2 = p[3] * x.x + p[2];
        let r = at(p, x.x, x.y);
        let g11 = dot(t1, t1);
        let g12 = dot(t1, t2);
        let g22 = dot(t2, t2);
        let b1 = dot(t1, r);
        let b2 = dot(t2, r);
        let inverse_determinant = 1.0 / max(g11 * g22 - g12 * g12, 1e-20);
        let d = vec2<f32>((g12 * b2 - g22 * b1) * inverse_determinant, (g12 * b1 - g11 * b2) * inverse_determinant);
        x = max(min(x + d, vec2<f32>(2.0)), vec2<f32>(-2.0));
        if abs(d.x) + abs(d.y) < 1e-4 {
            break;
        }
    }
    return x;
}

// Coordinate within ±1 of the closest point of an edge with middle `o` and half its vector `t`.
fn along_edge(o: vec3<f32>, t: vec3<f32>) -> f32 {
    return max(min(-dot(o, t) / dot(t, t), 1.0), -1.0);
}

// The closest point of a face to the origin, where the slave is.
fn closest(q: array<vec3<f32>, 4>) -> Closest {
    let p = patch_of(q);
    var x = project(p);
    let interior = abs(x.x) <= 1.0 && abs(x.y) <= 1.0;
    if !interior {
        // on the border: best along each edge that the projection left through
        let c = max(min(x, vec2<f32>(1.0)), vec2<f32>(-1.0));
        let first = vec2<f32>(c.x, along_edge(p[1] * c.x + p[0], p[3] * c.x + p[2]));
        let second = vec2<f32>(along_edge(p[2] * c.y + p[0], p[3] * c.y + p[1]), c.y);
        let past_xi = abs(x.x) > 1.0;
        let past_eta = abs(x.y) > 1.0;
        if past_xi && !past_eta {
            x = first;
        } else if past_eta && !past_xi {
            x = second;
        } else {
            let a = at(p, first.x, first.y);
            let b = at(p, second.x, second.y);
            x = select(first, second, dot(b, b) < dot(a, a));
        }
    }
    let offset = -at(p, x.x, x.y);
    let n = cross(p[3] * x.x + p[2], p[3] * x.y + p[1]);
    let normal = n * (1.0 / max(norm(n), 1e-20));
    return Closest(x.x, x.y, offset, norm(offset), normal, interior);
}

// Height of the slave above the face's tangent plane, mm.
fn height(point: Closest) -> f32 {
    return dot(point.offset, point.normal);
}

// Whether the slave is behind the inside of the face.
fn is_behind(point: Closest) -> bool {
    return point.interior && height(point) < 0.0;
}

// Whether a point is closer than another, or as close with the slave more in front of its face.
fn better_than(point: Closest, other: Closest) -> bool {
    let tie = other.distance * 1e-4 + 1e-7;
    if abs(point.distance - other.distance) < tie {
        return height(point) > height(other) + tie;
    }
    return point.distance < other.distance;
}

// Direction in which a slave is pushed, and signed distance, mm; not `faces` where the point lies beside the border of a face
// that it has passed under.
struct Side {
    faces: bool,
    normal: vec3<f32>,
    distance: f32,
}

fn normal_and_distance(point: Closest, is_thread: bool) -> Side {
    let height = height(point);
    if point.interior || point.distance < 1e-6 {
        return Side(true, point.normal, height);
    }
    if is_thread || height >= 0.0 {
        return Side(true, point.offset * (1.0 / point.distance), point.distance);
    }
    return Side(-height > 0.7 * point.distance, point.offset * (-1.0 / point.distance), -point.distance);
}

// Weights of the four corners.
fn weights(point: Closest) -> vec4<f32> {
    let a = 1.0 - point.xi;
    let b = 1.0 + point.xi;
    let c = 1.0 - point.eta;
    let d = 1.0 + point.eta;
    return vec4<f32>(0.25 * a * c, 0.25 * b * c, 0.25 * b * d, 0.25 * a * d);
}

#if TOUCH
// Faces that a walk passes at most.
const MOST_FACES: u32 = 12u;
// Walks from a face downhill in distance to the one closest to the slave.
fn walk(slave: u32, body: u32, image: vec2<i32>, from_place: Place) -> Walked {
    var here: Walked;
    here.place = from_place;
    here.corners = corners(slave, body, image, from_place);
    here.point = closest(here.corners.current);
    for (var i = 0u; i < MOST_FACES; i++) {
        if here.point.interior {
            break;
        }
        var moved = false;
        for (var side = 0; side < 2; side++) {
            let along_ring = side == 0;
            let coordinate = select(here.point.xi, here.point.eta, along_ring);
            if abs(coordinate) < 1.0 {
                continue;
            }
            let step = select(-1, 1, coordinate > 0.0);
            var next = here.place;
            if along_ring {
                next.ring = next.ring + step;
            } else {
                next.slice = next.slice + step;
                if !has_slice(body, next.slice) {
                    continue;
                }
            }
            let next_corners = corners(slave, body, image, next);
            let next_point = closest(next_corners.current);
            if better_than(next_point, here.point) {
                here = Walked(next, next_corners, next_point);
                moved = true;
                break;
            }
        }
        if !moved {
            break;
        }
    }
    here.place.ring = rem_euclid(here.place.ring, ring_of(body));
    return here;
}

#if THREAD
// Corners at the ends of the edge that a face shares with the one it is reached from, by a step around the ring or along the
// slices.
fn near_edge(ring: i32, slice: i32) -> vec2<u32> {
    if ring != 0 {
        return select(vec2<u32>(3u, 2u), vec2<u32>(0u, 1u), ring > 0);
    }
    return select(vec2<u32>(1u, 2u), vec2<u32>(0u, 3u), slice > 0);
}

// More than rounding moves a distance, as a share of it.
const FACE_ROUNDING: f32 = 1e-4;

// Whether all of a face is sure to be farther from the slave than `reach`: it lies behind a plane that is so far away, across
// the direction to the closest point of one of its edges.
fn is_beyond(q: array<vec3<f32>, 4>, edge: vec2<u32>, reach: f32) -> bool {
    var corners = q;
    let start = corners[edge.x];
    let along = corners[edge.y] - start;
    let share = min(max(-dot(start, along) / dot(along, along), 0.0), 1.0);
    let nearest = along * share + start;
    let square = dot(nearest, nearest);
    let least = min(min(dot(q[0], nearest), dot(q[1], nearest)), min(dot(q[2], nearest), dot(q[3], nearest)));
    return least > 0.0 && least * least > reach * reach * square * (1.0 + FACE_ROUNDING);
}

// The closest face of all around the slice of one that was found: in front of an open end the two sides of a thin rim may be as
// near as each other.
fn around(slave: u32, body: u32, image: vec2<i32>, found: Walked) -> Walked {
    let ring = ring_of(body);
    var best = found;
    for (var step = 1; step < ring; step++) {
        let place = Place(rem_euclid(found.place.ring + step, ring), found.place.slice);
        best = closer(best, slave, body, image, place, near_edge(1, 0));
    }
    return best;
}

// The closest face of one where a walk has ended and those beside it that rise above it: in front of a fold each of its sides may
// be where a walk ends.
fn beside(slave: u32, body: u32, image: vec2<i32>, found: Walked) -> Walked {
    let place = found.place;
    var best = found;
    for (var step = -1; step <= 1; step += 2) {
        for (var k = 1; k <= RING_REACH; k++) {
            let next = Place(place.ring + k * step, place.slice);
            if k == 1 && !rises(slave, body, image, place, next, found.point) {
                break;
            }
            best = closer(best, slave, body, image, next, near_edge(step, 0));
        }
        let next = Place(place.ring, place.slice + step);
        if has_slice(body, next.slice) && rises(slave, body, image, place, next, found.point) {
            best = closer(best, slave, body, image, next, near_edge(0, step));
        }
    }
    best.place.ring = rem_euclid(best.place.ring, ring_of(body));
    return best;
}

// A face instead of another one if it is closer and not seen from behind; `edge` is the one on the side of that other one.
fn closer(best: Walked, slave: u32, body: u32, image: vec2<i32>, place: Place, edge: vec2<u32>) -> Walked {
    let corners = corners(slave, body, image, place);
    if is_beyond(corners.current, edge, best.point.distance * 1.001 + 1e-6) {
        return best;
    }
    let point = closest(corners.current);
    if !is_behind(point) && better_than(point, best.point) {
        return Walked(place, corners, point);
    }
    return best;
}

// Faces that a thread node can touch at once.
const MOST_TOUCHED: u32 = 12u;
// Places around the ring that are looked at on either side of the closest face.
const RING_REACH: i32 = 3;

// Touches all further faces within `reach` (mm) of the slave, found by spreading from the closest one; in front of an open end,
// all around its rim.
fn faces_within(all: ptr<function, Touch>, slave: u32, body: u32, image: vec2<i32>, first: Walked, reach: f32) {
    let place = first.place;
    let furthest = select(1, RING_REACH, ring_of(body) > 2 * RING_REACH);
    let rim = is_rim(body, place, first.point);
    let front = !is_behind(first.point);
    let borders = borders_within(first.corners, first.point, reach);
    var count = 1u;
    // around the ring, as long as faces are near; then the same in the slices before and after
    for (var turn = 0; turn < 3; turn++) {
        let slice = select(2 * turn - 3, 0, turn == 0);
        if !has_slice(body, place.slice + slice) {
            continue;
        }
        if slice != 0 {
            let border = select(borders.high_slice, borders.low_slice, slice < 0);
            let next = Place(place.ring, place.slice + slice);
            if !border && !rises(slave, body, image, place, next, first.point) {
                continue;
            }
            if !add_near(all, &count, slave, body, image, next, reach, front, near_edge(0, slice)) {
                continue;
            }
        }
        if slice == 0 && rim {
            for (var k = 1; k < ring_of(body); k++) {
                let next = Place(place.ring + k, place.slice);
                add_near(all, &count, slave, body, image, next, reach, front, near_edge(1, 0));
            }
            continue;
        }
        for (var step = -1; step <= 1; step += 2) {
            let border = select(borders.high_ring, borders.low_ring, step < 0);
            for (var k = 1; k <= furthest; k++) {
                let next = Place(place.ring + k * step, place.slice + slice);
                let beside = Place(next.ring, place.slice);
                if k == 1 && !border && !rises(slave, body, image, place, beside, first.point) {
                    break;
                }
                if !add_near(all, &count, slave, body, image, next, reach, front, near_edge(step, 0)) {
                    break;
                }
            }
        }
    }
}

// Touches a face if it is within reach; says whether it is. Where the first one is seen from the `front`, one that is seen from
// behind is the other side of a thin edge. `edge` is the one on the side of those that were looked at before.
fn add_near(
    all: ptr<function, Touch>,
    count: ptr<function, u32>,
    slave: u32,
    body: u32,
    image: vec2<i32>,
    place: Place,
    reach: f32,
    front: bool,
    edge: vec2<u32>,
) -> bool {
    if *count == MOST_TOUCHED {
        return false;
    }
    let corners = corners(slave, body, image, place);
    if is_beyond(corners.current, edge, reach) {
        return false;
    }
    let point = closest(corners.current);
    let is_near = point.distance < reach && !(front && is_behind(point));
    if is_near {
        touch(all, corners, point);
        *count = *count + 1u;
    }
    return is_near;
}

// Whether the far edge of a neighbouring face lies above the plane of the closest point.
fn rises(slave: u32, body: u32, image: vec2<i32>, place: Place, next: Place, point: Closest) -> bool {
    let ring = next.ring - place.ring;
    let slice = next.slice - place.slice;
    var a = Place(next.ring + select(0, 1, ring > 0), next.slice);
    var b = Place(a.ring, next.slice + 1);
    if ring == 0 {
        a = Place(next.ring, next.slice + select(0, 1, slice > 0));
        b = Place(next.ring + 1, a.slice);
    }
    let above_a = from_slave(slave, node(body, image, a)).current + point.offset;
    let above_b = from_slave(slave, node(body, image, b)).current + point.offset;
    return dot(above_a, point.normal) > 1e-4 || dot(above_b, point.normal) > 1e-4;
}

// Borders of a face that are within reach of the slave.
struct Borders {
    low_ring: bool,
    low_slice: bool,
    high_ring: bool,
    high_slice: bool,
}

// Faces are neither flat nor rectangles: their borders may be nearer than they look along the face by this factor.
const SLANT: f32 = 0.5;

fn is_within(gap: f32, tangent: vec3<f32>, room: f32) -> bool {
    return gap * gap * dot(tangent, tangent) * (SLANT * SLANT) < room;
}

fn borders_within(corners: Corners, point: Closest, reach: f32) -> Borders {
    let p = patch_of(corners.current);
    let room = max(reach * reach - point.distance * point.distance, 0.0);
    let slice = p[3] * point.eta + p[1];
    let ring = p[3] * point.xi + p[2];
    return Borders(
        is_within(point.eta + 1.0, ring, room),
        is_within(point.xi + 1.0, slice, room),
        is_within(1.0 - point.eta, ring, room),
        is_within(1.0 - point.xi, slice, room),
    );
}
#endif
#endif
