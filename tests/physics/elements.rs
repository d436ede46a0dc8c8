//! Hexahedra, beams and their integration in time: patch test, rigid motion, momentum, energy, the limit of the time step,
//! and fibre lines.

use crate::common::{
    Random, advance, bare, below, block, charmetant, momenta, near, neo_hookean, norm, reduced, shaped, start, with,
};
use serde_json::{Value, json};
use tricot::materials::charmetant::{Charmetant, parameters};
use tricot::materials::{Material, Tensor};
use tricot::settings::integration::Precision::{self, F32, F64};
use tricot::simulate::Simulation;

const DENSITY: f64 = 1e-9;

fn scene(blocks: Value) -> Value {
    with(bare(), &[("/domain/mesh/blocks", blocks), ("/integration", json!({ "dt_s": 1e-9, "energy_tolerance": 100 }))])
}

/// A kind of hexahedra, and the change of a case that selects it.
type Hexahedra = (&'static str, fn(Value) -> Value);
/// Both kinds.
const HEXAHEDRA: [Hexahedra; 2] = [("full", |case| case), ("reduced", reduced)];

/// Forces on all nodes at the present positions, at rest.
fn forces(simulation: &mut Simulation) -> Vec<[f64; 3]> {
    let still = vec![[0.0; 3]; simulation.mesh().nodes.len()];
    simulation.set_velocities(&still);
    let until = simulation.time() + 0.5e-9;
    advance(simulation, until);
    crate::common::forces(simulation)
}

fn rotation(axis: [f64; 3], angle: f64) -> Tensor<f64> {
    let u = axis.map(|x| x / norm(axis));
    let (s, c) = angle.sin_cos();
    let skew = [[0.0, -u[2], u[1]], [u[2], 0.0, -u[0]], [-u[1], u[0], 0.0]];
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| (1.0 - c) * u[i] * u[j] + s * skew[i][j] + if i == j { c } else { 0.0 }))
}

fn product(a: &Tensor<f64>, b: &Tensor<f64>) -> Tensor<f64> {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

fn transpose(a: &Tensor<f64>) -> Tensor<f64> {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| a[j][i]))
}

fn apply(a: &Tensor<f64>, x: [f64; 3]) -> [f64; 3] {
    a.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2])
}

/// A 3 × 2 × 2 mm block whose inner nodes are displaced at random.
fn distorted(fibre: [f64; 3]) -> Value {
    let random = std::cell::RefCell::new(Random(3));
    let inner = |x: f64| x > 0.0 && x < 1.0;
    let place = |t: [f64; 3]| {
        let shift = if t.into_iter().all(inner) { 0.08 } else { 0.0 };
        [0, 1, 2].map(|k| [3.0, 2.0, 2.0][k] * (t[k] + shift * random.borrow_mut().draw()))
    };
    let mut block = shaped("patch", [4, 4, 4], DENSITY, charmetant(), place);
    block["fibre"] = json!(fibre);
    block
}

