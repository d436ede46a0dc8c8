//! Hexahedra with one integration point: which deformations they resist and how much, whether their energy is that of their
//! forces, how they bend beside fully integrated ones, and that nothing is left of them where they are not chosen.

use crate::common::{
    Random, advance, bare, below, block, charmetant, coarse_cell, near, neo_hookean, reduced, shaped, start, with,
};
use serde_json::{Value, json};
use tricot::kernel::shader::Text;
use tricot::settings::integration::Precision::F64;
use tricot::simulate::{Energies, Simulation};

const DENSITY: f64 = 1e-9;

/// Displacements of nodes, mm.
type Displacements = Vec<[f64; 3]>;

fn scene(blocks: Value) -> Value {
    with(bare(), &[("/domain/mesh/blocks", blocks), ("/integration", json!({ "dt_s": 1e-9, "energy_tolerance": 100 }))])
}

fn with_coefficient(case: Value, hourglass: f64) -> Value {
    with(reduced(case), &[("/integration/hourglass", json!(hourglass))])
}

/// One hexahedron of a box or of any shape.
fn one(size: [f64; 3], shift: f64, material: Value) -> Value {
    let random = std::cell::RefCell::new(Random(4));
    let place = |t: [f64; 3]| [0, 1, 2].map(|k| size[k] * (t[k] + shift * random.borrow_mut().draw()));
    scene(json!([shaped("one", [1, 1, 1], DENSITY, material, place)]))
}

fn energies(case: &Value, moved: &Displacements) -> Energies {
    let mut simulation = start(case, F64);
    simulation.set_fluctuations(moved);
    advance(&mut simulation, 0.0);
    *simulation.energies()
}

/// Forces on all nodes, N, at rest.
fn forces(case: &Value, moved: &Displacements) -> Vec<[f64; 3]> {
    let mut simulation = start(&with(case.clone(), &[("/steps", json!([{ "hold": { "time_s": 1e-9 } }]))]), F64);
    simulation.set_fluctuations(moved);
    advance(&mut simulation, 0.5e-9);
    crate::common::forces(&simulation)
}

fn nodes(case: &Value) -> Displacements {
    start(case, F64).mesh().nodes.clone()
}

/// Independent columns of a square matrix, by elimination with the largest pivot; what is left is below a share of the first.
fn rank(mut a: Vec<Vec<f64>>) -> (usize, f64) {
    let n = a.len();
    let mut first = 0.0;
    for step in 0..n {
        let places = (step..n).flat_map(|i| (step..n).map(move |j| (i, j)));
        let (i, j) = places.max_by(|p, q| a[p.0][p.1].abs().total_cmp(&a[q.0][q.1].abs())).unwrap();
        let pivot = a[i][j];
        first = if step == 0 { pivot.abs() } else { first };
        if pivot.abs() < 1e-8 * first {
            return (step, pivot.abs() / first);
        }
        a.swap(step, i);
        a.iter_mut().for_each(|row| row.swap(step, j));
        for row in step + 1..n {
            let factor = a[row][step] / pivot;
            for column in step..n {
                a[row][column] -= factor * a[step][column];
            }
        }
    }
    (n, 0.0)
}

/// Stiffness of the hexahedra of a case at rest, by central differences of forces.
fn stiffness(case: &Value) -> Vec<Vec<f64>> {
    let count = nodes(case).len();
    let column = |n: usize| {
        let side = |size: f64| {
            let mut moved = vec![[0.0; 3]; count];
            moved[n / 3][n % 3] = size;
            forces(case, &moved).concat()
        };
        let (up, down) = (side(1e-5), side(-1e-5));
        up.iter().zip(down).map(|(a, b)| (a - b) / 2e-5).collect()
    };
    (0..3 * count).map(column).collect()
}

#[test]
fn twelve_modes_are_free_without_control_and_none_with_it() {
    for material in [neo_hookean(1000.0, 0.3), charmetant()] {
        let case = one([1.0, 0.8, 0.6], 0.1, material);
        // charmetant resists compaction and not expansion: differences see half of its stiffness
        for (name, case, expected) in [
            ("full", case.clone(), 24 - 6),
            ("reduced without control", with_coefficient(case.clone(), 0.0), 24 - 6 - 12),
            ("reduced", with_coefficient(case, 1.0), 24 - 6),
        ] {
            let (rank, rest) = rank(stiffness(&case));
            println!("{name}: {rank} of 24 deformations are resisted; the next pivot is {rest:.1e} of the first");
            assert_eq!(rank, expected, "{name}");
        }
    }
}

