// Arithmetic that a device must get right to the last bit.

#include "kernel/position"

#if ROOT
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
