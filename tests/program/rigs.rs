//! Rigs of the fabric: balances that hold whatever the fabric does, in both precisions.

use crate::common::program::{self, balanced, contents, copy, same};
use crate::common::with;
use serde_json::{Value, json};
use std::fs;
use tempfile::TempDir;
use tricot::output::columns::Columns;
use tricot::settings::integration::Precision::{self, F32, F64};

/// A coarse mesh of every rig, and quick load steps.
const COARSE: [&str; 3] = [
    r#"resolution={ "warp_columns": 6, "weft_columns": 4, "slice_mm": 1, "beams_per_lap": 34 }"#,
    "output.pictures=false",
    "output.rows_per_step=20",
];

/// The folder and the summary of a shipped case with changes.
fn ran(case: &str, sets: &[&str], precision: Precision) -> (TempDir, Value) {
    balanced(case, &[&COARSE[..], sets].concat(), precision)
}

fn table(folder: &TempDir, name: &str) -> Columns {
    Columns::read(&folder.path().join("run").join(name)).unwrap()
}

/// Both plates bear the same load, also of a sheared cell, and a sheared cell has more fibres between them.
#[test]
fn plates_press_a_cell_from_both_sides() {
    for (precision, angle) in [(F32, 0.0), (F64, 0.0), (F32, 20.0)] {
        let steps = format!(
            r#"steps=[{{ "pretension": {{ "time_s": 1e-3 }} }}, {{ "shear": {{ "angle_deg": {angle}, "time_s": 3e-3 }} }},
                {{ "move": {{ "time_s": 5e-3 }} }}]"#
        );
        let steps = if angle == 0.0 {
            r#"steps=[{ "pretension": { "time_s": 1e-3 } }, { "move": { "time_s": 5e-3 } }]"#
        } else {
            &steps
        };
        let (folder, summary) = ran("cell_compaction", &[steps, "domain.cell_compaction.thickness_mm=0.7"], precision);
        let plates = table(&folder, "plates.csv");
        let [upper, lower] =
            ["upper", "lower"].map(|plate| *plates.numbers(&format!("{plate}_pressure_mpa")).last().unwrap());
        println!("{precision:?}, {angle}°: {upper} and {lower} MPa");
        assert!(upper > 0.02 && (upper - lower).abs() < 0.02 * upper, "{upper} {lower}");
        let compaction = &summary["compaction"];
        assert!((compaction["thickness_mm"].as_f64().unwrap() - 0.7).abs() < 1e-4);
        // two plies of 300 g/m² of fibres of 1.8 g/cm³, on less ground when sheared
        let share = 2.0 * 300e-6 / 1.8e-3 / 0.7 / f64::to_radians(angle).cos();
        let stretch =
            [&summary["fibres"]["warp"], &summary["fibres"]["weft"]].map(|ply| ply["stretch"].as_f64().unwrap());
        let share = share / (stretch[0] * stretch[1]);
        assert!(
            (compaction["fibre_volume_fraction"].as_f64().unwrap() / share - 1.0).abs() < 1e-3,
            "{compaction} {share}"
        );
    }
}

/// The machine of a frame does the work of its clamps, and its force follows from Eqs 16 and 17.
#[test]
fn the_machine_of_a_frame_does_the_work_of_its_clamps() {
    for precision in [F32, F64] {
        let (folder, _) = ran(
            "picture_frame_small",
            &[
                "domain.picture_frame.frame_mm=20",
                "domain.picture_frame.fabric_mm=14",
                r#"steps=[{ "pretension": { "time_s": 1e-3 } }, { "shear": { "angle_deg": 20, "time_s": 6e-3 } }]"#,
            ],
            precision,
        );
        let (frame, energies) = (table(&folder, "frame.csv"), table(&folder, "energies.csv"));
        let (force, way) = (frame.numbers("machine_force_n"), frame.numbers("machine_displacement_mm"));
        let work = energies.numbers("prescribed_work_mj");
        let rows: Vec<usize> = (1..force.len()).filter(|row| force[*row].is_finite()).collect();
        let done: f64 = rows.iter().map(|row| force[*row] * (way[*row] - way[row - 1])).sum();
        let (first, last) = (rows[0], rows[rows.len() - 1]);
        let given = work[last] - work[first - 1];
        println!("{precision:?}: the machine does {done} mJ, the clamps {given} mJ");
        assert!(given > 0.05 && (done / given - 1.0).abs() < 2e-3);
        assert!((frame.numbers("shear_angle_deg")[last] - 20.0).abs() < 1e-3);
    }
}

