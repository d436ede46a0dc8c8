// The entry point of every stage: passes its items to the kernel. If one row of workgroups is not enough, they fill a plane.

struct Items {
    first: u32,
    count: u32,
}

@group(2) @binding(0) var<uniform> items: Items;

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let group = workgroup.y * workgroups.x + workgroup.x;
#if WORKGROUPS
    if group < items.count * ITEM_SHARES {
        KERNEL(items.first * ITEM_SHARES + group, local);
    }
#else
    let number = group * WORKGROUP + local;
    if number < items.count * ITEM_SHARES {
        KERNEL(items.first * ITEM_SHARES + number);
    }
#endif
}