#[test]
fn patch_an_affine_displacement_gives_uniform_stress() {
    let h: Tensor<f64> = [[0.01, 0.05, -0.03], [0.02, -0.08, 0.1], [-0.04, 0.03, -0.05]];
    let fibres = [([1.0, 0.0, 0.0], "along x"), ([1.0, 2.0, 2.0], "oblique")];
    for ((fibre, what), (element, of)) in fibres.into_iter().flat_map(|f| HEXAHEDRA.map(|h| (f, h))) {
        let what = format!("{element} integration, fibre {what}");
        // any frame with the fibre first
        let u = fibre.map(|x: f64| x / norm(fibre));
        let v = crate::common::cross(u, [0.0, 0.6, 0.8]);
        let v = v.map(|x| x / norm(v));
        let q = transpose(&[u, v, crate::common::cross(u, v)]);
        let local = product(&transpose(&q), &product(&h, &q));
        let stress = Charmetant::stress::<f64>(&parameters(108_500.0, 1.25, 1.84, 0.6, 2.2, 1e-3), &local);
        let stress = product(&q, &product(&stress, &transpose(&q)));
        for (precision, name, inner_allowed, face_allowed) in [(F64, "f64", 1e-12, 1e-12), (F32, "f32", 1e-5, 2e-5)] {
            let mut simulation = start(&of(scene(json!([distorted(fibre)]))), precision);
            let nodes = simulation.mesh().nodes.clone();
            simulation.set_fluctuations(&nodes.iter().map(|x| apply(&h, *x)).collect::<Vec<_>>());
            let forces = forces(&mut simulation);
            let (mut inner, mut largest, mut face) = (0.0f64, 0.0f64, [0.0; 3]);
            for (x, f) in nodes.iter().zip(&forces) {
                largest = largest.max(norm(*f));
                let at_border = (0..3).any(|k| x[k] < 1e-6 || x[k] > [3.0, 2.0, 2.0][k] - 1e-6);
                if !at_border {
                    inner = inner.max(norm(*f));
                }
            }
            // the force on the half beyond a cut: the nodes of the face at x = 3 carry −P N A less the share of the sides; over
            // the whole border, virtual power with a linear field gives V P exactly
            let mut virial = [[0.0; 3]; 3];
            for (x, f) in nodes.iter().zip(&forces) {
                for i in 0..3 {
                    for j in 0..3 {
                        virial[i][j] -= f[i] * x[j] / 12.0;
                    }
                }
                if x[0] > 3.0 - 1e-6 {
                    face = [0, 1, 2].map(|k| face[k] - f[k]);
                }
            }
            let scale = stress.iter().flatten().fold(0.0f64, |a, b| a.max(b.abs()));
            let error = virial.iter().flatten().zip(stress.iter().flatten()).map(|(a, b)| (a - b).abs());
            below(&format!("{what}, {name}: force on inner nodes over the largest"), inner / largest, inner_allowed);
            below(
                &format!("{what}, {name}: uniform stress, over its largest component ({scale:.1} MPa)"),
                error.fold(0.0, f64::max) / scale,
                face_allowed,
            );
            assert!(norm(face) > 0.0);
        }
    }
}

#[test]
fn patch_inner_nodes_find_their_affine_places() {
    let h: Tensor<f64> = [[0.02, 0.05, -0.03], [0.02, -0.06, 0.1], [-0.04, 0.03, 0.05]];
    let mut patch = distorted([1.0, 0.0, 0.0]);
    patch["material"] = neo_hookean(1000.0, 0.3);
    // one condition a node of the border
    let nodes: Vec<[f64; 3]> = serde_json::from_value(patch["nodes"].clone()).unwrap();
    let border = |x: &&[f64; 3]| (0..3).any(|k| x[k] < 1e-6 || x[k] > [3.0, 2.0, 2.0][k] - 1e-6);
    let conditions: Vec<Value> =
        nodes.iter().filter(border).map(|x| json!({ "within": [x, x], "displacement_mm": apply(&h, *x) })).collect();
    assert_eq!(conditions.len(), 125 - 27);
    let case = with(
        bare(),
        &[
            ("/domain/mesh/blocks", json!([patch])),
            ("/domain/mesh/conditions", json!(conditions)),
            ("/effects/damping", json!({ "rate_per_s": 1e6 })),
            ("/steps", json!([{ "move": { "time_s": 2e-5 } }, { "hold": { "time_s": 6e-5 } }])),
        ],
    );
    for (element, of) in HEXAHEDRA {
        let mut simulation = start(&of(case.clone()), F64);
        advance(&mut simulation, 8e-5);
        let worst = nodes.iter().zip(simulation.fluctuations()).map(|(x, w)| {
            let affine = apply(&h, *x);
            norm([0, 1, 2].map(|k| w[k] - affine[k]))
        });
        let what = format!("{element}: distance of 27 inner nodes from their affine places, mm");
        below(&what, worst.fold(0.0, f64::max), 1e-7);
    }
}

