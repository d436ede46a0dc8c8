// Contact of two straight segments A and B: a potential of the distance from B, integrated along A; see the twin.

// Two segments, relative to the first end of A, mm.
struct Segments {
    along: vec3<f32>,
    start: vec3<f32>,
    other: vec3<f32>,
}

// Points of A from `low` to `high`, with projections `base + slope s` on B; all from 0 to 1.
struct Part {
    low: f32,
    high: f32,
    base: f32,
    slope: f32,
}

// The parts of A where the first end of B, its inside and its second end are closest, and the part where the first end is not.
struct Parts {
    first: Part,
    inside: Part,
    second: Part,
    beyond: Part,
}

// Vector from the projection on B to a point s of A: its value at s = 0, and its change with s, mm.
struct Between {
    base: vec3<f32>,
    slope: vec3<f32>,
}

fn unit(x: f32) -> f32 {
    return min(max(x, 0.0), 1.0);
}

fn parts_of(segments: Segments) -> Parts {
    let turn = dot(segments.along, segments.other);
    let first = dot(segments.start, segments.other);
    let size = dot(segments.other, segments.other);
    let least = size * STRAIGHT;
    if !(turn < 0.0) {
        let safe = max(turn, least);
        let low = unit(first / safe);
        let high = unit((first + size) / safe);
        let inside = Part(low, high, -first / size, turn / size);
        return Parts(Part(0.0, low, 0.0, 0.0), inside, Part(high, 1.0, 1.0, 0.0), Part(low, 1.0, 0.0, 0.0));
    }
    let safe = min(turn, -least);
    let low = unit((first + size) / safe);
    let high = unit(first / safe);
    let inside = Part(low, high, -first / size, turn / size);
    return Parts(Part(high, 1.0, 0.0, 0.0), inside, Part(0.0, low, 1.0, 0.0), Part(0.0, high, 0.0, 0.0));
}

fn between_parts(segments: Segments, part: Part) -> Between {
    return Between(segments.other * -part.base - segments.start, segments.other * -part.slope + segments.along);
}

// The square of the distance in a part, mm², or `least`.
fn nearer(segments: Segments, part: Part, least: f32) -> f32 {
    let line = between_parts(segments, part);
    let curvature = max(dot(line.slope, line.slope), dot(segments.along, segments.along) * STRAIGHT);
    let s = min(max(-dot(line.base, line.slope) / curvature, part.low), part.high);
    let offset = line.slope * s + line.base;
    if part.low < part.high {
        return min(least, dot(offset, offset));
    }
    return least;
}

// Distance of the two segments, mm.
fn distance_of(segments: Segments) -> f32 {
    let parts = parts_of(segments);
    var least = dot(segments.start, segments.start);
    least = nearer(segments, parts.first, least);
    least = nearer(segments, parts.inside, least);
    least = nearer(segments, parts.second, least);
    return sqrt(least);
}

#if PAIRS
// Contact forces between two segments.
struct Push {
    energy: f32,
    growth: f32,
    own: array<vec3<f32>, 2>,
    others: array<vec3<f32>, 2>,
    own_rows: vec2<f32>,
    other_rows: vec2<f32>,
    stiffness: f32,
    at: vec2<f32>,
    weight: f32,
}

// Interval of a part in which q is below `square`; an empty interval if there is none.
fn touching(part: Part, line: Between, square: f32) -> vec2<f32> {
    let curvature = max(dot(line.slope, line.slope), square * STRAIGHT);
    let half_slope = -dot(line.base, line.slope);
    let above = dot(line.base, line.base) - square;
    let root = half_slope * half_slope - curvature * above;
    if !(root > 0.0) {
        return vec2<f32>(part.low, part.low);
    }
    var sum = half_slope + sqrt(root);
    if half_slope < 0.0 {
        sum = half_slope - sqrt(root);
    }
    let a = sum / curvature;
    let b = above / sum;
    return vec2<f32>(max(min(a, b), part.low), min(max(a, b), part.high));
}

// Adds the contribution of a Gauss point.
fn add_point(push: ptr<function, Push>, part: Part, line: Between, s: f32, share: f32, reach: f32) {
    let square = reach * reach;
    let scale = 0.5 / square;
    let t = part.base + part.slope * s;
    let offset = line.slope * s + line.base;
    let inside = max(square - dot(offset, offset), 0.0);
    let pressed = share * scale * inside;
    (*push).energy = (*push).energy + 0.25 * pressed * inside;
    (*push).growth = (*push).growth + scale * reach * pressed * (square + square - inside);
    let force = offset * pressed;
    (*push).own[0] = force * (1.0 - s) + (*push).own[0];
    (*push).own[1] = force * s + (*push).own[1];
    (*push).others[0] = force * (t - 1.0) + (*push).others[0];
    (*push).others[1] = force * -t + (*push).others[1];
    (*push).stiffness = (*push).stiffness + share;
    let pushes = max(pressed, 0.0);
    let rows = max(share, 0.0);
    (*push).own_rows = (*push).own_rows + rows * vec2<f32>(1.0 - s, s);
    (*push).other_rows = (*push).other_rows + rows * vec2<f32>(1.0 - t, t);
    (*push).at = (*push).at + pushes * vec2<f32>(s, t);
    (*push).weight = (*push).weight + pushes;
}

// Adds a part, or subtracts it with a negative strength.
fn add_part(push: ptr<function, Push>, segments: Segments, part: Part, reach: f32, strength: f32) {
    let line = between_parts(segments, part);
    let range = touching(part, line, reach * reach);
    let length = range.y - range.x;
    if !(range.x < range.y) {
        return;
    }
    add_point(push, part, line, range.x + length * 0.1127016653792583, strength * length * (5.0 / 18.0), reach);
    add_point(push, part, line, range.x + length * 0.5, strength * length * (8.0 / 18.0), reach);
    add_point(push, part, line, range.x + length * 0.8872983346207417, strength * length * (5.0 / 18.0), reach);
}

// Contact forces of two segments that touch at a distance of `reach` (mm), with `strength` (N/mm), the penalty times the
// reference length of A; `owns` tells whether B owns the joint at its first end.
fn push_of(segments: Segments, reach: f32, strength: f32, owns: bool) -> Push {
    let parts = parts_of(segments);
    var push: Push;
    add_part(&push, segments, parts.inside, reach, strength);
    add_part(&push, segments, parts.second, reach, strength);
    if owns {
        add_part(&push, segments, parts.beyond, reach, -strength);
    } else {
        add_part(&push, segments, parts.first, reach, strength);
    }
    return push;
}
#endif
