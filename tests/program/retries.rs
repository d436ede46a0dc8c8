//! Rollback: shorter steps rescue a run whose step is too long, or it says how often it tried; its bits stay reproducible.

use crate::common::program::{can_resume, failed, folder, kill_after, program, ran, same, summary};
use crate::common::{bare, block, neo_hookean, with};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::time::Duration;
use tricot::case::expect::Verdict;
use tricot::simulate::BackendConfig;
use tricot::study::scene::Scenes;

/// A block that falls on a stiffer one: the steps are short enough until they meet, after some thousand of them.
fn fall(dt: f64, retries: usize) -> Value {
    let mut high = block("high", [2, 2, 2], [[0.1, 0.2, 1.3], [1.1, 1.2, 2.3]], 1e-9, neo_hookean(100.0, 0.3));
    high["velocity_mm_s"] = json!([0, 0, -300]);
    let low = block("low", [2, 2, 2], [[0.0; 3], [1.0; 3]], 1e-9, neo_hookean(100.0, 0.3));
    with(
        bare(),
        &[
            ("/domain/mesh/blocks", json!([low, high])),
            ("/effects/contact", json!({ "yarn_penalty_n_mm3": 20_000 })),
            ("/steps", json!([{ "hold": { "time_s": 5e-4 } }, { "hold": { "time_s": 7e-4 } }])),
            (
                "/integration",
                json!({ "dt_s": dt, "retries": retries, "penetration_tolerance": 100, "energy_tolerance": 0.2 }),
            ),
            (
                "/output",
                json!({ "rows_per_step": 12, "frames_per_step": 2, "pictures": false, "checkpoint_wall_s": 0.02 }),
            ),
        ],
    )
}

/// Stable while the blocks are apart, and not when they touch.
const TOO_LONG: f64 = 4e-7;

/// A column of the history.
fn column(dir: &Path, name: &str) -> Vec<f64> {
    let text = fs::read_to_string(dir.join("history.csv")).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let at = lines.next().unwrap().iter().position(|n| *n == name).unwrap();
    lines.map(|row| row[at].parse().unwrap()).collect()
}

#[test]
fn too_long_a_step_is_rescued_in_a_reproducible_way() {
    let folder = folder(&fall(TOO_LONG, 0));
    let folder = folder.path();
    let text = failed(&program(folder, "stopped", &[]).output().unwrap(), 3);
    assert!(!text.contains("retries"), "{text}");

    fs::write(folder.join("case.json"), fall(TOO_LONG, 4).to_string()).unwrap();
    let output = program(folder, "whole", &[]).stdout(std::process::Stdio::piped()).output().unwrap();
    let printed = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    println!("{printed}");
    let dir = folder.join("whole");
    let found = summary(&dir);
    let guards = found["retries"].as_array().unwrap();
    assert!(!guards.is_empty() && guards.len() <= 4, "{guards:?}");
    assert!(text.contains(guards[0].as_str().unwrap()), "{guards:?}, but {text}");
    let share = 0.5f64.powi(guards.len() as i32);
    assert_eq!(found["dt_share"], json!(share));
    assert!(printed.contains("retries    went back") && printed.contains(guards.last().unwrap().as_str().unwrap()));

    // one row for each moment, in order, first without and then with shorter steps
    let (time, step, dt, retries) =
        (column(&dir, "time_s"), column(&dir, "step"), column(&dir, "dt_s"), column(&dir, "retries"));
    assert!(time.len() == 24 && time.windows(2).all(|t| t[0] < t[1]) && step.windows(2).all(|s| s[0] < s[1]));
    assert!((retries[0], dt[0]) == (0.0, TOO_LONG), "the part before is kept");
    assert_eq!((*retries.last().unwrap(), *dt.last().unwrap()), (guards.len() as f64, share * TOO_LONG));
    assert!(column(&dir, "e_balance_error").iter().all(|e| e.abs() < 0.2));

    ran(folder, "again", &[]);
    same(folder, "whole", "again");

    // killed repeatedly, before and after the rollback
    let mut resume: &[&str] = &[];
    let mut kills = 0;
    for wait in (0..).map(|attempt| 20 + 15 * attempt) {
        let child = program(folder, "killed", resume).spawn().unwrap();
        while !can_resume(&folder.join("killed")) {
            std::thread::sleep(Duration::from_millis(1));
        }
        let (killed, ended) = kill_after(child, Duration::from_millis(wait));
        kills += u32::from(killed);
        if ended {
            break;
        }
        resume = &["--resume"];
    }
    println!("{kills} kills");
    assert!(kills > 1, "the run is too short to be killed");
    same(folder, "whole", "killed");
    assert_eq!(summary(&folder.join("killed"))["retries"], found["retries"]);
}

#[test]
fn retries_run_out() {
    // the step is beyond the limit of the blocks by themselves: the guard speaks before the first one
    let folder = folder(&fall(5e-5, 2));
    let folder = folder.path();
    let text = failed(&program(folder, "stopped", &[]).output().unwrap(), 3);
    println!("{text}");
    assert!(text.contains("time step guard at step 0 ") && text.contains("1.250e-5 s is longer"), "{text}");
    assert!(text.contains(" 3 times the estimated limit"));
    assert!(text.trim_end().ends_with("(2 retries with shorter steps did not help)"), "{text}");
    let found = summary(&folder.join("stopped"));
    assert_eq!(found["retries"].as_array().unwrap().len(), 2);
    assert_eq!(found["verdict"].as_str(), text.trim_end().strip_prefix("error: "));
    assert_eq!(fs::read_to_string(folder.join("stopped/history.csv")).unwrap().lines().count(), 1, "no row");
}

#[test]
fn a_study_goes_back_like_a_run() {
    let folder = folder(&fall(TOO_LONG, 4));
    let mut scenes = Scenes::new(BackendConfig { threads: 1, ..BackendConfig::default() });
    let (seen, _) = scenes.examine(&folder.path().join("case.json"), &[]).unwrap();
    println!("{} steps, {} retries, balance {:.2e}", seen.steps, seen.retries, seen.balance);
    assert_eq!(seen.verdict, Verdict::Finished, "{}", seen.message);
    assert!(seen.retries > 0 && seen.balance < 0.2 && seen.dt < TOO_LONG);
}