#[test]
fn rigid_motion_gives_no_force() {
    // f64 rounds displacements of 100 mm to 1e-14 mm, 3e-14 of an element; f32 rounds H, of size 2, to 1e-7
    let precisions = [(F64, "f64", 1e-11), (F32, "f32", 3e-5)];
    for ((precision, name, allowed), (element, of)) in precisions.into_iter().flat_map(|p| HEXAHEDRA.map(|h| (p, h))) {
        let name = format!("{element}, {name}");
        let mut simulation = start(&of(scene(json!([distorted([1.0, 0.0, 0.0])]))), precision);
        let nodes = simulation.mesh().nodes.clone();
        let mut worst = 0.0f64;
        for (angle, far) in [(0.0, 200.0), (0.3, 0.0), (2.4, 20.0), (6.0 * std::f64::consts::PI + 0.5, 100.0)] {
            let q = rotation([1.0, -2.0, 0.5], angle);
            let shift = |x: [f64; 3]| {
                let turned = apply(&q, x);
                [turned[0] - x[0] + far, turned[1] - x[1] - far, turned[2] - x[2] + 0.5 * far]
            };
            simulation.set_fluctuations(&nodes.iter().map(|x| shift(*x)).collect::<Vec<_>>());
            let force = forces(&mut simulation).into_iter().map(norm).fold(0.0, f64::max);
            // relative to the force of one per cent of fibre stretch on the area of a node
            let scale = 0.01 * 108_500.0 * 0.25;
            println!(
                "{name}: {angle:.2} rad and {far} mm away: force {force:.1e} N, {:.1e} of that at 1 % strain",
                force / scale
            );
            worst = worst.max(force / scale);
        }
        below(&format!("{name}: largest force of rigid motion over that of 1 % of stretch"), worst, allowed);
    }
}

/// A block spinning and vibrating freely.
fn spinning(lines: Value, dt: f64) -> Value {
    let corners = [[1.0, 0.0, 0.0], [1.8, 0.6, 0.6]];
    let mut case = scene(json!([block("b", [8, 2, 2], corners, DENSITY, neo_hookean(1000.0, 0.3))]));
    case["integration"] = json!({ "dt_s": dt, "energy_tolerance": 100 });
    case["effects"]["fibre_lines"] = lines;
    case
}

fn spin(simulation: &mut Simulation, rate: f64) {
    let velocity = |x: &[f64; 3]| {
        let turn = crate::common::cross([0.3 * rate, -0.2 * rate, rate], [x[0] - 1.4, x[1] - 0.3, x[2] - 0.3]);
        [turn[0] + 300.0, turn[1] - 200.0 + 5000.0 * (x[0] - 1.4) * x[2], turn[2] + 100.0]
    };
    let velocities: Vec<[f64; 3]> = simulation.mesh().nodes.iter().map(velocity).collect();
    simulation.set_velocities(&velocities);
}

#[test]
fn a_free_block_keeps_its_momenta() {
    for ((precision, name, lines, dt, linear_allowed, angular_allowed), (element, of)) in [
        (F64, "f64", Value::Null, 6e-8, 1e-12, 1e-12),
        (F64, "f64, fibre lines", json!({}), 1.2e-7, 1e-12, 1e-12),
        (F32, "f32", Value::Null, 6e-8, 1e-5, 1e-4),
        (F32, "f32, fibre lines", json!({}), 1.2e-7, 1e-5, 1e-4),
    ]
    .into_iter()
    .flat_map(|scene| HEXAHEDRA.map(|h| (scene.clone(), h)))
    {
        let name = format!("{element}, {name}");
        let mut simulation = start(&of(spinning(lines, dt)), precision);
        // three turns
        spin(&mut simulation, 6e3);
        let (linear, angular) = momenta(&simulation);
        advance(&mut simulation, 3.2e-3);
        let (after, turned) = momenta(&simulation);
        assert!(simulation.energies().internal() > 0.0);
        let change = |a: [f64; 3], b: [f64; 3]| norm([0, 1, 2].map(|k| a[k] - b[k])) / norm(a);
        let steps = simulation.step();
        below(&format!("{name}: change of linear momentum in {steps} steps"), change(linear, after), linear_allowed);
        below(&format!("{name}: change of angular momentum"), change(angular, turned), angular_allowed);
    }
}

