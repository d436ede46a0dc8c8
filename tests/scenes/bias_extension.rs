//! A small specimen that is pulled: forces of its clamps against momentum and work, zones beside the theory, the contents of
//! tables and report, and a curve that survives a kill.

use crate::common::{below, near, options};
use serde_json::Value;
use std::f64::consts::SQRT_2;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;
use tricot::case::domain::Domain;
use tricot::output::columns::Columns;
use tricot::output::rows::{Crossing, History, Shear, Yarns, Zones};
use tricot::rigs::bias_extension::clamped;
use tricot::rigs::bias_extension::theory::Bias;
use tricot::rigs::read::{Loaded, read};
use tricot::run;
use tricot::simulate::BackendConfig;

const CASE: &str = "cases/bias_extension_small.json";
const LENGTH: f64 = 36.0;
const WIDTH: f64 = 12.0;
const ROWS: usize = 12;

/// A smaller and coarser specimen, pulled quickly by a millimetre.
const SETS: [&str; 14] = [
    "domain.specimen.length_mm=36",
    "domain.specimen.width_mm=12",
    "domain.specimen.displacement_mm=1",
    "resolution.warp_columns=6",
    "resolution.slice_mm=2",
    "resolution.beams_per_lap=32",
    // so fast a pull would ring
    "effects.damping.move_rate_per_s=2000",
    "steps.0.pretension.time_s=2e-4",
    "steps.1.hold.time_s=2e-5",
    "steps.2.move.time_s=6e-4",
    "output.rows_per_step=12",
    "output.frames_per_step=2",
    "output.pictures=false",
    "integration.energy_tolerance=100",
];

fn loaded() -> Loaded {
    read(Path::new(CASE), &SETS.map(String::from)).unwrap_or_else(|e| panic!("{e}"))
}

fn ran(output: PathBuf) -> String {
    run::run(&loaded(), &options(output, 2)).unwrap_or_else(|e| panic!("{e}")).text
}

fn rows(dir: &Path, table: &str) -> Columns {
    Columns::read(&dir.join(table)).unwrap()
}

fn summary(dir: &Path) -> Value {
    serde_json::from_slice(&fs::read(dir.join("summary.json")).unwrap()).unwrap()
}

/// At every step, internal forces on both clamps balance except for the force that accelerates the yarns between them, and the
/// work of prescribed motion is that of the moving clamp.
#[test]
fn clamps_feel_each_other_and_the_one_that_moves_does_the_work() {
    let mut loaded = loaded();
    // contact would absorb momentum with its temporary added mass
    loaded.case.effects.contact_mass = None;
    let Domain::Specimen(specimen) = &loaded.case.domain else { panic!("{:?}", loaded.case.domain) };
    let mut s = run::simulation(&loaded, BackendConfig { threads: 2, ..BackendConfig::default() }).unwrap();
    let [held, moved] = clamped(specimen, s.mesh());
    let nodes = s.prescribed_nodes();
    assert_eq!(nodes.len(), held.len() + moved.len());
    let pull = |reactions: &[[f64; 3]], clamp: &[usize]| -> f64 {
        let own = nodes.iter().zip(reactions).filter(|(node, _)| clamp.contains(node));
        -own.map(|(_, force)| force[0]).sum::<f64>()
    };
    let tightened = s.schedule.phases()[1].end;
    s.advance(tightened, |_| false).unwrap();
    let mass = s.model.mass.clone();
    let clamp_mass: f64 = moved.iter().map(|n| mass[*n]).sum();
    let free: Vec<usize> = (0..mass.len()).filter(|n| nodes.binary_search(n).is_err()).collect();
    let damping = loaded.case.effects.damping.as_ref().unwrap();
    let rate = damping.move_rate_per_s.unwrap_or(damping.rate_per_s);
    let momentum = |v: &[[f64; 3]]| free.iter().map(|n| mass[*n] * v[*n][0]).sum::<f64>();
    let (start, started) = (s.time(), s.energies().prescribed);
    let mut speed = 0.0;
    let [before, mut impulse, mut lost, mut work] = [momentum(&s.velocities()), 0.0, 0.0, 0.0];
    let mut sums = [0.0; 2];
    while !s.done() {
        let dt = s.dt();
        s.advance(s.time() + 0.5 * dt, |_| false).unwrap();
        let velocities = s.velocities();
        let forces = s.reactions();
        let [machine, other] = [pull(&forces, &moved), pull(&forces, &held)];
        let now = velocities[moved[0]][0];
        let mean = 0.5 * (speed + now);
        // the mass in the clamp is moved and damped too
        work += machine * mean * dt + clamp_mass * (mean * (now - speed) + rate * mean * mean * dt);
        speed = now;
        impulse += (machine + other) * dt;
        lost += rate * momentum(&velocities) * dt;
        sums = [sums[0] + machine * dt, sums[1] + other * dt];
    }
    let time = s.time() - start;
    let inertia = (momentum(&s.velocities()) - before + lost) / time;
    let [machine, other] = sums.map(|sum| sum / time);
    println!("machine {machine:.5} N, other clamp {other:.5} N, inertia between them {inertia:.5} N");
    assert!(machine > 0.005 && other < -0.005);
    // the inertia of fibre lines that end in a clamp is no part of that momentum
    below("balance of the clamps over the force", (impulse / time - inertia).abs() / machine, 0.01);
    near("work of the machine, mJ", s.energies().prescribed - started, work, 1e-3);
}

