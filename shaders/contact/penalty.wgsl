// Penalty contact of points with the closed surfaces of yarns, every step: points along the beams of a thread with THREAD, else
// the nodes of yarn surfaces.

#define STATUS
#define PAIRS
#define FACES
#define POINTS
#define VELOCITY
#include "contact/surface"
#include "contact/potential"
#include "contact/sums"
#if FRICTION
#include "contact/friction"
#endif

#if ROOT
// Damping and friction force on a point, N, and row sums of the stiffness against a body, N/mm: of a feature that pushes, and of
// damping.
struct Rubbed {
    force: vec3<f32>,
    feature: f32,
    viscous: f32,
}

// Force on a point, in quanta.
var<private> own: vec3<i32>;

// Adds forces to the corners of a face and their opposite to the force on the point, as integers whose sum is zero.
fn pull(item: u32, around: Corners, pulls: array<vec3<f32>, 4>) {
    let plane = arrayLength(&forces) / 3u;
    let sum = ((pulls[0] + pulls[1]) + (pulls[2] + pulls[3])) / params.force_quantum;
    let fits = is_finite(sum.x) && is_finite(sum.y) && is_finite(sum.z);
    if !fits || any(abs(sum) >= vec3<f32>(MOST_QUANTA)) {
        atomicOr(&status[FLAGS], FORCE_RANGE);
        atomicStore(&status[CULPRIT], around.nodes[0]);
        return;
    }
    var rest = vec3<i32>(to_i32(sum.x), to_i32(sum.y), to_i32(sum.z));
    own = own - rest;
    for (var a = 0u; a < 4u; a++) {
        let pulled = place(pulls, a);
        var part = rest;
        if a != 3u {
            let quanta_of = pulled / params.force_quantum;
            part = vec3<i32>(to_i32(quanta_of.x), to_i32(quanta_of.y), to_i32(quanta_of.z));
        }
        rest = rest - part;
        let node = around.nodes[a];
        atomicAdd(&forces[node], part.x);
        atomicAdd(&forces[node + plane], part.y);
        atomicAdd(&forces[node + 2u * plane], part.z);
#if PERIODIC
        add_virial(item, pulled, place(around.reference, a));
#endif
    }
}

// The corners of a face.
fn corners_of(here: Point, entry: u32) -> Corners {
    let face = of_key(entry);
    return corners(face.body, face.image, here.base, here.aside);
}

// Evaluates a face closely.
fn see(here: Point, entry: u32, around: Corners, shape: Patch) -> Seen {
    let point = closest(around.current, shape);
    return Seen(entry, around, point, push_of_face(here, around.current, marks(of_key(entry).body), point));
}

// Adds the forces of a face on a point; returns the gap or a lower bound of it.
fn face_push(here: Point, entry: u32, most: f32, pushed: ptr<function, Pushed>) -> f32 {
    let around = corners_of(here, entry);
    let shape = patch_of(around.current);
    let sure = nearest(shape) - here.radius;
    if sure > most {
        return sure;
    }
    let seen = see(here, entry, around, shape);
    let point = seen.point;
    let push = seen.push;
    let pulls = push.pull;
    (*pushed).push = (*pushed).push + ((pulls[0] + pulls[1]) + (pulls[2] + pulls[3])) * -1.0;
    (*pushed).energy = (*pushed).energy + push.energy;
    (*pushed).pressing = (*pushed).pressing + push.pressing;
    (*pushed).features = (*pushed).features + ((push.stiff.x + push.stiff.y) + (push.stiff.z + push.stiff.w));
    let nearer = is_nearer(pushed, point);
    if nearer {
        (*pushed).nearest = Nearest(true, entry, point.away, point.distance, point.height);
    }
    let gap = point.distance - here.radius;
    let size = here.stiff * max(-gap, 0.0);
    let alone = !((*pushed).shared_force > 0.0);
    if size > 0.0 || alone && nearer {
        let share = select(1.0, size, size > 0.0);
        if alone {
            (*pushed).motion = vec3<f32>(0.0);
            (*pushed).apart = vec3<f32>(0.0);
            (*pushed).inverse_mass = 0.0;
        }
        for (var a = 0u; a < 4u; a++) {
            let node = around.nodes[a];
            let weight = point.weights[a];
            (*pushed).motion = velocity_at(node) * (share * weight) + (*pushed).motion;
            (*pushed).apart = place(around.reference, a) * (share * weight) + (*pushed).apart;
            (*pushed).inverse_mass = (*pushed).inverse_mass + share * (weight * weight / mass[node]);
        }
        (*pushed).shared_force = (*pushed).shared_force + size;
    }
    return gap;
}

