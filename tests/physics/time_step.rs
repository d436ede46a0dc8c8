//! The limit of the time step: measured by power iteration, against a chain of known limit and against unstable steps; and the
//! estimate that runs follow, against the measured limit in states that are hard to estimate.

use crate::common::{advance, bare, block, charmetant, coarse_cell, loaded, near, neo_hookean, start, with};
use serde_json::{Value, json};
use std::path::Path;
use tricot::rigs::read::read;
use tricot::run;
use tricot::settings::integration::Precision::{F32, F64};
use tricot::simulate::{BackendConfig, Simulation};
use tricot::study::step::{State, longest_step, measure};

/// Measures a state, prints it, and fails unless the estimate lies between a share of the limit and the limit.
#[track_caller]
fn check(what: &str, scene: &mut Simulation, share: f64) -> State {
    let state = measure(scene).unwrap();
    println!(
        "{what}: estimate {:.3e} s by {}, limit {:.3e} s by {}: {:.2} of it",
        state.estimate,
        state.estimate_set_by,
        state.limit,
        state.limit_set_by,
        state.estimate / state.limit
    );
    assert!(state.estimate <= state.limit && state.estimate >= share * state.limit, "{what}");
    state
}

/// A scene without contact; its balance is that of what the tests do to it.
fn scene(blocks: Value, conditions: Value) -> Value {
    with(
        bare(),
        &[
            ("/domain/mesh/blocks", blocks),
            ("/domain/mesh/conditions", conditions),
            ("/effects/contact", Value::Null),
            ("/integration", json!({ "energy_tolerance": 100 })),
        ],
    )
}

#[test]
fn the_measured_limit_of_a_chain_is_exact() {
    const BEAMS: usize = 7;
    let nodes: Vec<[f64; 3]> = (0..=BEAMS).map(|i| [0.5 * i as f64, 0.0, 0.0]).collect();
    let thread = json!({ "name": "chain", "nodes": nodes, "radius_mm": 0.1, "axial_n": 11, "bending_n_mm2": 0, "linear_density_tex": 40, "thermal_strain": 0 });
    let conditions = json!([{ "within": [[0, 0, 0], [0, 0, 0]] }, { "within": [[3.5, 0, 0], [3.5, 0, 0]] }]);
    let case = with(scene(json!([]), conditions), &[("/domain/mesh/threads", json!([thread]))]);
    let mut chain = start(&case, F64);
    advance(&mut chain, 0.0);
    let (stiffness, mass): (f64, f64) = (11.0 / 0.5, 40e-12 * 0.5);
    let angle = std::f64::consts::PI * (BEAMS as f64 - 1.0) / (2.0 * BEAMS as f64);
    let exact = 1.0 / ((stiffness / mass).sqrt() * angle.sin());
    near("limit of a chain", chain.measured_limit().unwrap().dt, exact, 6e-3);
    assert!(start(&case, F32).measured_limit().is_err(), "f32 is too coarse");
}

/// Thin or sheared slices, tight fibres and buckling yarns, where fibre lines do not help.
#[test]
fn the_estimate_holds_for_elements() {
    for (name, times, share) in [
        ("sliver_elements", &[0.0][..], 0.5),
        ("sliver_elements_on_fibre_lines", &[0.0], 0.5),
        ("distorted_hexahedra", &[0.0, 5e-5], 0.5),
        ("fibre_compression", &[0.0, 3e-4, 2e-3], 0.4),
        // all of its nodes touch a plate and are as heavy as any step requires: there is no limit
        ("free_expansion", &[0.0], 0.0),
    ] {
        let mut loaded = read(Path::new(&format!("cases/hard/{name}.json")), &[]).unwrap();
        loaded.case.integration.precision = F64;
        let mut scene = run::simulation(&loaded, BackendConfig { precision: F64, ..BackendConfig::default() }).unwrap();
        for &time in times {
            advance(&mut scene, time);
            let state = check(&format!("{name} at {time:e} s"), &mut scene, share);
            assert!(share > 0.0 || state.limit > 100.0 * state.estimate, "{name} has a limit");
        }
    }
    let yarn = block("yarn", [6, 3, 2], [[0.0, -0.5, -0.2], [2.0, 0.5, 0.2]], 1.8e-9, charmetant());
    // pushed together, fibres on lines buckle faster than they oscillate
    for (lines, stretches) in [(json!({}), &[0.02][..]), (Value::Null, &[0.02, -0.05])] {
        for stretch in stretches {
            let conditions = json!([{ "within": [[0, -1, -1], [0, 1, 1]] }, { "within": [[2, -1, -1], [2, 1, 1]], "displacement_mm": [2.0 * stretch, 0, 0] }]);
            let case = with(
                scene(json!([yarn]), conditions),
                &[("/effects/fibre_lines", lines.clone()), ("/steps", json!([{ "move": { "time_s": 1e-5 } }]))],
            );
            let mut scene = start(&case, F64);
            advance(&mut scene, 0.0);
            let moved: Vec<[f64; 3]> = scene.mesh().nodes.iter().map(|x| [stretch * x[0], 0.0, 0.0]).collect();
            scene.set_fluctuations(&moved);
            advance(&mut scene, 1e-9);
            check(&format!("stretched by {stretch}, lines {lines}"), &mut scene, 0.5);
        }
    }
}

