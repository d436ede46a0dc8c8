//! Reference shape data of hexahedra, in the frame of the fibre.

use crate::elements::block::BINARY;
use crate::elements::hex8_reduced::MODES;
use crate::mesh::CORNER_SIGNS;

/// Inverse Jacobian ∂ξ_d/∂X_J and volume at a Gauss point.
pub type Point = ([[f64; 3]; 3], f64);

/// Coordinate of the Gauss points.
pub const GAUSS: f64 = 0.577_350_269_189_625_8;

/// Derivatives of the shape function of a corner (in mesh order) with respect to (ξ, η, ζ) at a Gauss point.
fn slope(corner: usize, point: usize) -> [f64; 3] {
    let sign = CORNER_SIGNS[corner];
    let f = [0, 1, 2].map(|k| 0.5 * (1.0 + sign[k] * if point >> k & 1 == 1 { GAUSS } else { -GAUSS }));
    [0.5 * sign[0] * f[1] * f[2], 0.5 * sign[1] * f[0] * f[2], 0.5 * sign[2] * f[0] * f[1]]
}

/// Inverse Jacobians and volumes at the Gauss points of a hexahedron with these corners (in mesh order); a volume that is not
/// positive is returned as the error.
pub fn points(corners: &[[f64; 3]; 8]) -> std::result::Result<[Point; 8], f64> {
    let mut points = [([[0.0; 3]; 3], 0.0); 8];
    for (point, result) in points.iter_mut().enumerate() {
        // jacobian[j][d] = ∂X_j/∂ξ_d
        let mut j = [[0.0; 3]; 3];
        for (corner, x) in corners.iter().enumerate() {
            for (row, x) in j.iter_mut().zip(x) {
                for (entry, slope) in row.iter_mut().zip(slope(corner, point)) {
                    *entry += x * slope;
                }
            }
        }
        let cofactor = |a: usize, b: usize| {
            let ([r, s], [c, d]) = ([(a + 1) % 3, (a + 2) % 3], [(b + 1) % 3, (b + 2) % 3]);
            j[r][c] * j[s][d] - j[r][d] * j[s][c]
        };
        let volume = j[0][0] * cofactor(0, 0) + j[0][1] * cofactor(0, 1) + j[0][2] * cofactor(0, 2);
        if volume <= 0.0 || volume.is_nan() {
            return Err(volume);
        }
        *result = (std::array::from_fn(|d| std::array::from_fn(|jj| cofactor(jj, d) / volume)), volume);
    }
    Ok(points)
}

/// Numbers of [`hex8`](crate::elements::hex8): inverse Jacobians, halved because kernels use differences of corners, which are
/// twice the derivative; volumes.
pub fn full(points: &[Point; 8]) -> Vec<f64> {
    let numbers = |(inverse, volume): &Point| inverse.as_flattened().iter().map(|x| 0.5 * x).chain([*volume]).collect();
    points.iter().map(numbers).collect::<Vec<Vec<f64>>>().concat()
}

/// Numbers of [`hex8_reduced`](crate::elements::hex8_reduced): mean gradients B of the shape functions, stored as half of their
/// differences and sums over edges along ξ (two Gauss points per direction integrate them exactly); the volume; Σ h X of the
/// hourglass modes; the hourglass stiffness.
///
/// The stiffness k = G ∫ |∇h|² dV / 8² is taken in the parallelepiped that has the mean gradients of (ξ, η, ζ) at right angles.
/// It resists u = q h/8 as if every component of the displacement gradient had the `modulus` G, MPa, under full integration.
pub fn reduced(points: &[Point; 8], corners: &[[f64; 3]; 8], modulus: f64) -> Vec<f64> {
    let volume: f64 = points.iter().map(|(_, volume)| volume).sum();
    let mut means = [[0.0; 3]; 8];
    // squares of the mean gradients of ξ, η and ζ, which the signs of the corners interpolate
    let mut gradients = [[0.0; 3]; 3];
    let mut moments = [[0.0; 3]; 4];
    for (corner, &binary) in BINARY.iter().enumerate() {
        for j in 0..3 {
            let mean = |(number, (inverse, volume)): (usize, &Point)| {
                let slope = slope(corner, number);
                volume * (slope[0] * inverse[0][j] + slope[1] * inverse[1][j] + slope[2] * inverse[2][j])
            };
            means[binary][j] = points.iter().enumerate().map(mean).sum::<f64>() / volume;
            for d in 0..3 {
                gradients[d][j] += CORNER_SIGNS[corner][d] * means[binary][j];
            }
            for (moment, signs) in moments.iter_mut().zip(MODES) {
                moment[j] += signs[binary] * corners[corner][j];
            }
        }
    }
    let [xi, eta, zeta] = gradients.map(|g| g.iter().map(|g| g * g).sum::<f64>());
    // the mean of ξ² is a third, the mean of ξ² η² a ninth
    let shares = [(eta + zeta) / 3.0, (xi + zeta) / 3.0, (xi + eta) / 3.0, (xi + eta + zeta) / 9.0];
    let stiffness = shares.map(|share| modulus * volume * share / 64.0);
    let halves = means.chunks_exact(2).flat_map(|ends| {
        let difference = [0, 1, 2].map(|j| 0.5 * (ends[1][j] - ends[0][j]));
        [difference, [0, 1, 2].map(|j| 0.5 * (ends[1][j] + ends[0][j]))]
    });
    let halves: Vec<f64> = halves.flatten().collect();
    [halves, vec![volume], moments.concat(), stiffness.to_vec()].concat()
}
