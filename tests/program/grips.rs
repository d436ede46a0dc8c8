//! Forces of grips and displacements of probes in every row, against the closed form of a bar in tension.

use crate::common::{bare, block, loaded, near, neo_hookean, options, with};
use serde_json::{Value, json};
use std::path::Path;
use tricot::output::columns::Columns;
use tricot::output::rows::Reaction;
use tricot::run::{check, run};

const YOUNG: f64 = 100.0;
const LENGTH: f64 = 8.0;

/// A bar of 8 × 1 × 1 mm without lateral strain, whose ends are displaced along it and then held.
fn bar(left: f64, right: f64) -> Value {
    let body = block("bar", [8, 1, 1], [[0.0; 3], [LENGTH, 1.0, 1.0]], 1e-9, neo_hookean(YOUNG, 0.0));
    let end = |name: &str, x: f64, way: f64| {
        let within = [[x - 0.01, -1.0, -1.0], [x + 0.01, 2.0, 2.0]];
        json!({ "name": name, "within": within, "displacement_mm": [way, 0.0, 0.0] })
    };
    let probes = json!([
        { "name": "left", "at": { "node": 0 } },
        { "name": "middle", "at": { "within": [[3.99, -1, -1], [4.01, 2, 2]] } }
    ]);
    with(
        bare(),
        &[
            ("/domain/mesh/blocks", json!([body])),
            ("/domain/mesh/conditions", json!([end("left grip", 0.0, left), end("right grip", LENGTH, right)])),
            ("/effects/damping", json!({ "rate_per_s": 2e4 })),
            ("/steps", json!([{ "move": { "time_s": 2e-3 } }, { "hold": { "time_s": 1e-3 } }])),
            ("/output", json!({ "rows_per_step": 20, "pictures": false, "probes": probes })),
        ],
    )
}

/// The last row of a column, of a condition if there is one.
fn last(dir: &Path, table: &str, condition: Option<&str>, column: &str) -> f64 {
    let table = Columns::read(&dir.join(table)).unwrap();
    let numbers = table.numbers(column);
    let names = table.texts("condition");
    let row = (0..table.len()).rev().find(|row| condition.is_none_or(|name| names[*row] == name)).unwrap();
    numbers[row]
}

#[test]
fn grips_of_a_bar_pull_with_its_force() {
    // energy per volume μ/2 (λ² − 1) − μ ln λ with ν = 0 and μ = E/2
    let stretch: f64 = 1.02;
    let force = 0.5 * YOUNG * (stretch - 1.0 / stretch);
    for (left, right, machine) in [(0.0, 0.16, force), (-0.08, 0.08, 2.0 * force), (-0.04, 0.12, force * 4.0 / 3.0)] {
        let folder = tempfile::tempdir().unwrap();
        let dir = folder.path().join("bar");
        let outcome = run(&loaded(&bar(left, right)), &options(dir.clone(), 1)).unwrap();
        assert!(outcome.text.contains("at rest after load step 2 (hold)"), "{}", outcome.text);
        let of = |grip: &str, column: &str| last(&dir, "reactions.csv", Some(grip), column);
        near("force of the left grip", of("left grip", "force_x_n"), -force, 1e-3);
        near("force of the right grip", of("right grip", "force_x_n"), force, 1e-3);
        near("its size", of("right grip", "force_n"), force, 1e-3);
        near("across", of("right grip", "force_y_n"), 0.0, 1e-4);
        // the machine does work on the largest displacement
        near("force of the machine", last(&dir, "history.csv", None, "force_n"), machine, 1e-3);
        let probe = |name: &str| last(&dir, "probes.csv", None, name);
        near("probe at the left", probe("left x_mm"), left, 1e-6);
        near("probe in the middle", probe("middle x_mm"), 0.5 * (left + right), 1e-3);
        near("and across", probe("middle y_mm"), 0.0, 1e-5);
        let rows = Columns::read(&dir.join("reactions.csv")).unwrap().len();
        assert_eq!(rows, 2 * Columns::read(&dir.join("history.csv")).unwrap().len(), "one row a grip");
    }
}

#[test]
fn names_with_commas_and_quotes_survive_a_round_trip() {
    let [body, grip, probe] = ["bar, the \"long\" one", "grip, \"left\"", "\", at"];
    let case = with(
        bar(0.0, 0.16),
        &[
            ("/domain/mesh/blocks/0/name", json!(body)),
            ("/domain/mesh/conditions/0/name", json!(grip)),
            ("/domain/mesh/conditions/0/body", json!(body)),
            ("/output/probes/0/name", json!(probe)),
            ("/steps", json!([{ "move": { "time_s": 1e-5 } }])),
            ("/output/rows_per_step", json!(2)),
        ],
    );
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("bar");
    run(&loaded(&case), &options(dir.clone(), 1)).unwrap();
    let read = |table: &str| Columns::read(&dir.join(table)).unwrap();
    let reactions: Vec<Reaction> = read("reactions.csv").rows().unwrap();
    let names: Vec<&str> = reactions.iter().map(|row| row.condition.as_str()).collect();
    assert_eq!(names, [grip, "right grip", grip, "right grip"]);
    assert_eq!(read("probes.csv").names()[3..6], ["x", "y", "z"].map(|axis| format!("{probe} {axis}_mm")));
    assert_eq!(read("probes.csv").numbers(&format!("{probe} x_mm")).len(), 2);
}

#[test]
fn a_scene_that_swings_is_not_called_at_rest() {
    let swinging = with(bar(0.0, 0.16), &[("/effects/damping", Value::Null), ("/steps/0/move/time_s", json!(2e-5))]);
    let folder = tempfile::tempdir().unwrap();
    let outcome = run(&loaded(&swinging), &options(folder.path().join("bar"), 1)).unwrap();
    assert!(outcome.text.contains("still moving"), "{}", outcome.text);
}

#[test]
fn probes_that_are_nowhere_are_named() {
    for (at, wanted) in [
        (json!({ "node": 999 }), "output.probes.0.at: 999 is no node: they go from 0 to 35"),
        (json!({ "first_of": "x" }), "output.probes.0.at: there is no thread \"x\""),
        (json!({ "within": [[50, 0, 0], [51, 1, 1]] }), "output.probes.0.at: no node is in this box"),
    ] {
        let case = loaded(&with(bar(0.0, 0.1), &[("/output/probes", json!([{ "name": "p", "at": at }]))]));
        let folder = tempfile::tempdir().unwrap();
        let ran = run(&case, &options(folder.path().join("bar"), 1)).unwrap_err().to_string();
        let checked = check(&case, false).unwrap_err().to_string();
        assert!(ran.contains(wanted), "{ran}");
        assert_eq!(checked, ran);
    }
}