// Forces of a body on a point, by its entries and their gaps: entries with gaps up to `most` are evaluated. Returns the least gap.
fn look(here: Point, list: u32, first_gap: u32, part: vec2<u32>, most: f32, pushed: ptr<function, Pushed>) -> f32 {
    var least = params.skin;
    for (var round = 0u; round < 2u; round++) {
        // a point that seems to be inside is inside only if no other face is nearer
        if round == 1u && !is_behind(pushed, most) {
            break;
        }
        least = params.skin;
        for (var i = part.x; i < part.y; i++) {
            let limit = select(beyond(pushed) - here.radius, most, round == 0u);
            if (gaps[first_gap + i] > most) == (round == 1u) && gaps[first_gap + i] <= limit {
                gaps[first_gap + i] = face_push(here, near[list + i], limit, pushed);
            }
            least = min(least, gaps[first_gap + i]);
        }
    }
    return least;
}

// Viscosity for damping a spring between masses of joint inverse `inverse_mass`.
fn viscosity(stiff: f32, inverse_mass: f32) -> f32 {
    return params.damping * 2.0 * sqrt(stiff / inverse_mass);
}

// Damping and friction, once per point and body: against the mean motion of the pushing faces, weighted by their forces.
fn rub(here: Point, pushed: ptr<function, Pushed>, touch: u32) -> Rubbed {
    let elapsed = row.dt_mid + row.dt_mid - row.dt;
    let share = select(1.0, (*pushed).shared_force, (*pushed).shared_force > 0.0);
    var motion = (*pushed).motion * (-1.0 / share);
    var inverse_mass = (*pushed).inverse_mass / share;
    for (var a = 0u; a < CARRIED_BY; a++) {
        let node = carried_by(here.item, a);
        let weight = points[POINT * here.item + a];
        motion = velocity_at(node) * weight + motion;
        inverse_mass = inverse_mass + weight * weight / mass[node];
    }
#if PERIODIC
    let apart = (*pushed).apart * (-1.0 / share);
    motion = motion + apply(rate(), apart);
#endif
    let size = norm((*pushed).push);
    var normal = (*pushed).nearest.away;
    if size > 0.0 {
        normal = (*pushed).push * (1.0 / size);
    }
    let approach = dot(motion, normal);
    let viscous = viscosity(here.stiff, inverse_mass);
    let pressing = max(size - viscous * approach, 0.0);
    // over the motion since the previous positions, with the mean of the old and new forces
    let drag = size - pressing;
    add_sum(here.item, SUM_DAMPING, 0.5 * (touches[touch + DAMPED] + drag) * approach * elapsed);
    touches[touch + NORMAL] = pressing;
    touches[touch + DAMPED] = drag;
    var rubbing = normal * -drag;
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
    rubbing = slid.elastic * -tangential + rubbing;
#endif
    let weights = 1.0 + here.size;
    let rubbed = Rubbed(rubbing, weights * here.stiff, weights * (viscous * (2.0 / row.dt)));
    let stiffness_quanta = (rubbed.feature * (*pushed).features + rubbed.viscous) / params.stiffness_quantum;
    for (var a = 0u; a < CARRIED_BY; a++) {
        let node = carried_by(here.item, a);
        atomicAdd(&stiffness[node], to_i32(stiffness_quanta * abs(points[POINT * here.item + a])));
    }
    return rubbed;
}

