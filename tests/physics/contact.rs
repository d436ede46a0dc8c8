//! Contact: collisions, Hertz, a patch of uniform pressure, an edge, and the search against brute force.

use crate::common::{
    Random, advance, bare, below, block, cross, loaded, momenta, near, neo_hookean, norm, positions, shaped, start,
    with,
};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::f64::consts::PI;
use tricot::contact::{arc, found};
use tricot::mesh::Mesh;
use tricot::mesh::surface::Surface;
use tricot::settings::integration::Precision::{self, F32, F64};
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
    let first = simulation.mesh().blocks[0].hexes();
    let pressures: Vec<f64> = (first..simulation.mesh().hexes())
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

/// From the closest point of an edge to a point.
fn from_edge([a, b]: [[f64; 3]; 2], point: [f64; 3]) -> [f64; 3] {
    let (along, to) = (sub(b, a), sub(point, a));
    let dot = |x: [f64; 3], y: [f64; 3]| (0..3).map(|k| x[k] * y[k]).sum::<f64>();
    let share = (dot(along, to) / dot(along, along)).clamp(0.0, 1.0);
    [0, 1, 2].map(|k| to[k] - share * along[k])
}

/// What the closed surface of the first block does to a point outside, for each unit of penalty: faces less edges plus corners, each
/// by how deep the point lies in its radius, away from where it is closest, mm.
fn push(mesh: &Mesh, places: &[[f64; 3]], point: [f64; 3], radius: f64) -> [f64; 3] {
    let faces = Surface::new(&mesh.blocks[0]).closed();
    let mut sum = [0.0; 3];
    let mut add = |sign: f64, away: [f64; 3]| {
        let depth = (radius - norm(away)).max(0.0);
        sum = [0, 1, 2].map(|k| sum[k] + sign * depth * away[k] / norm(away));
    };
    let (mut edges, mut corners) = (BTreeSet::new(), BTreeSet::new());
    for face in &faces {
        let nodes = face.map(|seen| seen.node);
        add(1.0, offset(&nodes.map(|node| places[node]), point));
        edges.extend((0..4).map(|a| [nodes[a].min(nodes[(a + 1) % 4]), nodes[a].max(nodes[(a + 1) % 4])]));
        corners.extend(nodes);
    }
    edges.into_iter().for_each(|ends: [usize; 2]| add(-1.0, from_edge(ends.map(|node| places[node]), point)));
    corners.into_iter().for_each(|node: usize| add(1.0, sub(point, places[node])));
    sum
}

