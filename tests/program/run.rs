//! A coarse cell run through the library and through the program: its files on disk, and its end.

use crate::common::options;
use crate::common::program::contents;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use tricot::output::columns::Columns;
use tricot::output::picture::View;
use tricot::output::rows::{History, Stitches, Yarns};
use tricot::output::vtu_read;
use tricot::rigs::read::{Loaded, read};
use tricot::run::{Outcome, picture, run};
use tricot::simulate::BackendConfig;

const CASE: &str = "cases/unit_cell_shear.json";

/// A coarse mesh, short times, few rows, no pictures.
const COARSE: [&str; 9] = [
    "resolution.warp_columns=12",
    "resolution.weft_columns=6",
    "resolution.slice_mm=0.5",
    "steps.0.pretension.time_s=3e-4",
    "steps.1.stretch.time_s=2e-5",
    "steps.2.shear.time_s=1e-4",
    "steps.2.shear.angle_deg=3",
    "output.rows_per_step=10",
    "output.pictures=false",
];

fn sets(more: &[&str]) -> Vec<String> {
    COARSE.iter().chain(more).map(|s| s.to_string()).collect()
}

fn view(field: Option<&str>) -> View {
    View { field: field.map(str::to_owned), width_px: 400, ..View::default() }
}

fn coarse() -> Loaded {
    read(Path::new(CASE), &sets(&[])).unwrap()
}

fn ran() -> (TempDir, Outcome) {
    let folder = tempfile::tempdir().unwrap();
    let outcome = run(&coarse(), &options(folder.path().join("cell"), 2)).unwrap();
    (folder, outcome)
}

/// Header and rows of a table; every row is whole.
fn table(path: &Path) -> (Vec<String>, Vec<Vec<String>>) {
    let text = fs::read_to_string(path).unwrap();
    let mut rows = text.lines().map(|l| l.split(',').map(String::from).collect::<Vec<_>>());
    let header = rows.next().unwrap();
    let rows: Vec<_> = rows.collect();
    assert!(rows.iter().all(|r| r.len() == header.len()), "{}", path.display());
    (header, rows)
}

fn column(path: &Path, name: &str) -> Vec<f64> {
    let (header, rows) = table(path);
    let at = header.iter().position(|h| h == name).unwrap_or_else(|| panic!("no column {name}"));
    rows.iter().map(|r| r[at].parse().unwrap()).collect()
}

fn summary(dir: &Path) -> Value {
    serde_json::from_slice(&fs::read(dir.join("summary.json")).unwrap()).unwrap()
}

/// The program on the coarse cell with more overrides.
fn program(dir: &Path, more: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tricot"));
    command.args(["run", CASE, "--quiet", "--threads", "1", "-o"]).arg(dir);
    for set in sets(more) {
        command.args(["--set", &set]);
    }
    command
}

fn message(output: &Output, code: i32) -> String {
    let text = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(output.status.code(), Some(code), "{text}");
    text
}

