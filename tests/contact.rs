//! Contact: collisions, Hertz, a patch of uniform pressure, an edge, and the search against brute force.

mod common;

use common::{
    Random, advance, bare, below, block, cross, loaded, momenta, near, neo_hookean, norm, positions, shaped, start,
    with,
};
use serde_json::{Value, json};
use std::f64::consts::PI;
use tricot::case::steps::Precision::{self, F32, F64};
use tricot::contact::{EMPTY, face, found};
use tricot::mesh::Mesh;
use tricot::mesh::surface::Surface;
use tricot::simulate::Simulation;

fn scene(blocks: Value, contact: Value) -> Value {
    with(bare(), &[("/domain/mesh/blocks", blocks), ("/effects/contact", contact)])
}

fn field(simulation: &Simulation, name: &str) -> Vec<f64> {
    simulation.frame().node_fields.into_iter().find(|f| f.name == name).unwrap().values
}

/// Two blocks that meet askew, before and after.
fn collide(friction: f64, precision: Precision, dt: f64) -> [Simulation; 2] {
    let mut low = block("low", [5, 4, 3], [[0.0, 0.0, 0.0], [2.5, 2.0, 1.0]], 1e-9, neo_hookean(200.0, 0.3));
    let mut high = block("high", [4, 5, 2], [[0.6, -0.7, 1.02], [2.4, 1.5, 1.9]], 1e-9, neo_hookean(300.0, 0.2));
    low["velocity_mm_s"] = json!([0, 0, 1500]);
    high["velocity_mm_s"] = json!([700, 300, -1000]);
    let case = with(
        scene(json!([low, high]), json!({ "yarn_penalty_n_mm3": 1000 })),
        &[("/domain/mesh/friction", json!(friction)), ("/integration", json!({ "dt_s": dt, "energy_tolerance": 100 }))],
    );
    let before = start(&case, precision);
    let mut after = start(&case, precision);
    advance(&mut after, 1e-4);
    [before, after]
}

#[test]
fn a_collision_keeps_momentum_and_balances_energy() {
    for (friction, precision, linear_allowed, angular_allowed) in
        [(0.0, F64, 1e-13, 1e-6), (0.3, F64, 1e-13, 1e-4), (0.3, F32, 1e-5, 1e-4)]
    {
        let [before, after] = collide(friction, precision, 5e-8);
        let ((p0, l0), (p1, l1)) = (momenta(&before), momenta(&after));
        // over what each block carries alone
        let mass: Vec<f64> = before.model.mass.clone();
        let carried: f64 = before.velocities().iter().zip(&mass).map(|(v, m)| m * norm(*v)).sum();
        let apart = |a: [f64; 3], b: [f64; 3]| norm([0, 1, 2].map(|k| a[k] - b[k])) / carried;
        let name = format!("μ {friction}, {precision:?}");
        below(&format!("{name}: change of linear momentum over the momentum of each"), apart(p0, p1), linear_allowed);
        below(&format!("{name}: change of angular momentum over that times 1 mm"), apart(l0, l1), angular_allowed);
        let e = after.energies();
        println!(
            "{name}: kinetic now {:.4e}, strain {:.4e}, friction {:.2e}, contact damping {:.2e} mJ",
            e.kinetic,
            e.internal(),
            e.friction,
            e.contact_damping
        );
        assert!(e.contact_damping > 0.0 && e.contact == 0.0, "the blocks did not meet and part");
        assert!((e.friction > 0.0) == (friction > 0.0));
        // kinetic energy is that of half a step earlier: the error falls with the step
        let half = collide(friction, precision, 2.5e-8)[1].health().balance.abs();
        let error = after.health().balance.abs();
        println!("{name}: error of the energy balance {error:.1e}, with half the step {half:.1e}");
        assert!(half < 0.6 * error && error < 5e-3, "energy balance {error:e}, with half the step {half:e}");
    }
}