/// Moves a thread past a slab that is held, from out of reach to out of reach or from on it, and compares the force on its first
/// node with what the whole surface does to the points of its beam. At some places the node must be `beyond` the faces.
fn pass(what: &str, slab: Value, nodes: [[f64; 3]; 2], moved: [f64; 3], beyond: fn([f64; 3]) -> bool) {
    let (radius, penalty) = (0.2, 50.0);
    let thread =
        json!({ "name": "thread", "nodes": nodes, "radius_mm": radius, "axial_n": 1, "linear_density_tex": 10 });
    let case = with(
        scene(
            json!([slab]),
            // the stiffest contact sets how finely all forces are added up
            json!({ "thread_thread": false, "thread_penalty_n_mm2": penalty, "damping_ratio": 0, "skin_mm": 1.5 }),
        ),
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
            ("/integration", json!({ "dt_s": 1e-7, "energy_tolerance": 100, "penetration_tolerance": 100 })),
        ],
    );
    let length = nodes[1][0] - nodes[0][0];
    let count = arc::points(length, radius);
    let stiffness = penalty * length / count as f64;
    for (precision, allowed) in [(F64, 1e-6), (F32, 1e-4)] {
        let mut simulation = start(&case, precision);
        let (mut worst, mut places, mut last) = (0.0f64, 0, None);
        simulation
            .advance(1e-3, |s| {
                let first = s.mesh().first_thread_node();
                let (x, v) = (positions(s)[first], s.velocities()[first]);
                // the reaction belongs to the position before the last step
                let x = [0, 1, 2].map(|k| x[k] - v[k] * s.dt());
                let mut expected = [0.0; 3];
                for k in 0..count {
                    let share = (k as f64 + 0.5) / count as f64;
                    let vector = push(s.mesh(), &s.mesh().nodes, [x[0] + share * length, x[1], x[2]], radius);
                    (0..3).for_each(|k| expected[k] += stiffness * (1.0 - share) * vector[k]);
                }
                let got = s.reactions()[s.reactions().len() - 2];
                worst = worst.max(norm(sub(got, expected)));
                places += usize::from(beyond(x) && norm(expected) > 0.0);
                last = Some(norm(expected));
                false
            })
            .unwrap();
        assert!(places > 5 && last == Some(0.0), "{what} was not passed: {places}, {last:?}");
        let name =
            format!("{precision:?}: force at {what} ({places} places) against the whole surface, over that of 0.05 mm");
        below(&name, worst / (penalty * length * 0.05), allowed);
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
    let nodes = [[1.01, 0.1, 0.3], [1.68, 0.1, 0.3]];
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

/// A block that flies against the cut end of another one is stopped by the cap there and flies back.
#[test]
fn what_is_pushed_against_a_cut_end_is_stopped() {
    let yarn = block("yarn", [6, 3, 2], [[0.0, 0.0, 0.0], [1.2, 0.9, 0.4]], 1e-9, neo_hookean(200.0, 0.3));
    let mut slider =
        block("slider", [5, 4, 3], [[-1.05, 0.1, -0.1], [-0.05, 0.85, 0.55]], 1e-9, neo_hookean(200.0, 0.3));
    slider["velocity_mm_s"] = json!([1000, 0, 0]);
    let case = with(
        scene(json!([yarn, slider]), json!({ "yarn_penalty_n_mm3": 1000, "damping_ratio": 0 })),
        &[("/steps", json!([{ "hold": { "time_s": 2e-4 } }])), ("/integration", json!({ "dt_max_s": 5e-8 }))],
    );
    let mut simulation = start(&case, F64);
    advance(&mut simulation, 2e-4);
    let mass = &simulation.model.mass;
    let first = simulation.mesh().blocks[1].first;
    let mean = |nodes: std::ops::Range<usize>| {
        let carried: f64 =
            simulation.velocities()[nodes.clone()].iter().zip(&mass[nodes.clone()]).map(|(v, m)| v[0] * m).sum();
        carried / mass[nodes].iter().sum::<f64>()
    };
    let (struck, striking) = (mean(0..first), mean(first..mass.len()));
    println!("velocities along the fibre: struck {struck:.1}, striking {striking:.1} mm/s");
    assert!(striking < struck - 500.0 && simulation.energies().contact == 0.0, "not parted");
    assert!(simulation.health().balance.abs() < 5e-3, "{:?}", simulation.health());
}

#[test]
fn the_search_finds_what_brute_force_finds() {
    /// Of threads with one contact point, mm.
    const LENGTH: f64 = 0.115;
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
    let mesh = tricot::rigs::scene(&loaded(&scene(json!([yarn]), Value::Null)).case).unwrap().mesh;
    let now: Vec<[f64; 3]> = mesh
        .nodes
        .iter()
        .map(|x| {
            let w = winding(x);
            [0, 1, 2].map(|k| x[k] + w[k])
        })
        .collect();
    let faces: Vec<[[f64; 3]; 4]> =
        Surface::new(&mesh.blocks[0]).closed().into_iter().map(|face| face.map(|seen| now[seen.node])).collect();
    // points over the faces, on their outer side, in the middle of short threads
    let mut random = Random(17);
    let (mut points, mut threads) = (vec![], vec![]);
    while points.len() < 400 {
        let f = &faces[((random.draw() + 1.0) * 0.5 * faces.len() as f64) as usize % faces.len()];
        let (s, t, high) = (0.5 + 0.5 * random.draw(), 0.5 + 0.5 * random.draw(), 0.1 + 0.1 * random.draw());
        let w = [(1.0 - s) * (1.0 - t), s * (1.0 - t), s * t, (1.0 - s) * t];
        let on: [f64; 3] = [0, 1, 2].map(|k| (0..4).map(|a| w[a] * f[a][k]).sum());
        let normal = cross(sub(f[2], f[0]), sub(f[3], f[1]));
        let point = [0, 1, 2].map(|k| on[k] + high * normal[k] / norm(normal));
        let along = [random.draw(), random.draw(), random.draw()];
        let end = |side: f64| [0, 1, 2].map(|k| point[k] + side * 0.5 * LENGTH * along[k] / norm(along));
        threads
            .push(json!({ "name": format!("t{}", points.len()), "nodes": [end(-1.0), end(1.0)], "radius_mm": radius,
                             "axial_n": 1, "linear_density_tex": 10 }));
        points.push(point);
    }
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
        let mut moved = vec![[0.0; 3]; simulation.mesh().nodes.len()];
        for (moved, x) in moved.iter_mut().zip(&mesh.nodes) {
            *moved = winding(x);
        }
        simulation.set_fluctuations(&moved);
        advance(&mut simulation, 0.5e-8);
        let force = field(&simulation, "contact_force_n");
        let first = simulation.mesh().first_thread_node();
        let (mut worst, mut touching) = (0.0f64, 0);
        for (i, point) in points.iter().enumerate() {
            let expected = norm(push(&mesh, &now, *point, radius));
            let got = (force[first + 2 * i] + force[first + 2 * i + 1]) / (penalty * LENGTH);
            touching += usize::from(expected > 0.0);
            if (got - expected).abs() > allowed {
                println!("point {i} at {point:.3?}: push {expected:.6}, contact found {got:.6}");
            }
            worst = worst.max((got - expected).abs());
        }
        assert!(touching > 100, "{touching} points touch");
        let name = format!("{precision:?}: push on 400 points ({touching} touch) of {} faces, mm", faces.len());
        below(&name, worst, allowed);
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
    // whether the beams of the first and of the second thread were searched again since the last search of everything
    let again = |simulation: &Simulation| {
        let when = simulation.backend().uints(simulation.model.buffers.found[0].unwrap());
        assert!(when.len() == 2 && when.iter().all(|when| *when != found::NEVER));
        [when[0], when[1]].map(|when| when == found::SINCE)
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
        let first = simulation.mesh().first_thread_node();
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
        assert!(simulation.health().touching == [0; 3], "{precision:?}: {:?}", simulation.health());
        assert!(field(&simulation, "contact_force_n").iter().all(|force| *force == 0.0));
    }
}
