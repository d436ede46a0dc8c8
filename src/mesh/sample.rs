//! A small fabric for tests: one 10 × 10 mm cell with two warps, four wefts and one wavy thread.

use super::frame::Frame;
use super::{Block, Mesh, Part, Ply, Thread};
use crate::settings::material::Material;
use std::f64::consts::TAU;

/// Slices of a yarn of [`plies`].
const SLICES: usize = 33;

/// The cell: warps along y above z = 0, wefts along x below, a closed thread along y that dips through both.
pub fn plies() -> Mesh {
    let mut mesh = Mesh { period: Some([10.0, 10.0]), ..Mesh::default() };
    for i in 0..2 {
        yarn(&mut mesh, Ply::Warp, -5.0 + 5.0 * f64::from(i), 4.59, 18);
    }
    for i in 0..4 {
        yarn(&mut mesh, Ply::Weft, -3.75 + 2.5 * f64::from(i), 2.08, 8);
    }
    let (first, count) = (mesh.nodes.len(), 240);
    for i in 0..count {
        let s = i as f64 / count as f64;
        let z = 0.47 * ((2.0 * (4.0 * TAU * s).cos()).tanh() / 2.0_f64.tanh());
        mesh.nodes.push([-2.5 + 1.1 * (TAU * 2.0 * s).sin(), -5.0 + 10.0 * s, z]);
    }
    mesh.threads.push(Thread {
        name: "stitch".into(),
        first,
        count,
        wrap: Some([0, 1]),
        radius: 0.1,
        axial: 11.0,
        bending: 5.6e-4,
        rest_curvature: 1.0,
        linear_density: 4.34e-11,
        thermal_strain: -0.15,
        velocity: [0.0; 3],
        parts: (0..count).map(|i| if i % 60 < 30 { Part::Loop } else { Part::Underlap }).collect(),
        excess: vec![0.0; count],
    });
    mesh
}

/// A mesh moved by an in-plane gradient.
pub fn frame(mesh: &Mesh, gradient: [[f64; 2]; 2]) -> Frame {
    let [[a, b], [c, d]] = gradient;
    Frame {
        gradient,
        positions: mesh.nodes.iter().map(|&[x, y, z]| [a * x + b * y, c * x + d * y, z]).collect(),
        ..Frame::default()
    }
}

/// A mesh in trellis shear by an angle in rad.
pub fn sheared(mesh: &Mesh, angle: f64) -> Frame {
    let (s, c) = (0.5 * angle).sin_cos();
    frame(mesh, [[c, s], [s, c]])
}

/// A closed straight yarn with a truncated elliptic section, 0.38 mm thick, centred at `place` across its ply.
fn yarn(mesh: &mut Mesh, ply: Ply, place: f64, width: f64, columns: usize) {
    let (layers, half, axis) = (2, 0.19, width / (2.0 * 0.95));
    let first = mesh.nodes.len();
    for layer in 0..=layers {
        for column in 0..=columns {
            let u = width * (column as f64 / columns as f64 - 0.5);
            let h = half * (1.0 - (u / axis).powi(2)).sqrt() * (layer as f64 - 1.0);
            for slice in 0..SLICES {
                let along = -5.0 + 10.0 * slice as f64 / SLICES as f64;
                mesh.nodes.push(match ply {
                    Ply::Warp => [place - u, along, half + h],
                    _ => [along, place + u, -half + h],
                });
            }
        }
    }
    mesh.blocks.push(Block {
        name: format!("{ply:?} {}", mesh.blocks.len()),
        ply,
        first,
        slices: SLICES,
        columns,
        layers,
        wrap: Some(if ply == Ply::Warp { [0, 1] } else { [1, 0] }),
        fibre: if ply == Ply::Warp { [0.0, 1.0, 0.0] } else { [1.0, 0.0, 0.0] },
        density: 1.05e-9,
        material: Material::NeoHookean { young_mpa: 1.0, poisson: 0.0 },
        velocity: [0.0; 3],
    });
}