/// A half cylinder of radius 1 (of a rigid core of 0.5) pressed on a rigid plane: force per length, pressure and place of the
/// nodes that touch.
fn hertz(elements: [usize; 2], sink: f64) -> (f64, Vec<[f64; 2]>) {
    let width = 0.05;
    // angles dense around the lowest point, layers dense at the surface
    let cylinder = shaped("cylinder", [1, elements[0], elements[1]], 1e-9, neo_hookean(1000.0, 0.3), |t| {
        let u = 2.0 * t[1] - 1.0;
        let angle = 1.5 * PI + 0.5 * PI * (0.08 * u + 0.92 * u.powi(3));
        let radius = 1.0 - 0.5 * ((1.0 - t[2]) * (0.08 + 0.92 * (1.0 - t[2]).powi(2)));
        [radius * angle.cos(), width * t[0], 1.0 + radius * angle.sin()]
    });
    let plane = block("plane", [1, 1, 1], [[-2.0, -1.0, -1.0], [2.0, 1.0, 0.0]], 1e-9, neo_hookean(1000.0, 0.3));
    let (cylinder, core) = core_conditions(cylinder, width, sink);
    let case = with(
        scene(json!([plane, cylinder]), json!({ "yarn_penalty_n_mm3": 2e5, "skin_mm": 0.02 })),
        &[
            ("/domain/mesh/conditions", core),
            ("/effects/damping", json!({ "rate_per_s": 1e6 })),
            ("/steps", json!([{ "move": { "time_s": 1.5e-5 } }, { "hold": { "time_s": 1e-5 } }])),
            ("/integration", json!({ "dt_max_s": 1e-8, "energy_tolerance": 100 })),
        ],
    );
    let mut simulation = start(&case, F64);
    advance(&mut simulation, 2.5e-5);
    println!("{} steps", simulation.step());
    let ratio = simulation.energies().kinetic / simulation.energies().internal();
    assert!(ratio < 1e-4, "not at rest: {ratio:e}");
    let (force, at) = (field(&simulation, "contact_force_n"), positions(&simulation));
    let total = force.iter().sum::<f64>() / width;
    let pressure = field(&simulation, "contact_pressure_mpa");
    let touching = (0..at.len()).filter(|n| pressure[*n] > 0.0 && at[*n][1] < 1e-6).map(|n| [at[n][0], pressure[n]]);
    (total, touching.collect())
}

/// Plane strain for all, a rigid core that sinks, a rigid plane.
fn core_conditions(cylinder: Value, width: f64, sink: f64) -> (Value, Value) {
    let nodes: Vec<[f64; 3]> = serde_json::from_value(cylinder["nodes"].clone()).unwrap();
    let mut conditions = vec![
        json!({ "within": [[-9, -9, -9], [9, 9, 9]], "body": "plane" }),
        json!({ "within": [[-9, 0, -9], [9, width, 9]], "body": "cylinder", "components": [false, true, false] }),
    ];
    for x in nodes.iter().filter(|x| (x[0].hypot(x[2] - 1.0) - 0.5).abs() < 1e-9) {
        conditions.push(json!({ "within": [x, x], "body": "cylinder", "displacement_mm": [0, 0, -sink] }));
    }
    (cylinder, json!(conditions))
}

#[test]
fn a_cylinder_on_a_plane_follows_hertz() {
    let modulus = 1000.0 / (1.0 - 0.09);
    let hertz_of = |p: f64| ((4.0 * p / (PI * modulus)).sqrt(), (p * modulus / PI).sqrt());
    let (b, p0) = hertz_of(1.0);
    near("half width under 1 N/mm, mm", b, 0.034039, 1e-4);
    near("largest pressure under 1 N/mm, MPa", p0, 18.703, 1e-4);
    let (force, touching) = hertz([48, 14], 0.0045);
    let (b, p0) = hertz_of(force);
    let got = touching.iter().map(|t| t[1]).fold(0.0, f64::max);
    let reach = touching.iter().map(|t| t[0].abs()).fold(0.0, f64::max);
    println!("force {force:.4} N/mm, {} nodes across the contact", touching.len());
    let mut worst = 0.0f64;
    for [x, p] in &touching {
        let expected = p0 * (1.0 - (x / b).powi(2)).max(0.0).sqrt();
        println!("x {x:+.4} mm: pressure {p:.3}, Hertz {expected:.3} MPa");
        worst = worst.max((p - expected).abs() / p0);
    }
    near("largest pressure, MPa", got, p0, 0.05);
    near("half width, mm", reach, b, 0.15);
    below("largest error of the pressure over p0", worst, 0.3);
}

