// The arithmetic that a device must get right to the last bit.

#include "kernel/position"

#if ROOT
const STEPS: u32 = 2048u;

@group(1) @binding(0) var<storage, read> increments: array<f32>;
@group(1) @binding(1) var<storage, read_write> quanta: array<i32>;
@group(1) @binding(2) var<storage, read_write> remainders: array<f32>;
@group(1) @binding(3) var<storage, read_write> sum: array<atomic<i32>>;

fn exact(item: u32) {
    var q = quanta[item];
    var r = remainders[item];
    for (var step = 0u; step < STEPS; step++) {
        r = r + increments[item] * f32(step % 7u + 1u);
        q = carry(q, &r);
    }
    quanta[item] = q;
    remainders[item] = r;
    atomicAdd(&sum[0], q);
}
#endif
