// The limit of the time step, node by node.

#if ROOT
#if held_limit
// Excludes fully prescribed nodes, which do not vibrate.
fn held_limit(item: u32) {
    if conditions[2u * item + 1u] == 7u {
        limit[arrayLength(&limit) / 2u + conditions[2u * item]] = 0.0;
    }
}
#else
struct Params {
    first_thread: u32,
    mass_per_stiffness: f32,
    axial: f32,
}

@group(2) @binding(1) var<uniform> params: Params;

#if BENDING
// Stiffness of a bend relative to a straight one.
fn stiffening(bend: u32) -> f32 {
    let stiffness = bends[BEND * bend];
    let rest = bends[BEND * bend + 1u];
    let force = length(vec3<f32>(bend_force[6u * bend], bend_force[6u * bend + 1u], bend_force[6u * bend + 2u]));
    let away = sqrt(bend_energy[bend] / stiffness);
    var t = rest;
    if away >= AT_REST {
        t = sqrt(max(force * bend_rows[ROWS * bend + 3u] / (stiffness * away) - 1.0, 0.0));
    }
    let square = 1.0 + t * t;
    let further = select(0.0, away, t > rest);
    return square * (square + (t + t) * further);
}
#endif

// Weight of a row at a node: one, or R/m.
fn weight(node: u32) -> f32 {
#if weighed_limit
    return limit[arrayLength(&limit) / 2u + node];
#else
    return 1.0;
#endif
}

// Sum of the weights of the nodes of a beam.
fn both(beam: u32) -> f32 {
#if weighed_limit
    return weight(ends[2u * beam]) + weight(ends[2u * beam + 1u]);
#else
    return 2.0;
#endif
}

#if BENDING
// Mean weight over the nodes of a bend, weighted by its row sums.
fn mean(bend: u32) -> f32 {
#if weighed_limit
    let first = pairs[2u * bend];
    let second = pairs[2u * bend + 1u];
    let weights = vec3<f32>(weight(ends[2u * first]), weight(ends[2u * first + 1u]), weight(ends[2u * second + 1u]));
    let rows = vec3<f32>(bend_rows[ROWS * bend], bend_rows[ROWS * bend + 1u], bend_rows[ROWS * bend + 2u]);
    return dot(rows, weights) / (rows.x + rows.y + rows.z);
#else
    return 1.0;
#endif
}
#endif

// The row sum of a node, weighed if there are weights; the bounds of hexahedra are already weighed.
fn row_sum(node: u32) -> f32 {
    // the nodes of short lines have equal weights
    var k = constant[node] * weight(node);
    if node < params.first_thread {
        for (var i = 0u; i < SOLID; i++) {
            let slot = solid_bounds[SOLID * node + i];
            if slot != NONE {
                k = k + hex_bound[slot];
            }
        }
        return k;
    }
    let item = node - params.first_thread;
    for (var i = 0u; i < THREAD; i++) {
        let slot = thread_slots[THREAD * item + i];
        if slot != NONE {
            let force = vec3<f32>(beam_force[3u * slot], beam_force[3u * slot + 1u], beam_force[3u * slot + 2u]);
            let axial = params.axial * beams[TABLE * slot + 4u];
            k = k + both(slot) * (length(force) + axial) / beams[TABLE * slot + 3u];
        }
    }
#if BENDING
    for (var i = 0u; i < BENT; i++) {
        let slot = bend_slots[BENT * item + i];
        if slot != NONE {
            k = k + bend_rows[ROWS * slot + i] * stiffening(slot) * mean(slot);
        }
    }
#endif
    return k;
}

#if weighed_limit
// The weighted mean of R/m over each node and its neighbours.
fn weighed_limit(node: u32) {
    // fully prescribed nodes are excluded
    if weight(node) > 0.0 {
        out[node] = row_sum(node) / limit[node];
    } else {
        out[node] = 0.0;
    }
}
#else
// Assembles the row sums of the element stiffness.
fn element_limit(node: u32) {
    let k = row_sum(node);
    limit[node] = k;
#if MASS_ADDED
    let acting = mass[node] + added_mass[node];
#else
    let acting = mass[node];
#endif
    limit[node + arrayLength(&mass)] = k / max(acting, k * params.mass_per_stiffness);
}
#endif
#endif
#endif
