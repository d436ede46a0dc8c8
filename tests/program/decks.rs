//! Decks of a cell and a specimen as CalculiX reads them: it runs a static step on each as it is written.
//!
//! Without `ccx` the test passes without a check, unless `TRICOT_REQUIRE_CCX` is set.

use crate::common::{coarse_cell, held_specimen, loaded};
use serde_json::Value;
use std::fs;
use std::process::Command;
use tricot::run;

/// Displacements of nodes in a results file, by node.
fn displacements(text: &str) -> Vec<(usize, [f64; 3])> {
    let lines = text.lines().skip_while(|line| !line.contains("displacements")).skip(1);
    let lines = lines.skip_while(|line| line.trim().is_empty()).take_while(|line| !line.trim().is_empty());
    let row = |line: &str| {
        let mut words = line.split_whitespace();
        let node = words.next().unwrap().parse().unwrap();
        (node, [0; 3].map(|_| words.next().unwrap().parse().unwrap()))
    };
    lines.map(row).collect()
}

/// Displacements along x of the mesh of a case with some sets held, each with its degrees of freedom, and with sets that are moved
/// along x by some way, mm; `None` without `ccx`.
fn moved(case: &Value, sets: &[String], moved: &[(&str, f64)]) -> Option<Vec<f64>> {
    if Command::new("ccx").arg("-v").output().is_err() {
        assert!(std::env::var_os("TRICOT_REQUIRE_CCX").is_none(), "there is no ccx: install calculix-ccx");
        println!("skipped: there is no ccx");
        return None;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    run::mesh(&loaded(case), folder, true).unwrap();
    let held: String = sets.iter().map(|set| format!("{set}\n")).collect();
    let ways: String = moved.iter().map(|(set, way)| format!("{set}, 1, 1, {way}\n")).collect();
    let step = format!(
        "*INCLUDE, INPUT=mesh.inp\n*BOUNDARY\n{held}*STEP\n*STATIC\n*BOUNDARY\n{ways}*NODE PRINT, NSET=ALL_NODES\nU\n\
         *END STEP\n"
    );
    fs::write(folder.join("step.inp"), step).unwrap();
    let output = Command::new("ccx").arg("step").current_dir(folder).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && said.contains("Job finished") && !said.contains("*ERROR"), "{said}");
    let found = displacements(&fs::read_to_string(folder.join("step.dat")).unwrap());
    let deck = fs::read_to_string(folder.join("mesh.inp")).unwrap();
    let nodes = deck.lines().skip_while(|line| !line.starts_with("*NODE")).skip(1);
    assert_eq!(found.len(), nodes.take_while(|line| !line.starts_with('*')).count(), "every node has a displacement");
    Some(found.iter().map(|(_, u)| u[0]).collect())
}

/// A cell whose wefts are stretched: the moved nodes move farthest.
#[test]
fn calculix_stretches_a_cell() {
    let sets = ["PERIODIC_X_ORIGINAL", "PERIODIC_X_COPY", "PERIODIC_Y_ORIGINAL", "PERIODIC_Y_COPY"];
    let held = sets.map(|set| format!("{set}, 1, 3"));
    let Some(found) = moved(&coarse_cell(), &held, &[("PERIODIC_X_COPY", 1e-3)]) else { return };
    let largest = found.into_iter().fold(0.0, f64::max);
    println!("largest displacement {largest:.4e} mm");
    assert!((largest / 1e-3 - 1.0).abs() < 1e-3);
}

/// A specimen whose ends all have the same displacement moves as a whole.
#[test]
fn calculix_moves_a_specimen() {
    let sets = ["HELD_CLAMP", "MOVED_CLAMP", "YARN_ENDS", "THREAD_ENDS"];
    // a bent thread whose ends may turn could turn about the line through both
    let held = [("HELD_CLAMP", 3), ("MOVED_CLAMP", 3), ("YARN_ENDS", 3), ("THREAD_ENDS", 6)];
    let held = held.map(|(set, last)| format!("{set}, 1, {last}"));
    let Some(found) = moved(&held_specimen(), &held, &sets.map(|set| (set, 1e-3))) else { return };
    let furthest = found.into_iter().map(|u| (u / 1e-3 - 1.0).abs()).fold(0.0, f64::max);
    println!("largest relative error {furthest:.1e}");
    assert!(furthest < 1e-4);
}
