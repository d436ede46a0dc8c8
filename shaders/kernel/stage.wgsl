// The entry point of every stage: hands the items of the stage to its kernel. Workgroups fill a plane once a row of them is full.

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
