//! `tricot study effects` on the coarse cell: rows for the requested effects, and changes due to an effect rather than to chance.
//! `tricot check --explain`: every effect with the reason for it.

use crate::common::{coarse_cell, held_specimen, loaded, with};
use serde_json::json;
use tricot::output::columns::Columns;
use tricot::run::{self, check};
use tricot::simulate::BackendConfig;
use tricot::study::effects::{Options, effects};

fn options(folder: &std::path::Path, only: &[&str]) -> Options {
    Options {
        config: BackendConfig { threads: 1, ..BackendConfig::default() },
        only: only.iter().map(|name| (*name).to_owned()).collect(),
        table: folder.join("effects.csv"),
        force: false,
    }
}

#[test]
fn each_effect_is_turned_off_in_turn_and_compared() {
    let folder = tempfile::tempdir().unwrap();
    let case = loaded(&with(coarse_cell(), &[("/output", json!({ "rows_per_step": 30 }))]));
    let options = options(folder.path(), &["thread-yarn contact", "bending", "fibre lines"]);
    let text = effects(&case, &options).unwrap_or_else(|e| panic!("{e}")).text;
    println!("{text}");
    let table = Columns::read(&options.table).unwrap();
    let names = ["nothing (a µm aside)", "thread-yarn contact", "bending", "fibre lines"];
    assert_eq!(table.texts("without"), names);
    assert!(names.iter().all(|name| text.contains(name)));
    for column in ["step_time_ratio", "run_time_ratio"] {
        assert!(table.numbers(column).iter().all(|ratio| ratio.is_finite() && *ratio > 0.0), "{column}");
    }
    let steps = table.numbers("steps");
    assert!(steps[3] > 2.0 * steps[0], "fibre lines lengthen the step: {steps:?}");
    for measure in ["F_nor_l2", "warp_width_l2", "stitch_tension_l2"] {
        let changes = table.numbers(measure);
        println!("{measure}: {changes:?}");
        assert!(changes.iter().all(|change| change.is_finite()));
        assert!(changes[1] > 10.0 * changes[0], "{measure} without contact of threads and yarns: {changes:?}");
    }
    for run in ["all", "nothing", "thread_yarn_contact", "bending", "fibre_lines"] {
        assert!(folder.path().join("effects").join(run).join("summary.json").is_file(), "{run}");
    }
    let again = effects(&case, &options).unwrap_err().to_string();
    assert!(again.contains("not empty") && again.contains("--force"), "{again}");
}

#[test]
fn an_effect_that_the_scene_does_not_have_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let message = effects(&loaded(&coarse_cell()), &options(folder.path(), &["gravity"])).unwrap_err().to_string();
    println!("{message}");
    assert!(message.contains("--only gravity") && message.contains("friction, "), "{message}");
}

/// If a guard stops the scene itself, there is nothing to compare with: the guard is the error.
#[test]
fn a_scene_that_a_guard_stops_is_the_error() {
    let folder = tempfile::tempdir().unwrap();
    let case = with(coarse_cell(), &[("/integration", json!({ "energy_tolerance": 1e-6 }))]);
    let options = options(folder.path(), &["friction"]);
    let error = effects(&loaded(&case), &options).unwrap_err();
    assert_eq!(error.exit_code(), 3, "{error}");
    assert!(error.to_string().contains("energy guard") && !options.table.exists(), "{error}");
}

#[test]
fn explain_names_every_effect_with_what_called_for_it_and_its_share() {
    let text = check(&loaded(&coarse_cell()), true).unwrap();
    println!("{}", text.split("\nstep\n").next().unwrap());
    let line = |name: &str| {
        text.lines().find(|line| line.starts_with(&format!("  {name} "))).unwrap_or_else(|| panic!("{name}"))
    };
    for (effect, cause) in [
        ("thread-yarn contact", "effects.contact.thread_yarn by default; "),
        ("yarn-yarn contact", "nodes of yarns are closer than 0.12 mm to another yarn"),
        ("thread-thread contact", "beams are closer"),
        ("friction", "a coefficient of friction of 0.2"),
        ("contact damping", "effects.contact.damping_ratio by default"),
        ("bending", "a thread has EI = 5.600e-4 N mm² > 0"),
        ("thermal strain", "a pretension step, and a thread with a thermal strain of -0.15"),
        ("damping", "effects.damping by default"),
        ("fibre lines", "effects.fibre_lines by default"),
        ("contact-aware mass", "effects.contact_mass by default"),
        ("mass floor", "effects.mass_floor by default; "),
        ("periodicity", "domain.cell"),
        ("energies by mode", "guards"),
    ] {
        assert!(line(effect).contains(cause), "{}", line(effect));
        assert!(effect == "mass floor" || line(effect).contains('%'), "{}", line(effect));
    }
    assert!(!text.contains("  gravity ") && !text.contains("  ties "));
    let specimen = loaded(&with(held_specimen(), &[("/effects/contact", json!({ "friction": false }))]));
    let text = check(&specimen, true).unwrap();
    let listed = text.split("\nstep\n").next().unwrap();
    let on: Vec<&str> =
        listed.lines().filter(|l| l.starts_with("  ties ") || l.starts_with("  prescribed motion ")).collect();
    println!("{on:#?}");
    assert!(
        on.len() == 2 && on[0].contains("nodes of cut threads are held") && on[1].contains("held clamp, moved clamp")
    );
    assert!(!listed.contains("\n  friction ") && !listed.contains("\n  periodicity "));
}

/// Every effect that can be turned off is absent from the scene without it.
#[test]
fn a_scene_without_an_effect_does_not_have_it() {
    for case in [coarse_cell(), held_specimen()] {
        let case = loaded(&case);
        let begun = |case: &tricot::rigs::read::Loaded| {
            let mut simulation = run::simulation(case, BackendConfig::default()).unwrap();
            simulation.advance(0.0, |_| false).unwrap();
            simulation
        };
        let found = run::effects::effects(&case, &begun(&case));
        assert!(found.len() > 10);
        for effect in found {
            let Some(without) = effect.without(&case) else { continue };
            let left = run::effects::effects(&without, &begun(&without));
            assert!(left.iter().all(|other| other.name != effect.name), "{} is still there", effect.name);
        }
    }
}
