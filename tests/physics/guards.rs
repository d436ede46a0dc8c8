//! Guards, provoked: each stops the run, and names the cause and the remedy.

use crate::common::{bare, block, charmetant, neo_hookean, start, with};
use serde_json::{Value, json};
use tricot::backend::Backend as _;
use tricot::backend::cpu::Cpu;
use tricot::case::expect::Verdict;
use tricot::contact::status;
use tricot::error::{Error, Guard};
use tricot::kernel::lane::Isa;
use tricot::kernel::row::Row;
use tricot::settings::integration::Precision::{F32, F64};
use tricot::simulate::Simulation;

/// Runs until a guard stops the run, which must happen by the given time.
#[track_caller]
fn stopped(simulation: &mut Simulation, until: f64) -> Guard {
    match simulation.advance(until, |_| false) {
        Err(Error::Guard(guard)) => {
            println!("{guard}");
            assert!(Verdict::of_cause(&guard.cause).is_some_and(|v| v != Verdict::Finished), "{}", guard.cause);
            guard
        }
        other => panic!("no guard: {other:?}, balance {}", simulation.health().balance),
    }
}

fn cube(name: &str, low: [f64; 3]) -> Value {
    block(name, [2, 2, 2], [low, low.map(|x| x + 1.0)], 1e-9, neo_hookean(100.0, 0.3))
}

fn scene(blocks: Value, contact: Value, integration: Value) -> Value {
    with(bare(), &[("/domain/mesh/blocks", blocks), ("/effects/contact", contact), ("/integration", integration)])
}

#[test]
fn a_fixed_step_beyond_the_limit() {
    let case = scene(json!([cube("cube", [0.0; 3])]), Value::Null, json!({ "dt_s": 1e-5 }));
    let guard = stopped(&mut start(&case, F64), 1.0);
    assert_eq!((guard.cause.as_str(), guard.step), ("time step", 0));
    assert!(guard.culprit.contains("cube") && guard.advice.contains("dt_s"));
}

#[test]
fn a_body_that_flies_away() {
    for precision in [F64, F32] {
        let mut body = cube("bullet", [0.0; 3]);
        body["velocity_mm_s"] = json!([0, 0, -3e5]);
        let mut simulation = start(&scene(json!([body]), Value::Null, json!({})), precision);
        let guard = stopped(&mut simulation, 1.0);
        assert_eq!(guard.cause, "position range");
        assert!(guard.culprit.contains("bullet"), "{guard}");
        let reached = simulation.fluctuations().iter().fold(0.0, |most: f64, w| most.max(w[2].abs()));
        assert!((252.0..256.0).contains(&reached), "{reached} mm");
    }
}

#[test]
fn a_hexahedron_turned_inside_out() {
    let yarn = block("yarn", [1, 1, 1], [[0.0; 3], [1.0; 3]], 1e-9, charmetant());
    let conditions = json!([{ "within": [[0, 0, 0], [1, 1, 0]] }, { "within": [[0, 0, 1], [1, 1, 1]], "displacement_mm": [0, 0, -1.5] }]);
    let case = with(
        scene(json!([yarn]), Value::Null, json!({ "energy_tolerance": 100 })),
        &[("/domain/mesh/conditions", conditions), ("/steps", json!([{ "move": { "time_s": 1e-3 } }]))],
    );
    let guard = stopped(&mut start(&case, F64), 1e-3);
    assert_eq!(guard.cause, "inversion");
    assert!(guard.culprit.contains("hexahedron 0 of yarn"), "{guard}");
}

/// Rounding in f32 lets the energy of a stiff part drift; f64 conserves it.
#[test]
fn an_energy_that_drifts_is_told_from_one_that_explodes() {
    let nodes: Vec<[f64; 3]> = (0..=50).map(|i| [0.2 * f64::from(i), 0.0, 0.0]).collect();
    let rod = json!({ "name": "rod", "nodes": nodes, "radius_mm": 0.1, "axial_n": 11, "bending_n_mm2": 50, "linear_density_tex": 43.4 });
    let effects = json!({ "gravity_mm_s2": [0.0, 0.0, -1e7], "damping": null });
    let case = with(
        bare(),
        &[
            ("/domain/mesh/threads", json!([rod])),
            ("/domain/mesh/conditions", json!([{ "within": [[0, -1, -1], [0.21, 1, 1]] }])),
            ("/effects", effects),
            ("/integration", json!({ "energy_tolerance": 0.05 })),
        ],
    );
    let guard = stopped(&mut start(&case, F32), 2e-3);
    assert_eq!(guard.cause, "energy");
    assert!(guard.advice.contains("drifts slowly") && guard.advice.contains("f64"), "{guard}");
    let mut exact = start(&case, F64);
    crate::common::advance(&mut exact, 2e-4);
    println!("balance in f64 {:.1e}", exact.health().balance);
    assert!(exact.health().balance.abs() < 1e-4, "{}", exact.health().balance);
}

#[test]
fn energy_from_nowhere() {
    let mut simulation = start(&scene(json!([cube("cube", [0.0; 3])]), Value::Null, json!({})), F32);
    crate::common::advance(&mut simulation, 1e-5);
    let mut thrown = simulation.velocities();
    thrown[13] = [1e5, 0.0, 0.0];
    simulation.set_velocities(&thrown);
    let guard = stopped(&mut simulation, 1e-3);
    assert!(guard.cause == "energy" || guard.cause == "inversion", "{guard}");
    assert!(guard.culprit.contains("(cube)") || guard.culprit.contains("of cube"), "{guard}");
    let mut whole = start(&scene(json!([cube("cube", [0.0; 3])]), Value::Null, json!({})), F32);
    crate::common::advance(&mut whole, 1e-5);
    whole.set_velocities(&[[100.0, 0.0, 0.0]; 27]);
    let guard = stopped(&mut whole, 1e-3);
    assert_eq!(guard.cause, "energy");
    assert!(guard.culprit.contains("fastest now: node ") && guard.culprit.contains(" (cube) at "), "{guard}");
    assert!(guard.advice.contains("explodes") && !guard.advice.contains("drifts"), "{guard}");
}

