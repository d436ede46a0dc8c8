//! Rigid tools: forces by closed forms, Coulomb's law, balances of momentum and energy, and shapes given in two ways.

use crate::common::{advance, bare, below, block, cross, near, neo_hookean, norm, shaped, start, with};
use serde_json::{Value, json};
use std::f64::consts::PI;
use tricot::mesh::solid::{Grid, Triangle, surface};
use tricot::settings::integration::Precision::{self, F32, F64};
use tricot::settings::tool::{Shape, Tool};
use tricot::simulate::Simulation;

/// Gravity, mm/s².
const G: f64 = 9810.0;
/// Penalty of yarn surfaces by default, N/mm³.
const PENALTY: f64 = 65.0;

/// A block of 2 × 1 × 1 mm, its upper face at z = 0, and a tool.
fn scene(stiff: f64, held: Value, tool: Value, steps: Value) -> Value {
    let body = block("block", [4, 2, 2], [[-1.0, -0.5, -1.0], [1.0, 0.5, 0.0]], 1e-9, neo_hookean(stiff, 0.0));
    with(
        bare(),
        &[
            ("/domain/mesh/blocks", json!([body])),
            ("/domain/mesh/conditions", held),
            ("/domain/mesh/tools", json!([tool])),
            ("/effects/contact", json!({ "damping_ratio": 0.1 })),
            ("/effects/contact_mass", json!({})),
            ("/steps", steps),
        ],
    )
}

/// All nodes of the block, or those of its lower face.
fn held(top: f64) -> Value {
    json!([{ "within": [[-1, -0.5, -1], [1, 0.5, top]] }])
}

fn moves(time: f64) -> Value {
    json!([{ "move": { "time_s": time } }])
}

fn run(case: &Value, precision: Precision, until: f64) -> Simulation {
    let mut simulation = start(case, precision);
    advance(&mut simulation, until);
    simulation
}

/// A plate that moves into a rigid block: every node of the upper face, with its share of the sides, is as deep as the plate. The
/// work of the plate is the energy of contact.
#[test]
fn a_plate_presses_with_its_penalty() {
    const DEPTH: f64 = 0.01;
    // half of the upper layer of both sides counts
    let area = 2.0 * (1.0 + 2.0 * 0.25);
    for precision in [F32, F64] {
        let plate =
            json!({ "name": "plate", "shape": "plane", "turned_deg": [180, 0, 0], "displacement_mm": [0, 0, -DEPTH] });
        let case =
            with(scene(100.0, held(0.0), plate, moves(1e-3)), &[("/effects/contact", json!({ "damping_ratio": 0 }))]);
        let s = run(&case, precision, 1e-3);
        let tool = s.tools()[0];
        near("displacement, mm", tool.displacement[2], -DEPTH, 1e-5);
        near("area, mm²", tool.area, area, 1e-6);
        near("force, N", tool.force[2], PENALTY * area * DEPTH, 2e-4);
        below("side force, N", tool.force[0].hypot(tool.force[1]), 1e-6);
        below("moment, N mm", norm(tool.moment), 1e-5);
        let energy = 0.5 * PENALTY * area * DEPTH * DEPTH;
        near("work, mJ", s.energies().prescribed, energy, 1e-3);
        near("energy of contact, mJ", s.energies().contact, energy, 1e-3);
    }
}

/// On a plane tilted by θ, a block slides with g (sin θ − μ cos θ), and stays where μ > tan θ.
#[test]
fn a_block_on_a_tilted_plane_obeys_coulomb() {
    const TILT: f64 = 30.0;
    const TIME: f64 = 0.01;
    let (sin, cos) = TILT.to_radians().sin_cos();
    let body = shaped("block", [2, 2, 2], 1e-7, neo_hookean(100.0, 0.0), |[x, y, z]| {
        let (x, z) = (2.0 * x - 1.0, 2.0 * z);
        [x * cos + z * sin, 2.0 * y - 1.0, -x * sin + z * cos]
    });
    for (precision, friction) in [(F32, 0.0), (F32, 0.2), (F64, 0.2), (F32, 0.7)] {
        let plane = json!({ "name": "plane", "shape": "plane", "turned_deg": [0, TILT, 0], "friction": friction });
        let case = with(
            bare(),
            &[
                ("/domain/mesh/blocks", json!([body])),
                ("/domain/mesh/tools", json!([plane])),
                ("/effects/contact", json!({ "damping_ratio": 0.5 })),
                ("/effects/contact_mass", json!({})),
                ("/effects/gravity_mm_s2", json!([0, 0, -G])),
            ],
        );
        let slid = |s: &Simulation| {
            let moved = s.fluctuations();
            let mean = |k: usize| moved.iter().map(|w| w[k]).sum::<f64>() / moved.len() as f64;
            mean(0) * cos - mean(2) * sin
        };
        let mut s = run(&case, precision, 0.5 * TIME);
        let half = slid(&s);
        advance(&mut s, TIME);
        let expected = 0.5 * G * (sin - friction * cos).max(0.0) * TIME * TIME;
        if expected > 0.0 {
            near(&format!("way with a coefficient of {friction}, mm"), slid(&s), expected, 0.01);
        } else {
            below("creep of a block that sticks, mm", (slid(&s) - half).abs(), 1e-6);
        }
        below("error of the energy balance", s.health().balance.abs(), 2e-3);
        let weight = 8e-7 * G;
        let [x, _, z] = s.tools()[0].force;
        near("force across the plane, N", -(x * sin + z * cos), weight * cos, 0.03);
    }
}