#[test]
fn pressure_through_meshes_that_do_not_match() {
    let (young, sink, penalty) = (100.0, 0.02, 2000.0);
    // 5 × 5 nodes of the ground, 0.8 mm apart, face a block of 7 × 7 elements; both surfaces push
    let ground = block("ground", [10, 10, 1], [[-2.0, -2.0, -1.0], [6.0, 6.0, 0.0]], 1e-9, neo_hookean(young, 0.0));
    let pressed = block("pressed", [7, 7, 4], [[0.0, 0.0, 0.0], [4.0, 4.0, 1.0]], 1e-9, neo_hookean(young, 0.0));
    let case = with(
        scene(json!([ground, pressed]), json!({ "yarn_penalty_n_mm3": penalty })),
        &[
            (
                "/domain/mesh/conditions",
                json!([
                    { "within": [[-9, -9, -9], [9, 9, 9]], "body": "ground" },
                    { "within": [[0, 0, 1], [4, 4, 1]], "body": "pressed", "displacement_mm": [0, 0, -sink] }
                ]),
            ),
            ("/effects/damping", json!({ "rate_per_s": 1e5 })),
            ("/steps", json!([{ "move": { "time_s": 1e-4 } }, { "hold": { "time_s": 2e-4 } }])),
            ("/integration", json!({ "dt_max_s": 1e-7 })),
        ],
    );
    let mut simulation = start(&case, F64);
    advance(&mut simulation, 3e-4);
    let kinetic = simulation.energies().kinetic / simulation.energies().internal();
    assert!(kinetic < 1e-6, "not at rest: {kinetic:e}");
    let force: f64 = simulation.reactions().iter().map(|f| f[2].max(0.0)).sum();
    // the block in series with the two penalties, which are side by side
    let mut mean = 0.0;
    for _ in 0..50 {
        let stretch = 1.0 - sink + mean / (2.0 * penalty);
        mean = 0.5 * young * (1.0 / stretch - stretch);
    }
    near("mean pressure, MPa", force / 16.0, mean, 0.01);
    let fields = simulation.frame().hex_fields;
    let first = simulation.mesh.blocks[0].hexes();
    let pressures: Vec<f64> = (first..simulation.mesh.hexes())
        .map(|h| (2.0 * young * fields[..4].iter().map(|f| f.values[h]).sum::<f64>()).sqrt())
        .collect();
    for (layer, pressures) in pressures.chunks_exact(49).enumerate() {
        let spread = pressures.iter().map(|p| (p / mean - 1.0).abs()).fold(0.0, f64::max);
        println!("layer {layer} above the contact: pressure within {:.1} % of the mean", 100.0 * spread);
        assert!(spread < 0.1, "pressure off by {spread}");
    }
}

/// From the closest point of a bilinear face to a point, by sampling and shrinking.
fn offset(corners: &[[f64; 3]; 4], point: [f64; 3]) -> [f64; 3] {
    let at = |s: f64, t: f64| {
        let w = [(1.0 - s) * (1.0 - t), s * (1.0 - t), s * t, (1.0 - s) * t];
        [0, 1, 2].map(|k| point[k] - (0..4).map(|a| w[a] * corners[a][k]).sum::<f64>())
    };
    let (mut s, mut t, mut step, mut best) = (0.5, 0.5, 0.5, at(0.5, 0.5));
    for _ in 0..40 {
        let (from_s, from_t) = (s, t);
        for i in -4..=4 {
            for j in -4..=4 {
                let here = [from_s + f64::from(i) * 0.25 * step, from_t + f64::from(j) * 0.25 * step];
                let here = here.map(|x: f64| x.clamp(0.0, 1.0));
                let d = at(here[0], here[1]);
                if norm(d) < norm(best) {
                    (best, s, t) = (d, here[0], here[1]);
                }
            }
        }
        step *= 0.6;
    }
    best
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| a[k] - b[k])
}