/// What pulls the yarn is borne by the held edges, once inertia has died away.
#[test]
fn the_edges_bear_what_pulls_the_yarn_out() {
    let steps = r#"steps=[{ "pretension": { "time_s": 1e-3 } }, { "move": { "time_s": 6e-3 } }, { "hold": { "time_s": 4e-3 } }]"#;
    for (ply, precision) in [("warp", F32), ("weft", F64)] {
        let ply_set = format!("domain.pull_out.ply={ply}");
        let sets = [&ply_set, steps, "domain.pull_out.length_mm=16", "domain.pull_out.width_mm=16"];
        let (folder, summary) = ran("pull_out", &sets, precision);
        let reactions = table(&folder, "reactions.csv");
        let (names, force) = (reactions.texts("condition"), reactions.numbers("force_x_n"));
        let last =
            |name: &str| names.iter().zip(&force).filter(|(n, _)| **n == name).map(|(_, f)| *f).next_back().unwrap();
        let (pulled, held) = (last("pulled yarn"), last("held edges"));
        println!("{ply} {precision:?}: {pulled} N pulled, {held} N held; {}", summary["pull_out"]);
        assert!(pulled > 0.01 && (pulled + held).abs() < 0.03 * pulled, "{pulled} {held}");
    }
}

/// The plate finds the coefficient that it was given.
#[test]
fn a_sliding_plate_finds_its_coefficient() {
    for (coefficient, precision) in [(0.3, F32), (0.1, F64)] {
        let set = format!("domain.tool_friction.coefficient={coefficient}");
        let steps = r#"steps=[{ "pretension": { "time_s": 1e-3 } }, { "move": { "time_s": 8e-3 } }]"#;
        let (_, summary) = ran("tool_friction", &[&set, steps], precision);
        let found = summary["property"]["evaluated"].as_f64().unwrap();
        println!("{precision:?}: {found} of {coefficient}");
        assert!((found / coefficient - 1.0).abs() < 0.02, "{found}");
    }
}

/// Tools are part of the state: a run with moving tools goes on from a checkpoint to the same files.
#[test]
fn tools_go_on_from_a_checkpoint_to_the_same_files() {
    let case: Value = serde_json::from_str(include_str!("../../cases/ball_on_yarn.json")).unwrap();
    let free = json!({ "axes": [true, true, true], "mass_g": 0.01, "force_n": [0.02, 0, -0.1] });
    let folder = program::folder(&with(
        case,
        &[
            ("/domain/mesh/tools/1/displacement_mm", json!([0, 0, 0])),
            ("/domain/mesh/tools/1/free", free),
            ("/output", json!({ "rows_per_step": 10, "pictures": false })),
        ],
    ));
    let folder = folder.path();
    program::ran(folder, "whole", &[]);
    copy(&folder.join("whole"), &folder.join("resumed"));
    let states = contents(&folder.join("resumed/state"));
    let later = states.iter().filter(|(path, _)| !path.to_str().unwrap().ends_with("-1-move.state"));
    let removed = later.map(|(path, _)| fs::remove_file(path).unwrap()).count();
    assert!(removed > 0 && removed < states.len());
    program::ran(folder, "resumed", &["--resume"]);
    same(folder, "whole", "resumed");
    let moved = Columns::read(&folder.join("whole/tools.csv")).unwrap().numbers("displacement_x_mm");
    assert!(moved.last().unwrap().abs() > 1e-3, "the ball has not moved");
}