#[test]
fn tables_of_a_specimen_hold_force_zones_and_theory() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("specimen");
    let text = ran(dir.clone());
    println!("{text}");
    assert_eq!(rows(&dir, "history.csv").rows::<History>().unwrap().len(), 3 * ROWS);
    assert_eq!(rows(&dir, "shear.csv").rows::<Shear>().unwrap().len(), 3 * ROWS);
    assert_eq!(rows(&dir, "shear.csv").rows::<Zones>().unwrap().len(), 3 * ROWS);
    assert!(!rows(&dir, "crossings.csv").rows::<Crossing>().unwrap().is_empty());
    assert_eq!(rows(&dir, "yarns.csv").rows::<Yarns>().unwrap().len(), 3 * ROWS);
    assert!(!dir.join("stress.csv").exists(), "nothing is homogenised");

    // the mean force of each row, with the way of the clamp, is the work of prescribed motion
    let (history, energies) = (rows(&dir, "history.csv"), rows(&dir, "energies.csv"));
    let [d, force] = ["displacement_mm", "force_n"].map(|c| history.numbers(c));
    let work = energies.numbers("prescribed_work_mj");
    assert_eq!(d.len(), 3 * ROWS);
    // the last step of a load step may end behind it
    assert!(d[..2 * ROWS].iter().all(|d| *d < 1e-5) && d[2 * ROWS - 1..].is_sorted_by(|a, b| a < b));
    near("displacement at the end, mm", d[d.len() - 1], 1.0, 1e-6);
    let way = |i: usize| d[i] - if i == 2 * ROWS { 0.0 } else { d[i - 1] };
    let done: f64 = (2 * ROWS..d.len()).map(|i| force[i] * way(i)).sum();
    near("∫ F dd, mJ", done, work[work.len() - 1] - work[2 * ROWS - 1], 1e-9);
    assert!(done > 0.0 && force[..2 * ROWS].iter().all(|f| f.is_finite()));

    // angles: the history's is that of zone C, the theory's is Eq. 18, and F_nor follows from both by Eq. 19
    let shear = rows(&dir, "shear.csv");
    let (angle, free) = (shear.numbers("zone_c_angle_deg"), LENGTH - WIDTH);
    assert_eq!(history.numbers("shear_angle_deg"), angle);
    for (d, theory) in d.iter().zip(shear.numbers("theory_angle_deg")) {
        let wanted = 90.0 - 2.0 * ((free + d) / (SQRT_2 * free)).acos().to_degrees();
        assert!((theory - wanted).abs() < 1e-9, "{theory} for {wanted} at {d} mm");
    }
    let last = |column: &str| *shear.numbers(column).last().unwrap();
    let zones = ["a", "b", "c"].map(|zone| last(&format!("zone_{zone}_angle_deg")));
    println!("zones {zones:.3?}°, theory {:.3}°", last("theory_angle_deg"));
    assert!(zones[2] > 0.2 && zones[2] < last("theory_angle_deg") && zones[0].abs() < zones[2]);
    let normalised = history.numbers("f_nor_n_per_mm");
    let known: Vec<usize> = (0..d.len()).filter(|i| normalised[*i].is_finite()).collect();
    assert!(known.len() > ROWS / 3 && known[0] >= 2 * ROWS, "{known:?}");
    let samples: Vec<(f64, f64)> = known.iter().map(|i| (angle[*i].to_radians(), force[*i])).collect();
    let wanted = Bias::new(LENGTH, WIDTH).unwrap().normalised(&samples).unwrap();
    for (i, wanted) in known.into_iter().zip(wanted) {
        assert!((normalised[i] - wanted).abs() < 1e-9 * wanted.abs().max(1e-3), "row {i}");
    }
    for column in ["zone_c_warp_width_mm", "zone_c_weft_gap_mm", "zone_c_slip_mm", "zone_c_warp_direction_deg"] {
        assert!(shear.numbers(column).iter().all(|v| v.is_finite()), "{column}");
    }
    near("direction of the warps in zone C, degrees", last("zone_c_warp_direction_deg"), 45.0, 0.1);
    near("direction of the wefts in zone C, degrees", last("zone_c_weft_direction_deg"), -45.0, 0.1);

    // maps: every crossing has its zone, at every frame its displacement
    let crossings = rows(&dir, "crossings.csv");
    for zone in ["A", "B", "C"] {
        assert!(crossings.texts("zone").contains(&zone), "{zone}");
    }
    assert_eq!(crossings.numbers("displacement_mm").last(), d.last());
    assert!(dir.join("crossings.pvd").is_file());

    // the text for a reader
    assert!(text.lines().count() <= 12, "{text}");
    assert!(text.contains("force      ") && text.contains("sheared by") && text.contains("without slip (Eq. 18)"));
    assert!(!text.contains("tomography") && !text.contains("before shear"), "{text}");
    let specimen = &summary(&dir)["specimen"];
    let said = specimen["curve"].as_array().unwrap().last().unwrap();
    assert_eq!(said["force_n"].as_f64(), force.last().copied());
    assert_eq!(specimen["theory_angle_deg"].as_f64(), Some(last("theory_angle_deg")));

    let page = dir.join("report.html");
    run::report(&dir, &page).unwrap();
    let page = fs::read_to_string(page).unwrap();
    for title in [
        "Force of the machine, N",
        "Shear force, N/mm",
        "Shear angle in zone C, degrees",
        "Shear angle by zone, degrees",
        "Gaps in zone C, mm",
        "Zones beside the theory",
        "Crossings while the specimen is pulled",
    ] {
        assert!(page.contains(title), "{title}");
    }
    assert!(!page.contains("Size of the sum of the forces"));
}

