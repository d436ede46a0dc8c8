//! Studies and comparisons of runs: they say what the tables of the runs say, and go on where they were stopped.

mod common;

use common::{coarse_cell, with};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tricot::output::columns::Columns;
use tricot::study::difference::relative_l2;
use tricot::study::results::{MEASURES, Results};

/// A coarse cell that is tightened and sheared by little, as a file.
fn cell(folder: &Path) -> PathBuf {
    let path = folder.join("cell.json");
    let output = json!({ "rows_per_step": 50, "pictures": false, "frames_at_deg": [] });
    fs::write(&path, with(coarse_cell(), &[("/output", output)]).to_string()).unwrap();
    path
}

fn tricot(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_tricot")).args(arguments).output().unwrap()
}

#[track_caller]
fn text(output: &Output) -> String {
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    String::from_utf8(output.stdout.clone()).unwrap()
}

#[test]
fn comparisons_say_what_the_tables_say() {
    let folder = tempfile::tempdir().unwrap();
    let case = cell(folder.path());
    let run = |name: &str, sets: &[&str]| {
        let dir = folder.path().join(name);
        let mut arguments = vec!["run", case.to_str().unwrap(), "-q", "--backend", "cpu", "-o", dir.to_str().unwrap()];
        sets.iter().for_each(|set| arguments.extend(["--set", set]));
        text(&tricot(&arguments));
        dir
    };
    let a = run("a", &["steps.1.shear.time_s=8e-5", "steps.1.shear.angle_deg=-2"]);
    let b = run("b", &[]);
    let of = |a: &Path, b: &Path, option: &[&str]| {
        let folders = [a, b].map(|p| p.to_str().unwrap());
        text(&tricot(&[&["compare"], &folders[..], option].concat()))
    };
    let same: Value = serde_json::from_str(&of(&b, &b, &["--json"])).unwrap();
    assert!(same["case"].as_array().unwrap().is_empty());
    let measures = same["measures"].as_array().unwrap();
    assert!(measures.len() == 9 && measures.iter().all(|m| m["relative_l2"] == 0.0), "{measures:?}");

    let table = folder.path().join("difference.csv");
    let told = of(&a, &b, &["-o", table.to_str().unwrap()]);
    assert!(told.contains("steps.1.shear.angle_deg: -2.0 and 3.0"), "{told}");
    assert!(told.contains("steps.1.shear.time_s: 8e-5 and 0.0001") || told.contains("0.00008 and 0.0001"), "{told}");
    let json: Value = serde_json::from_str(&of(&a, &b, &["--json"])).unwrap();
    assert_eq!(json["case"].as_array().unwrap().len(), 2);
    let table = Columns::read(&table).unwrap();
    let row = table.texts("measure").iter().position(|m| *m == "F_nor").unwrap();
    assert_eq!(json["measures"][row]["relative_l2"].as_f64().unwrap(), table.numbers("relative_l2")[row]);

    // the other way of shear has positive angles and forces, and rows up to its end
    let [a, b] = [&a, &b].map(|dir| Results::read(dir).unwrap());
    let curves = [a.curve(&MEASURES[0]), b.curve(&MEASURES[0])];
    let ends = curves.each_ref().map(|curve| curve[curve.len() - 1]);
    assert!(ends[0][0] > 1.95 && ends[0][0] < 2.0 && ends[1][0] > 2.95, "{ends:?}");
    assert!(ends.iter().all(|end| end[1] > 0.0), "{ends:?}");
    assert!((json["range"][1].as_f64().unwrap() - 2.0).abs() < 0.01, "{}", json["range"]);

    // by another route: forces where both have the angle, without windows; windows take away jitter, so this one is larger
    let history = Columns::read(&b.folder.join("history.csv")).unwrap();
    let rows: Vec<[f64; 2]> = history
        .numbers("shear_angle_deg")
        .into_iter()
        .zip(history.numbers("f_nor_n_per_mm"))
        .zip(history.texts("phase"))
        .filter(|((angle, _), phase)| *phase == "shear" && *angle < 1.9)
        .map(|((angle, force), _)| [angle, force])
        .collect();
    let nearest = |angle: f64| {
        let off = |p: &&[f64; 2]| (p[0] - angle).abs();
        curves[0].iter().min_by(|p, q| off(p).total_cmp(&off(q))).unwrap()[1]
    };
    let others: Vec<f64> = rows.iter().map(|p| nearest(p[0])).collect();
    let direct = relative_l2(&others, &rows.iter().map(|p| p[1]).collect::<Vec<_>>());
    let stated = table.numbers("relative_l2")[row];
    assert!(stated > 0.1 * direct && stated < 1.5 * direct, "{stated} where rows differ by {direct}");

    let none = tricot(&["compare", folder.path().to_str().unwrap(), b.folder.to_str().unwrap()]);
    assert_eq!(none.status.code(), Some(4));
    assert!(String::from_utf8_lossy(&none.stderr).contains("no history.csv"));
}