#[test]
fn a_free_chain_of_beams_keeps_its_momenta() {
    let nodes: Vec<[f64; 3]> = (0..30).map(|i| f64::from(i) * 0.2).map(|s| [s, s.sin(), (0.7 * s).cos()]).collect();
    let thread = json!({ "name": "t", "nodes": nodes, "radius_mm": 0.1, "axial_n": 10.0, "bending_n_mm2": 0.01,
                         "rest_curvature": 0.5, "linear_density_tex": 8 });
    for (precision, name, lines, linear_allowed, angular_allowed) in [
        (F64, "f64", Value::Null, 1e-12, 1e-12),
        (F64, "f64, fibre lines", json!({}), 1e-12, 1e-12),
        (F32, "f32", Value::Null, 1e-5, 1e-5),
    ] {
        let mut case = scene(json!([]));
        case["domain"]["mesh"]["threads"] = json!([thread]);
        case["effects"]["fibre_lines"] = lines;
        case["integration"]["dt_s"] = json!(1e-7);
        let mut simulation = start(&case, precision);
        let mut random = Random(5);
        let velocities: Vec<[f64; 3]> = nodes
            .iter()
            .map(|x| [400.0 + 100.0 * random.draw(), 2000.0 * (x[0] - 3.0), 300.0 * random.draw()])
            .collect();
        simulation.set_velocities(&velocities);
        let (linear, angular) = momenta(&simulation);
        advance(&mut simulation, 5e-4);
        let (after, turned) = momenta(&simulation);
        let change = |a: [f64; 3], b: [f64; 3]| norm([0, 1, 2].map(|k| a[k] - b[k])) / norm(a);
        below(
            &format!("chain, {name}: change of linear momentum in 5000 steps"),
            change(linear, after),
            linear_allowed,
        );
        below(&format!("chain, {name}: change of angular momentum"), change(angular, turned), angular_allowed);
    }
}

/// Largest less smallest energy of a vibrating block at whole steps, over the largest.
fn energy_spread(dt: f64, steps: usize) -> f64 {
    let case = with(
        scene(json!([block("b", [2, 2, 2], [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]], DENSITY, neo_hookean(1000.0, 0.3))])),
        &[("/integration", json!({ "dt_s": dt, "energy_tolerance": 100 }))],
    );
    let mut simulation = start(&case, F64);
    let wave: Vec<[f64; 3]> =
        simulation.mesh().nodes.iter().map(|x| [2e4 * (x[0] - 0.5), 1e4 * x[0] * x[1], -1e4 * (x[2] - 0.5)]).collect();
    simulation.set_velocities(&wave);
    let (mut low, mut high, mut internal) = (f64::INFINITY, 0.0f64, 0.0f64);
    advance(&mut simulation, 0.5 * dt);
    for step in 1..steps {
        advance(&mut simulation, (step as f64 + 0.5) * dt);
        let e = simulation.energies();
        (low, high, internal) = (low.min(e.output()), high.max(e.output()), internal.max(e.internal()));
    }
    println!(
        "dt {dt:.1e}: energy {high:.6e} mJ, spread {:.2e} of it, strain energy up to {internal:.2e}",
        (high - low) / high
    );
    assert!(internal > 0.3 * high, "the block does not vibrate");
    (high - low) / high
}

#[test]
fn elastic_energy_drifts_with_the_square_of_the_step() {
    let limit = 2.5e-7;
    let coarse = energy_spread(0.2 * limit, 400);
    let middle = energy_spread(0.1 * limit, 800);
    let fine = energy_spread(0.05 * limit, 1600);
    near("order of the energy error", (middle / fine).log2(), 2.0, 0.05);
    near("order of the energy error, coarser pair", (coarse / middle).log2(), 2.0, 0.1);
}

