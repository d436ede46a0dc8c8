//! A cell from pre-tension to 10° of shear on the GPU backend against the CPU, and how runs on a device end. Without an adapter
//! the tests say so and pass, unless TRICOT_REQUIRE_ADAPTER is set.

use crate::common::options;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use std::sync::Arc;
use tricot::backend::gpu::{Device, Gpu};
use tricot::error::Error;
use tricot::kernel::buffer::{Description, Initial, Kind};
use tricot::measure::yarns;
use tricot::mesh::Ply;
use tricot::plan::Capacity;
use tricot::rigs;
use tricot::rigs::read::{Loaded, read};
use tricot::run::{Machine, Options, run_on, simulation};
use tricot::simulate::{BackendConfig, Simulation};

const CASE: &str = "cases/unit_cell_shear.json";

/// About 1,700 hexahedra, tightened and sheared to 10° in a tenth of the time.
const SMALL: [&str; 7] = [
    "resolution.warp_columns=10",
    "resolution.weft_columns=6",
    "resolution.slice_mm=0.6",
    "steps.0.pretension.time_s=1e-3",
    "steps.1.stretch.time_s=2e-4",
    "steps.2.shear.angle_deg=10",
    "steps.2.shear.time_s=2e-3",
];
/// Shortest run that has searches and every kind of contact.
const SHORT: [&str; 4] = [
    "steps.0.pretension.time_s=1e-4",
    "steps.1.stretch.time_s=2e-5",
    "steps.2.shear.time_s=5e-5",
    // so short a tightening acts as an impact
    "integration.energy_tolerance=100",
];

fn case(more: &[&str]) -> Loaded {
    let sets: Vec<String> = SMALL.iter().chain(more).map(|s| (*s).to_owned()).collect();
    read(Path::new(CASE), &sets).unwrap()
}

