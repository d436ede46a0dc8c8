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

/// The same scene with tools of every shape, which press on its yarns and its thread.
pub(super) fn tools() -> Value {
    let corner = |i: usize| [0, 1, 2].map(|k| 0.3 * (f64::from(u8::from(i >> k & 1 == 1)) - 0.5) * 2.0);
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles: Vec<_> =
        faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]].map(|face| face.map(corner))).collect();
    let tools = json!([
        { "name": "plate", "shape": "plane", "at_mm": [0, 0, 0.005], "displacement_mm": [0.05, 0, 0.01], "friction": 0.3 },
        { "name": "ball", "shape": { "sphere": { "radius_mm": 0.5 } }, "at_mm": [2, 0.65, 2.16], "displacement_mm": [0.02, 0, -0.05],
          "friction": { "yarn": 0.1, "thread": 0.4 } },
        { "name": "cube", "shape": { "mesh": { "triangles_mm": triangles, "cell_mm": 0.07 } }, "at_mm": [1, 0.5, 1.985],
          "turned_deg": [5, 3, 20] },
        { "name": "box", "shape": { "box": { "size_mm": [0.8, 0.62, 0.7], "edge_radius_mm": 0.1 } },
          "at_mm": [1.5, 1.3, 1.25], "friction": 0.2,
          "free": { "axes": [false, true, true], "mass_g": 1e-3, "force_n": [0, -0.1, 0] } }
    ]);
    with(free(), &[("/domain/mesh/tools", tools)])
}
