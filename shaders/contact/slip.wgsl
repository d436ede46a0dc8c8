// How far slaves have slipped since the start.

#include "kernel/stage"

const SUMS: u32 = 14u;
const SUM_SLIP: u32 = 3u;

#if ROOT
@group(1) @binding(0) var<storage, read> sums: array<f32>;
@group(1) @binding(1) var<storage, read_write> slipped: array<f32>;

@compute @workgroup_size(WORKGROUP)
fn slip(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let item = invocation(workgroup, workgroups, local);
    if item >= items.count {
        return;
    }
    slipped[item] = slipped[item] + sums[SUMS * item + SUM_SLIP];
}
#endif