/// Growth of the velocity of a laterally held bar in some steps of a multiple of L/c.
fn bar_growth(material: Value, speed: f64, factor: f64) -> f64 {
    let length = 0.5;
    let case = with(
        scene(json!([block("bar", [16, 1, 1], [[0.0; 3], [16.0 * length, 1.0, 1.0]], DENSITY, material)])),
        &[
            ("/integration", json!({ "dt_s": factor * length / speed, "energy_tolerance": 100 })),
            (
                "/domain/mesh/conditions",
                json!([{ "within": [[-1, -1, -1], [9, 2, 2]], "components": [false, true, true] }]),
            ),
        ],
    );
    let mut simulation = start(&case, F64);
    let mut random = Random(9);
    let sections: Vec<f64> = (0..=16).map(|_| random.draw()).collect();
    let velocities: Vec<[f64; 3]> =
        simulation.mesh().nodes.iter().map(|x| [sections[(x[0] / length).round() as usize], 0.0, 0.0]).collect();
    simulation.set_velocities(&velocities);
    let mut largest = 0.0f64;
    for window in 1..=25 {
        let until = f64::from(64 * window) * factor * length / speed;
        if simulation.advance(until, |_| false).is_err() {
            return f64::INFINITY;
        }
        largest = simulation.velocities().into_iter().map(norm).fold(largest, f64::max);
    }
    largest
}

#[test]
fn a_bar_steps_stably_up_to_length_over_wave_speed() {
    let (young, poisson) = (1000.0f64, 0.3);
    let confined = young * (1.0 - poisson) / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
    for (name, material, modulus) in
        [("charmetant", charmetant(), 108_500.0), ("neo-Hookean", neo_hookean(young, poisson), confined)]
    {
        let speed = f64::sqrt(modulus / DENSITY);
        for factor in [0.99, 0.999] {
            let growth = bar_growth(material.clone(), speed, factor);
            println!("{name}: 1600 steps of {factor} L/c: largest speed over the first {growth:.2}");
            assert!(growth < 20.0, "{name} at {factor} L/c grows {growth:e}");
        }
        let growth = bar_growth(material.clone(), speed, 1.01);
        println!("{name}: 1600 steps of 1.01 L/c: largest speed over the first {growth:.1e}");
        assert!(growth > 1e4, "{name} at 1.01 L/c grows only {growth:e}");
    }
}

/// Force on the far end of a yarn held at one end and moved at the other.
fn bent_yarn(lines: Value, dt: f64, precision: Precision) -> tricot::error::Result<[f64; 3]> {
    let yarn = block("yarn", [12, 3, 2], [[0.0; 3], [9.6, 2.0, 0.4]], 1.16e-9, charmetant());
    let case = with(
        scene(json!([yarn])),
        &[
            ("/effects/fibre_lines", lines),
            ("/effects/damping", json!({ "rate_per_s": 3e4 })),
            ("/integration", json!({ "dt_s": dt })),
            (
                "/domain/mesh/conditions",
                json!([
                    { "within": [[0, 0, 0], [0, 2, 1]] },
                    { "within": [[9.6, 0, 0], [9.6, 2, 1]], "displacement_mm": [-0.04, 0.7, 0.4] }
                ]),
            ),
            ("/steps", json!([{ "move": { "time_s": 1e-3 } }, { "hold": { "time_s": 3e-3 } }])),
        ],
    );
    let mut simulation = start(&case, precision);
    simulation.advance(4e-3, |_| false)?;
    let kinetic = simulation.energies().kinetic / simulation.energies().internal();
    assert!(kinetic < 1e-6, "not at rest: kinetic over internal energy {kinetic:e}");
    // in the order of nodes: both ends of one line, then of the next
    let far: Vec<[f64; 3]> = simulation.reactions().chunks_exact(2).map(|ends| ends[1]).collect();
    let sum = far.iter().fold([0.0; 3], |sum, f| [0, 1, 2].map(|k| sum[k] + f[k]));
    println!("{precision:?}, dt {dt:.1e}: {} steps, force on the moved end {sum:.5?} N", simulation.step());
    Ok(sum)
}

#[test]
fn fibre_lines_do_not_change_the_static_answer() {
    // L/c of a slice is 8.3e-8 s
    let (short, long) = (7e-8, 1.4e-6);
    let explicit = bent_yarn(Value::Null, short, F64).unwrap();
    let change = |other: tricot::error::Result<[f64; 3]>| {
        let other = other.unwrap();
        norm([0, 1, 2].map(|k| other[k] - explicit[k])) / norm(explicit)
    };
    below("fibre lines at 1.4e-6 s against explicit at 7e-8 s", change(bent_yarn(json!({}), long, F64)), 1e-4);
    below("the same in f32", change(bent_yarn(json!({}), long, F32)), 1e-3);
    below("explicit, f32 against f64", change(bent_yarn(Value::Null, short, F32)), 1e-3);
    let stopped = bent_yarn(Value::Null, 2.0 * short, F64).unwrap_err();
    println!("explicit at 1.4e-7 s: {stopped}");
}