#[test]
fn a_run_leaves_what_the_readme_says() {
    let (folder, outcome) = ran();
    let dir = folder.path().join("cell");
    assert!(!outcome.interrupted);
    assert!(outcome.text.lines().count() <= 12 && outcome.text.contains("finished"), "{}", outcome.text);

    let rows = |name: &str| Columns::read(&dir.join(name)).unwrap();
    assert_eq!(rows("history.csv").rows::<History>().unwrap()[29].phase, "shear");
    assert_eq!(rows("yarns.csv").rows::<Yarns>().unwrap().len(), 30);
    assert_eq!(rows("stitches.csv").rows::<Stitches>().unwrap().len(), 30);
    for file in ["history.csv", "energies.csv", "stress.csv", "yarns.csv", "stitches.csv"] {
        let times = column(&dir.join(file), "time_s");
        assert_eq!(times.len(), 30, "{file}");
        assert!(times.is_sorted_by(|a, b| a < b), "{file}");
    }
    let angles = column(&dir.join("history.csv"), "shear_angle_deg");
    assert!((angles.last().unwrap() - 3.0).abs() < 1e-9);
    assert!(column(&dir.join("history.csv"), "min_jacobian").iter().all(|j| *j > 0.1));
    assert!(column(&dir.join("stitches.csv"), "tension_mean_n")[9] > 0.01, "the stitch is tight");

    // the stress of a row belongs to the angle in its middle: there its power is that of F_nor
    let angles: Vec<f64> = angles.iter().map(|degrees| degrees.to_radians()).collect();
    let force = column(&dir.join("history.csv"), "f_nor_n_per_mm");
    let stress = ["p_xx", "p_xy", "p_yx", "p_yy"].map(|p| column(&dir.join("stress.csv"), &format!("{p}_n_per_mm")));
    let largest = force.iter().fold(0.0, |most: f64, f| most.max(f.abs()));
    // where the shear rate rises and falls, time and angle are not proportional
    for row in 22..29 {
        let (sin, cos) = (0.25 * (angles[row] + angles[row - 1])).sin_cos();
        let [xx, xy, yx, yy] = [0, 1, 2, 3].map(|k| stress[k][row]);
        let power = 0.5 * (cos * (xy + yx) - sin * (xx + yy)) / (0.5 * (angles[row] + angles[row - 1])).cos();
        assert!((power - force[row]).abs() < 5e-3 * largest, "row {row}: {power} and {} N/mm", force[row]);
    }

    let summary = summary(&dir);
    let keys = [
        ("verdict", "case", "defaults"),
        ("hexes", "beams", "nodes"),
        ("backend", "steps", "time_s"),
        ("dt_smallest_s", "dt_largest_s", "dt_limit_s"),
        ("contact_searches", "wall_s", "stage_wall_s"),
        ("added_mass", "energies_mj", "frames"),
        ("worst_energy_balance", "worst_kinetic_over_internal_in_shear", "state_hash"),
    ];
    for key in keys.iter().flat_map(|(a, b, c)| [a, b, c]) {
        assert!(!summary[*key].is_null(), "{key} is missing");
    }
    assert_eq!(summary["verdict"], "finished");
    assert_eq!((summary["hexes"].as_u64(), summary["beams"].as_u64()), (Some(1920), Some(720)));
    assert_eq!(summary["case"]["fabric"]["friction"], 0.2);

    let balance: Vec<f64> = column(&dir.join("history.csv"), "e_balance_error");
    assert!(balance[..10].iter().all(|e| e.abs() < 0.02), "pre-tension: {balance:?}");
}

#[test]
fn frames_read_back_and_can_be_drawn() {
    let (folder, _) = ran();
    let dir = folder.path().join("cell");
    // the case beside the results is the case that was run
    let loaded = read(&dir.join("case.json"), &[]).unwrap();
    assert_eq!((&loaded.case, loaded.defaults.len()), (&coarse().case, 0));
    let mesh = tricot::run::simulation(&loaded, BackendConfig::default()).unwrap().mesh().clone();
    let frames = vtu_read::read_collection(&dir.join("run.pvd")).unwrap();
    assert_eq!(frames.len(), 4, "start and the end of each load step");
    let summary = summary(&dir);
    for (path, listed) in frames.iter().zip(summary["frames"].as_array().unwrap()) {
        assert_eq!(&dir.join(listed["file"].as_str().unwrap()), path);
        let frame = vtu_read::read(path, &mesh).unwrap();
        assert_eq!(Some(frame.time), listed["time_s"].as_f64());
        frame.check(&mesh).unwrap();
        assert!(frame.beam_fields.iter().any(|f| f.name == "tension_n"));
    }
    let last = vtu_read::read(frames.last().unwrap(), &mesh).unwrap();
    assert!((last.angle_deg - 3.0).abs() < 1e-9);

    let out = folder.path().join("tension.png");
    let text = picture(&dir, None, &view(Some("tension_n")), &out).unwrap();
    assert!(text.contains("3-shear.vtu") && text.contains("tension.png"), "{text}");
    assert!(fs::read(&out).unwrap().starts_with(b"\x89PNG"));
    let error = picture(&dir, None, &view(Some("tension")), &out).unwrap_err();
    assert!(error.to_string().contains("available: ") && error.to_string().contains("tension_n"), "{error}");
    assert_eq!(error.exit_code(), 2);
    let text = picture(&dir, Some("0"), &view(Some("velocity_mm_s.z")), &out).unwrap();
    assert!(text.contains("0000-start.vtu drawn") && text.ends_with("which is replaced"), "{text}");
    assert!(picture(&dir, Some("1-pretension"), &view(None), &out).unwrap().contains("0001-1-pretension.vtu"));
    for (frame, field, out, wanted) in [
        (Some("25deg"), None, "x.png", "has no frame 25deg; there are 0000-start, 0001-1-pretension"),
        (None, Some("velocity_mm_s"), "x.png", "is a vector: give one of velocity_mm_s.x"),
        (None, Some("tension_n.x"), "x.png", "has no components"),
        (None, None, "x.jpg", "x.jpg: pictures are written as PNG"),
    ] {
        let error = picture(&dir, frame, &view(field), &folder.path().join(out)).unwrap_err().to_string();
        assert!(error.contains(wanted), "{error}");
    }
    let view_of = |range| View { range: Some(range), ..view(Some("tension_n")) };
    assert!(picture(&dir, None, &view_of([1.0, 0.0]), &out).unwrap_err().to_string().contains("is no range"));
    picture(&dir, None, &view_of([0.0, 1.0]), &out).unwrap();
    fs::remove_file(dir.join("case.json")).unwrap();
    let error = picture(&frames[0], None, &view(None), &out).unwrap_err().to_string();
    assert!(error.contains("case.json"), "{error}");
    let error = picture(folder.path(), None, &view(None), &out).unwrap_err();
    assert!(error.to_string().contains("run.pvd") && error.exit_code() == 4, "{error}");
}

