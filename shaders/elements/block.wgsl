// Common to all hexahedra: one invocation works on one lane of a block. The including element defines the length of a SHAPE.

#include "kernel/row"
#include "kernel/position"
#include LAW

struct Params {
    // Nodes in a plane of the position buffers.
    nodes: u32,
    // Factor on the axial fibre stiffness across the fibre lines; 0 without lines.
    left: f32,
}

@group(2) @binding(1) var<uniform> params: Params;

// A hexahedron: the start of its numbers in the tables.
struct Hex {
    corners: u32,
    shape: u32,
    frame: u32,
    material: u32,
}

fn hex(block: u32, lane: u32) -> Hex {
    let header = 4u * block;
    return Hex(
        8u * LANES * block + lane,
        SHAPE * headers[header + 2u] + lane,
        9u * headers[header + 1u],
        PARAMETERS * headers[header],
    );
}

fn frame(h: Hex) -> Tensor {
    let q = h.frame;
    return Tensor(
        vec3<f32>(frames[q], frames[q + 1u], frames[q + 2u]),
        vec3<f32>(frames[q + 3u], frames[q + 4u], frames[q + 5u]),
        vec3<f32>(frames[q + 6u], frames[q + 7u], frames[q + 8u]),
    );
}

fn material(h: Hex) -> array<f32, PARAMETERS> {
    let p = h.material;
    return array<f32, PARAMETERS>(
        materials[p],
        materials[p + 1u],
        materials[p + 2u],
        materials[p + 3u],
        materials[p + 4u],
        materials[p + 5u],
        materials[p + 6u],
        materials[p + 7u],
    );
}

fn node_quanta(node: u32) -> vec3<i32> {
    return vec3<i32>(quanta[node], quanta[node + params.nodes], quanta[node + 2u * params.nodes]);
}

fn node_remainder(node: u32) -> vec3<f32> {
    return vec3<f32>(remainder[node], remainder[node + params.nodes], remainder[node + 2u * params.nodes]);
}

// Displacement of a corner (in mesh order) relative to a position.
fn displacement(h: Hex, corner: u32, from_quanta: vec3<i32>, from_remainder: vec3<f32>) -> vec3<f32> {
    let node = corners[h.corners + corner * LANES];
    return vec3<f32>(node_quanta(node) - from_quanta) * QUANTUM + (node_remainder(node) - from_remainder);
}

#if PERIODIC
// The macroscopic displacement gradient in the fibre's frame, Qᵀ A Q.
fn macroscopic(q: Tensor) -> Tensor {
    let g = gradient();
    return (q * Tensor(g[0], g[1], g[2])) * transpose(q);
}
#endif

#if force
// Writes three components, one lane stride apart.
fn store(at: u32, a: vec3<f32>) {
    out[at] = a.x;
    out[at + LANES] = a.y;
    out[at + 2u * LANES] = a.z;
}

#if PERIODIC
fn add_to_row(at: u32, a: vec3<f32>) {
    out_virial[at] = out_virial[at] + a.x;
    out_virial[at + LANES] = out_virial[at + LANES] + a.y;
    out_virial[at + 2u * LANES] = out_virial[at + 2u * LANES] + a.z;
}

// Adds V P, in the fibre's frame, to the virial stress sum of a block.
fn add_virial(block: u32, lane: u32, q: Tensor, stress: Tensor) {
    // Q A Qᵀ
    let turned = (transpose(q) * stress) * q;
    let start = VIRIAL * block + lane;
    add_to_row(start, turned[0]);
    add_to_row(start + 3u * LANES, turned[1]);
    add_to_row(start + 6u * LANES, turned[2]);
}
#endif
#endif

#if bound
// Mesh order of the binary corners.
const MESH_ORDER = array<u32, 8>(0u, 1u, 3u, 2u, 4u, 5u, 7u, 6u);

// Weight of the stiffness rows at a binary corner: one, or R/m of the node.
fn weight(h: Hex, corner: u32) -> f32 {
#if WEIGHED
    return weights[params.nodes + corners[h.corners + MESH_ORDER[corner] * LANES]];
#else
    return 1.0;
#endif
}

// Writes the stiffness row sums of the binary corners.
fn store_rows(block: u32, lane: u32, rows: array<f32, 8>) {
    let at = BOUND * block + lane;
    out[at] = rows[0];
    out[at + LANES] = rows[1];
    out[at + 2u * LANES] = rows[3];
    out[at + 3u * LANES] = rows[2];
    out[at + 4u * LANES] = rows[4];
    out[at + 5u * LANES] = rows[5];
    out[at + 6u * LANES] = rows[7];
    out[at + 7u * LANES] = rows[6];
}
#endif
