// Passes the items of a workgroup to the kernel.

#if CHAIN
// Those of its unit.
fn stage(unit: u32, local: u32) {
    let first = cuts[unit * LINKS + LINK];
#if WORKGROUPS
    KERNEL(first, local);
#else
    let end = cuts[(unit + 1u) * LINKS + LINK];
    for (var item = first + local; item < end; item += WORKGROUP) {
        KERNEL(item);
    }
#endif
}
#else
struct Items {
    first: u32,
    count: u32,
}

@group(2) @binding(0) var<uniform> items: Items;

// Those of a range.
fn stage(group: u32, local: u32) {
#if WORKGROUPS
    if group < items.count * ITEM_SHARES {
        KERNEL(items.first * ITEM_SHARES + group, local);
    }
#endif
#if PICKS
    let first = group * ITEM_SHARES;
    if first < items.count {
        KERNEL(items.first + first, min(items.count - first, ITEM_SHARES), local);
    }
#endif
#if INVOCATIONS
    let number = group * WORKGROUP + local;
    if number < items.count * ITEM_SHARES {
        KERNEL(items.first * ITEM_SHARES + number);
    }
#endif
}

// Workgroups of a stage whose invocations work alone.
#if INVOCATIONS
fn stage_workgroups() -> u32 {
    return (items.count * ITEM_SHARES + WORKGROUP - 1u) / WORKGROUP;
}
#endif
#endif