#[test]
fn the_same_case_gives_the_same_bits_and_results_are_kept() {
    let (folder, _) = ran();
    let (first, second) = (folder.path().join("cell"), folder.path().join("again"));
    run(&coarse(), &options(second.clone(), 1)).unwrap();
    assert_eq!(summary(&first)["state_hash"], summary(&second)["state_hash"], "two threads and one");
    assert_eq!(fs::read(first.join("history.csv")).unwrap(), fs::read(second.join("history.csv")).unwrap());

    let before = contents(&first);
    let error = run(&coarse(), &options(first.clone(), 1)).unwrap_err();
    assert!(error.to_string().contains("--force") && error.exit_code() == 4, "{error}");
    assert!(before == contents(&first), "a refused run changes nothing");
}

#[test]
fn a_guard_stops_the_run_and_keeps_earlier_rows() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("cell");
    // 60° in four time steps
    let sets = ["steps.2.shear.angle_deg=60", "steps.2.shear.time_s=2e-6", "steps.0.pretension.time_s=1e-4"];
    let output = program(&dir, &sets).output().unwrap();
    let text = message(&output, 3);
    assert!(text.contains("guard at step ") && text.lines().count() == 1, "{text}");
    let (_, rows) = table(&dir.join("history.csv"));
    assert!(rows.len() >= 10 && rows[9][2] == "pretension", "{} rows", rows.len());
    assert!(text.contains(summary(&dir)["verdict"].as_str().unwrap()), "{text}");
    assert!(dir.join("frames").read_dir().unwrap().any(|f| f.unwrap().path().to_string_lossy().contains("stopped")));
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_the_run_cleanly() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("cell");
    let sets = ["steps.0.pretension.time_s=1", "output.rows_per_step=100000"];
    let child = program(&dir, &sets).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let history = dir.join("history.csv");
    let started = Instant::now();
    while fs::read_to_string(&history).map_or(0, |t| t.lines().count()) < 3 {
        assert!(started.elapsed() < Duration::from_secs(120), "no rows");
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(message(&output, 130), "");
    assert!(String::from_utf8_lossy(&output.stdout).contains("interrupted"));
    assert_eq!(summary(&dir)["verdict"], "interrupted");
    assert!(table(&history).1.len() >= 2);
    let last = vtu_read::read_collection(&dir.join("run.pvd")).unwrap().pop().unwrap();
    assert!(last.is_file() && last.to_string_lossy().contains("interrupted"), "{}", last.display());
}

/// A limit on the size of files stands in for a full disk: writing fails in the middle of the run.
#[cfg(unix)]
#[test]
fn a_disk_that_takes_no_more_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("cell");
    let run = program(&dir, &["output.rows_per_step=40"]);
    let mut shell = Command::new("sh");
    // 256 blocks of 512 or 1024 bytes: the first frame fits, the second does not
    shell.args(["-c", "trap '' XFSZ; ulimit -f 256; exec \"$@\"", "sh"]);
    let output = shell.arg(run.get_program()).args(run.get_args()).output().unwrap();
    let text = message(&output, 4);
    assert!(text.contains("frames/0001-1-pretension.vtu") && text.lines().count() == 1, "{text}");
    // the next load step may go on until its own frame
    let rows = table(&dir.join("history.csv")).1.len();
    assert!((40..=80).contains(&rows), "{rows} rows");
    assert!(text.contains(summary(&dir)["verdict"].as_str().unwrap()), "{text}");
    let frames = vtu_read::read_collection(&dir.join("run.pvd")).unwrap();
    assert!(frames.len() == 1 && frames[0].is_file());
    assert!(contents(&dir).iter().all(|(path, _)| !path.to_string_lossy().ends_with(".part")), "no half files");
}
