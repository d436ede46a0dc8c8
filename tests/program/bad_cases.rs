//! Every case in `cases/bad` gets exactly the message beside it, and no input makes the reader panic.
//! `TRICOT_WRITE_MESSAGES=1 cargo test --release --test program bad_cases` writes the messages anew, to be read before they are committed.

use proptest::prelude::*;
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tricot::rigs::read::read;

const GOOD: &str = "cases/unit_cell_shear.json";

fn bad_cases() -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = fs::read_dir("cases/bad").unwrap().map(|e| e.unwrap().path()).collect();
    found.retain(|path| path.extension().is_some_and(|e| e == "json"));
    found.sort();
    assert!(found.len() >= 45, "{} bad cases", found.len());
    found
}

#[test]
fn every_bad_case_gets_its_message() {
    let mut wrong = vec![];
    for case in bad_cases() {
        let Err(error) = read(&case, &[]) else {
            wrong.push(format!("{} is accepted", case.display()));
            continue;
        };
        let message = error.to_string();
        let beside = case.with_extension("txt");
        if std::env::var_os("TRICOT_WRITE_MESSAGES").is_some() {
            fs::write(&beside, format!("{message}\n")).unwrap();
        }
        let expected = fs::read_to_string(&beside).unwrap_or_default();
        if expected.strip_suffix('\n') != Some(&message) {
            wrong.push(format!("{}:\n  expected {expected}  got      {message}", case.display()));
        }
        assert_eq!(error.exit_code(), 2, "{message}");
        assert!(message.starts_with("cases/bad/") && !message.contains('\n') && message.len() < 400, "{message}");
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

fn tricot(arguments: &[&str], dir: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_tricot")).args(arguments).current_dir(dir).output().unwrap()
}

fn one_line(output: &Output, code: i32) -> String {
    let text = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(output.status.code(), Some(code), "{text}");
    assert!(output.stdout.is_empty());
    assert!(text.starts_with("error: ") && text.ends_with('\n') && text.lines().count() == 1, "{text}");
    text
}

#[test]
fn the_program_leaves_results_alone_when_the_case_is_bad() {
    let root = tempfile::tempdir().unwrap();
    let old = root.path().join("old");
    fs::create_dir(&old).unwrap();
    fs::write(old.join("history.csv"), "time_s\n0\n").unwrap();
    for name in ["truncated", "overlapping_yarns", "missing_fabric_file", "title_of_two_lines"] {
        let case = fs::canonicalize(format!("cases/bad/{name}.json")).unwrap();
        let case = case.to_str().unwrap();
        one_line(&tricot(&["run", case], root.path()), 2);
        one_line(&tricot(&["run", case, "-o", "new"], root.path()), 2);
        one_line(&tricot(&["run", case, "-o", "old", "--force"], root.path()), 2);
        one_line(&tricot(&["mesh", case, "-o", "new"], root.path()), 2);
        one_line(&tricot(&["check", case], root.path()), 2);
    }
    assert_eq!(fs::read_dir(root.path()).unwrap().count(), 1, "nothing but `old`");
    assert_eq!(fs::read_dir(&old).unwrap().count(), 1);
    assert_eq!(fs::read(old.join("history.csv")).unwrap(), b"time_s\n0\n");
}

#[test]
fn results_are_not_overwritten_without_force() {
    let root = tempfile::tempdir().unwrap();
    let case = fs::canonicalize(GOOD).unwrap();
    fs::write(root.path().join("file"), "mine").unwrap();
    fs::create_dir(root.path().join("old")).unwrap();
    fs::write(root.path().join("old/summary.json"), "{}").unwrap();
    let run = |dir: &str| one_line(&tricot(&["run", case.to_str().unwrap(), "-o", dir], root.path()), 4);
    assert!(run("old").starts_with("error: old: the folder is not empty"));
    assert!(run("file").starts_with("error: file: is in the way"));
    assert!(run("file/below").starts_with("error: file: is in the way"));
    assert_eq!(fs::read(root.path().join("old/summary.json")).unwrap(), b"{}");
    assert_eq!(fs::read(root.path().join("file")).unwrap(), b"mine");
    assert_eq!(fs::read_dir(root.path()).unwrap().count(), 2);
}

#[test]
fn the_command_line_is_checked() {
    let here = Path::new(".");
    for alone in [&[][..], &["study"]] {
        let help = tricot(alone, here);
        assert_eq!(help.status.code(), Some(0));
        assert!(String::from_utf8_lossy(&help.stdout).contains("Usage: tricot"), "{help:?}");
    }
    assert!(one_line(&tricot(&["chek", GOOD], here), 2).contains("'check'"));
    assert!(one_line(&tricot(&["run", GOOD, "--frce"], here), 2).contains("'--force'"));
    let fabric = one_line(&tricot(&["check", "cases/fabrics/px35.json"], here), 2);
    assert!(fabric.contains("this is a fabric, not a case"), "{fabric}");
    assert!(one_line(&tricot(&["run"], here), 2).contains("<CASE>"));
    assert!(one_line(&tricot(&["walk"], here), 2).contains("walk"));
    for range in ["1", "1,2,3", "low,high"] {
        let picture = tricot(&["picture", ".", "--field", "tension_n", "--range", range], here);
        assert!(one_line(&picture, 2).contains("give two numbers, as 0,0.4"), "{range}");
    }
    let picture = tricot(&["picture", ".", "--field", "tension_n", "--range", "-1,0.4"], here);
    assert!(one_line(&picture, 4).contains("no run.pvd in this folder"), "the range is taken");
    assert!(one_line(&tricot(&["run", GOOD, "--threads", "0"], here), 2).contains("1..=1024"));
    assert!(one_line(&tricot(&["run", GOOD, "--precision", "f16"], here), 2).contains("f32, f64"));
    assert_eq!(one_line(&tricot(&["check", "no.json"], here), 4), "error: no.json: no such file\n");
    assert_eq!(one_line(&tricot(&["check", "cases"], here), 4), "error: cases: is not a file\n");
    assert!(tricot(&["--help"], here).status.success());
    assert!(tricot(&["schema", "--fabric"], here).stdout.starts_with(b"{"));
}

#[cfg(unix)]
#[test]
fn a_closed_pipe_is_no_failure() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_tricot"))
        .arg("schema")
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
}

fn set_error(set: &str) -> String {
    read(Path::new(GOOD), &[set.to_string()]).unwrap_err().to_string()
}

#[test]
fn wrong_overrides_are_named() {
    let cases = [
        ("steps", "--set steps: no `=`: write PATH=VALUE"),
        ("=1", "--set =1: no `` in a case; allowed: $schema, accuracy,"),
        ("steps.3.shear.angle_deg=30", "no entry `3` in the list `steps`, which holds 3, from 0"),
        ("steps.x=30", "no entry `x` in the list `steps`"),
        ("steps.2.shear.angle=30", "no `angle` in `steps.2.shear`; did you mean `angle_deg`?"),
        ("fabric.stitch.thermal_strian=-0.1", "did you mean `thermal_strain`?"),
        ("intergration.safety=0.5", "did you mean `integration`?"),
        ("title.x=1", "`title` is \"PX35"),
        ("output.frames_at_deg.0=1", "set `frames_at_deg` as a whole"),
        ("steps.2.shear.angle_deg=NaN", "--set steps.2.shear.angle_deg=NaN: \"NaN\" is text, expected a number"),
        ("steps.2.shear.angle_deg=95", "--set steps.2.shear.angle_deg=95: 95 is out of range, give -80 to 80"),
        ("fabric.warp={}", "--set fabric.warp={}: `pitch_mm` is missing"),
        ("fabric=none.json", "--set fabric=none.json: the fabric file cases/none.json cannot be read: no such file"),
        ("fabric.weft.width_mm=3", "--set fabric.weft.width_mm=3: yarns overlap"),
    ];
    for (set, expected) in cases {
        let message = set_error(set);
        assert!(message.starts_with("--set ") && message.contains(expected), "{set}: {message}");
    }
    let off = ["effects.contact=null", "effects.contact.skin_mm=0.1"].map(String::from);
    assert!(read(Path::new(GOOD), &off).unwrap_err().to_string().contains("turn it on"));
}

#[test]
fn overrides_reach_everything() {
    let sets = [
        "steps.2.shear.angle_deg=30",
        "fabric.stitch.thermal_strain=-0.1",
        "integration.precision=f64",
        "effects.contact.skin_mm=0.1",
        "effects.damping=null",
        "title=Another",
    ];
    let loaded = read(Path::new(GOOD), &sets.map(String::from)).unwrap();
    assert_eq!(loaded.case.fabric().unwrap().stitch.thermal_strain, -0.1);
    let case = serde_json::to_value(&loaded.case).unwrap();
    assert_eq!(case["steps"][2], json!({ "shear": { "angle_deg": 30.0, "time_s": 1.4e-2 } }));
    assert_eq!(case["title"], "Another");
    assert_eq!(case["effects"]["contact"]["skin_mm"], 0.1);
    assert_eq!(case["effects"]["damping"], Value::Null);
    let default = |path: &str| loaded.defaults.iter().find(|(p, _)| p == path).map(|(_, v)| v.clone());
    assert_eq!(default("effects.contact.skin_mm"), None);
    assert_eq!(default("effects.contact.damping_ratio"), Some(json!(0.1)));
    assert_eq!(default("fabric.warp.truncation"), Some(json!(0.95)));
    assert_eq!(default("fabric.stitch.clearance_thread_mm"), None);
}

/// Everything written out reads back as the same case, with no default left.
#[test]
fn a_case_with_all_defaults_written_is_the_same_case() {
    let loaded = read(Path::new(GOOD), &[]).unwrap();
    let file = tempfile::NamedTempFile::new().unwrap();
    fs::write(file.path(), serde_json::to_vec(&loaded.case).unwrap()).unwrap();
    let again = read(file.path(), &[]).unwrap();
    assert_eq!(again.case, loaded.case);
    assert_eq!(again.defaults, []);
}

/// All places in a value.
fn pointers(value: &Value, here: &str, found: &mut Vec<String>) {
    found.push(here.into());
    match value {
        Value::Object(fields) => fields.iter().for_each(|(k, v)| pointers(v, &format!("{here}/{k}"), found)),
        Value::Array(items) => items.iter().enumerate().for_each(|(i, v)| pointers(v, &format!("{here}/{i}"), found)),
        _ => {}
    }
}

fn junk() -> impl Strategy<Value = Value> {
    prop_oneof![
        Just(Value::Null),
        any::<bool>().prop_map(Value::from),
        any::<i64>().prop_map(Value::from),
        any::<u64>().prop_map(Value::from),
        prop::num::f64::NORMAL.prop_map(Value::from),
        (-10.0..10.0).prop_map(Value::from),
        (0..20u64).prop_map(Value::from),
        any::<String>().prop_map(Value::from),
        prop::collection::vec(-3.0..3.0, 0..5).prop_map(Value::from),
        Just(json!({})),
        Just(json!({ "shear": { "angle_deg": 10, "time_s": 1e-3 } })),
        Just(json!({ "mesh": { "blocks": [], "conditions": [] } })),
    ]
}

const SCENE: &str = r#"{
  "title": "scene", "steps": [{ "move": { "time_s": 1e-3 } }],
  "domain": { "mesh": {
    "blocks": [{
      "name": "cube", "elements": [1, 1, 1], "density_t_mm3": 1e-9,
      "nodes": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 1, 1]],
      "material": { "neo_hookean": { "young_mpa": 10, "poisson": 0.3 } }
    }],
    "threads": [{
      "name": "thread", "nodes": [[0, 0, 0], [1, 0, 0]], "radius_mm": 0.1, "axial_n": 11, "linear_density_tex": 43
    }],
    "conditions": [{ "within": [[0, 0, 0], [0, 1, 1]], "body": "cube", "displacement_mm": [0.1, 0, 0] }]
  } }
}"#;

