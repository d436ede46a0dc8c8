// The limit of the time step, node by node.

#include "dynamics/assemble"

#if ROOT
struct Params {
    first_thread: u32,
}

@group(2) @binding(1) var<uniform> params: Params;

@group(1) @binding(0) var<storage, read> solid_bounds: array<u32>;
@group(1) @binding(1) var<storage, read> hex_bound: array<f32>;
@group(1) @binding(2) var<storage, read> constant: array<f32>;
@group(1) @binding(3) var<storage, read> mass: array<f32>;
@group(1) @binding(4) var<storage, read_write> limit: array<f32>;

// Assembles the row sums of element stiffness.
fn element_limit(node: u32) {
    var k = constant[node];
    if node < params.first_thread {
        for (var i = 0u; i < SOLID; i++) {
            let slot = solid_bounds[SOLID * node + i];
            if slot != NONE {
                k = k + hex_bound[slot];
            }
        }
    }
    limit[node] = k;
    limit[node + arrayLength(&mass)] = k / mass[node];
}
#endif