/// What all faces within a radius do to a point outside: every one that it is not right behind pushes by how deep it lies, away
/// from its closest point. The sum of the depths, and the vector, mm.
fn push(faces: &[[[f64; 3]; 4]], point: [f64; 3], radius: f64) -> (f64, [f64; 3]) {
    let (mut depths, mut sum) = (0.0, [0.0; 3]);
    for face in faces {
        let away = offset(face, point);
        let normal = cross(sub(face[2], face[0]), sub(face[3], face[1]));
        let behind = -away.iter().zip(normal).map(|(a, n)| a * n).sum::<f64>() / norm(normal);
        let depth = if behind > (1.0 - 1e-9) * norm(away) { 0.0 } else { (radius - norm(away)).max(0.0) };
        depths += depth;
        sum = [0, 1, 2].map(|k| sum[k] + depth * away[k] / norm(away));
    }
    (depths, sum)
}

/// Faces of the first block with its nodes at places.
fn faces(mesh: &Mesh, places: &[[f64; 3]]) -> Vec<[[f64; 3]; 4]> {
    let surface = Surface::new(&mesh.blocks[0]);
    (0..surface.ring())
        .flat_map(|r| (0..mesh.blocks[0].slices).map(move |s| (r, s)))
        .map(|(r, s)| surface.face(r, s).map(|n| places[n.node]))
        .collect()
}

/// Moves a thread past a slab that is held, from out of reach to out of reach or from on it, and compares the force on its first
/// node with what all faces within reach do to it. At some places the node must be `beyond` the faces.
fn pass(what: &str, slab: Value, nodes: [[f64; 3]; 2], moved: [f64; 3], beyond: fn([f64; 3]) -> bool) {
    let (radius, penalty) = (0.2, 50.0);
    let thread =
        json!({ "name": "thread", "nodes": nodes, "radius_mm": radius, "axial_n": 1, "linear_density_tex": 10 });
    let case = with(
        scene(json!([slab]), json!({ "thread_penalty_n_mm2": penalty, "damping_ratio": 0, "skin_mm": 1.5 })),
        &[
            ("/domain/mesh/threads", json!([thread])),
            (
                "/domain/mesh/conditions",
                json!([
                    { "within": [[-9, -9, -9], [9, 9, 9]], "body": "slab" },
                    { "within": [[-9, -9, -9], [9, 9, 9]], "body": "thread", "displacement_mm": moved }
                ]),
            ),
            ("/steps", json!([{ "move": { "time_s": 1e-3 } }])),
            ("/integration", json!({ "dt_s": 1e-7, "energy_tolerance": 100 })),
        ],
    );
    let stiffness = penalty * 0.5 * (nodes[1][0] - nodes[0][0]);
    for (precision, allowed) in [(F64, 1e-6), (F32, 1e-4)] {
        let mut simulation = start(&case, precision);
        let (mut worst, mut places, mut last) = (0.0f64, 0, None);
        simulation
            .advance(1e-3, |s| {
                let first = s.mesh.first_thread_node();
                let (x, v) = (positions(s)[first], s.velocities()[first]);
                // the reaction belongs to the position before the last step
                let x = [0, 1, 2].map(|k| x[k] - v[k] * s.dt());
                let (depths, vector) = push(&faces(&s.mesh, &s.mesh.nodes), x, radius);
                let got = s.reactions()[s.reactions().len() - 2];
                worst = worst.max(norm([0, 1, 2].map(|k| got[k] - stiffness * vector[k])));
                places += usize::from(beyond(x) && depths > 0.0);
                last = Some(depths);
                false
            })
            .unwrap();
        assert!(places > 5 && last == Some(0.0), "{what} was not passed: {places}, {last:?}");
        let name = format!(
            "{precision:?}: force at {what} ({places} places) against all faces within reach, over that of 0.05 mm"
        );
        below(&name, worst / (stiffness * 0.05), allowed);
    }
}