/// Lines that diverge evenly in every slice: the worst case of fibres for the estimate.
#[test]
fn the_estimate_holds_for_a_yarn_that_is_twisted_or_spread() {
    let yarn = block("yarn", [8, 4, 2], [[0.0, -0.5, -0.2], [2.0, 0.5, 0.2]], 1.8e-9, charmetant());
    let case = with(scene(json!([yarn]), json!([])), &[("/effects/fibre_lines", json!({}))]);
    for amount in [0.1, 0.4] {
        let twisted = |[x, y, z]: [f64; 3]| {
            let (sin, cos) = f64::sin_cos(amount * x);
            [0.0, cos * y - sin * z - y, sin * y + cos * z - z]
        };
        let spread = |[x, y, _]: [f64; 3]| [0.0, 0.5 * amount * x * y, 0.0];
        for (what, change) in [("twisted", &twisted as &dyn Fn([f64; 3]) -> [f64; 3]), ("spread", &spread)] {
            let mut scene = start(&case, F64);
            advance(&mut scene, 0.0);
            let moved: Vec<[f64; 3]> = scene.mesh().nodes.iter().map(|x| change(*x)).collect();
            scene.set_fluctuations(&moved);
            advance(&mut scene, 1e-9);
            check(&format!("{what} by {amount}"), &mut scene, 0.5);
        }
    }
}

#[test]
fn the_estimate_holds_for_a_cell_with_contact_and_stick() {
    let mut cell = start(&coarse_cell(), F64);
    advance(&mut cell, 0.0);
    check("cell at rest", &mut cell, 0.5);
    // contacts begin and end all the time; none of that may count as stiffness
    for i in 0..=12 {
        let time = 1.5e-4 + 1e-4 * f64::from(i) / 12.0;
        advance(&mut cell, time);
        check(&format!("cell after {time:.3e} s"), &mut cell, 0.5);
    }
}

/// Nodes whose elements would require shorter steps are made heavier, but only as much as necessary.
#[test]
fn a_least_limit_holds_for_elements() {
    let mut case = coarse_cell();
    let mut before = start(&case, F64);
    advance(&mut before, 1.5e-4);
    for factor in [0.5, 3.0] {
        let least = factor * before.health().dt_limit;
        case["effects"] = json!({ "contact_mass": { "least_limit_s": least } });
        let mut cell = start(&case, F64);
        advance(&mut cell, 1.5e-4);
        let now = cell.health();
        println!("limit {:.3e} s, at least {least:.3e} s; {:.2?} of mass added", now.dt_limit, now.added_mass);
        if factor < 1.0 {
            assert_eq!(cell.state_hash(), before.state_hash());
        } else {
            near("limit", now.dt_limit, least, 1e-6);
            check("cell with a least limit", &mut cell, 0.5);
        }
    }
}

/// A time step above the measured limit fails within 2,000 steps; one below it is stable.
#[test]
fn steps_confirm_the_limit() {
    let cube = block("cube", [2, 2, 2], [[0.0; 3], [1.0; 3]], 1e-9, neo_hookean(100.0, 0.3));
    let mut case = scene(json!([cube]), json!([]));
    case["steps"] = json!([{ "hold": { "time_s": 1e-6 } }]);
    case["integration"] = json!({ "perturbation_mm": 0.001, "energy_tolerance": 100 });
    for lines in [json!({}), Value::Null] {
        case["effects"]["fibre_lines"] = lines;
        let mut scene = start(&case, F64);
        advance(&mut scene, 1e-6);
        let limit = check("cube", &mut scene, 0.5).limit;
        let (lasts, fails) = longest_step(&loaded(&case), &mut scene, 1.5 * limit).unwrap();
        println!("{lasts:.3e} s lasts, {fails:.3e} s fails, limit {limit:.3e} s");
        assert!(lasts < 1.05 * limit && fails > 0.95 * limit);
    }
}

/// Light nodes on a held face do not limit the time step.
#[test]
fn held_nodes_are_left_out() {
    let cube = block("cube", [4, 2, 2], [[0.0; 3], [1.0; 3]], 1e-9, neo_hookean(100.0, 0.3));
    let free = scene(json!([cube]), json!([]));
    let held = scene(json!([cube]), json!([{ "within": [[-1, -1, -1], [2, 2, 0.6]] }]));
    let limits = [free, held].map(|case| {
        let mut scene = start(&case, F64);
        advance(&mut scene, 0.0);
        let held = scene.prescribed_nodes();
        let state = check("cube", &mut scene, 0.5);
        assert!(!held.contains(&scene.health().limiting_node), "a held node sets the step");
        state.estimate
    });
    assert!(limits[1] > limits[0], "{limits:?}");
}
