// 8-node hexahedron with one Gauss point and hourglass control: one invocation works on one lane of a block.

#include "elements/block"

// Deformation of a hexahedron.
struct Deformation {
    // Mean displacement gradient in the fibre's frame.
    h: Tensor,
    // q by mode, along global axes.
    modes: array<vec3<f32>, 4>,
}

// A number of the shape.
fn entry(h: Hex, place: u32) -> f32 {
    return shapes[h.shape + place * LANES];
}

fn volume(h: Hex) -> f32 {
    return entry(h, VOLUME);
}

fn shape_vector(h: Hex, first: u32) -> vec3<f32> {
    return vec3<f32>(entry(h, first), entry(h, first + 1u), entry(h, first + 2u));
}

// Half the difference of B at both ends of an edge along ξ: fibre strain is computed from differences of near nodes, which are
// exact in f32.
fn difference_of(h: Hex, edge: u32) -> vec3<f32> {
    return shape_vector(h, 6u * edge);
}

// Half the sum of B at both ends of an edge along ξ.
fn sum_of(h: Hex, edge: u32) -> vec3<f32> {
    return shape_vector(h, 6u * edge + 3u);
}

// Σ h X of a mode.
fn moment(h: Hex, mode: u32) -> vec3<f32> {
    return shape_vector(h, MOMENTS + 3u * mode);
}

// Adds u ⊗ B.
fn add_product_of(u: vec3<f32>, b: vec3<f32>, to: Tensor) -> Tensor {
    return Tensor(fma(u.xxx, b, to[0]), fma(u.yyy, b, to[1]), fma(u.zzz, b, to[2]));
}

// q of a mode, from Σ h u.
fn unseen(h: Hex, mode: u32, sum: vec3<f32>, mixed: Tensor) -> vec3<f32> {
    return sum - moment(h, mode) * mixed;
}

fn deformation(h: Hex, q: Tensor) -> Deformation {
    let node = corners[h.corners];
    let at = node_quanta(node);
    let rest = node_remainder(node);
    // binary order; the first corner is the reference of displacements
    let u1 = displacement(h, 1u, at, rest);
    let u2 = displacement(h, 3u, at, rest);
    let u3 = displacement(h, 2u, at, rest);
    let u4 = displacement(h, 4u, at, rest);
    let u5 = displacement(h, 5u, at, rest);
    let u6 = displacement(h, 7u, at, rest);
    let u7 = displacement(h, 6u, at, rest);
    // differences and sums over edges along ξ
    let d1 = u3 - u2;
    let d2 = u5 - u4;
    let d3 = u7 - u6;
    let s1 = u2 + u3;
    let s2 = u4 + u5;
    let s3 = u6 + u7;
    // components along global axes, derivatives along those of the fibre
    var mixed = Tensor();
    mixed = add_product_of(u1, sum_of(h, 0u), add_product_of(u1, difference_of(h, 0u), mixed));
    mixed = add_product_of(s1, sum_of(h, 1u), add_product_of(d1, difference_of(h, 1u), mixed));
    mixed = add_product_of(s2, sum_of(h, 2u), add_product_of(d2, difference_of(h, 2u), mixed));
    mixed = add_product_of(s3, sum_of(h, 3u), add_product_of(d3, difference_of(h, 3u), mixed));
    // Σ h u of the modes ηζ, ξζ, ξη and ξηζ
    let low = d1 - u1;
    let high = d3 - d2;
    let modes = array<vec3<f32>, 4>(
        unseen(h, 0u, (u1 - s1) + (s3 - s2), mixed),
        unseen(h, 1u, (d2 + d3) - (u1 + d1), mixed),
        unseen(h, 2u, low + high, mixed),
        unseen(h, 3u, high - low, mixed),
    );
#if PERIODIC
    return Deformation(macroscopic(q) + mixed * transpose(q), modes);
#else
    return Deformation(mixed * transpose(q), modes);
#endif
}

#if force
// Writes the forces on both ends of an edge along ξ (in mesh order) from Σ h k q there.
fn store_edge(h: Hex, at: u32, low: u32, high: u32, edge: u32, conjugate: Tensor, held_low: vec3<f32>, held_high: vec3<f32>) {
    let d = difference_of(h, edge) * conjugate;
    let s = sum_of(h, edge) * conjugate;
    store(at + 3u * low * LANES, d - (s + held_low));
    store(at + 3u * high * LANES, -d - (s + held_high));
}

