//! Runs the program on a case in a folder, and reads its results.

use super::options;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output};
use std::time::Duration;
use tempfile::TempDir;
use tricot::rigs::read::read;
use tricot::run::{Options, run};
use tricot::settings::integration::Precision;

/// A folder that holds a case as `case.json`.
pub fn folder(case: &Value) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("case.json"), case.to_string()).unwrap();
    folder
}

/// `tricot run` on that case, on one thread.
pub fn program(folder: &Path, output: &str, more: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tricot"));
    command.args(["run", "--quiet", "--backend", "cpu", "--threads", "1", "-o"]).arg(folder.join(output));
    command.arg(folder.join("case.json")).args(more).stdout(std::process::Stdio::null());
    command
}

/// Runs it to its end.
#[track_caller]
pub fn ran(folder: &Path, output: &str, more: &[&str]) {
    let output = program(folder, output, more).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// The one line of a program that failed with an exit code.
#[track_caller]
pub fn failed(output: &Output, code: i32) -> String {
    let text = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(output.status.code(), Some(code), "{text}");
    assert_eq!(text.lines().count(), 1, "{text}");
    text
}

/// Every file below a folder with its bytes.
pub fn contents(dir: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(contents(&path));
        } else {
            found.push((path.clone(), fs::read(&path).unwrap()));
        }
    }
    found.sort();
    found
}

/// Names and bytes of all results that do not depend on wall time.
fn results(dir: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let timed = |path: &Path| path.starts_with("state") || ["summary.json", "run.log"].map(Path::new).contains(&path);
    let files = contents(dir).into_iter().map(|(path, bytes)| (path.strip_prefix(dir).unwrap().to_path_buf(), bytes));
    files.filter(|(path, _)| !timed(path)).collect()
}

/// `summary.json` of a run.
pub fn summary(dir: &Path) -> Value {
    serde_json::from_slice(&fs::read(dir.join("summary.json")).unwrap()).unwrap()
}

/// The folder, with the run in `run`, and the summary of a shipped case with changes, whose energies balance to 2 %.
#[track_caller]
pub fn balanced(case: &str, sets: &[&str], precision: Precision) -> (TempDir, Value) {
    let folder = tempfile::tempdir().unwrap();
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    let loaded = read(Path::new(&format!("cases/{case}.json")), &sets).unwrap_or_else(|e| panic!("{e}"));
    let options = Options { precision: Some(precision), ..options(folder.path().join("run"), 1) };
    run(&loaded, &options).unwrap_or_else(|e| panic!("{e}"));
    let summary = summary(&folder.path().join("run"));
    let balance = summary["worst_energy_balance"].as_f64().unwrap();
    println!("{case} {precision:?}: balance {balance:.2e}");
    assert!(balance < 0.02, "{case}: balance {balance}");
    (folder, summary)
}

/// The hash of the state at the end of a run.
#[track_caller]
pub fn hash(dir: &Path) -> String {
    let summary = summary(dir);
    assert_eq!(summary["verdict"], "finished");
    summary["state_hash"].as_str().unwrap().to_owned()
}

/// Fails unless two runs left the same files and ended in the same state.
#[track_caller]
pub fn same(folder: &Path, a: &str, b: &str) {
    let [a, b] = [a, b].map(|name| folder.join(name));
    let (first, second) = (results(&a), results(&b));
    let names = |files: &[(PathBuf, Vec<u8>)]| files.iter().map(|(path, _)| path.clone()).collect::<Vec<_>>();
    assert_eq!(names(&first), names(&second));
    for ((path, a), (_, b)) in first.iter().zip(&second) {
        assert!(a == b, "{} differs", path.display());
    }
    assert_eq!(hash(&a), hash(&b));
}

/// Whether there is a checkpoint to go on from.
pub fn can_resume(results: &Path) -> bool {
    let Ok(entries) = fs::read_dir(results.join("state")) else { return false };
    entries.into_iter().any(|f| f.unwrap().path().extension().is_some_and(|e| e == "state"))
}

/// Kills a program after some time by a signal that it cannot catch. Returns whether it was still running, and whether it had
/// succeeded.
pub fn kill_after(mut child: Child, wait: Duration) -> (bool, bool) {
    std::thread::sleep(wait);
    let alive = child.try_wait().unwrap().is_none();
    if alive {
        child.kill().unwrap();
    }
    (alive, child.wait().unwrap().success())
}

/// A copy of a folder.
pub fn copy(from: &Path, to: &Path) {
    for (path, bytes) in contents(from) {
        let target = to.join(path.strip_prefix(from).unwrap());
        fs::create_dir_all(target.parent().unwrap()).unwrap();
        fs::write(target, bytes).unwrap();
    }
}
