//! The picture frame: its clamps turn on exact arcs, glued yarns shear by the angle of the frame, and pinned ones do not.

use crate::common::{advance, below, coarse_cell, near, start, with};
use serde_json::{Value, json};
use tricot::measure::shear::{frame_angle, frame_displacement, trellis};
use tricot::mesh::quality;
use tricot::settings::integration::Precision::{F32, F64};

/// Shear angle, degrees, and time of the shear step, s.
const ANGLE: f64 = 20.0;
const TIME: f64 = 8e-3;

/// A small frame without contact, whose yarns bear the load alone.
fn yarns_in_a_frame(clamps: &str, strain: f64) -> Value {
    let frame = json!({ "frame_mm": 16, "fabric_mm": 10, "clamps": clamps, "tension_strain": strain });
    let mut steps = vec![json!({ "shear": { "angle_deg": ANGLE, "time_s": TIME } })];
    if strain > 0.0 {
        steps.insert(0, json!({ "move": { "time_s": 1e-3 } }));
    }
    with(
        coarse_cell(),
        &[
            ("/domain", json!({ "picture_frame": frame })),
            ("/effects", json!({ "contact": null, "damping": { "rate_per_s": 500 } })),
            ("/steps", json!(steps)),
            ("/integration", json!({})),
        ],
    )
}

/// The fibres of a glued yarn keep their length and stay parallel, so the yarn is sheared by γ: by the law, ½ K_sh sin² γ per volume.
/// A pinned yarn turns as a whole.
#[test]
fn glued_yarns_shear_by_the_angle_of_the_frame_and_pinned_ones_turn() {
    let sin = ANGLE.to_radians().sin();
    for (clamps, precision) in [("glued", F32), ("glued", F64), ("pinned", F32)] {
        let mut s = start(&yarns_in_a_frame(clamps, 0.0), precision);
        advance(&mut s, TIME);
        let mesh = s.mesh();
        let volume: f64 = mesh.blocks.iter().map(|block| quality::volume(mesh, block)).sum();
        let whole = volume * 0.5 * 2.2 * sin * sin;
        if clamps == "glued" {
            near("energy of longitudinal shear, mJ", s.energies().shear, whole, 0.02);
        } else {
            below("energy of longitudinal shear over that of glued yarns", s.energies().shear / whole, 0.02);
        }
        below("error of the energy balance", s.health().balance.abs(), 5e-3);
    }
}

/// Clamped nodes go where the frame takes them, with the tension and without it.
#[test]
fn clamps_turn_on_exact_arcs() {
    for (strain, precision) in [(0.0, F32), (0.002, F64)] {
        let mut s = start(&yarns_in_a_frame("pinned", strain), precision);
        advance(&mut s, if strain > 0.0 { 1e-3 + TIME } else { TIME });
        let (f, moved) = (trellis(ANGLE.to_radians()), s.shape().positions);
        let nodes = s.prescribed_nodes();
        assert!(nodes.len() > 20);
        for node in nodes {
            let [x, y, z] = s.mesh().nodes[node];
            let (x, y) = if x.abs() > y.abs() { (x * (1.0 + strain), y) } else { (x, y * (1.0 + strain)) };
            let aim = [f[0][0] * x + f[0][1] * y, f[1][0] * x + f[1][1] * y, z];
            for k in 0..3 {
                assert!((moved[node][k] - aim[k]).abs() < 2e-5, "node {node}: {:?} and not {aim:?}", moved[node]);
            }
        }
    }
    let there = frame_displacement(0.7, 120.0);
    near("angle of a frame at the displacement of an angle", frame_angle(there, 120.0), 0.7, 1e-12);
}
