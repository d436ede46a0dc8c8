// Fully integrated 8-node hexahedron: one invocation works on one lane of a block.

#include "elements/block"

// Derivatives with respect to ξ, η and ζ, each at the four points of the other two directions.
struct Derivatives {
    x: array<vec3<f32>, 4>,
    y: array<vec3<f32>, 4>,
    z: array<vec3<f32>, 4>,
}

// Row k of the inverse Jacobian at a Gauss point, halved.
fn inverse(h: Hex, point: u32, k: u32) -> vec3<f32> {
    let at = h.shape + (10u * point + 3u * k) * LANES;
    return vec3<f32>(shapes[at], shapes[at + LANES], shapes[at + 2u * LANES]);
}

fn volume(h: Hex, point: u32) -> f32 {
    return shapes[h.shape + (10u * point + 9u) * LANES];
}

// Displacement of a corner (in mesh order) relative to a position, in the fibre's frame.
fn local_displacement(h: Hex, corner: u32, from_quanta: vec3<i32>, from_remainder: vec3<f32>, q: Tensor) -> vec3<f32> {
    let global = displacement(h, corner, from_quanta, from_remainder);
    return fma(q[2], global.zzz, fma(q[1], global.yyy, q[0] * global.x));
}

// Derivatives of the displacement in the fibre's frame.
fn derivatives(h: Hex, q: Tensor) -> Derivatives {
    let node = corners[h.corners];
    let at = node_quanta(node);
    let rest = node_remainder(node);
    // binary order; the first corner is the reference of displacements
    let u1 = local_displacement(h, 1u, at, rest, q);
    let u2 = local_displacement(h, 3u, at, rest, q);
    let u3 = local_displacement(h, 2u, at, rest, q);
    let u4 = local_displacement(h, 4u, at, rest, q);
    let u5 = local_displacement(h, 5u, at, rest, q);
    let u6 = local_displacement(h, 7u, at, rest, q);
    let u7 = local_displacement(h, 6u, at, rest, q);
    return Derivatives(
        interpolate(u1, u3 - u2, u5 - u4, u7 - u6),
        interpolate(u2, u3 - u1, u6 - u4, u7 - u5),
        interpolate(u4, u5 - u1, u6 - u2, u7 - u3),
    );
}

fn near_far(a: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    return fma(vec3<f32>(NEAR), a, FAR * b);
}

fn far_near(a: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    return fma(vec3<f32>(FAR), a, NEAR * b);
}

// Differences along one direction, interpolated to the Gauss points of the others.
fn interpolate(d0: vec3<f32>, d1: vec3<f32>, d2: vec3<f32>, d3: vec3<f32>) -> array<vec3<f32>, 4> {
    let f0 = near_far(d0, d1);
    let f1 = far_near(d0, d1);
    let f2 = near_far(d2, d3);
    let f3 = far_near(d2, d3);
    return array<vec3<f32>, 4>(near_far(f0, f2), near_far(f1, f3), far_near(f0, f2), far_near(f1, f3));
}

// The transpose of `interpolate`.
fn spread(g: array<vec3<f32>, 4>) -> array<vec3<f32>, 4> {
    let f0 = near_far(g[0], g[2]);
    let f1 = near_far(g[1], g[3]);
    let f2 = far_near(g[0], g[2]);
    let f3 = far_near(g[1], g[3]);
    return array<vec3<f32>, 4>(near_far(f0, f1), far_near(f0, f1), near_far(f2, f3), far_near(f2, f3));
}

// Index of a Gauss point among the four points of the other two directions, for each direction.
fn others(point: u32) -> vec3<u32> {
    let i = point & 1u;
    let j = (point >> 1u) & 1u;
    let k = point >> 2u;
    return vec3<u32>(j + 2u * k, i + 2u * k, i + 2u * j);
}

#if PERIODIC
// The macroscopic displacement gradient in the frame of the current fibre.
var<private> added: Tensor;
#endif