#[test]
fn a_scene_is_read() {
    let file = tempfile::NamedTempFile::new().unwrap();
    fs::write(file.path(), SCENE).unwrap();
    assert_eq!(read(file.path(), &[]).unwrap().case.fabric, None);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, failure_persistence: None, ..ProptestConfig::default() })]

    /// Values replaced by junk: accepted or refused in one line, never a panic.
    #[test]
    fn mutated_cases_never_panic(scene: bool, edits in prop::collection::vec((any::<prop::sample::Index>(), junk()), 1..4)) {
        let mut case: Value = if scene {
            serde_json::from_str(SCENE).unwrap()
        } else {
            let mut case: Value = serde_json::from_slice(&fs::read(GOOD).unwrap()).unwrap();
            case["fabric"] = serde_json::from_slice(&fs::read("cases/fabrics/px35.json").unwrap()).unwrap();
            case
        };
        for (place, value) in edits {
            let mut all = vec![];
            pointers(&case, "", &mut all);
            *case.pointer_mut(place.get(all.as_slice()).as_str()).unwrap() = value;
        }
        accepted_or_refused(&serde_json::to_vec(&case).unwrap(), &[])?;
    }

    /// Bytes changed, cut or doubled.
    #[test]
    fn mangled_text_never_panics(cut: prop::sample::Index, byte: u8, keep: bool) {
        let mut text = SCENE.as_bytes().to_vec();
        let at = cut.index(text.len());
        text[at] = byte;
        if !keep {
            text.truncate(at + 1);
        }
        accepted_or_refused(&text, &[])?;
    }

    /// Any override.
    #[test]
    fn any_override_never_panics(path in "([a-z_]{0,8}|fabric|stitch|steps|0|2|shear|domain|cell)(\\.([a-z]{0,4}|warp|width_mm|0|cell)){0,4}", value in any::<String>()) {
        if let Err(error) = read(Path::new(GOOD), &[format!("{path}={value}")]) {
            prop_assert!(!error.to_string().contains('\n'));
        }
    }
}

fn accepted_or_refused(text: &[u8], sets: &[String]) -> Result<(), TestCaseError> {
    let file = tempfile::NamedTempFile::new().unwrap();
    fs::write(file.path(), text).unwrap();
    if let Err(error) = read(file.path(), sets) {
        let message = error.to_string();
        prop_assert!(!message.contains('\n'), "{message}");
    }
    Ok(())
}