/// A ball hits a free block: momentum and energy stay.
#[test]
fn a_free_tool_and_a_block_keep_momentum_and_energy() {
    let ball = json!({
        "name": "ball", "shape": { "sphere": { "radius_mm": 0.8 } }, "at_mm": [0.1, 0.05, 0.81],
        "free": { "axes": [true, true, true], "mass_g": 1e-3 }, "friction": 0.3
    });
    for precision in [F32, F64] {
        let case = with(
            scene(100.0, json!([]), ball.clone(), json!([{ "hold": { "time_s": 1.0 } }])),
            &[
                ("/domain/mesh/blocks/0/velocity_mm_s", json!([200, 0, 1000])),
                ("/effects/contact", json!({ "damping_ratio": 0 })),
                ("/effects/contact_mass", Value::Null),
                ("/integration", json!({ "dt_s": 1e-7 })),
            ],
        );
        let mut s = start(&case, precision);
        let before = [200.0, 0.0, 1000.0].map(|v| v * 2e-9);
        advance(&mut s, 2e-4);
        let tool = s.tools()[0];
        assert!(tool.velocity[2] > 500.0, "it was not hit: {tool:?}");
        assert_eq!(tool.force, [0.0; 3], "they have parted");
        let mut after = tool.velocity.map(|v| v * 1e-9);
        for (v, m) in s.velocities().iter().zip(&s.model.mass) {
            (0..3).for_each(|k| after[k] += m * v[k]);
        }
        let scale = norm(before);
        for k in 0..3 {
            below("change of momentum over momentum", (after[k] - before[k]).abs() / scale, 1e-5);
        }
        below("error of the energy balance", s.health().balance.abs(), 2e-3);
    }
}

/// A box rests with its weight and the force on it; its loads have done as much work as they came down.
#[test]
fn a_box_rests_with_its_weight_and_its_load() {
    const MASS: f64 = 0.5;
    const LOAD: f64 = 0.02;
    let weight = MASS * 1e-6 * G;
    for precision in [F32, F64] {
        let tool = json!({
            "name": "box", "shape": { "box": { "size_mm": [4, 3, 1], "edge_radius_mm": 0.2 } }, "at_mm": [0, 0, 0.5],
            "free": { "axes": [false, false, true], "mass_g": MASS, "force_n": [0, 0, -LOAD] }
        });
        let case = with(
            scene(10.0, held(-1.0), tool, json!([{ "move": { "time_s": 0.02 } }, { "hold": { "time_s": 0.02 } }])),
            &[("/effects/gravity_mm_s2", json!([0, 0, -G])), ("/effects/damping", json!({ "rate_per_s": 2000 }))],
        );
        let s = run(&case, precision, 0.04);
        let tool = s.tools()[0];
        near("force, N", tool.force[2], weight + LOAD, 2e-3);
        assert_eq!([tool.displacement[0], tool.displacement[1]], [0.0; 2]);
        below("speed at rest, mm/s", tool.velocity[2].abs(), 0.02);
        below("error of the energy balance", s.health().balance.abs(), 5e-3);
    }
}

/// A box as twelve triangles.
fn box_of_triangles(size: [f64; 3]) -> Vec<Triangle> {
    let corner = |i: usize| [0, 1, 2].map(|k| size[k] * (f64::from(u8::from(i >> k & 1 == 1)) - 0.5));
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]].map(|face| face.map(corner))).collect()
}

/// A sphere as triangles: an octahedron whose faces are cut into four, several times.
fn sphere_of_triangles(radius: f64, times: usize) -> Vec<Triangle> {
    let on = |x: [f64; 3]| x.map(|c| c * radius / norm(x));
    let mut all: Vec<Triangle> = Vec::new();
    for signs in 0..8 {
        let [x, y, z] = [0, 1, 2].map(|k| if signs >> k & 1 == 1 { -radius } else { radius });
        let face = [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]];
        all.push(if x * y * z > 0.0 { face } else { [face[0], face[2], face[1]] });
    }
    for _ in 0..times {
        let cut = |[a, b, c]: &Triangle| {
            let between = |p: &[f64; 3], q: &[f64; 3]| on([0, 1, 2].map(|k| p[k] + q[k]));
            let [ab, bc, ca] = [between(a, b), between(b, c), between(c, a)];
            [[*a, ab, ca], [*b, bc, ab], [*c, ca, bc], [ab, bc, ca]]
        };
        all = all.iter().flat_map(cut).collect();
    }
    all
}