#[test]
fn a_velocity_that_is_not_a_number() {
    for precision in [F64, F32] {
        let mut simulation = start(&scene(json!([cube("cube", [0.0; 3])]), Value::Null, json!({})), precision);
        crate::common::advance(&mut simulation, 1e-5);
        let mut spoilt = simulation.velocities();
        spoilt[13][1] = f64::NAN;
        simulation.set_velocities(&spoilt);
        let guard = stopped(&mut simulation, 1e-3);
        assert_eq!(guard.cause, "non-finite");
        assert!(guard.culprit.contains("(cube)"), "{guard}");
    }
}

#[test]
fn bodies_that_run_through_each_other() {
    let mut thrown = cube("thrown", [0.1, 0.2, 1.01]);
    thrown["velocity_mm_s"] = json!([0, 0, -2e4]);
    let case = scene(
        json!([cube("target", [0.0; 3]), thrown]),
        json!({ "yarn_penalty_n_mm3": 5 }),
        json!({ "penetration_tolerance": 0.02, "energy_tolerance": 100 }),
    );
    let guard = stopped(&mut start(&case, F64), 1e-3);
    assert_eq!(guard.cause, "penetration");
    assert!(guard.culprit.contains("a yarn into a yarn"), "{guard}");
}

#[test]
fn threads_that_overlap_as_they_are_given() {
    let thread = |name: &str, ends: [[f64; 3]; 2]| json!({ "name": name, "nodes": ends, "radius_mm": 0.1, "axial_n": 11, "linear_density_tex": 10 });
    // one goes through the axis of the other, one passes it by less than their radii
    for height in [0.0, 0.05] {
        let threads =
            [thread("a", [[-0.5, 0.0, 0.0], [0.6, 0.0, 0.0]]), thread("b", [[0.0, -0.5, height], [0.0, 0.4, height]])];
        let case = with(bare(), &[("/domain/mesh/threads", json!(threads)), ("/effects/contact", json!({}))]);
        let guard = stopped(&mut start(&case, F64), 1.0);
        assert_eq!((guard.cause.as_str(), guard.step), ("penetration", 0));
        let depth = format!("{:.4} mm", 0.2 - height);
        assert!(guard.culprit.contains(&depth) && guard.culprit.contains("beams 0 and 1"), "{guard}");
        assert!(guard.advice.contains("overlap at the start"), "{guard}");
    }
}

#[test]
fn more_bodies_in_one_place_than_tables_can_hold() {
    let blocks: Vec<Value> = (0..100).map(|i| cube(&format!("cube {i}"), [0.01 * f64::from(i), 0.0, 0.0])).collect();
    let guard = stopped(&mut start(&scene(json!(blocks), json!({}), json!({})), F32), 1e-3);
    assert_eq!(guard.cause, "contact overflow");
    assert!(guard.culprit.contains("most crowded: node ") && guard.culprit.contains(" (cube "), "{guard}");
}

#[test]
fn a_contact_force_that_no_integer_holds() {
    let mut thrown = cube("thrown", [0.1, 0.2, 0.999]);
    thrown["velocity_mm_s"] = json!([0, 0, -1e7]);
    let integration = json!({ "dt_s": 1e-10, "energy_tolerance": 100, "penetration_tolerance": 100 });
    let case = scene(json!([cube("target", [0.0; 3]), thrown]), json!({}), integration);
    let case = with(case, &[("/steps", json!([{ "hold": { "time_s": 1e-6 } }]))]);
    for precision in [F64, F32] {
        let guard = stopped(&mut start(&case, precision), 1e-6);
        assert_eq!(guard.cause, "force range");
        assert!(guard.culprit.contains("(target)") || guard.culprit.contains("(thrown)"), "{guard}");
    }
}

/// Contact forces are summed as integers: a sum near the end of their range is reported, with its node, before more of them could
/// wrap it around.
#[test]
fn a_sum_of_contact_forces_out_of_range_is_reported() {
    const MOST: i32 = 1 << 30;
    let cubes = json!([cube("below", [0.0; 3]), cube("above", [0.0, 0.0, 1.0])]);
    let simulation = start(&scene(cubes, json!({}), json!({})), F32);
    let (plan, buffers) = (&simulation.model.plan, &simulation.model.buffers);
    let force = buffers.contact_force.unwrap();
    let assemble: Vec<_> = plan.step.iter().filter(|stage| stage.name() == "assemble").cloned().collect();
    let mut cpu = Cpu::<f32>::new(&plan.buffers, 1, Isa::best());
    let mut culprit = |place: usize, sum: i32| {
        let mut sums = vec![0; plan.describe(force).len];
        sums[place] = sum;
        cpu.set_bytes(force, bytemuck::cast_slice(&sums));
        cpu.clear(buffers.status);
        cpu.run(&assemble, &[Row::default()]);
        let status = cpu.uints(buffers.status);
        (status[status::FLAGS] == status::FORCE_RANGE).then_some(status[status::CULPRIT])
    };
    let nodes = simulation.mesh().nodes.len();
    assert_eq!(culprit(5, MOST), None);
    assert_eq!(culprit(5, MOST + 1), Some(5));
    assert_eq!(culprit(2 * nodes + 40, -MOST - 1), Some(40));
    assert_eq!(culprit(53, i32::MIN), Some(53), "a sum that has wrapped");
}
