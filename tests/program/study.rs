//! Studies and comparisons of runs: they agree with the tables of the runs, and continue where they were stopped.

use crate::common::{coarse_cell, with};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::SystemTime;
use tricot::output::columns::Columns;
use tricot::rigs::read::read;
use tricot::run::{self, Machine};
use tricot::study::accuracy::{Options, accuracy};
use tricot::study::difference::{difference, relative_l2};
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
    let told = [json["measures"][row]["relative_l2"].as_f64().unwrap(), table.numbers("relative_l2")[row]];
    assert!((told[0] - told[1]).abs() < 1e-12, "{told:?}");

    // shear to the other side has positive angles and forces, and rows up to its end
    let [a, b] = [&a, &b].map(|dir| Results::read(dir).unwrap());
    let curves = [a.curve(&MEASURES[0]), b.curve(&MEASURES[0])];
    let ends = curves.each_ref().map(|curve| curve[curve.len() - 1]);
    assert!(ends[0][0] > 1.95 && ends[0][0] < 2.0 && ends[1][0] > 2.95, "{ends:?}");
    assert!(ends.iter().all(|end| end[1] > 0.0), "{ends:?}");
    assert!((json["range"][1].as_f64().unwrap() - 2.0).abs() < 0.01, "{}", json["range"]);

    // by another route: forces at common angles, without windows; windows remove jitter, so this difference is larger
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

/// A study of a cell that is sheared at once.
fn study(case: &Path, sets: &[&str], points: &[&str], dir: &Path) -> String {
    let hurried = ["steps.0.pretension.time_s=8e-5", "steps.1.shear.time_s=5e-5"];
    let sets: Vec<String> = hurried.iter().chain(sets).map(|s| (*s).to_owned()).collect();
    let points = points.iter().map(|s| (*s).to_owned()).collect();
    let options = Options { output: dir.to_path_buf(), points, machine: Machine::Cpu, threads: Some(2), quiet: true };
    let study = accuracy(case, &sets, &options).unwrap_or_else(|e| panic!("{e}"));
    assert!(!study.interrupted);
    study.text
}

#[test]
fn a_study_says_what_its_runs_say_and_runs_none_of_them_twice() {
    let folder = tempfile::tempdir().unwrap();
    let (case, dir) = (cell(folder.path()), folder.path().join("study"));
    let told = study(&case, &[], &["loading × 0.5", "beams × 0.6", "beams × 2"], &dir);
    println!("{told}");
    let table = Columns::read(&dir.join("accuracy.csv")).unwrap();
    let labels = table.texts("point");
    let expected = [
        "default",
        "a micrometre aside",
        "a micrometre to the other side",
        "two beams less",
        "one beam less",
        "one beam more",
        "two beams more",
        "reference",
        "beams × 0.6",
        "beams × 2",
        "loading × 0.5",
    ];
    assert_eq!(labels, expected);
    let row = |label: &str| labels.iter().position(|l| *l == label).unwrap();
    let impossible = row("beams × 0.6");
    assert!(labels.iter().all(|label| told.contains(label)), "{told}");
    let times = table.numbers("time_over_default");
    assert_eq!(table.texts("ended")[impossible], "impossible", "19 beams do not go around a lap");
    assert!((times[..3].iter().sum::<f64>() - 3.0).abs() < 1e-9, "{times:?}");
    assert_eq!(times.iter().filter(|time| time.is_nan()).count(), 1, "{times:?}");
    // several times the work, whatever the load of the machine
    assert!(times[row("reference")] > 2.0, "{times:?}");

    // errors are differences from the reference, and none is claimed below the effect of node positions
    let json: Value = serde_json::from_slice(&fs::read(dir.join("accuracy.json")).unwrap()).unwrap();
    let of = |name: &str| Results::read(&dir.join("points").join(name)).unwrap();
    let by = |what: &str| json[what]["F_nor"].as_f64().unwrap();
    let (reference, chance, places) = (of("reference"), by("by_chance"), by("by_places_of_nodes"));
    assert!(chance > 0.0 && places > chance, "{chance} {places}");
    for (row, label) in labels.iter().enumerate().filter(|(row, _)| *row != impossible) {
        let name = label.replace(" × ", "-").replace(' ', "-");
        let name = name.as_str();
        let found = difference(&of(name).curve(&MEASURES[0]), &reference.curve(&MEASURES[0])).unwrap().l2;
        let (key, expected) = if found < places { ("below", places) } else { ("l2", found) };
        let stated = json["points"][row]["errors"]["F_nor"][key].as_f64().unwrap();
        assert!((stated - expected).abs() <= 1e-12 * expected, "{name}: {stated} for {expected}");
        let cell = table.texts("error_f_nor")[row];
        let claimed: f64 = cell.trim_start_matches('<').parse().unwrap();
        assert_eq!((claimed, cell.starts_with('<')), (found.max(places), found < places), "{name}");
    }

    // the flags of a point reproduce it, from the tightened state where only the loading differs
    let flags = table.texts("flags");
    assert_eq!(flags[row("beams × 2")], "--set resolution.beams_per_lap=64");
    let loading = flags[row("loading × 0.5")];
    assert!(loading.starts_with("--set steps.1.shear.time_s=0.000025 --from points/default/state/"), "{loading}");
    let hash = |dir: &Path| {
        let summary: Value = serde_json::from_slice(&fs::read(dir.join("summary.json")).unwrap()).unwrap();
        summary["state_hash"].as_str().unwrap().to_owned()
    };
    let sets = ["steps.0.pretension.time_s=8e-5", "steps.1.shear.time_s=5e-5", "resolution.beams_per_lap=64"];
    let again = crate::common::options(folder.path().join("again"), 1);
    run::run(&read(&case, &sets.map(String::from)).unwrap(), &again).unwrap();
    assert_eq!(hash(&again.output), hash(&dir.join("points/beams-2")));

    let page = fs::read_to_string(dir.join("accuracy.html")).unwrap();
    assert!(
        page.contains("19, but a lap needs at least 24 beams")
            && page.contains("beams × 2")
            && page.matches("<svg").count() >= 6
    );
    let chart = fs::read_to_string(dir.join("accuracy.svg")).unwrap();
    assert!(chart.contains("error of F_nor") && chart.contains("loading × 0.5"));

    // the same points are found, a new one is run, and another case is another study
    let written = |name: &str| -> SystemTime {
        fs::metadata(dir.join("points").join(name).join("point.json")).unwrap().modified().unwrap()
    };
    let before = ["default", "reference", "beams-2"].map(written);
    let told = study(&case, &[], &["beams × 2", "β × 2"], &dir);
    assert_eq!(before, ["default", "reference", "beams-2"].map(written));
    assert!(told.contains("β × 2") && dir.join("points/b-2/point.json").is_file(), "{told}");
    study(&case, &["fabric.friction=0.3"], &["beams × 2"], &dir);
    let after = ["default", "reference", "beams-2"].map(written);
    assert!(before.iter().zip(after).all(|(before, after)| *before < after));
}
