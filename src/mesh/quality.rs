//! Quality and sizes of an undeformed mesh: shape of hexahedra, volumes, lengths, masses.

use super::vector::{Vector, cross, dot, norm, scale, sub, unit};
use super::{Block, CORNER_SIGNS, Mesh, Part, Ply, Thread};

/// 1 g/m² in tonne/mm².
pub const TONNES_PER_MM2: f64 = 1e-12;
/// Tonnes per mm³ of a g/cm³.
pub const TONNES_PER_MM3: f64 = 1e-9;
/// 1 tex (g/km) in tonne/mm.
pub const TONNES_PER_MM_OF_TEX: f64 = 1e-12;

/// For each corner of a hexahedron, its neighbours along ξ, η and ζ, in right-handed order.
const NEIGHBOURS: [[usize; 3]; 8] =
    [[1, 3, 4], [2, 0, 5], [3, 1, 6], [0, 2, 7], [7, 5, 0], [4, 6, 1], [5, 7, 2], [6, 4, 3]];

/// Smallest scaled Jacobian over the corners of every hexahedron of a block: the triple product of the unit vectors along
/// the three edges of a corner, 1 for a box, 0 or below where the element is inverted.
pub fn scaled_jacobian(mesh: &Mesh, block: &Block) -> f64 {
    elements(mesh, block).map(|hex| corner_jacobian(&hex)).fold(f64::INFINITY, f64::min)
}

fn corner_jacobian(hex: &[Vector; 8]) -> f64 {
    let corner = |c: usize| NEIGHBOURS[c].map(|n| unit(sub(hex[n], hex[c])));
    (0..8).map(corner).map(|[a, b, c]| dot(cross(a, b), c)).fold(f64::INFINITY, f64::min)
}

/// Volume of a block in mm³, exact for trilinear hexahedra (2 × 2 × 2 Gauss points).
pub fn volume(mesh: &Mesh, block: &Block) -> f64 {
    elements(mesh, block).map(|hex| hex_volume(&hex)).sum()
}

fn hex_volume(hex: &[Vector; 8]) -> f64 {
    let gauss = 1.0 / 3f64.sqrt();
    let at = |point: Vector| {
        let mut columns = [[0.0; 3]; 3];
        for (corner, sign) in hex.iter().zip(CORNER_SIGNS) {
            let factor = [0, 1, 2].map(|i| 1.0 + sign[i] * point[i]);
            for (i, column) in columns.iter_mut().enumerate() {
                let slope = sign[i] * factor[(i + 1) % 3] * factor[(i + 2) % 3] / 8.0;
                *column = super::vector::add(*column, scale(*corner, slope));
            }
        }
        dot(cross(columns[0], columns[1]), columns[2])
    };
    CORNER_SIGNS.iter().map(|&sign| at(scale(sign, gauss))).sum()
}

/// Corner positions of every hexahedron of a block.
fn elements<'a>(mesh: &'a Mesh, block: &'a Block) -> impl Iterator<Item = [Vector; 8]> + 'a {
    let [slices, columns] = [block.slices, block.columns];
    (0..block.hexes()).map(move |e| {
        let [slice, rest] = [e % slices, e / slices];
        block.corners(slice, rest % columns, rest / columns).map(|c| mesh.position(c))
    })
}

/// Length of a thread along its curve in mm, over the beams of the given part or over all.
pub fn length(mesh: &Mesh, thread: &Thread, part: Option<Part>) -> f64 {
    (0..thread.beams())
        .filter(|&i| part.is_none_or(|p| thread.parts[i] == p))
        .map(|i| (thread.beam(i).map(|n| mesh.position(n)), thread.excess[i]))
        .map(|([a, b], excess)| norm(sub(b, a)) * (1.0 + excess))
        .sum()
}

/// Masses per area of a periodic cell, g/m².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArealMass {
    pub warp: f64,
    pub weft: f64,
    pub stitch: f64,
}

/// Areal masses, from the density and volume of the mesh; `None` without a periodic cell.
pub fn areal_mass(mesh: &Mesh) -> Option<ArealMass> {
    let [lx, ly] = mesh.period?;
    let per_area = 1.0 / (lx * ly * TONNES_PER_MM2);
    let ply = |ply: Ply| -> f64 {
        mesh.blocks.iter().filter(|b| b.ply == ply).map(|b| b.density * volume(mesh, b)).sum::<f64>() * per_area
    };
    let stitch: f64 = mesh.threads.iter().map(|t| t.linear_density * length(mesh, t, None)).sum();
    Some(ArealMass { warp: ply(Ply::Warp), weft: ply(Ply::Weft), stitch: stitch * per_area })
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUBE: [Vector; 8] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 1.0],
        [1.0, 1.0, 1.0],
        [0.0, 1.0, 1.0],
    ];

    #[test]
    fn a_cube_is_perfect_and_its_mirror_image_inverted() {
        assert!((corner_jacobian(&CUBE) - 1.0).abs() < 1e-15);
        let mirrored = CUBE.map(|[x, y, z]| [-x, y, z]);
        assert!((corner_jacobian(&mirrored) + 1.0).abs() < 1e-15);
    }

    #[test]
    fn volume_of_a_sheared_frustum() {
        // Top face half as wide, shifted: 1/3 (1 + 1/4 + 1/2).
        let hex = CUBE.map(|[x, y, z]| if z > 0.5 { [0.5 * x + 0.3, 0.5 * y, z] } else { [x, y, z] });
        assert!((hex_volume(&hex) - 1.75 / 3.0).abs() < 1e-14, "{}", hex_volume(&hex));
    }
}
