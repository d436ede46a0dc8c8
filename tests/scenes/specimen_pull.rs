//! Physics of a bias-extension run on a specimen small enough for every day: what keeps the stitch tight at the cuts, and what
//! pulling costs.

use serde_json::json;
use std::path::Path;
use tricot::measure::stitches;
use tricot::mesh::linking;
use tricot::rigs::read::{Loaded, read};
use tricot::run;
use tricot::simulate::{BackendConfig, Simulation};

/// Displacement of the clamp, mm: 26° of shear without slip (Eq. 18).
const PULL: f64 = 1.2;

/// The small specimen of the cases, smaller still.
fn loaded(sets: &[&str]) -> Loaded {
    let steps = json!([
        { "pretension": { "time_s": 3e-3 } }, { "hold": { "time_s": 0.5e-3 } }, { "move": { "time_s": 3.2e-3 } }
    ]);
    let ours = ["domain.specimen.length_mm=20", "domain.specimen.width_mm=14"].map(String::from);
    let ours = ours.into_iter().chain([format!("domain.specimen.displacement_mm={PULL}"), format!("steps={steps}")]);
    let sets: Vec<String> = ours.chain(sets.iter().map(|s| s.to_string())).collect();
    read(Path::new("cases/bias_extension_small.json"), &sets).unwrap_or_else(|e| panic!("{e}"))
}

fn started(sets: &[&str]) -> Simulation {
    run::simulation(&loaded(sets), BackendConfig { threads: 2, ..BackendConfig::default() })
        .unwrap_or_else(|e| panic!("{e}"))
}

fn advance(simulation: &mut Simulation, until: f64) {
    simulation.advance(until, |_| false).unwrap_or_else(|e| panic!("{e}"));
}

/// Mean tension of the stitch, N.
fn tension(simulation: &Simulation) -> f64 {
    stitches::measure(&simulation.mesh(), &simulation.tensions()).unwrap().all.mean_n
}

/// Ends of load steps, s.
fn ends(simulation: &Simulation) -> Vec<f64> {
    simulation.schedule.phases().iter().map(|p| p.end).collect()
}

#[test]
fn held_ends_keep_the_stitch_tight_and_free_ends_do_not() {
    let [held, free] = ["held", "free"].map(|ends_are| {
        let mut simulation = started(&[&format!("domain.specimen.thread_ends={ends_are}")]);
        let times = ends(&simulation);
        [0, 1].map(|k| {
            advance(&mut simulation, times[k]);
            tension(&simulation)
        })
    });
    println!("mean tension after pretension and after the hold: held {held:.4?} N, free {free:.4?} N");
    assert!(held[1] > 2.0 * free[1], "{held:?} {free:?}");
    // both settle in the hold, but free ends unravel as well
    assert!(held[1] / held[0] > 1.1 * free[1] / free[0], "{held:?} {free:?}");
}

#[test]
fn pulling_balances_and_is_slow_and_the_force_rises() {
    let mut simulation = started(&[]);
    let times = ends(&simulation);
    advance(&mut simulation, times[1]);
    let tight = tension(&simulation);
    // pieces of equal displacement, but for the first with the jerk of the start
    let mut pieces = Vec::new();
    let mut last = (simulation.load().motion, simulation.energies().prescribed);
    for k in 1..=4 {
        advance(&mut simulation, times[1] + (times[2] - times[1]) * f64::from(k) / 4.0);
        let (e, h) = (simulation.energies(), simulation.health());
        let now = (simulation.load().motion, e.prescribed);
        let force = (now.1 - last.1) / (PULL * (now.0 - last.0));
        let kinetic = e.kinetic / e.internal();
        println!("{:.2} mm: {force:.4} N, kinetic share {kinetic:.4}, balance {:.4}", PULL * now.0, h.balance);
        assert!(h.balance.abs() < 0.02 && kinetic < 0.1);
        pieces.push(force);
        last = now;
    }
    assert!(pieces[0] > 0.0 && pieces.windows(2).all(|f| f[1] > f[0]), "{pieces:?}");
    assert!(tension(&simulation) > 0.8 * tight, "{tight} {}", tension(&simulation));
}

#[test]
fn every_cut_is_held_once_and_free_ends_leave_no_trace() {
    let ties = |ends_are: &str| {
        let simulation = started(&[&format!("domain.specimen.thread_ends={ends_are}")]);
        let stages = simulation.model.plan.step.iter().filter(|stage| stage.name() == "ties");
        (stages.map(|stage| stage.items().len()).sum::<usize>(), simulation.mesh().clone())
    };
    assert_eq!(ties("free").0, 0);
    let (count, mesh) = ties("held");
    let ends = mesh.threads.iter().flat_map(|t| [t.first, t.first + t.count - 1]);
    let free = ends.filter(|n| mesh.nodes[*n][0].abs() < 9.999).count();
    let heads = linking::open_heads(&mesh).len();
    println!("{free} free ends, {heads} open heads, {count} ties");
    assert!(free > 0 && heads > 0 && count == free + heads);
}