/// Signs of the corners in the order of the mesh's nodes: x fastest, then y, then z.
fn signs(node: usize) -> [f64; 3] {
    [0, 1, 2].map(|k| if node >> k & 1 == 1 { 1.0 } else { -1.0 })
}

#[test]
fn a_mode_has_the_energy_of_its_closed_form() {
    // whole numbers of position quanta
    let size = [0.875, 0.5, 0.25];
    let (young, poisson, coefficient, amplitude) = (1000.0, 0.3, 0.7, 0.01);
    let case = with_coefficient(one(size, 0.0, neo_hookean(young, poisson)), coefficient);
    let half = size.map(|s| 0.5 * s);
    let (modulus, volume) = (young / (2.0 * (1.0 + poisson)), size[0] * size[1] * size[2]);
    let place = nodes(&case);
    // ∫ |∇h|² dV / V of ηζ, ξζ, ξη, ξηζ
    let [x, y, z] = half.map(|h| 1.0 / (h * h));
    let squares = [(y + z) / 3.0, (x + z) / 3.0, (x + y) / 3.0, (x + y + z) / 9.0];
    for (mode, square) in squares.into_iter().enumerate() {
        let expected = 0.5 * coefficient * modulus * volume * square * amplitude * amplitude;
        for direction in 0..3 {
            let moved: Displacements = (0..8)
                .map(|node| {
                    let [i, j, k] = signs(node);
                    let sign = [j * k, i * k, i * j, i * j * k][mode];
                    [0, 1, 2].map(|c| if c == direction { amplitude * sign } else { 0.0 })
                })
                .collect();
            let e = energies(&case, &moved);
            near(&format!("mode {mode} along {direction}, mJ"), e.hourglass.unwrap(), expected, 1e-9);
            assert!(e.internal() - e.hourglass.unwrap() < 1e-12 * expected, "the point sees a mode: {e:?}");
            // the same in a body that is stretched along x, turned by 50° about it, and far away
            let (s, c) = 50f64.to_radians().sin_cos();
            let turned = |x: [f64; 3]| [1.2 * x[0] + 30.0, c * x[1] - s * x[2], s * x[1] + c * x[2] - 20.0];
            let pure = |m: [f64; 3]| [m[0], c * m[1] - s * m[2], s * m[1] + c * m[2]];
            let moved: Displacements =
                place.iter().zip(&moved).map(|(x, m)| [0, 1, 2].map(|k| turned(*x)[k] + pure(*m)[k] - x[k])).collect();
            near("    turned", energies(&case, &moved).hourglass.unwrap(), expected, 1e-8);
        }
    }
}

#[test]
fn energy_is_the_work_of_the_forces() {
    let random = std::cell::RefCell::new(Random(11));
    let draw = |size: f64| [0; 3].map(|_| size * random.borrow_mut().draw());
    for (name, material) in [("neo-Hookean", neo_hookean(1000.0, 0.3)), ("charmetant", charmetant())] {
        let place = |t: [f64; 3]| {
            let shift = draw(0.06);
            [0, 1, 2].map(|k| [1.5, 1.0, 0.8][k] * (t[k] + shift[k]))
        };
        let case = scene(json!([shaped("b", [3, 2, 2], DENSITY, material, place)]));
        for case in [with_coefficient(case.clone(), 0.0), with_coefficient(case.clone(), 3.0), case] {
            let nodes = nodes(&case);
            // compressed, so that every mode of the law takes part
            let moved: Displacements = nodes.iter().map(|x| [0, 1, 2].map(|k| -0.1 * x[k] + draw(0.03)[k])).collect();
            let change: Displacements = nodes.iter().map(|_| draw(1.0)).collect();
            let along = |size: f64| -> Displacements {
                moved.iter().zip(&change).map(|(u, d)| [0, 1, 2].map(|k| u[k] + size * d[k])).collect()
            };
            const STEP: f64 = 1e-5;
            let [up, down] = [STEP, -STEP].map(|size| energies(&case, &along(size)).internal());
            let work: f64 = forces(&case, &moved).concat().iter().zip(change.concat()).map(|(f, d)| f * d).sum();
            let control = case["integration"].get("hourglass");
            near(&format!("{name}, hourglass {control:?}: −dW"), work, -(up - down) / (2.0 * STEP), 1e-6);
        }
    }
}

