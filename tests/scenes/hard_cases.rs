//! Every scene of `cases/hard`, shortened where it is long, shows what its `expect` says: on the CPU in f32 and f64, and small
//! ones on the GPU backend. Without an adapter that test says so and passes, unless TRICOT_REQUIRE_ADAPTER is set.

use std::path::Path;
use std::time::Instant;
use tricot::backend::gpu::Device;
use tricot::rigs::read::read;
use tricot::settings::integration::Precision;
use tricot::simulate::BackendConfig;
use tricot::study::scene::Scenes;
use tricot::study::stability::scenes;

const FOLDER: &str = "cases/hard";

/// Overrides that shorten scenes here relative to the study.
const SHORTER: [(&str, &str); 1] = [("long_rest_under_tension", "steps.3.hold.time_s=5e-3")];

/// Scenes of few steps, for a device in software.
const SMALL: [&str; 5] =
    ["nodes_on_nodes", "nodes_on_edges", "touching_at_the_start", "penetrating_at_the_start", "askew_mirrored"];

/// Runs the wanted scenes and fails with a list of all unmet expectations.
fn check(config: BackendConfig, wanted: impl Fn(&str) -> bool) {
    let (mut all, mut failed) = (Scenes::new(config), Vec::new());
    for path in scenes(Path::new(FOLDER)).unwrap() {
        let name = path.file_stem().unwrap().to_str().unwrap();
        if !wanted(name) {
            continue;
        }
        let started = Instant::now();
        let overrides: Vec<String> =
            SHORTER.iter().filter(|(scene, _)| *scene == name).map(|(_, set)| (*set).to_owned()).collect();
        let (seen, broken) = all.examine(&path, &overrides).unwrap_or_else(|e| panic!("{e}"));
        println!(
            "{name}: {} steps, balance {:.2} %, penetration {:.4} mm, det F {:.3}, {}; {:.1} s",
            seen.steps,
            100.0 * seen.balance,
            seen.penetration,
            seen.min_jacobian,
            seen.verdict.name(),
            started.elapsed().as_secs_f64()
        );
        failed.extend(broken.into_iter().map(|what| format!("{name}: {what}")));
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn every_scene_says_what_to_expect() {
    let paths = scenes(Path::new(FOLDER)).unwrap();
    assert!(paths.len() > 20);
    for path in paths {
        let expect = read(&path, &[]).unwrap_or_else(|e| panic!("{e}")).case.expect;
        assert!(expect.is_some_and(|e| e.energy_balance.is_some()), "{}", path.display());
    }
}

#[test]
fn hard_cases_hold_in_f32() {
    check(BackendConfig { threads: 1, ..BackendConfig::default() }, |_| true);
}

#[test]
fn hard_cases_hold_in_f64() {
    check(BackendConfig { threads: 1, precision: Precision::F64, ..BackendConfig::default() }, |_| true);
}

#[test]
fn small_hard_cases_hold_on_a_device() {
    match Device::open("") {
        Ok(device) => {
            check(BackendConfig { device: Some(device), ..BackendConfig::default() }, |name| SMALL.contains(&name))
        }
        Err(error) if std::env::var_os("TRICOT_REQUIRE_ADAPTER").is_none() => println!("skipped: {error}"),
        Err(error) => panic!("{error}"),
    }
}