// H at a Gauss point.
fn gradient_at(h: Hex, point: u32, d: ptr<function, Derivatives>) -> Tensor {
    let at = others(point);
    let x = (*d).x[at.x];
    let y = (*d).y[at.y];
    let z = (*d).z[at.z];
    let a = inverse(h, point, 0u);
    let b = inverse(h, point, 1u);
    let c = inverse(h, point, 2u);
    let seen = Tensor(
        fma(z.xxx, c, fma(y.xxx, b, x.x * a)),
        fma(z.yyy, c, fma(y.yyy, b, x.y * a)),
        fma(z.zzz, c, fma(y.zzz, b, x.z * a)),
    );
#if PERIODIC
    return seen + added;
#else
    return seen;
#endif
}

#if force
// Sums over the Gauss points of a hexahedron: forces conjugate to the derivatives, and for periodic scenes V P̄.
struct Sum {
    forces: Derivatives,
    stress: Tensor,
}

fn add_point(
    h: Hex,
    point: u32,
    p: array<f32, PARAMETERS>,
    d: ptr<function, Derivatives>,
    sum: ptr<function, Sum>,
) {
    let weighted = stress(p, gradient_at(h, point, d)) * volume(h, point);
#if PERIODIC
    (*sum).stress = (*sum).stress + weighted;
#endif
    let at = others(point);
    (*sum).forces.x[at.x] = (*sum).forces.x[at.x] - inverse(h, point, 0u) * weighted;
    (*sum).forces.y[at.y] = (*sum).forces.y[at.y] - inverse(h, point, 1u) * weighted;
    (*sum).forces.z[at.z] = (*sum).forces.z[at.z] - inverse(h, point, 2u) * weighted;
}

fn force(number: u32) {
    let block = number / LANES;
    let lane = number % LANES;
    let h = hex(block, lane);
    let q = frame(h);
    let p = material(h);
#if PERIODIC
    added = macroscopic(q);
#endif
    var d = derivatives(h, q);
    var sum = Sum();
    add_point(h, 0u, p, &d, &sum);
    add_point(h, 1u, p, &d, &sum);
    add_point(h, 2u, p, &d, &sum);
    add_point(h, 3u, p, &d, &sum);
    add_point(h, 4u, p, &d, &sum);
    add_point(h, 5u, p, &d, &sum);
    add_point(h, 6u, p, &d, &sum);
    add_point(h, 7u, p, &d, &sum);
    let x = spread(sum.forces.x);
    let y = spread(sum.forces.y);
    let z = spread(sum.forces.z);
    // corners in mesh order
    let at = SLOTS * block + lane;
    store(at, (-x[0] - y[0] - z[0]) * q);
    store(at + 3u * LANES, (x[0] - y[1] - z[1]) * q);
    store(at + 6u * LANES, (x[1] + y[1] - z[3]) * q);
    store(at + 9u * LANES, (y[0] - x[1] - z[2]) * q);
    store(at + 12u * LANES, (z[0] - x[2] - y[2]) * q);
    store(at + 15u * LANES, (x[2] - y[3] + z[1]) * q);
    store(at + 18u * LANES, (x[3] + y[3] + z[3]) * q);
    store(at + 21u * LANES, (y[2] - x[3] + z[2]) * q);
#if PERIODIC
    add_virial(block, lane, q, sum.stress);
#endif
}
#endif

#if energy
fn energy(number: u32) {
    let block = number / LANES;
    let lane = number % LANES;
    let h = hex(block, lane);
    let q = frame(h);
    let p = material(h);
#if PERIODIC
    added = macroscopic(q);
#endif
    var d = derivatives(h, q);
    var sum = vec4<f32>();
    var smallest = 1e30;
    for (var point = 0u; point < 8u; point++) {
        let here = gradient_at(h, point, &d);
        sum = fma(energies(p, here), vec4<f32>(volume(h, point)), sum);
        smallest = min(smallest, jacobian(here));
    }
    let at = ENERGY * block + lane;
    out[at] = sum.x;
    out[at + LANES] = sum.y;
    out[at + 2u * LANES] = sum.z;
    out[at + 3u * LANES] = sum.w;
    out[at + 4u * LANES] = smallest;
}
#endif