// Adds the forces of a face on a point to the nodes, with its share of damping and friction.
fn press(here: Point, entry: u32, pushed: ptr<function, Pushed>, rubbed: Rubbed) {
    // found again rather than kept, for the sake of registers
    let around = corners_of(here, entry);
    let seen = see(here, entry, around, patch_of(around.current));
    let point = seen.point;
    var push = seen.push;
    let is_nearest = entry == (*pushed).nearest.entry;
    if (*pushed).inside && is_nearest {
        add_push(&push, point.weights, point.away * -1.0, out_force(here, point.distance), out_energy(here, point.distance));
    }
    var share = select(0.0, 1.0, is_nearest);
    if (*pushed).shared_force > 0.0 {
        share = here.stiff * max(here.radius - point.distance, 0.0) / (*pushed).shared_force;
    }
    for (var a = 0u; a < 4u; a++) {
        push.pull[a] = rubbed.force * -(share * point.weights[a]) + push.pull[a];
    }
    pull(here.item, around, push.pull);
    // a face that has just begun to push is as stiff as any other, whatever its share of the force
    for (var a = 0u; a < 4u; a++) {
        let features = select(push.stiff[a], push.stiff[a] + point.weights[a], (*pushed).inside && is_nearest);
        let rows = rubbed.feature * features + rubbed.viscous * (share * point.weights[a]);
        atomicAdd(&stiffness[around.nodes[a]], to_i32(rows / params.stiffness_quantum));
    }
}

// Distributes the force on a point to its nodes.
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
        atomicAdd(&forces[node], part.x);
        atomicAdd(&forces[node + plane], part.y);
        atomicAdd(&forces[node + 2u * plane], part.z);
    }
}