#[test]
fn a_thread_passes_an_edge_smoothly() {
    let slab = block("slab", [4, 4, 1], [[-1.0, -1.0, -0.5], [1.0, 1.0, 0.0]], 1e-9, neo_hookean(1000.0, 0.3));
    let nodes = [[-0.3, 0.2, 0.15], [0.37, 0.2, 0.15]];
    pass("the edge", slab, nodes, [0.0, 1.3, -0.02], |x| x[1] > 1.0);
}

/// The lower side of a thin edge is within reach as well, but the thread is not inside.
#[test]
fn a_thread_passes_a_thin_edge_smoothly() {
    let slab = block("slab", [4, 3, 1], [[-1.0, -1.0, -0.04], [1.0, 1.0, 0.0]], 1e-9, neo_hookean(1000.0, 0.3));
    let nodes = [[-0.3, 0.6, 0.15], [0.37, 0.6, 0.15]];
    pass("the thin edge", slab, nodes, [0.0, 0.9, -0.02], |x| x[1] > 1.0);
}

/// In front of an open end both sides of a thin rim are within reach.
#[test]
fn a_thread_passes_a_thin_end_smoothly() {
    let slab = block("slab", [4, 4, 1], [[-1.0, -1.0, -0.05], [1.0, 1.0, 0.05]], 1e-9, neo_hookean(1000.0, 0.3));
    let nodes = [[1.12, 0.1, 0.3], [1.79, 0.1, 0.3]];
    pass("the thin end", slab, nodes, [0.0, 0.05, -0.6], |x| x[2].abs() < 0.05);
}

/// In front of a valley either side is where a walk over the surface may end; the ridge beyond it is nearer.
#[test]
fn a_thread_passes_a_ridge_behind_a_valley_smoothly() {
    let slab = shaped("slab", [4, 8, 1], 1e-9, neo_hookean(1000.0, 0.3), |t| {
        let across = 2.0 * t[1] - 1.0;
        [2.0 * t[0] - 1.0, across, t[2] * (1.0 - (across.abs() - 0.5).abs()) - 0.5]
    });
    let nodes = [[-0.3, -0.1, 0.62], [0.37, -0.1, 0.62]];
    pass("the ridge", slab, nodes, [0.0, 1.1, 0.0], |x| x[1] > 0.3);
}

/// Nodes of surfaces and of threads all around a warped face: inside, over its border and behind it.
#[test]
fn a_face_pushes_along_the_gradient_of_the_distance() {
    let face = [[-0.5, -0.3, 0.0], [0.5, -0.35, 0.05], [0.55, 0.3, -0.04], [-0.45, 0.35, 0.03]];
    let seen = |point: [f64; 3], is_thread| {
        let closest = face::closest(&face.map(|corner: [f64; 3]| [0, 1, 2].map(|k| corner[k] - point[k])));
        Some((closest.normal_and_distance(is_thread)?, closest.interior))
    };
    let (mut worst, mut behind_border) = (0.0f64, 0);
    for (i, j, k) in (0..21).flat_map(|i| (0..17).flat_map(move |j| (0..12).map(move |k| (i, j, k)))) {
        let point = [-0.8 + 0.08 * f64::from(i), -0.6 + 0.075 * f64::from(j), -0.31 + 0.055 * f64::from(k)];
        for is_thread in [false, true] {
            let Some(((direction, distance), interior)) = seen(point, is_thread) else { continue };
            for axis in 0..3 {
                let step = 1e-5;
                let moved = |by: f64| seen([0, 1, 2].map(|k| point[k] + if k == axis { by } else { 0.0 }), is_thread);
                // next to a border that is seen from one side only there is no derivative
                let (Some((ahead, a)), Some((back, b))) = (moved(step), moved(-step)) else { continue };
                if a != interior || b != interior || (ahead.1 - back.1).abs() > 3.0 * step {
                    continue;
                }
                worst = worst.max(((ahead.1 - back.1) / (2.0 * step) - direction[axis]).abs());
                behind_border += usize::from(!interior && distance < 0.0);
            }
        }
    }
    assert!(behind_border > 300, "{behind_border}");
    below("direction of contact against the gradient of the distance by finite differences", worst, 1e-4);
}

