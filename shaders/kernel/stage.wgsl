// What every stage has: the range of its items, and the number of an invocation among all of the stage.

struct Items {
    first: u32,
    count: u32,
}

@group(2) @binding(0) var<uniform> items: Items;

// Number of an invocation: workgroups fill a plane once a row of them is full.
fn invocation(workgroup: vec3<u32>, workgroups: vec3<u32>, local: u32) -> u32 {
    return (workgroup.y * workgroups.x + workgroup.x) * WORKGROUP + local;
}
