// What contact sums up for each point and each beam: energies, slip, and the share of the homogenised stress.
// What includes this binds `sums`.

// Adds to a sum of an item.
fn add_sum(item: u32, sum: u32, value: f32) {
    sums[SUMS * item + sum] = sums[SUMS * item + sum] + value;
}

#if PERIODIC
// Subtracts force ⊗ ΔX from the sum of an item that makes the homogenised stress.
fn add_virial(item: u32, push: vec3<f32>, apart: vec3<f32>) {
    for (var i = 0u; i < 3u; i++) {
        for (var j = 0u; j < 3u; j++) {
            add_sum(item, SUM_VIRIAL + 3u * i + j, -(push[i] * apart[j]));
        }
    }
}
#endif