// The index of a body among the touches of a point; if it `begins` to touch, a free index; else `params.slots`.
fn place_of(item: u32, body: u32, begins: bool) -> u32 {
    var free = params.slots;
    let slots = bound(params.slots, arrayLength(&keys));
    for (var slot = 0u; slot < slots; slot++) {
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

// Damping, friction, and the end of a body's touch; whether it still touches.
fn settle(here: Point, body: u32, depth: f32, pushed: ptr<function, Pushed>, rubbed: ptr<function, Rubbed>) -> bool {
    let touching = (*pushed).features > 0.0;
    let slot = place_of(here.item, body, touching);
    if slot == params.slots {
        return false;
    }
    let touch = TOUCH * (params.slots * here.item + slot);
    let place = (MADE + params.slots) * here.item + MADE + slot;
    *rubbed = rub(here, pushed, touch);
    add_sum(here.item, SUM_RADIUS, (*pushed).pressing * here.full_radius * row.radius_increment);
    if !touching {
        keys[place] = EMPTY;
        for (var i = 0u; i < TOUCH; i++) {
            touches[touch + i] = 0.0;
        }
        return false;
    }
    keys[place] = body;
    let outside = max(here.radius - (*pushed).nearest.distance, 0.0);
    raise(PENETRATION + KIND, select(outside, here.radius + depth, depth > 0.0));
    return true;
}

// Distance by which bodies and a point can have approached since the step before, mm.
fn closing_of(item: u32) -> f32 {
    let elapsed = row.dt_mid + row.dt_mid - row.dt;
    var motion = vec3<f32>(0.0);
    for (var a = 0u; a < CARRIED_BY; a++) {
        motion = velocity_at(carried_by(item, a)) * points[POINT * item + a] + motion;
    }
    let speed = norm(motion) + speed_of(0u) + row.affine;
    return row.closing * speed * elapsed + points[POINT * item + 5u] * row.radius_increment;
}

// Whether a point looks at faces; if not, its bound of the gaps is reduced.
fn walks(item: u32) -> bool {
    let faces_listed = bound(params.faces, arrayLength(&near));
    let first = (MADE + params.faces) * nodes[CARRIED * item + CARRIED - 1u];
    let first_gap = (GAPS + params.faces) * item;
    let made = (MADE + params.slots) * item;
    if row.searched > 0.0 && keys[made] != near[first] {
        // a new list: all faces are evaluated. The penetration is kept; before the first list it may be anything up to `depth`
        let inner = select(gaps[first_gap + INNER], params.depth, keys[made] == EMPTY);
        keys[made] = near[first];
        for (var i = 0u; i < GAPS + faces_listed; i++) {
            gaps[first_gap + i] = 0.0;
        }
        gaps[first_gap + INNER] = inner;
    }
    let closed = gaps[first_gap + CLOSED] + closing_of(item);
    if closed < gaps[first_gap + LEAST] {
        gaps[first_gap + CLOSED] = closed;
        return false;
    }
    return true;
}

// Forces on a point that looks at faces; whether it touches any.
fn push_point(item: u32) -> bool {
    let faces_listed = bound(params.faces, arrayLength(&near));
    let first = (MADE + params.faces) * nodes[CARRIED * item + CARRIED - 1u];
    let first_gap = (GAPS + params.faces) * item;
    let closing = closing_of(item);
    let closed = gaps[first_gap + CLOSED] + closing;
    let full_radius = points[POINT * item + 5u];
    var size = 0.0;
    for (var a = 0u; a < CARRIED_BY; a++) {
        size = size + abs(points[POINT * item + a]);
    }
    let stiff = points[POINT * item + 4u];
    let radius = full_radius * row.radius;
    let here = Point(item, carried_by(item, 0u), point_of(item), stiff, full_radius, radius, size);
    // upper bound of the penetration of a point that was inside
    let deepest = gaps[first_gap + INNER] + closing;
    let most = deepest + margin(radius + deepest);
    var least = params.skin;
    var inner = 0.0;
    var touching = false;
    own = vec3<i32>(0);
    sums[SUMS * item + SUM_ENERGY] = 0.0;
    let list = first + MADE;
    var end = 0u;
    while end < faces_listed && near[list + end] != EMPTY {
        let start = end;
        let body = body_of(near[list + end]);
        var gap = params.skin;
        while end < faces_listed && near[list + end] != EMPTY && body_of(near[list + end]) == body {
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
        var depth = 0.0;
        if is_behind(&pushed, most) {
            depth = push_out(here, &pushed);
        }
        inner = max(inner, depth);
        var rubbed = Rubbed();
        if settle(here, body, depth, &pushed, &rubbed) {
            touching = true;
            for (var i = start; i < end; i++) {
                if gaps[first_gap + GAPS + i] < 0.0 || near[list + i] == pushed.nearest.entry {
                    press(here, near[list + i], &pushed, rubbed);
                }
            }
        }
        add_sum(item, SUM_ENERGY, pushed.energy);
    }
    gaps[first_gap + LEAST] = least - inner - margin(radius + inner);
    gaps[first_gap + CLOSED] = 0.0;
    gaps[first_gap + INNER] = inner;
    if any(own != vec3<i32>(0)) {
        share_out(here);
    }
    return touching;
}

// The points of the workgroup that look at faces, and how many of them touch.
var<workgroup> walking: array<u32, ITEM_SHARES>;
var<workgroup> walkers: atomic<u32>;
var<workgroup> touchers: atomic<u32>;

fn penalty(first: u32, count: u32, local: u32) {
    if local == 0u {
        atomicStore(&walkers, 0u);
        atomicStore(&touchers, 0u);
    }
    workgroupBarrier();
    for (var i = local; i < count; i += WORKGROUP) {
        if walks(first + i) {
            walking[atomicAdd(&walkers, 1u)] = first + i;
        }
    }
    workgroupBarrier();
    let most = atomicLoad(&walkers);
    for (var i = local; i < most; i += WORKGROUP) {
        if push_point(walking[i]) {
            atomicAdd(&touchers, 1u);
        }
    }
    workgroupBarrier();
    if local == 0u && atomicLoad(&touchers) > 0u {
        atomicAdd(&status[TOUCHING + KIND], atomicLoad(&touchers));
    }
}
#endif
