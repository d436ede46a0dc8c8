// Motion of tools by central differences, after the nodes have moved.

#include "kernel/row"
#include "kernel/position"

#if ROOT
struct Params {
    gravity_x: f32,
    gravity_y: f32,
    gravity_z: f32,
    mass_factor: f32,
}

@group(2) @binding(1) var<uniform> params: Params;

fn march(tool: u32) {
    let fall = vec3<f32>(params.gravity_x, params.gravity_y, params.gravity_z);
    let decay = row.damping_solid * row.dt_mid * 0.5;
    let keep = (1.0 - decay) / (1.0 + decay);
    let gain = row.dt_mid / (1.0 + decay);
    let count = arrayLength(&loads) / LOAD;
    let load = LOAD * tool;
    let result = NOTES * tool;
    for (var i = 0u; i < NOTES; i++) {
        results[result + i] = 0.0;
    }
    for (var part = 0u; part < arrayLength(&parts) / (NOTES * count); part++) {
        for (var i = 0u; i < NOTES; i++) {
            results[result + i] = results[result + i] + parts[NOTES * (count * part + tool) + i];
        }
    }
    let mass = loads[load + MASS];
    let needed = results[result + STIFFNESS] * (params.mass_factor * 0.25) * row.dt * row.dt;
    let acting = max(mass, needed);
    let work = WORKS * tool;
    var squares = 0.0;
    for (var k = 0u; k < 3u; k++) {
        let at = MOTION * tool + k;
        let old = motions[at + 3u];
        let pushed = loads[load + FORCE + k] * row.amplitude;
        let is_free = loads[load + FREE + k] > 0.0;
        let a = (results[result + k] + pushed + mass * fall[k]) / acting;
        let new_speed = select(loads[load + k] * row.motion, old * keep + a * gain, is_free);
        let way = 0.5 * (old + new_speed) * row.dt_mid;
        if is_free {
            let mean = 0.5 * (old + new_speed);
            works[work + LOADED] = works[work + LOADED] + pushed * way;
            works[work + GRAVITY] = works[work + GRAVITY] + mass * fall[k] * way;
            works[work + INERTIA] = works[work + INERTIA] - (acting - mass) * a * way;
            works[work + DAMPED] = works[work + DAMPED] + mass * row.damping_solid * mean * way;
            squares = squares + 0.5 * (old * old + new_speed * new_speed);
        } else {
            works[work + LOADED] = works[work + LOADED] - results[result + k] * way;
        }
        motions[at + 3u] = new_speed;
        var rest = motions[at] + new_speed * row.dt;
        seats[SEAT * tool + MOVED + k] = carry(seats[SEAT * tool + MOVED + k], &rest);
        motions[at] = rest;
    }
    works[work + KINETIC] = 0.5 * mass * squares;
}
#endif