#[test]
fn blocks_of_two_laws_move_as_if_alone() {
    let blocks = [
        block("rubber", [3, 2, 2], [[0.0; 3], [3.0, 2.0, 2.0]], DENSITY, neo_hookean(10.0, 0.3)),
        block("yarn", [20, 2, 2], [[0.0, 0.0, 5.0], [3.0, 2.0, 7.0]], DENSITY, charmetant()),
    ];
    let after = |blocks: &[Value], speed: &[[f64; 3]]| {
        let mut simulation = start(&scene(json!(blocks)), F32);
        simulation.set_velocities(speed);
        advance(&mut simulation, 5e-8);
        (simulation.velocities(), simulation.energies().internal())
    };
    let mut random = Random(8);
    let nodes = start(&scene(json!(blocks)), F32).mesh().nodes.len();
    let speed: Vec<[f64; 3]> = (0..nodes).map(|_| [0; 3].map(|_| 1e4 * random.draw())).collect();
    let (both, energy) = after(&blocks, &speed);
    let first = 4 * 3 * 3;
    let (rubber, rubber_energy) = after(&blocks[..1], &speed[..first]);
    let (yarn, yarn_energy) = after(&blocks[1..], &speed[first..]);
    assert_eq!(both, [rubber, yarn].concat());
    assert!(rubber_energy > 0.0 && yarn_energy > 0.0);
    near("energy", energy, rubber_energy + yarn_energy, 1e-6);
}

/// Half of a body whose plane of symmetry is held along its normal moves as the whole one, with fibre lines across that plane and time
/// steps that need them.
#[test]
fn half_a_body_on_its_plane_of_symmetry_moves_as_the_whole() {
    let yarn = |low: f64, slices| {
        let corners = [[low, -0.3, -0.2], [1.0, 0.3, 0.2]];
        let block = block("yarn", [slices, 2, 2], corners, DENSITY, crate::common::charmetant());
        let mut case = scene(json!([block]));
        case["integration"] = json!({ "dt_s": 1e-7, "energy_tolerance": 100 });
        case["effects"]["fibre_lines"] = json!({});
        case
    };
    let plane = json!([{ "within": [[0, -9, -9], [0, 9, 9]], "components": [true, false, false] }]);
    let half = with(yarn(0.0, 4), &[("/domain/mesh/conditions", plane)]);
    let [whole, half] = [yarn(-1.0, 8), half].map(|case| {
        let mut simulation = start(&case, F64);
        // stretched, bent and pressed alike on both sides
        let velocity =
            |x: &[f64; 3]| [20.0 * x[0] * (1.0 + x[2]), 300.0 * x[0] * x[0] - 50.0 * x[1], 200.0 * x[2] * x[0].abs()];
        let velocities: Vec<[f64; 3]> = simulation.mesh().nodes.iter().map(velocity).collect();
        simulation.set_velocities(&velocities);
        advance(&mut simulation, 2e-4);
        simulation
    });
    below("balance of the half body", half.health().balance.abs(), 1e-2);
    let moved = half.fluctuations();
    let farthest = moved.iter().map(|w| norm(*w)).fold(0.0, f64::max);
    for (node, w) in half.mesh().nodes.iter().zip(&moved) {
        let same = |x: &[f64; 3]| norm([0, 1, 2].map(|k| x[k] - node[k])) < 1e-6;
        let other = whole.mesh().nodes.iter().position(same).unwrap();
        let apart = norm([0, 1, 2].map(|k| whole.fluctuations()[other][k] - w[k]));
        assert!(apart < 1e-6 * farthest, "{node:?}: {apart:e} mm apart, moved by up to {farthest} mm");
    }
    assert!(farthest > 1e-3);
}