/// Yarns are open at their ends: what slides in there is inside without having passed a side, and no side pushes it out.
#[test]
fn what_enters_through_an_open_end_is_not_pushed_out() {
    let yarn = block("yarn", [8, 2, 1], [[0.0, 0.0, 0.0], [2.0, 1.0, 0.4]], 1e-9, neo_hookean(10.0, 0.3));
    let slider = block("slider", [4, 2, 1], [[-1.2, 0.2, 0.32], [-0.2, 0.8, 0.72]], 1e-9, neo_hookean(10.0, 0.3));
    let thread = |z: f64| {
        json!({ "name": "slider", "nodes": [[-1.2, 0.3, z], [-0.7, 0.3, z], [-0.2, 0.3, z]],
                "radius_mm": 0.05, "axial_n": 1, "linear_density_tex": 10 })
    };
    // the higher thread touches the rim as it passes
    let [deep, high] = [thread(0.2), thread(0.37)];
    let whole =
        |body: &str, x: f64| json!({ "within": [[-9, -9, -9], [9, 9, 9]], "body": body, "displacement_mm": [x, 0, 0] });
    for (blocks, threads) in
        [(json!([yarn, slider]), json!([])), (json!([yarn]), json!([deep])), (json!([yarn]), json!([high]))]
    {
        let case = with(
            scene(blocks, json!({})),
            &[
                ("/domain/mesh/threads", threads),
                ("/domain/mesh/conditions", json!([whole("yarn", 0.0), whole("slider", 0.75)])),
                ("/steps", json!([{ "move": { "time_s": 2e-4 } }])),
                ("/integration", json!({ "dt_max_s": 2e-7 })),
            ],
        );
        let mut simulation = start(&case, F64);
        advance(&mut simulation, 2e-4);
        let furthest = positions(&simulation).iter().map(|x| x[0]).fold(f64::NEG_INFINITY, f64::max);
        assert!(furthest == 2.0 && simulation.health().touching == [0; 3], "{:?}", simulation.health());
        assert_eq!(simulation.energies().contact, 0.0);
        assert!(field(&simulation, "contact_force_n").iter().all(|f| *f == 0.0));
    }
}

