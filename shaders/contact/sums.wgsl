// Contact sums per point and beam: energies, slip, and the virial for the homogenised stress.
// The including file binds `sums`.

// Adds to a sum of an item.
fn add_sum(item: u32, sum: u32, value: f32) {
    sums[SUMS * item + sum] = sums[SUMS * item + sum] + value;
}

#if PERIODIC
// Subtracts force ⊗ ΔX from the virial sums of an item for the homogenised stress.
fn add_virial(item: u32, push: vec3<f32>, apart: vec3<f32>) {
    for (var i = 0u; i < 3u; i++) {
        for (var j = 0u; j < 3u; j++) {
            add_sum(item, SUM_VIRIAL + 3u * i + j, -(push[i] * apart[j]));
        }
    }
}
#endif
