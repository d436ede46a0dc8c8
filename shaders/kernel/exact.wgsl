// What a device must get right: to the last bit, or closely.

#include "kernel/position"

#if ROOT
#if exact
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

#if together
var<workgroup> numbers: array<u32, WORKGROUP>;

fn together(item: u32, local: u32) {
    numbers[local] = item * local + local * local;
    for (var half = WORKGROUP / 2u; half > 0u; half = half / 2u) {
        workgroupBarrier();
        if local < half {
            numbers[local] = numbers[local] + numbers[local + half];
        }
    }
    if local == 0u {
        sums[item] = numbers[0];
    }
}
#endif

#if roots
fn roots(item: u32) {
    out[item] = sqrt(numerators[item] / denominators[item]);
}
#endif
#endif