#[test]
fn the_search_finds_what_brute_force_finds() {
    let (radius, penalty) = (0.12, 100.0);
    // a yarn whose flat section bulges and that winds along its length
    let yarn = shaped("yarn", [12, 10, 2], 1e-9, neo_hookean(1000.0, 0.3), |t| {
        let across = 2.0 * t[1] - 1.0;
        let half = 0.25 * (1.1 - across * across).max(0.2).sqrt();
        [6.0 * t[0], 2.0 * across, half * (2.0 * t[2] - 1.0)]
    });
    let winding = |x: &[f64; 3]| {
        let phase = x[0] * 1.1;
        [
            0.1 * (2.0 * x[1]).sin(),
            0.3 * phase.sin() + 0.2 * x[2],
            0.25 * (phase + 0.5 * x[1]).cos() + 0.05 * (5.0 * x[1]).sin(),
        ]
    };
    let mesh = tricot::fabric::build(&loaded(&scene(json!([yarn]), Value::Null)).case, None).unwrap();
    let now: Vec<[f64; 3]> = mesh
        .nodes
        .iter()
        .map(|x| {
            let w = winding(x);
            [0, 1, 2].map(|k| x[k] + w[k])
        })
        .collect();
    let faces = faces(&mesh, &now);
    // points over the faces, on their outer side
    let mut random = Random(17);
    let mut points = vec![];
    while points.len() < 400 {
        let f = &faces[((random.draw() + 1.0) * 0.5 * faces.len() as f64) as usize % faces.len()];
        let (s, t, high) = (0.5 + 0.5 * random.draw(), 0.5 + 0.5 * random.draw(), 0.1 + 0.1 * random.draw());
        let w = [(1.0 - s) * (1.0 - t), s * (1.0 - t), s * t, (1.0 - s) * t];
        let on: [f64; 3] = [0, 1, 2].map(|k| (0..4).map(|a| w[a] * f[a][k]).sum());
        let normal = cross(sub(f[2], f[0]), sub(f[3], f[1]));
        points.push([0, 1, 2].map(|k| on[k] + high * normal[k] / norm(normal)));
    }
    let threads: Vec<Value> = points
        .chunks_exact(2)
        .enumerate()
        .map(|(i, ends)| {
            json!({ "name": format!("t{i}"), "nodes": ends, "radius_mm": radius, "axial_n": 1, "linear_density_tex": 10 })
        })
        .collect();
    let case = with(
        scene(json!([yarn]), json!({ "thread_penalty_n_mm2": penalty, "thread_thread": false, "damping_ratio": 0 })),
        &[
            ("/domain/mesh/threads", json!(threads)),
            ("/domain/mesh/conditions", json!([{ "within": [[-9, -9, -9], [9, 9, 9]] }])),
            ("/integration", json!({ "dt_s": 1e-8, "energy_tolerance": 100, "penetration_tolerance": 100 })),
        ],
    );
    for (precision, allowed) in [(F64, 1e-6), (F32, 1e-5)] {
        let mut simulation = start(&case, precision);
        let mut moved = vec![[0.0; 3]; simulation.mesh.nodes.len()];
        for (moved, x) in moved.iter_mut().zip(&mesh.nodes) {
            *moved = winding(x);
        }
        simulation.set_fluctuations(&moved);
        advance(&mut simulation, 0.5e-8);
        let force = field(&simulation, "contact_force_n");
        let first = simulation.mesh.first_thread_node();
        let (mut worst, mut touching, mut missed) = (0.0f64, 0, 0);
        for (i, point) in points.iter().enumerate() {
            let ends = &points[i / 2 * 2..][..2];
            let length = norm([0, 1, 2].map(|k| ends[1][k] - ends[0][k]));
            let (expected, _) = push(&faces, *point, radius);
            let got = force[first + i] / (penalty * 0.5 * length);
            touching += usize::from(expected > 0.0);
            if (got - expected).abs() > allowed {
                println!("point {i} at {point:.3?}: depths {expected:.6}, contact found {got:.6}");
                missed += 1;
            }
            worst = worst.max((got - expected).abs());
        }
        assert!(touching > 100, "{touching} points touch");
        println!("{missed} of {touching} touching points differ");
        below(&format!("{precision:?}: depths of 400 points ({touching} touch) in 288 faces, mm"), worst, allowed);
    }
}

/// A slab and two threads that nothing but conditions moves: the slab, the first and the second by displacements, mm.
fn moved_apart(displacements: [[f64; 3]; 3], high: f64, precision: Precision) -> Simulation {
    let slab = block("slab", [16, 4, 1], [[-4.0, -1.0, -0.5], [4.0, 1.0, 0.0]], 1e-9, neo_hookean(1000.0, 0.3));
    let thread = |name: &str, x: f64| {
        // over the middles of faces
        let nodes = [[x, 0.25, high], [x + 0.5, 0.25, high]];
        json!({ "name": name, "nodes": nodes, "radius_mm": 0.2, "axial_n": 1, "linear_density_tex": 10 })
    };
    let everywhere = [[-9, -9, -9], [9, 9, 9]];
    let conditions = ["slab", "first", "second"]
        .map(|body| json!({ "within": everywhere, "body": body }))
        .into_iter()
        .zip(displacements)
        .map(|(condition, by)| with(condition, &[("/displacement_mm", json!(by))]));
    let case = with(
        scene(json!([slab]), json!({ "thread_penalty_n_mm2": 50, "damping_ratio": 0, "skin_mm": 0.1 })),
        &[
            ("/domain/mesh/threads", json!([thread("first", -2.75), thread("second", 0.25)])),
            ("/domain/mesh/conditions", json!(conditions.collect::<Vec<_>>())),
            ("/steps", json!([{ "move": { "time_s": 1e-3 } }])),
            ("/integration", json!({ "dt_s": 2e-7, "energy_tolerance": 100 })),
        ],
    );
    start(&case, precision)
}

