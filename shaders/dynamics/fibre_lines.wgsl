// Fibre lines: selective mass scaling. One workgroup works on one line, and solves its system by parallel cyclic reduction.

#include "kernel/row"
#define REFERENCE
#include "kernel/node"
#include "kernel/vector"

#if ROOT
// Stations per invocation; STATIONS is the length of the longest line.
const ROUNDS: u32 = (STATIONS + WORKGROUP - 1u) / WORKGROUP;

struct Params {
    // Strength β of the added mass.
    beta: f32,
}

@group(2) @binding(1) var<uniform> params: Params;

// Direction of the segment that starts at a station, zero without a segment, and inverse mass of the station.
var<workgroup> stations: array<vec4<f32>, STATIONS>;
// Diagonal, coupling to the next row of the same subsystem, right side, and coupling to the last row.
var<workgroup> rows: array<vec4<f32>, STATIONS>;

// Current direction of the segment between two nodes, and its stiffness.
fn segment(here: u32, next: u32, shift: vec2<i32>) -> vec4<f32> {
    let rest = lattice_between(next, here, shift);
#if PERIODIC
    let v = rest + apply(gradient(), rest) + displacement_between(next, here);
#else
    let v = rest + displacement_between(next, here);
#endif
    let shortened = max(dot(rest, rest) / dot(v, v), 1.0);
    return vec4<f32>(v * (1.0 / norm(v)), stiffness[here] * shortened * shortened);
}

fn acceleration_at(node: u32) -> vec3<f32> {
    let plane = arrayLength(&inverse_mass);
    return vec3<f32>(acceleration[node], acceleration[node + plane], acceleration[node + 2u * plane]);
}

// A direction in the components of a node that are not prescribed.
fn free(direction: vec3<f32>, node: u32) -> vec3<f32> {
#if HELD
    let mask = vec3<u32>(held[node]) >> vec3<u32>(0u, 1u, 2u);
    return select(direction, vec3<f32>(), (mask & vec3<u32>(1u)) == vec3<u32>(1u));
#else
    return direction;
#endif
}

// Off-diagonal between a segment and the next, of a line that begins at node `first`.
fn coupling(first: u32, i: u32, next: u32) -> f32 {
    return -(dot(stations[i].xyz, free(stations[next].xyz, first + next)) * stations[next].w);
}

// Unknown of a row after the reduction to diagonals; `end` is the unknown of the last row.
fn solution(i: u32, end: f32) -> f32 {
    return (rows[i].z - rows[i].w * end) / rows[i].x;
}

fn fibre_lines(number: u32, local: u32) {
    let line = LINE * number;
    let first = lines[line];
    let n = lines[line + 1u];
    let kind = lines[line + 2u];
    if kind == FREE {
        return;
    }
    let closed = kind == CLOSED;
    let wrap = vec2<i32>(bitcast<i32>(lines[line + 3u]), bitcast<i32>(lines[line + 4u]));
    let last = n - 1u;

    for (var i = local; i < n; i += WORKGROUP) {
        let here = first + i;
        var s = vec4<f32>();
        if stiffness[here] > 0.0 && i < last {
            s = segment(here, here + 1u, vec2<i32>());
        }
        if stiffness[here] > 0.0 && i == last && closed {
            s = segment(here, first, wrap);
        }
        stations[i] = vec4<f32>(s.xyz, inverse_mass[here]);
        rows[i].x = s.w;
    }
    workgroupBarrier();

    // the last row is the border; without a last segment nothing couples to it
    let compliance = 1.0 / (params.beta * row.dt * row.dt);
    for (var i = local; i < n; i += WORKGROUP) {
        let next = select(i + 1u, 0u, i == last);
        let d = stations[i].xyz;
        var diagonal = 1.0;
        if any(d != vec3<f32>()) {
#if HELD
            let both = dot(d, free(d, first + i)) * stations[i].w + dot(d, free(d, first + next)) * stations[next].w;
#else
            let both = stations[i].w + stations[next].w;
#endif
            diagonal = compliance / rows[i].x + both;
        }
        let right = -dot(d, acceleration_at(first + next) - acceleration_at(first + i));
        var along = coupling(first, i, next);
        var border = 0.0;
        if i == 0u {
            border = coupling(first, last, 0u);
        }
        if i + 1u == last {
            border = border + along;
            along = 0.0;
        }
        rows[i] = vec4<f32>(diagonal, along, right, border);
    }
    workgroupBarrier();

    for (var step = 1u; step < last; step *= 2u) {
        var reduced = array<vec4<f32>, ROUNDS>();
        for (var round = 0u; round < ROUNDS; round++) {
            let i = local + round * WORKGROUP;
            if i < last {
                var r = rows[i];
                let along = r.y;
                r.y = 0.0;
                if i >= step {
                    let low = rows[i - step];
                    let factor = low.y / low.x;
                    r = r - factor * vec4<f32>(low.y, 0.0, low.z, low.w);
                }
                if i + step < last {
                    let high = rows[i + step];
                    let factor = along / high.x;
                    r = r - factor * vec4<f32>(along, high.y, high.z, high.w);
                }
                reduced[round] = r;
            }
        }
        workgroupBarrier();
        for (var round = 0u; round < ROUNDS; round++) {
            let i = local + round * WORKGROUP;
            if i < last {
                rows[i] = reduced[round];
            }
        }
        workgroupBarrier();
    }

    // coupling of the first row and of the last but one to the last row
    let back = coupling(first, last, 0u);
    let ahead = coupling(first, last - 1u, last);
    let low = rows[0];
    let high = rows[last - 1u];
    let bottom = rows[last];
    let right = bottom.z - back * (low.z / low.x) - ahead * (high.z / high.x);
    let end = right / (bottom.x - back * (low.w / low.x) - ahead * (high.w / high.x));
    let plane = arrayLength(&inverse_mass);
    for (var i = local; i < n; i += WORKGROUP) {
        let previous = select(i - 1u, last, i == 0u);
        let p = select(solution(previous, end), end, previous == last);
        let q = select(solution(i, end), end, i == last);
        let a = free((p * stations[previous].xyz - q * stations[i].xyz) * stations[i].w, first + i);
        correction[first + i] = a.x;
        correction[first + i + plane] = a.y;
        correction[first + i + 2u * plane] = a.z;
    }
}
#endif
