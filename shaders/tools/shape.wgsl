// Shapes of tools as signed distances, in the axes of the tool: positive outside. The including file binds `tools` and
// `seats`.

#include "kernel/vector"
#include "kernel/position"

// The surface of a tool near a point; `is_there` is false far outside a grid.
struct Near {
    is_there: bool,
    distance: f32,
    slope: vec3<f32>,
}

// The surface of a tool near a point at `at` from its origin, mm.
fn near(tool: u32, at: vec3<f32>) -> Near {
    let t = TOOL * tool;
    let axes = array<vec3<f32>, 3>(
        vec3<f32>(tools[t], tools[t + 1u], tools[t + 2u]),
        vec3<f32>(tools[t + 3u], tools[t + 4u], tools[t + 5u]),
        vec3<f32>(tools[t + 6u], tools[t + 7u], tools[t + 8u]),
    );
    let local = apply(axes, at);
    var own = Near(false, 0.0, vec3<f32>(0.0));
    let kind = seats[SEAT * tool + KIND];
    if kind == PLANE {
        own = Near(true, local.z, vec3<f32>(0.0, 0.0, 1.0));
    } else if kind == BOX {
        own = rounded(vec3<f32>(tools[t + HALF], tools[t + HALF + 1u], tools[t + HALF + 2u]), tools[t + RADIUS], local);
    } else {
        own = sampled(tool, local);
    }
    own.slope = axes[2] * own.slope.z + (axes[1] * own.slope.y + axes[0] * own.slope.x);
    return own;
}

// The distance interpolated between the points of a grid.
fn sampled(tool: u32, at: vec3<f32>) -> Near {
    let t = TOOL * tool;
    let seat = SEAT * tool;
    var low = vec3<i32>(0);
    var part = vec3<f32>(0.0);
    for (var k = 0u; k < 3u; k++) {
        let cells = (at[k] - tools[t + FROM + k]) / tools[t + CELL];
        let last = seats[seat + COUNTS + k] - 2;
        if cells < 0.0 || cells > f32(last + 1) {
            return Near(false, 0.0, vec3<f32>(0.0));
        }
        low[k] = clamp(to_i32(cells - 0.5), 0, last);
        part[k] = cells - f32(low[k]);
    }
    let line = seats[seat + COUNTS];
    let layer = line * seats[seat + COUNTS + 1u];
    let first = seats[seat + FIRST] + low.x + low.y * line + low.z * layer;
    // along x, then y, then z: value and slopes
    let e0 = edge(first, part.x);
    let e1 = edge(first + line, part.x);
    let e2 = edge(first + layer, part.x);
    let e3 = edge(first + layer + line, part.x);
    let lower = vec3<f32>(e0 * (1.0 - part.y) + e1 * part.y, e1.x - e0.x);
    let upper = vec3<f32>(e2 * (1.0 - part.y) + e3 * part.y, e3.x - e2.x);
    let between = lower * (1.0 - part.z) + upper * part.z;
    let slope = vec3<f32>(between.y, between.z, upper.x - lower.x);
    return Near(true, between.x, slope * (1.0 / tools[t + CELL]));
}

// Value and slope along an edge of a cell.
fn edge(first: i32, part: f32) -> vec2<f32> {
    let a = tools[first];
    let b = tools[first + 1];
    return vec2<f32>(a * (1.0 - part) + b * part, b - a);
}

// A rounded box: half the sizes of its core, and its radius.
fn rounded(half: vec3<f32>, radius: f32, at: vec3<f32>) -> Near {
    let beyond = abs(at) - half;
    let outside = max(beyond, vec3<f32>(0.0));
    let side = select(vec3<f32>(1.0), vec3<f32>(-1.0), at < vec3<f32>(0.0));
    let far = norm(outside);
    if far > 0.0 {
        return Near(true, far - radius, side * outside * (1.0 / far));
    }
    // in the core: to its nearest face
    var nearest = select(1u, 0u, beyond.x > beyond.y);
    nearest = select(2u, nearest, beyond[nearest] > beyond.z);
    var slope = vec3<f32>(0.0);
    slope[nearest] = side[nearest];
    return Near(true, beyond[nearest] - radius, slope);
}