fn force(number: u32) {
    let block = number / LANES;
    let lane = number % LANES;
    let h = hex(block, lane);
    let q = frame(h);
    let state = deformation(h, q);
    let weighted = stress(material(h), state.h) * volume(h);
    // conjugate to the gradient: stress, minus the response of the hourglass modes to linear displacements
    var conjugate = weighted * q;
    let g0 = entry(h, STIFFNESS) * state.modes[0];
    let g1 = entry(h, STIFFNESS + 1u) * state.modes[1];
    let g2 = entry(h, STIFFNESS + 2u) * state.modes[2];
    let g3 = entry(h, STIFFNESS + 3u) * state.modes[3];
    conjugate = add_product_of(-g0, moment(h, 0u), conjugate);
    conjugate = add_product_of(-g1, moment(h, 1u), conjugate);
    conjugate = add_product_of(-g2, moment(h, 2u), conjugate);
    conjugate = add_product_of(-g3, moment(h, 3u), conjugate);
    let plus = g2 + g3;
    let minus = g3 - g2;
    let along0 = minus - g1;
    let along1 = -(minus + g1);
    let along2 = g1 - plus;
    let along3 = g1 + plus;
    let at = SLOTS * block + lane;
    store_edge(h, at, 0u, 1u, 0u, conjugate, g0 - along0, g0 + along0);
    store_edge(h, at, 3u, 2u, 1u, conjugate, -(g0 + along1), along1 - g0);
    store_edge(h, at, 4u, 5u, 2u, conjugate, -(g0 + along2), along2 - g0);
    store_edge(h, at, 7u, 6u, 3u, conjugate, g0 - along3, g0 + along3);
#if PERIODIC
    add_virial(block, lane, q, weighted);
#endif
}
#endif

#if energy
fn energy(number: u32) {
    let block = number / LANES;
    let lane = number % LANES;
    let h = hex(block, lane);
    var state = deformation(h, frame(h));
    let modes = energies(material(h), state.h) * volume(h);
    var sum = 0.0;
    for (var mode = 0u; mode < 4u; mode++) {
        let q = state.modes[mode];
        sum = fma(entry(h, STIFFNESS + mode), dot(q, q), sum);
    }
    let at = ENERGY * block + lane;
    out[at] = modes.x;
    out[at + LANES] = modes.y;
    out[at + 2u * LANES] = modes.z;
    out[at + 3u * LANES] = modes.w;
    out[at + 4u * LANES] = jacobian(state.h);
    out_hourglass[HOURGLASS * block + lane] = 0.5 * sum;
}
#endif

#if bound
// B of a binary corner.
fn slope(h: Hex, corner: u32) -> vec3<f32> {
    let sign = select(-1.0, 1.0, corner % 2u == 1u);
    return sum_of(h, corner / 2u) + sign * difference_of(h, corner / 2u);
}

// Sign of a mode at a binary corner.
fn sign_of(mode: u32, corner: u32) -> f32 {
    let s = vec3<f32>((vec3<u32>(corner) >> vec3<u32>(0u, 1u, 2u)) & vec3<u32>(1u)) * 2.0 - 1.0;
    return vec4<f32>(s.y * s.z, s.x * s.z, s.x * s.y, s.x * s.y * s.z)[mode];
}

// Adds the row sums of a stiffness matrix bounded by k times the products of its corner magnitudes.
fn add_rows(rows: ptr<function, array<f32, 8>>, k_total: f32, sizes: array<f32, 8>) {
    var s = sizes;
    for (var a = 0u; a < 8u; a++) {
        (*rows)[a] = fma(k_total, s[a], (*rows)[a]);
    }
}

fn bound(number: u32) {
    let block = number / LANES;
    let lane = number % LANES;
    let h = hex(block, lane);
    let state = deformation(h, frame(h));
    var rows = array<f32, 8>();
    var sizes = array<f32, 8>();
    let p = material(h);
    // modulus × V |B_a| Σ|B|
    let m = moduli(p, state.h);
    let here = volume(h);
    var total = 0.0;
    var sum_slopes = vec3<f32>();
    for (var a = 0u; a < 8u; a++) {
        let b = slope(h, a);
        total = total + weight(h, a) * length(b.yz);
        sum_slopes = sum_slopes + weight(h, a) * abs(b);
    }
    for (var a = 0u; a < 8u; a++) {
        let b = slope(h, a);
        rows[a] = here * moduli_rows(m, abs(b), length(b.yz), sum_slopes, total);
        sizes[a] = abs(b.x);
    }
    if params.left == 0.0 {
        add_rows(&rows, m.along * here * sum_slopes.x, sizes);
    } else {
        // fibre stiffness acts along the mean fibre, fibre lines along each edge: the difference between these directions is
        // not covered, (d + e)² ≤ 2 d² + 2 e²
        total = 0.0;
        for (var a = 0u; a < 8u; a++) {
            let b = abs(slope(h, a).x);
            let lower = sign_of(1u, a) * state.modes[1] + sign_of(2u, a) * state.modes[2];
            let apart = lower + sign_of(3u, a) * state.modes[3];
            sizes[a] = b * b * sqrt(dot(apart, apart));
            total = total + weight(h, a) * sizes[a];
        }
        add_rows(&rows, 2.0 * m.along * here * total, sizes);
    }
    // k |γ_a| Σ|γ|
    for (var mode = 0u; mode < 4u; mode++) {
        let sum = moment(h, mode);
        total = 0.0;
        for (var a = 0u; a < 8u; a++) {
            sizes[a] = abs(sign_of(mode, a) - dot(sum, slope(h, a)));
            total = total + weight(h, a) * sizes[a];
        }
        add_rows(&rows, entry(h, STIFFNESS + mode) * total, sizes);
    }
    store_rows(block, lane, rows);
}
#endif
