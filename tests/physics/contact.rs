//! Contact: collisions, Hertz, a patch of uniform pressure, an edge, and the search against brute force.

use super::brute_force::push;
use crate::common::{advance, bare, below, block, momenta, near, neo_hookean, norm, positions, shaped, start, with};
use serde_json::{Value, json};
use std::f64::consts::PI;
use tricot::contact::arc;
use tricot::mesh::vector::sub;
use tricot::settings::integration::Precision::{self, F32, F64};
use tricot::simulate::Simulation;

pub(super) fn scene(blocks: Value, contact: Value) -> Value {
    with(bare(), &[("/domain/mesh/blocks", blocks), ("/effects/contact", contact)])
}

pub(super) fn field(simulation: &Simulation, name: &str) -> Vec<f64> {
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

/// Moves a thread past a held slab, starting and ending out of reach or starting on it, and compares the force on its first node
/// with the force of the whole surface on the points of its beam. At some places the node must be `beyond` the faces.
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
