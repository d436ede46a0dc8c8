// Central differences with mass-proportional damping.

#include "kernel/row"
#include "kernel/position"

// Factors on the old velocity and on the acceleration.
fn factors(damping: f32, dt: f32) -> vec2<f32> {
    let half_step = damping * dt * 0.5;
    return vec2<f32>((1.0 - half_step) / (1.0 + half_step), dt / (1.0 + half_step));
}

#if ROOT
struct Params {
    first_thread: u32,
    gravity_x: f32,
    gravity_y: f32,
    gravity_z: f32,
}

@group(2) @binding(1) var<uniform> params: Params;

@group(1) @binding(0) var<storage, read> acceleration: array<f32>;
@group(1) @binding(1) var<storage, read> mass: array<f32>;
@group(1) @binding(2) var<storage, read> inverse_mass: array<f32>;
#if LINES
@group(1) @binding(3) var<storage, read> correction: array<f32>;
const WRITES: u32 = 4u;
#else
const WRITES: u32 = 3u;
#endif
@group(1) @binding(WRITES) var<storage, read_write> velocity: array<f32>;
@group(1) @binding(WRITES + 1u) var<storage, read_write> quanta: array<i32>;
@group(1) @binding(WRITES + 2u) var<storage, read_write> remainder: array<f32>;
@group(1) @binding(WRITES + 3u) var<storage, read_write> work: array<f32>;

fn integrate(node: u32) {
    let plane = arrayLength(&mass);
    let damping = select(row.damping_thread, row.damping_solid, node < params.first_thread);
    let keep_gain = factors(damping, row.dt_mid);
    let own_mass = mass[node];
    // what acts beyond the true mass: added mass, and the inertia of fibre lines
    var extra = 0.0;
    if inverse_mass[node] != 0.0 {
        extra = 1.0 / inverse_mass[node] - own_mass;
    }
#if GRAVITY
    let gravity = vec3<f32>(params.gravity_x, params.gravity_y, params.gravity_z);
    var fallen = 0.0;
#endif
    var damped = 0.0;
    var inertia = 0.0;
    for (var k = 0u; k < 3u; k++) {
        let at = node + k * plane;
        var a = acceleration[at];
        var virtual_force = 0.0;
#if LINES
        let c = correction[at];
        a = a + c;
        virtual_force = (own_mass + extra) * c;
#endif
#if GRAVITY
        a = a + gravity[k];
#endif
        virtual_force = virtual_force - extra * a;
        let v = velocity[at];
        let new_v = v * keep_gain.x + a * keep_gain.y;
        let mean = 0.5 * (v + new_v);
        velocity[at] = new_v;
        damped = damped + own_mass * damping * mean * mean * row.dt_mid;
        inertia = inertia + virtual_force * mean * row.dt_mid;
#if GRAVITY
        fallen = fallen + (own_mass + extra) * gravity[k] * mean * row.dt_mid;
#endif
        var r = remainder[at] + new_v * row.dt;
        quanta[at] = carry(quanta[at], &r);
        remainder[at] = r;
    }
    work[node] = work[node] + damped;
    work[node + plane] = work[node + plane] + inertia;
#if GRAVITY
    work[node + 2u * plane] = work[node + 2u * plane] + fallen;
#endif
}
#endif
