// Accelerations: each node gathers its corner slots in a fixed order, adds contact forces and weight, and divides by its mass.

#include "kernel/row"

#if ROOT
#if CONTACT
#define STATUS
#include "contact/mod"
#endif

struct Params {
    first_thread: u32,
    force_quantum: f32,
    stiffness_quantum: f32,
    mass_factor: f32,
    mass_memory: f32,
    mass_per_stiffness: f32,
    gravity_x: f32,
    gravity_y: f32,
    gravity_z: f32,
}

@group(2) @binding(1) var<uniform> params: Params;

#if CONTACT
// Records a node whose sum is out of range.
fn check_range(node: u32, sum: i32) {
    if u32(abs(sum)) > MOST_SUM {
        atomicOr(&status[FLAGS], FORCE_RANGE);
        atomicStore(&status[CULPRIT], node);
    }
}

// Contact force component of a node in N; reset to zero.
fn taken(node: u32, at: u32) -> f32 {
    let quanta = contact_force[at];
    if quanta != 0 {
        contact_force[at] = 0;
    }
    check_range(node, quanta);
    return f32(quanta) * params.force_quantum;
}
#endif

fn hex_at(slot: u32) -> vec3<f32> {
    return vec3<f32>(hex_force[slot], hex_force[slot + LANES], hex_force[slot + 2u * LANES]);
}

fn beam_at(slot: u32) -> vec3<f32> {
    return vec3<f32>(beam_force[3u * slot], beam_force[3u * slot + 1u], beam_force[3u * slot + 2u]);
}

#if BENDING
fn bend_at(slot: u32, k: u32) -> vec3<f32> {
    let at = 6u * slot + 3u * k;
    return vec3<f32>(bend_force[at], bend_force[at + 1u], bend_force[at + 2u]);
}
#endif

fn assemble(node: u32) {
    let plane = arrayLength(&mass);
    var force = vec3<f32>();
    if node < params.first_thread {
        for (var k = 0u; k < SOLID; k++) {
            let slot = solid_slots[SOLID * node + k];
            if slot == NONE {
                break;
            }
            force = force + hex_at(slot);
        }
    } else {
        let at = THREAD * (node - params.first_thread);
        // the node is the first of one beam and the second of another
        if thread_slots[at] != NONE {
            force = force + beam_at(thread_slots[at]);
        }
        if thread_slots[at + 1u] != NONE {
            force = force - beam_at(thread_slots[at + 1u]);
        }
#if BENDING
        // the first, middle and last node of three bends
        let bent = BENT * (node - params.first_thread);
        if bend_slots[bent] != NONE {
            force = force + bend_at(bend_slots[bent], 0u);
        }
        if bend_slots[bent + 1u] != NONE {
            force = force - bend_at(bend_slots[bent + 1u], 0u);
            force = force + bend_at(bend_slots[bent + 1u], 1u);
        }
        if bend_slots[bent + 2u] != NONE {
            force = force - bend_at(bend_slots[bent + 2u], 1u);
        }
#endif
    }
#if CONTACT
    force = force + vec3<f32>(taken(node, node), taken(node, node + plane), taken(node, node + 2u * plane));
#endif
#if GRAVITY
    force = force + true_mass[node] * vec3<f32>(params.gravity_x, params.gravity_y, params.gravity_z);
#endif
    var acting = mass[node];
#if CONTACT
    let contact = f32(contact_stiffness[node]) * params.stiffness_quantum;
    contact_stiffness[node] = 0;
#if MASS_ADDED
    let reach = params.mass_factor * 0.25 * row.dt * row.dt;
    let touching = select(0.0, (contact + element_stiffness[node]) * reach, contact > 0.0);
    let needed = max(touching, element_stiffness[node] * params.mass_per_stiffness) - acting;
    let added = max(needed, added_mass[node] * params.mass_memory);
    added_mass[node] = added;
    acting = acting + added;
#else
    if contact > 0.0 {
        raise(CONTACT_RATE, contact / acting);
    }
#endif
#endif
    let inverse = 1.0 / acting;
    inverse_mass[node] = inverse;
    acceleration[node] = force.x * inverse;
    acceleration[node + plane] = force.y * inverse;
    acceleration[node + 2u * plane] = force.z * inverse;
}
#endif