#[test]
fn contact_is_searched_again_only_where_bodies_move_relative_to_each_other() {
    // whether nodes of the first and of the second thread were searched again since the last search of everything
    let again = |simulation: &Simulation| {
        let when = simulation.backend().uints(simulation.model.buffers.found[0].unwrap());
        assert!(when.len() == 4 && when.iter().all(|when| *when != found::NEVER));
        [&when[..2], &when[2..]].map(|thread| thread.contains(&found::SINCE))
    };
    let ever_again = |simulation: &mut Simulation| {
        let [mut first, mut second] = again(simulation);
        for part in 1..=100 {
            advance(simulation, 1e-5 * f64::from(part));
            let [now_first, now_second] = again(simulation);
            (first, second) = (first || now_first, second || now_second);
        }
        [first, second]
    };
    let force = |simulation: &Simulation| {
        let first = simulation.mesh.first_thread_node();
        field(simulation, "contact_force_n")[first..].to_vec()
    };
    for (precision, allowed) in [(F64, 3e-6), (F32, 1e-4)] {
        // the second thread slides over the slab, the first one lies on it
        let mut simulation = moved_apart([[0.0; 3], [0.0; 3], [2.0, 0.0, 0.0]], 0.15, precision);
        advance(&mut simulation, 1e-6);
        assert_eq!(again(&simulation), [false; 2], "the first search is one of everything");
        let before = force(&simulation);
        assert_eq!(ever_again(&mut simulation), [false, true], "{precision:?}, {} looks", simulation.searches());
        // carried along together, neither is
        let mut carried = moved_apart([[2.0, 0.0, 0.0]; 3], 0.15, precision);
        advance(&mut carried, 1e-6);
        assert_eq!(ever_again(&mut carried), [false; 2], "{precision:?}");
        assert!(simulation.searches() > 50 && carried.searches() > 50);
        let after = force(&simulation);
        assert_eq!(before[..2], after[..2], "the thread that lies still");
        let expected = 50.0 * 0.25 * 0.05;
        after.iter().for_each(|force| near("force on a thread, N", *force, expected, allowed));
        // the slab comes up to both, from out of reach
        let mut simulation = moved_apart([[0.0, 0.0, 0.3], [0.0; 3], [0.0; 3]], 0.4, precision);
        advance(&mut simulation, 1e-6);
        assert!(force(&simulation).iter().all(|force| *force == 0.0));
        advance(&mut simulation, 1e-3);
        force(&simulation).iter().for_each(|force| near("force on a thread, N", *force, 2.0 * expected, allowed));
    }
}

/// Nodes of a yarn before the cut end of another one, below the plane of its upper side, are not in it.
#[test]
fn what_is_before_a_cut_end_is_not_behind_its_sides() {
    let yarn = block("yarn", [8, 2, 1], [[0.0, 0.0, 0.0], [2.0, 1.0, 0.4]], 1e-9, neo_hookean(10.0, 0.3));
    let other = block("other", [2, 2, 1], [[-0.53, 0.2, 0.3], [-0.03, 0.8, 0.7]], 1e-9, neo_hookean(10.0, 0.3));
    let case = with(
        scene(json!([yarn, other]), json!({ "skin_mm": 0.12 })),
        &[("/steps", json!([{ "hold": { "time_s": 1e-5 } }])), ("/integration", json!({ "dt_s": 1e-7 }))],
    );
    for precision in [F64, F32] {
        let mut simulation = start(&case, precision);
        advance(&mut simulation, 1e-5);
        let keys = simulation.backend().uints(simulation.model.buffers.contact_keys.unwrap());
        assert!(keys.iter().all(|key| *key == EMPTY), "{precision:?}: {:?}", &keys[..12]);
    }
}
