//! Gravity acts on the true mass, whatever mass a scene adds for its time step.

use crate::common::{advance, bare, block, near, neo_hookean, start, with};
use serde_json::{Value, json};
use tricot::settings::integration::Precision::{self, F32, F64};

/// So strong that a light thread presses as in a fabric, mm/s².
const GRAVITY: f64 = 1e7;

/// A thread that lies on a plate, which is held at its bottom. Contact adds mass, and the mass floor makes edges of the plate and
/// ends of the thread heavier.
fn scene() -> Value {
    let plate = block("plate", [6, 6, 2], [[-1.5, -1.5, -1.0], [1.5, 1.5, 0.0]], 2e-9, neo_hookean(1000.0, 0.3));
    let nodes: Vec<[f64; 3]> = (0..=8).map(|i| [0.25 * f64::from(i) - 1.0, 0.1, 0.1]).collect();
    let thread = json!({
        "name": "thread", "nodes": nodes, "radius_mm": 0.1, "axial_n": 11, "bending_n_mm2": 5.6e-4, "linear_density_tex": 10
    });
    with(
        bare(),
        &[
            ("/domain/mesh/blocks", json!([plate])),
            ("/domain/mesh/threads", json!([thread])),
            ("/domain/mesh/conditions", json!([{ "within": [[-9, -9, -1.001], [9, 9, -0.999]], "body": "plate" }])),
            (
                "/effects",
                json!({
                    "contact": {}, "contact_mass": {}, "mass_floor": 1, "fibre_lines": {},
                    "damping": { "rate_per_s": 50_000 }, "gravity_mm_s2": [0, 0, -GRAVITY]
                }),
            ),
            ("/integration", json!({ "energy_tolerance": 100 })),
        ],
    )
}

/// Reaction of the ground, true weight, and weight of all acting mass, N.
fn carried(precision: Precision) -> [f64; 3] {
    let mut simulation = start(&scene(), precision);
    advance(&mut simulation, 1e-3);
    assert!(simulation.health().added_mass[1] > 0.5, "contact added {:?}", simulation.health().added_mass);
    let model = &simulation.model;
    let weight = |mass: &[f64]| GRAVITY * mass.iter().sum::<f64>();
    [-simulation.reactions().iter().map(|force| force[2]).sum::<f64>(), weight(&model.true_mass), weight(&model.mass)]
}

#[test]
fn a_scene_at_rest_weighs_its_true_mass() {
    for precision in [F64, F32] {
        let [carried, weight, with_floor] = carried(precision);
        assert!(with_floor > 1.1 * weight, "the floor adds nothing: {with_floor} {weight}");
        near(&format!("{precision:?}: weight on the ground, N"), carried, weight, 1e-3);
    }
}
