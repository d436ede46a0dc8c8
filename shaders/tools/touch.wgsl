// Penalty contact of points with tools, every step: points along the beams of a thread with THREAD, else the nodes of yarn
// surfaces.

#define STATUS
#define POINTS
#define VELOCITY
#include "contact/surface"
#include "contact/sums"
#if FRICTION
#include "contact/friction"
#endif
#include "tools/shape"

#if ROOT
// Forces of all tools on a point.
fn press(item: u32) {
    let count = arrayLength(&seats) / SEAT;
    let elapsed = row.dt_mid + row.dt_mid - row.dt;
    let base = carried_by(item, 0u);
    let plane = arrayLength(&remainder) / 3u;
    let aside = point_of(item);
    var extent = 0.0;
    var inverse = 0.0;
    var own_motion = vec3<f32>(0.0);
    for (var a = 0u; a < CARRIED_BY; a++) {
        let weight = points[POINT * item + a];
        let node = carried_by(item, a);
        extent = extent + abs(weight);
        own_motion = velocity_at(node) * weight + own_motion;
        inverse = inverse + weight * weight / mass[node];
    }
    let penalty = points[POINT * item + 4u];
    let full_radius = points[POINT * item + 5u];
    let radius = full_radius * row.radius;
    sums[SUMS * item + SUM_ENERGY] = 0.0;
    var push_of_all = vec3<f32>(0.0);
    var rows = 0.0;
    var is_touching = false;
    for (var tool = 0u; tool < count; tool++) {
        let note = NOTES * (count * item + tool);
        for (var i = 0u; i < NOTES; i++) {
            notes[note + i] = 0.0;
        }
        let memory = TOUCH * (count * item + tool);
        // from the origin of the tool to the point, in the reference and current states
        var start = vec3<f32>(0.0);
        var by = vec3<f32>(0.0);
        for (var k = 0u; k < 3u; k++) {
            let node = base + k * plane;
            start[k] = f32(reference[node] - seats[SEAT * tool + k]) * QUANTUM;
            by[k] = difference(quanta[node], remainder[node], seats[SEAT * tool + MOVED + k], motions[MOTION * tool + k]);
        }
#if PERIODIC
        let at = ((start + apply(gradient(), start)) + by) + aside.current;
#else
        let at = (start + by) + aside.current;
#endif
        let here = near(tool, at);
        if !here.is_there {
            for (var i = 0u; i < TOUCH; i++) {
                touches[memory + i] = 0.0;
            }
            continue;
        }
        let depth = radius - here.distance;
        if !(depth > 0.0) && touches[memory + NORMAL] == 0.0 && touches[memory + DAMPED] == 0.0 {
            continue;
        }
        let steep = max(norm(here.slope), 1e-6);
        let normal = here.slope * (1.0 / steep);
        let pressing = penalty * max(depth, 0.0);
        let size = pressing * steep;
        var motion = own_motion;
        for (var k = 0u; k < 3u; k++) {
            motion[k] = motion[k] - motions[MOTION * tool + 3u + k];
        }
#if PERIODIC
        motion = motion + apply(rate(), start + aside.reference);
#endif
        let approach = dot(motion, normal);
        let viscosity = params.damping * 2.0 * sqrt(penalty / inverse);
        let firm = max(size - viscosity * approach, 0.0);
        // over the motion since the previous positions, with the mean of the old and new forces
        let drag = size - firm;
        add_sum(item, SUM_DAMPING, 0.5 * (touches[memory + DAMPED] + drag) * approach * elapsed);
        touches[memory + NORMAL] = firm;
        touches[memory + DAMPED] = drag;
        var push = normal * firm;
        var energy = 0.5 * pressing * max(depth, 0.0);
#if FRICTION
        let tangential = penalty * params.tangential;
        let limit = tools[TOOL * tool + RUBS + KIND_OF_POINT] * firm;
        let at_elastic = memory + ELASTIC;
        let elastic = vec3<f32>(touches[at_elastic], touches[at_elastic + 1u], touches[at_elastic + 2u]);
        let slid = slide(elastic, motion * elapsed, normal, tangential, limit);
        add_sum(item, SUM_FRICTION, slid.dissipated);
        add_sum(item, SUM_SLIP, slid.slip);
        for (var k = 0u; k < 3u; k++) {
            touches[at_elastic + k] = slid.elastic[k];
        }
        energy = energy + 0.5 * tangential * dot(slid.elastic, slid.elastic);
        push = slid.elastic * -tangential + push;
#endif
        add_sum(item, SUM_RADIUS, pressing * full_radius * row.radius_increment);
        if !(depth > 0.0) {
            for (var i = 0u; i < TOUCH; i++) {
                touches[memory + i] = 0.0;
            }
            continue;
        }
        is_touching = true;
        raise(PENETRATION + KIND_OF_POINT, depth);
        add_sum(item, SUM_ENERGY, energy);
        let row_sum = (1.0 + extent) * (penalty + viscosity * (2.0 / row.dt));
        push_of_all = push_of_all + push;
        rows = rows + row_sum;
        let back = push * -1.0;
        let moment = cross(at, back);
        for (var k = 0u; k < 3u; k++) {
            notes[note + k] = back[k];
            notes[note + MOMENT + k] = moment[k];
        }
        notes[note + STIFFNESS] = row_sum;
#if THREAD
#else
        notes[note + TOUCHED] = penalty;
#endif
    }
    if is_touching {
        atomicAdd(&status[TOUCHING + KIND_OF_POINT], 1u);
        give(item, push_of_all, rows);
    }
}

// Distributes the force on a point and the stiffness of its touches to the nodes that carry it.
fn give(item: u32, push: vec3<f32>, rows: f32) {
    let plane = arrayLength(&forces) / 3u;
    let in_quanta = push / params.force_quantum;
    let fits = is_finite(in_quanta.x) && is_finite(in_quanta.y) && is_finite(in_quanta.z)
        && all(abs(in_quanta) < vec3<f32>(MOST_QUANTA));
    if !fits {
        atomicOr(&status[FLAGS], FORCE_RANGE);
        atomicStore(&status[CULPRIT], carried_by(item, 0u));
    }
    let whole = vec3<i32>(to_i32(in_quanta.x), to_i32(in_quanta.y), to_i32(in_quanta.z));
    var rest = whole;
    for (var a = 0u; a < CARRIED_BY; a++) {
        let node = carried_by(item, a);
        let weight = points[POINT * item + a];
        atomicAdd(&stiffness[node], to_i32(rows / params.stiffness_quantum * abs(weight)));
        if !fits {
            continue;
        }
        var part = rest;
        if a + 1u != CARRIED_BY {
            let share = vec3<f32>(whole) * weight;
            part = vec3<i32>(to_i32(share.x), to_i32(share.y), to_i32(share.z));
        }
        rest = rest - part;
        atomicAdd(&forces[node], part.x);
        atomicAdd(&forces[node + plane], part.y);
        atomicAdd(&forces[node + 2u * plane], part.z);
    }
}
#endif
