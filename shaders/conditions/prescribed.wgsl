// Prescribed motion: the velocity of chosen components follows the amplitude of the schedule exactly.

#include "kernel/row"
#include "dynamics/integrate"

#if ROOT
struct Params {
    first_thread: u32,
}

@group(2) @binding(1) var<uniform> params: Params;

// Replaces the accelerations of prescribed components before the fibre lines use them.
fn prescribed(item: u32) {
    let node = nodes[2u * item];
    let mask = nodes[2u * item + 1u];
    let plane = arrayLength(&mass);
#if DAMPING
    let damping = select(row.damping_thread, row.damping_solid, node < params.first_thread);
    let keep_gain = factors(damping, row.dt_mid);
#else
    let keep_gain = vec2<f32>(1.0, row.dt_mid);
#endif
    for (var k = 0u; k < 3u; k++) {
        if ((mask >> k) & 1u) == 0u {
            continue;
        }
        let place = node + k * plane;
        let v = velocity[place];
        let force = acceleration[place] / inverse_mass[node];
#if ARCS
        let aim = (targets[3u * item + k] * row.motion + arcs[6u * item + k] * row.cosine) + arcs[6u * item + 3u + k] * row.sine;
#else
        let aim = targets[3u * item + k] * row.motion;
#endif
        let a = (aim - v * keep_gain.x) / keep_gain.y;
        acceleration[place] = a;
        let mean = (v + aim) * 0.5;
        // a fully prescribed node carries no added mass
        var inertia = mass[node];
        if mask != 7u {
            inertia = 1.0 / inverse_mass[node];
        }
        let reaction = inertia * a - force;
        work[item] = work[item] + reaction * mean * row.dt_mid;
        reactions[3u * item + k] = force;
    }
    if mask == 7u {
        inverse_mass[node] = 0.0;
    }
}
#endif
