// Time integration by central differences.

#include "kernel/row"
#include "kernel/position"

#if DAMPING
// Factors on the old velocity and on the acceleration.
fn factors(damping: f32, dt: f32) -> vec2<f32> {
    let half_step = damping * dt * 0.5;
    return vec2<f32>((1.0 - half_step) / (1.0 + half_step), dt / (1.0 + half_step));
}
#endif

#if ROOT
#define STATUS
#include "contact/mod"

struct Params {
    first_thread: u32,
    gravity_x: f32,
    gravity_y: f32,
    gravity_z: f32,
}

@group(2) @binding(1) var<uniform> params: Params;

fn integrate(node: u32) {
    let plane = arrayLength(&acceleration) / 3u;
#if DAMPING
    let damping = select(row.damping_thread, row.damping_solid, node < params.first_thread);
    let keep_gain = factors(damping, row.dt_mid);
    var damped = 0.0;
#endif
#if WORKS
    let own_mass = mass[node];
    // effective mass beyond the nodal mass
    var extra = 0.0;
#endif
#if MASS_ADDED
    if inverse_mass[node] != 0.0 {
        extra = 1.0 / inverse_mass[node] - own_mass;
    }
#endif
#if INERTIA
    var inertia = 0.0;
#endif
#if GRAVITY
    let gravity = vec3<f32>(params.gravity_x, params.gravity_y, params.gravity_z);
    var fallen = 0.0;
#endif
    if node == 0u {
        atomicStore(&status[turn(NEXT)], 0u);
        atomicStore(&status[turn(NEXT) + 1u], 0u);
    }
    var square = 0.0;
    for (var k = 0u; k < 3u; k++) {
        let at = node + k * plane;
        var a = acceleration[at];
#if INERTIA
        var virtual_force = 0.0;
#endif
#if LINES
        let c = correction[at];
        a = a + c;
        virtual_force = (own_mass + extra) * c;
#endif
#if MASS_ADDED
        virtual_force = virtual_force - extra * a;
#endif
        let v = velocity[at];
#if DAMPING
        let new_v = v * keep_gain.x + a * keep_gain.y;
#else
        let new_v = v + a * row.dt_mid;
#endif
        velocity[at] = new_v;
#if WORKS
        let mean = 0.5 * (v + new_v);
#endif
#if DAMPING
        damped = damped + own_mass * damping * mean * mean * row.dt_mid;
#endif
#if INERTIA
        inertia = inertia + virtual_force * mean * row.dt_mid;
#endif
#if GRAVITY
        fallen = fallen + true_mass[node] * gravity[k] * mean * row.dt_mid;
#endif
        var r = remainder[at] + new_v * row.dt;
        quanta[at] = carry(quanta[at], &r);
        remainder[at] = r;
        square = square + new_v * new_v;
    }
    raise(turn(NOW) + select(1u, 0u, node < params.first_thread), sqrt(square));
#if DAMPING
    work[node] = work[node] + damped;
#endif
#if INERTIA
    work[node + INERTIA_PLANE * plane] = work[node + INERTIA_PLANE * plane] + inertia;
#endif
#if GRAVITY
    work[node + GRAVITY_PLANE * plane] = work[node + GRAVITY_PLANE * plane] + fallen;
#endif
}
#endif