#if bound
// Derivatives of the shape function of a binary corner in the fibre's frame, at a Gauss point.
fn slope_at(h: Hex, point: u32, corner: u32) -> vec3<f32> {
    let bits = vec3<u32>(0u, 1u, 2u);
    let high = (vec3<u32>(corner) >> bits) & vec3<u32>(1u);
    let own = high == ((vec3<u32>(point) >> bits) & vec3<u32>(1u));
    let n = select(vec3<f32>(FAR), vec3<f32>(NEAR), own);
    let sign = select(vec3<f32>(-1.0), vec3<f32>(1.0), high == vec3<u32>(1u));
    let slope = sign * n.yxx * n.zzy;
    let lower = fma(slope.yyy, inverse(h, point, 1u), slope.x * inverse(h, point, 0u));
    return fma(slope.zzz, inverse(h, point, 2u), lower);
}

// Displacement of the high corner relative to the low corner of the four edges along ξ.
fn edges(h: Hex, q: Tensor) -> array<vec3<f32>, 4> {
    let node = corners[h.corners];
    let at = node_quanta(node);
    let rest = node_remainder(node);
    // binary order
    return array<vec3<f32>, 4>(
        local_displacement(h, 1u, at, rest, q),
        local_displacement(h, 2u, at, rest, q) - local_displacement(h, 3u, at, rest, q),
        local_displacement(h, 5u, at, rest, q) - local_displacement(h, 4u, at, rest, q),
        local_displacement(h, 6u, at, rest, q) - local_displacement(h, 7u, at, rest, q),
    );
}

// Sine of the angle between the fibre at a Gauss point and an edge, from the reference edge and its change.
fn sine_between(rest: vec3<f32>, change: vec3<f32>, fibre: vec3<f32>) -> f32 {
    var now = rest + change;
#if PERIODIC
    now = now + vec3<f32>(dot(added[0], rest), dot(added[1], rest), dot(added[2], rest));
#endif
    let turned = cross(now, fibre);
    return sqrt(dot(turned, turned) / (dot(now, now) * dot(fibre, fibre)));
}

fn bound(number: u32) {
    let block = number / LANES;
    let lane = number % LANES;
    let h = hex(block, lane);
    let q = frame(h);
    let p = material(h);
#if PERIODIC
    added = macroscopic(q);
#endif
    var d = derivatives(h, q);
    var changes = edges(h, q);
    let explicit_fibres = params.left == 0.0;
    let factor = select(params.left, 1.0, explicit_fibres);
    var rows = array<f32, 8>();
    for (var point = 0u; point < 8u; point++) {
        let here = gradient_at(h, point, &d);
        let fibre = vec3<f32>(1.0 + here[0].x, here[1].x, here[2].x);
        let side = cross(inverse(h, point, 1u), inverse(h, point, 2u));
        let rest = side / dot(inverse(h, point, 0u), side);
        var left = array<f32, 8>();
        var sum = vec3<f32>();
        var sum_across = 0.0;
        var sum_left = 0.0;
        for (var edge = 0u; edge < 4u; edge++) {
            let low = slope_at(h, point, 2u * edge);
            let high = slope_at(h, point, 2u * edge + 1u);
            var sizes = abs(vec2<f32>(low.x, high.x));
            if !explicit_fibres {
                let sine = sine_between(rest, changes[edge], fibre);
                sizes = vec2<f32>(fma(sine, abs(0.5 * (high.x - low.x)), abs(0.5 * (high.x + low.x))));
            }
            left[2u * edge] = sizes.x;
            left[2u * edge + 1u] = sizes.y;
            let w = vec2<f32>(weight(h, 2u * edge), weight(h, 2u * edge + 1u));
            sum = sum + w.x * abs(low) + w.y * abs(high);
            sum_across = sum_across + w.x * length(low.yz) + w.y * length(high.yz);
            sum_left = sum_left + dot(w, sizes);
        }
        let m = moduli(p, here);
        let volume_here = volume(h, point);
        for (var a = 0u; a < 8u; a++) {
            // found again rather than kept: a GPU would keep an array of slopes in memory
            let slope = abs(slope_at(h, point, a));
            let others = moduli_rows(m, slope, length(slope.yz), sum, sum_across);
            let row = fma(factor * m.along * left[a], sum_left, others);
            rows[a] = fma(row, volume_here, rows[a]);
        }
    }
    store_rows(block, lane, rows);
}
#endif
