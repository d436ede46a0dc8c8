// Totals: sums and maxima of columns, part by part. A workgroup works on a part.

var<workgroup> sums: array<f32, WORKGROUP>;

// Adds the partial results of a workgroup, the upper half to the lower until one sum is left.
fn add_up(found: f32, local: u32) -> f32 {
    sums[local] = found;
    for (var half = WORKGROUP / 2u; half > 0u; half = half / 2u) {
        workgroupBarrier();
        if local < half {
            sums[local] = sums[local] + sums[local + half];
        }
    }
    return sums[local];
}

#if ROOT
struct Params {
    start: u32,
    count: u32,
    lanes: u32,
    stride: u32,
    columns: u32,
    length: u32,
    into: u32,
}

@group(2) @binding(1) var<uniform> params: Params;

// Index of a number of a column.
fn place_of(number: u32, column: u32) -> u32 {
    return params.start + number / params.lanes * params.stride + column * params.lanes + number % params.lanes;
}

#if sum
fn sum(item: u32, local: u32) {
    let column = item % params.columns;
    let first = item / params.columns * params.length;
    let end = min(first + params.length, params.count);
    var found = 0.0;
    for (var number = first + local; number < end; number += WORKGROUP) {
        let place = place_of(number, column);
        found = found + source[place];
#if TAKEN
        source[place] = 0.0;
#endif
    }
    let total = add_up(found, local);
    if local == 0u {
        totals[params.into + item] = total;
    }
}
#endif

#if worst
var<workgroup> places: array<u32, WORKGROUP>;

fn worst(item: u32, local: u32) {
    let first = item * params.length;
    let end = min(first + params.length, params.count);
    var known = LOWEST;
    var place = 0u;
    for (var number = first + local; number < end; number += WORKGROUP) {
#if JACOBIAN
        if number % LANES >= lanes_used[number / LANES] {
            continue;
        }
        let value = -source[place_of(number, 0u)];
#else
        let value = source[place_of(number, 0u)];
#endif
        if value > known {
            known = value;
            place = number - first;
        }
    }
    sums[local] = known;
    places[local] = place;
    for (var half = WORKGROUP / 2u; half > 0u; half = half / 2u) {
        workgroupBarrier();
        if local < half {
            let other = sums[local + half];
            let there = places[local + half];
            if other > sums[local] || (other == sums[local] && there < places[local]) {
                sums[local] = other;
                places[local] = there;
            }
        }
    }
    if local == 0u {
        totals[params.into + WORST * item] = sums[0];
        totals[params.into + WORST * item + 1u] = f32(places[0]);
    }
}
#endif
#endif
