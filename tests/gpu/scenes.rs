//! Scenes in which every stage has work.

use crate::common::{bare, block, charmetant, neo_hookean, with};
use serde_json::{Value, json};

/// Two blocks of different laws that touch, one held and one guided at an end, with a loose thread, gravity and open fibre lines.
pub(super) fn free() -> Value {
    let held = json!({ "within": [[-0.1, -0.1, -0.1], [0.1, 1.1, 1.1]], "displacement_mm": [0.01, 0, 0] });
    let guided = json!({
        "body": "yarn", "within": [[2.9, -0.1, 0.9], [3.1, 1.1, 1.6]], "components": [true, false, false],
        "displacement_mm": [0, 0, 0]
    });
    let thread = json!({
        "name": "thread", "nodes": [[0, 0.5, 1.6], [1, 0.5, 1.6], [2, 0.7, 1.6], [3, 0.5, 1.6]], "radius_mm": 0.1,
        "axial_n": 100, "bending_n_mm2": 0.01, "linear_density_tex": 10, "rest_curvature": 0.5
    });
    with(
        bare(),
        &[
            (
                "/domain/mesh/blocks",
                json!([
                    block("rubber", [19, 2, 1], [[0.0; 3], [3.0, 1.0, 1.0]], 1e-9, neo_hookean(1.0, 0.3)),
                    block("yarn", [5, 2, 1], [[0.0, 0.0, 0.999], [3.0, 1.0, 1.501]], 1e-9, charmetant()),
                ]),
            ),
            ("/domain/mesh/threads", json!([thread])),
            ("/domain/mesh/conditions", json!([held, guided])),
            ("/effects/gravity_mm_s2", json!([0, 0, -9810])),
            ("/effects/fibre_lines", json!({})),
            ("/effects/contact", json!({})),
            ("/steps", json!([{ "move": { "time_s": 1e-4 } }])),
            // bodies start pressed together
            ("/integration", json!({ "energy_tolerance": 100 })),
        ],
    )
}