/// Force at the tip of a clamped bar over that of Timoshenko's theory, with `layers` hexahedra through its thickness.
fn cantilever(layers: usize, change: fn(Value) -> Value) -> (f64, f64) {
    let (length, young, down) = (8.0, 1000.0, 0.05);
    let bar =
        block("bar", [8 * layers, layers, layers], [[0.0; 3], [length, 1.0, 1.0]], DENSITY, neo_hookean(young, 0.0));
    let case = with(
        bare(),
        &[
            ("/domain/mesh/blocks", json!([bar])),
            (
                "/domain/mesh/conditions",
                json!([
                    { "within": [[0, 0, 0], [0, 1, 1]] },
                    { "within": [[8, 0, 0], [8, 1, 1]], "displacement_mm": [0, 0, -down], "components": [false, false, true] }
                ]),
            ),
            ("/effects/damping", json!({ "rate_per_s": 3e4 })),
            ("/effects/fibre_lines", json!({})),
            ("/steps", json!([{ "move": { "time_s": 5e-4 } }, { "hold": { "time_s": 1.5e-3 } }])),
        ],
    );
    let mut simulation = start(&change(case), F64);
    advance(&mut simulation, 2e-3);
    let e = *simulation.energies();
    assert!(e.kinetic < 1e-7 * e.internal(), "not at rest: {e:?}");
    let at = simulation.prescribed_nodes();
    let tip = at.iter().zip(simulation.reactions()).filter(|(n, _)| simulation.mesh().nodes[**n][0] > 7.9);
    let force: f64 = tip.map(|(_, f)| f[2]).sum();
    let (bending, shear) = (length * length * length / (3.0 * young / 12.0), length / (5.0 / 6.0 * young / 2.0));
    (force.abs() * (bending + shear) / down, e.hourglass.unwrap_or(0.0) / e.internal())
}

#[test]
fn a_cantilever_converges_to_beam_theory_with_either_element() {
    for (name, change) in [("full", (|case| case) as fn(Value) -> Value), ("reduced", reduced)] {
        let found = [1, 2, 4].map(|layers| {
            let (ratio, hourglass) = cantilever(layers, change);
            println!(
                "{name}: {layers} hexahedra through the thickness: {ratio:.4} of theory, hourglass share {hourglass:.3}"
            );
            ratio
        });
        let errors = found.map(|ratio| (ratio - 1.0).abs());
        assert!(errors[0] > errors[1] && errors[1] > errors[2] && errors[2] < 0.05, "{name}: {errors:?}");
    }
}

#[test]
fn one_layer_of_reduced_hexahedra_bends_without_its_fibres() {
    let (elements, length, height, curvature) = (12, 3.0, 0.375, 1e-4);
    let yarn = block("yarn", [elements, 1, 1], [[0.0; 3], [length, 1.0, height]], DENSITY, charmetant());
    let case = scene(json!([yarn]));
    // sections stay flat and turn with the curve of the axis
    let arc = |x: &[f64; 3]| [-(x[2] - 0.5 * height) * curvature * x[0], 0.0, 0.5 * curvature * x[0] * x[0]];
    let moved: Displacements = nodes(&case).iter().map(arc).collect();
    let (full, soft) = (energies(&case, &moved), energies(&reduced(case.clone()), &moved));
    // ½ EI κ² L of the fibres in eight points
    let bending = 0.5 * 108_500.0 * height.powi(3) / 12.0 * curvature * curvature * length;
    near("eight points: elongation, mJ", full.elongation, bending, 1e-3);
    below("one point: elongation over that", soft.elongation / full.elongation, 1e-5);
    // mode ξζ of u_x, per element: amplitude κ (l/2) (t/2), gradients 2/l and 2/t, the shear modulus 2.2 MPa
    let l = length / elements as f64;
    let control = 0.5
        * 2.2
        * length
        * height
        * (curvature * l * height / 4.0).powi(2)
        * (4.0 / (l * l) + 4.0 / (height * height))
        / 3.0;
    near("one point: hourglass energy, mJ", soft.hourglass.unwrap(), control, 1e-6);
    below("one point: hourglass energy over bending energy of the fibres", control / bending, 1e-4);
}

/// Largest energy in the second half of a time over that in the first.
fn growth(simulation: &mut Simulation, time: f64) -> f64 {
    let mut halves = [0.0f64; 2];
    for (half, largest) in halves.iter_mut().enumerate() {
        let until = 0.5 * time * (half + 1) as f64;
        let look = |s: &Simulation| {
            *largest = largest.max(s.energies().output());
            false
        };
        simulation.advance(until, look).unwrap_or_else(|e| panic!("{e}"));
    }
    halves[1] / halves[0]
}

fn free_step() -> Value {
    json!({ "dt_max_s": 1e-4, "safety": 1.0, "energy_tolerance": 100 })
}