fn device() -> Option<Arc<Device>> {
    match Device::open("") {
        Ok(device) => Some(device),
        Err(error) if std::env::var_os("TRICOT_REQUIRE_ADAPTER").is_none() => {
            println!("skipped: {error}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// Results of a run: width, thickness and gap of warp and weft after tightening, mm, and F_nor over rows of one degree.
struct Result {
    sizes: Vec<f64>,
    forces: Vec<f64>,
    /// Membrane forces along the wefts and the warps at the end, N/mm.
    fibres: [f64; 2],
    touching: [u32; 3],
}

fn result(mut cell: Simulation) -> Result {
    let ends: Vec<f64> = cell.schedule.phases().iter().map(|p| p.end).collect();
    cell.advance(ends[1], |_| false).unwrap_or_else(|e| panic!("{e}"));
    let yarns = yarns::measure(cell.mesh(), &cell.frame()).unwrap();
    let plies = [Ply::Warp, Ply::Weft].map(|ply| yarns::ply(&yarns, ply));
    let sizes = plies.iter().flat_map(|p| [p.width.mean, p.thickness.mean, p.gap.mean]).collect();
    let area = cell.mesh().period.map(|[x, y]| x * y).unwrap();
    let mut forces = Vec::new();
    let (mut angle, mut work) = (0.0f64, cell.energies().external);
    for row in 1..=8 {
        cell.advance(ends[1] + (ends[2] - ends[1]) * f64::from(row) / 8.0, |_| false).unwrap_or_else(|e| panic!("{e}"));
        let (now, done) = (cell.load().angle, cell.energies().external);
        forces.push((done - work) / (area * (now.sin() - angle.sin())));
        (angle, work) = (now, done);
    }
    println!(
        "{} hexes, {} steps, {} searches; {}",
        cell.mesh().hexes(),
        cell.step(),
        cell.searches(),
        cell.backend().describe()
    );
    println!("    sizes {sizes:.5?} mm, F_nor {forces:.5?} N/mm, touching {:?}", cell.health().touching);
    Result { sizes, forces, fibres: cell.fibres().map(|f| f.force), touching: cell.health().touching }
}

/// Root mean square of the relative differences.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    (a.iter().zip(b).map(|(a, b)| (a / b - 1.0).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
}

#[test]
fn a_small_cell_tightens_and_shears_as_on_the_cpu() {
    let Some(device) = device() else { return };
    let cpu = |aside_mm: f64| {
        let perturbed = format!("integration.perturbation_mm={aside_mm}");
        result(simulation(&case(&[&perturbed]), BackendConfig::default()).unwrap())
    };
    let exact = cpu(0.0);
    let spread = apart(&cpu(1e-3).forces, &exact.forces).max(apart(&cpu(-1e-3).forces, &exact.forces));
    let config = BackendConfig { device: Some(device), ..BackendConfig::default() };
    let ours = result(simulation(&case(&[]), config).unwrap());
    assert!(ours.touching.iter().all(|n| *n > 0), "a kind of contact is missing");
    let difference = apart(&ours.forces, &exact.forces);
    println!("F_nor: GPU and CPU differ by {:.3} %, runs on the CPU by {:.3} %", 100.0 * difference, 100.0 * spread);
    assert!(difference < spread.max(0.01), "{difference}");
    println!("membrane forces {:.4?} and {:.4?} N/mm", ours.fibres, exact.fibres);
    for (ours, exact) in ours.fibres.iter().zip(&exact.fibres) {
        // held fibres pull with some 0.2 N/mm here
        assert!((ours - exact).abs() < 0.02, "{ours} and {exact} N/mm along fibres that are driven");
    }
    for (ours, exact) in ours.sizes.iter().zip(&exact.sizes) {
        assert!((ours - exact).abs() < 1e-3, "{ours} mm and {exact} mm after tightening");
    }
}

#[test]
fn the_same_device_gives_the_same_bits_twice() {
    let Some(device) = device() else { return };
    let hash = || {
        let config = BackendConfig { device: Some(Arc::clone(&device)), ..BackendConfig::default() };
        let mut cell = simulation(&case(&SHORT), config).unwrap();
        let end = cell.schedule.end();
        cell.advance(end, |_| false).unwrap_or_else(|e| panic!("{e}"));
        assert!(cell.searches() > 1 && cell.health().touching.iter().all(|n| *n > 0));
        cell.state_hash()
    };
    let (first, second) = (hash(), hash());
    println!("{first:016x} and {second:016x}");
    assert_eq!(first, second);
}

#[test]
fn a_device_that_is_lost_stops_the_run_with_its_name() {
    let Some(device) = device() else { return };
    let config = BackendConfig { device: Some(Arc::clone(&device)), ..BackendConfig::default() };
    let mut cell = simulation(&case(&SHORT), config).unwrap();
    cell.advance(2e-5, |_| false).unwrap_or_else(|e| panic!("{e}"));
    device.lose();
    let error = cell.advance(1.0, |_| false).unwrap_err();
    println!("{error}");
    assert!(matches!(error, Error::Device(_)) && error.to_string().contains(&device.listed().name));
    assert!(error.to_string().contains("the device was lost"), "{error}");
    assert!(cell.alive().is_err());
    assert_eq!(error.exit_code(), 6);
}

/// When a device is lost in the middle of a run, files on disk are complete and stay.
#[test]
fn a_device_that_is_lost_leaves_whole_results() {
    let Some(device) = device() else { return };
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("cell");
    let adapter = device.listed().name.clone();
    let options = Options { machine: Machine::Gpu, adapter, threads: None, ..options(output.clone(), 0) };
    let config = BackendConfig { device: Some(Arc::clone(&device)), ..BackendConfig::default() };
    let rows = || fs::read_to_string(output.join("history.csv")).unwrap_or_default().lines().count();
    let error = std::thread::scope(|scope| {
        let run = scope.spawn(|| run_on(&case(&SHORT), &options, config).unwrap_err());
        while rows() < 20 {
            assert!(!run.is_finished(), "the run ended too soon");
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        device.lose();
        run.join().unwrap()
    });
    println!("{error} after {} rows", rows() - 1);
    assert!(matches!(error, Error::Device(_)), "{error}");
    let history = fs::read_to_string(output.join("history.csv")).unwrap();
    let mut lines = history.lines().map(|l| l.split(',').collect::<Vec<_>>());
    let header = lines.next().unwrap();
    let column = |name: &str| header.iter().position(|h| *h == name).unwrap();
    for row in lines {
        let number = |name| row[column(name)].parse::<f64>().unwrap();
        assert!(row.len() == header.len() && number("min_jacobian") > 0.0 && number("e_internal_mj") > 0.0, "{row:?}");
    }
    let summary: Value = serde_json::from_slice(&fs::read(output.join("summary.json")).unwrap()).unwrap();
    assert!(summary["verdict"].as_str().unwrap().contains("lost"), "{summary:#}");
    assert!(summary["state_hash"].is_null());
}

#[test]
fn contact_tables_that_overflow_on_a_device_grow_and_leave_no_trace() {
    let Some(device) = device() else { return };
    let hash = |capacity: Capacity| {
        let loaded = case(&SHORT);
        let scene = rigs::scene(&loaded.case).unwrap();
        let config = BackendConfig { device: Some(Arc::clone(&device)), ..BackendConfig::default() };
        let mut cell = Simulation::with_capacity(scene, config, capacity).unwrap();
        cell.advance(1.2e-4, |_| false).unwrap_or_else(|e| panic!("{e}"));
        cell.fluctuations()
    };
    assert!(hash(Capacity { cell: 6, faces: 4, slots: 1, beam_slots: 1 }) == hash(Capacity::default()));
}

#[test]
fn a_scene_that_does_not_fit_is_refused_by_name_and_size() {
    let Some(device) = device() else { return };
    let len = (device.listed().binding_bytes / 2) as usize;
    let large = Description { name: "shapes", kind: Kind::Scalar, len, persistent: false, initial: Initial::Zero };
    let error = Gpu::new(device, &[large]).err().expect("twice what can be bound is too much").to_string();
    println!("{error}");
    assert!(error.contains("`shapes`") && error.contains("50 %"), "{error}");
}

/// Runs the program on the short case.
fn program(arguments: &[&str], environment: &[(&str, &str)], folder: &Path) -> Output {
    let sets = SMALL.iter().chain(&SHORT).flat_map(|s| ["--set", s]);
    Command::new(env!("CARGO_BIN_EXE_tricot"))
        .args(["run", CASE, "--quiet", "--backend", "gpu", "--set", "output.pictures=false", "-o"])
        .arg(folder.join("cell"))
        .args(sets)
        .args(arguments)
        .envs(environment.iter().copied())
        .output()
        .unwrap()
}

#[test]
#[cfg(target_os = "linux")]
fn without_an_adapter_the_program_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let none = [("VK_ICD_FILENAMES", "/nowhere.json"), ("VK_DRIVER_FILES", "/nowhere.json")];
    let output = program(&[], &none, folder.path());
    let message = String::from_utf8(output.stderr).unwrap();
    println!("{message}");
    assert_eq!(output.status.code(), Some(5));
    assert!(message.contains("no adapter was found") && message.contains("--backend cpu"), "{message}");
    assert!(!folder.path().join("cell").exists(), "nothing was run");
}

#[test]
fn the_program_names_the_device_and_refuses_what_it_cannot_do() {
    let Some(device) = device() else { return };
    let folder = tempfile::tempdir().unwrap();
    let output = program(&["--adapter", &device.listed().name, "--precision", "f64"], &[], folder.path());
    assert_eq!(output.status.code(), Some(5), "{output:?}");
    assert!(String::from_utf8_lossy(&output.stderr).contains("f32"), "{output:?}");
    let output = program(&["--adapter", "no such thing"], &[], folder.path());
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(message.contains("`no such thing`") && message.contains(&device.listed().name), "{message}");
    let output = program(&["--adapter", &device.listed().name], &[], folder.path());
    assert!(output.status.success(), "{output:?}");
    if device.is_software() {
        let output = program(&["--force"], &[], folder.path());
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(5), "{message}");
        assert!(message.contains("computes on the CPU") && message.contains("--adapter"), "{message}");
    }
    let summary = fs::read(folder.path().join("cell/summary.json")).unwrap();
    let summary: Value = serde_json::from_slice(&summary).unwrap();
    assert!(summary["backend"].as_str().unwrap().contains(&device.listed().name), "{summary:#}");
}

/// The validation layer of Vulkan reports nothing over a whole short run.
#[test]
#[cfg(target_os = "linux")]
fn validation_layers_find_nothing() {
    const LAYER: &str = "VK_LAYER_KHRONOS_validation";
    let Some(device) = device() else { return };
    let folder = tempfile::tempdir().unwrap();
    let layer = [("VK_INSTANCE_LAYERS", LAYER), ("VK_LOADER_DEBUG", "layer")];
    let output = program(&["--adapter", &device.listed().name], &layer, folder.path());
    let said = [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned()).concat();
    if !said.contains(LAYER) && std::env::var_os("TRICOT_REQUIRE_ADAPTER").is_none() {
        return println!("skipped: {LAYER} is not installed");
    }
    assert!(output.status.success() && said.contains(LAYER), "{said}");
    let complaints: Vec<&str> = said.lines().filter(|l| l.contains("VUID") || l.contains("Validation Error")).collect();
    assert!(complaints.is_empty(), "{complaints:#?}");
}