#[cfg(unix)]
#[test]
fn the_curve_survives_a_kill_and_a_study_starts_before_it() {
    let folder = tempfile::tempdir().unwrap();
    let run = |output: &str, more: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_tricot"));
        command.args(["run", CASE, "--quiet", "--threads", "1", "--set", "output.checkpoint_wall_s=0.01", "-o"]);
        command.arg(folder.path().join(output)).args(SETS.iter().flat_map(|set| ["--set", set])).args(more);
        command.stdout(std::process::Stdio::null());
        command
    };
    assert!(run("whole", &[]).status().unwrap().success());
    let [whole, killed] = ["whole", "killed"].map(|name| folder.path().join(name));
    let mut child = run("killed", &[]).spawn().unwrap();
    let pulled = || fs::read_to_string(killed.join("history.csv")).map_or(0, |t| t.matches(",move,").count());
    while pulled() < ROWS / 2 {
        assert!(child.try_wait().unwrap().is_none(), "the run is too short to be killed");
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(pulled() < ROWS);
    assert!(run("killed", &["--resume"]).status().unwrap().success());
    for table in ["history.csv", "shear.csv", "crossings.csv", "energies.csv", "yarns.csv"] {
        let [a, b] = [&whole, &killed].map(|dir| fs::read_to_string(dir.join(table)).unwrap());
        assert!(a == b, "{table} differs");
    }
    let states = fs::read_dir(whole.join("state")).unwrap().map(|f| f.unwrap().path());
    let hold = states.into_iter().find(|p| p.to_str().unwrap().ends_with("-2-hold.state")).unwrap();
    assert!(run("again", &["--from", hold.to_str().unwrap()]).status().unwrap().success());
    let [a, b, c] = [whole, killed, folder.path().join("again")].map(|dir| summary(&dir));
    for other in [b, c] {
        assert_eq!((&a["specimen"], &a["state_hash"]), (&other["specimen"], &other["state_hash"]));
    }
}