#[test]
fn the_estimated_step_is_stable_whatever_the_coefficient() {
    let mut steps = Vec::new();
    for coefficient in [0.1, 1.0, 30.0] {
        let random = std::cell::RefCell::new(Random(21));
        let place = |t: [f64; 3]| [0, 1, 2].map(|k| [2.0, 1.0, 1.0][k] * (t[k] + 0.03 * random.borrow_mut().draw()));
        let case = scene(json!([shaped("b", [4, 3, 3], DENSITY, neo_hookean(1000.0, 0.3), place)]));
        let case = with_coefficient(with(case, &[("/integration", free_step())]), coefficient);
        let mut simulation = start(&case, F64);
        let moved: Displacements =
            simulation.mesh().nodes.iter().map(|_| [0; 3].map(|_| 0.02 * random.borrow_mut().draw())).collect();
        simulation.set_fluctuations(&moved);
        let growth = growth(&mut simulation, 1e-3);
        let e = simulation.energies();
        let share = e.hourglass.unwrap() / e.output();
        println!(
            "hourglass {coefficient}: {} steps of {:.2e} s, energy grows by {growth:.3}, hourglass share {share:.3}",
            simulation.step(),
            simulation.dt()
        );
        assert!(growth < 1.1 && share > 0.0, "{growth}");
        steps.push(simulation.dt());
    }
    assert!(steps[2] < 0.5 * steps[1], "stiff control does not shorten the step");
}

/// A yarn on fibre lines whose edges along the fibre are turned up and down in turn, let go with a small kick.
fn tilted(tilt: f64, integration: Value) -> Simulation {
    let yarn = block("yarn", [16, 4, 2], [[0.0; 3], [4.8, 1.2, 0.4]], DENSITY, charmetant());
    let changes = [("/effects/fibre_lines", json!({})), ("/integration", integration)];
    let mut simulation = start(&reduced(with(scene(json!([yarn])), &changes)), F64);
    // no element is stretched in the mean
    let amplitude = 0.5 * 0.3 * tilt;
    let odd = |x: &[f64; 3]| ((x[0] / 0.3).round() + (x[1] / 0.3).round() + (x[2] / 0.2).round()) as i64 % 2 == 1;
    let moved: Displacements =
        simulation.mesh().nodes.iter().map(|x| [0.0, 0.0, if odd(x) { amplitude } else { -amplitude }]).collect();
    simulation.set_fluctuations(&moved);
    let mut random = Random(6);
    let kick: Displacements = moved.iter().map(|_| [0; 3].map(|_| 10.0 * random.draw())).collect();
    simulation.set_velocities(&kick);
    simulation
}

/// Fibre lines add inertia along their segments, an element is stiff along its mean fibre.
#[test]
fn the_estimated_step_is_stable_where_edges_turn_away_from_the_fibre() {
    let limits = [0.0, 0.1].map(|tilt| {
        let mut yarn = tilted(tilt, free_step());
        yarn.advance(0.0, |_| false).unwrap();
        let (estimate, limit) = (yarn.health().dt_limit, yarn.measured_limit().unwrap().dt);
        println!("tilt {tilt}: estimate {estimate:.2e} s, limit {limit:.2e} s");
        assert!(estimate <= limit && estimate > 0.4 * limit, "{estimate:e} {limit:e}");
        estimate
    });
    assert!(limits[1] < limits[0], "the tilt does not shorten the step");
    let long = 6.0 * limits[1];
    assert!(long < limits[0]);
    let mut forced = tilted(0.1, json!({ "dt_s": long, "energy_tolerance": 100 }));
    let outcome = forced.advance(5e-4, |_| false);
    println!("tilted, at a step that the straight yarn stands: {outcome:?}");
    assert!(outcome.is_err(), "the longer step is stable as well");
}

#[test]
fn full_integration_has_no_trace_of_hourglass_control() {
    for (case, expected) in [(coarse_cell(), false), (reduced(coarse_cell()), true)] {
        let simulation = start(&case, F64);
        let plan = &simulation.model.plan;
        let stages: Vec<_> =
            [&plan.step, &plan.search, &plan.watch, &plan.diagnose, &plan.collect].into_iter().flatten().collect();
        let texts = stages.iter().map(|s| Text::of(s).unwrap().text);
        let traces = texts.filter(|t| t.contains("hourglass")).count()
            + plan.buffers.iter().filter(|b| b.name.contains("hourglass")).count()
            + stages.iter().filter(|s| s.name().contains("reduced")).count()
            + simulation.energies().columns().filter(|(name, _)| *name == "hourglass_mj").count();
        let full = stages.iter().filter(|s| s.kernel().shader.file == "elements/hex8").count();
        println!("{traces} traces of hourglass control, {full} stages of full integration");
        assert_eq!((traces > 0, full > 0), (expected, !expected));
    }
}