/// Force of a tool that moves by `by` into a held block.
fn force(shape: Value, at: [f64; 3], by: f64) -> [f64; 3] {
    let tool = json!({ "name": "tool", "shape": shape, "at_mm": at, "displacement_mm": [0, 0, -by] });
    let s = run(&scene(100.0, held(0.0), tool, moves(1e-3)), F32, 1e-3);
    s.tools()[0].force
}

/// A box of triangles presses as one with sharp edges, a sphere of triangles nearly as a sphere: the more triangles and cells, the
/// nearer.
#[test]
fn shapes_of_triangles_press_as_the_shapes_that_they_are() {
    let size = [1.4, 0.7, 1.0];
    let own = force(json!({ "box": { "size_mm": size, "edge_radius_mm": 0 } }), [0.05, 0.0, 0.505], 0.02);
    let same =
        force(json!({ "mesh": { "triangles_mm": box_of_triangles(size), "cell_mm": 0.05 } }), [0.05, 0.0, 0.505], 0.02);
    near("force of a box, N", same[2], own[2], 1e-4);

    let radius = 2.0;
    let own = force(json!({ "sphere": { "radius_mm": radius } }), [0.0, 0.0, radius], 0.1);
    let mut errors = Vec::new();
    for (times, cell) in [(4, 0.2), (5, 0.1)] {
        let shape = json!({ "mesh": { "triangles_mm": sphere_of_triangles(radius, times), "cell_mm": cell } });
        let same = force(shape, [0.0, 0.0, radius], 0.1);
        errors.push((same[2] - own[2]).abs() / own[2]);
        println!("sphere with cells of {cell} mm: {:.5} N and not {:.5} N", same[2], own[2]);
    }
    below("error with small cells over that with large ones", errors[1] / errors[0], 0.35);
    below("error of a sphere of triangles", errors[1], 0.03);
}

/// Distances on a grid are those of the shape, inside negative.
#[test]
fn a_grid_has_the_distances_of_its_surface() {
    let grid = Grid::new(&box_of_triangles([2.0, 1.0, 3.0]), 0.25, 0.0).unwrap();
    let mut index = 0;
    for z in 0..grid.counts[2] {
        for y in 0..grid.counts[1] {
            for x in 0..grid.counts[0] {
                let place = [x, y, z];
                let at = [0, 1, 2].map(|k| grid.from[k] + grid.cell * place[k] as f64);
                let beyond: [f64; 3] = [0, 1, 2].map(|k| at[k].abs() - [1.0, 0.5, 1.5][k]);
                let outside = norm(beyond.map(|b| b.max(0.0)));
                let exact = if outside > 0.0 { outside } else { beyond.into_iter().fold(f64::NEG_INFINITY, f64::max) };
                // on the surface the sign is that of rounding
                let limited = exact.clamp(-0.75, 0.75);
                assert!(
                    (grid.distances[index] - limited).abs() < 1e-9 || exact.abs() < 1e-9,
                    "{at:?}: {}",
                    grid.distances[index]
                );
                index += 1;
            }
        }
    }
}

/// What pictures show of a tool is a closed surface, at no distance from its shape.
#[test]
fn surfaces_of_tools_are_closed_and_lie_on_their_shapes() {
    let shapes = [
        (Shape::Sphere { radius_mm: 2.0 }, 32.0 / 3.0 * PI),
        (Shape::Cylinder { radius_mm: 1.0, length_mm: 3.0 }, 13.0 / 3.0 * PI),
        (Shape::Box { size_mm: [2.0, 3.0, 4.0], edge_radius_mm: 0.0 }, 24.0),
    ];
    for (shape, volume) in shapes {
        let tool = Tool { turned_deg: [10.0, -20.0, 30.0], ..Tool::held("tool", shape, [1.0, 2.0, 3.0]) };
        let triangles = surface(&tool, 0.0);
        let own: f64 =
            triangles.iter().map(|[a, b, c]| cross(*a, *b).iter().zip(c).map(|(n, x)| n * x).sum::<f64>() / 6.0).sum();
        near("volume, mm³", own, volume, 0.02);
    }
}

/// Surfaces that bound no body are refused with what is wrong.
#[test]
fn surfaces_that_are_open_or_inside_out_are_refused() {
    let whole = box_of_triangles([1.0; 3]);
    let wrong = |triangles: &[Triangle]| Grid::new(triangles, 0.1, 0.0).unwrap_err();
    assert!(wrong(&whole[1..]).contains("is open"), "{}", wrong(&whole[1..]));
    let turned: Vec<Triangle> = whole.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
    assert!(wrong(&turned).contains("inside out"), "{}", wrong(&turned));
    let mut mixed = whole.clone();
    mixed[3].swap(0, 1);
    assert!(wrong(&mixed).contains("same direction"), "{}", wrong(&mixed));
    assert!(Grid::new(&whole, 1e-3, 0.0).unwrap_err().contains("make cell_mm larger"));
}
