//! What the host asks of a device: how often it submits work, and how often it waits.

use super::scenes::free;
use super::stages::device;
use crate::common::{bare, block, coarse_cell, loaded, neo_hookean, with};
use serde_json::{Value, json};
use std::sync::Arc;
use tricot::backend::Traffic;
use tricot::backend::gpu::Device;
use tricot::run;
use tricot::simulate::{BackendConfig, Simulation};

/// Steps between two looks at energies.
const WINDOW: u64 = 64;

fn start(case: &Value, device: Arc<Device>) -> Simulation {
    let config = BackendConfig { device: Some(device), ..BackendConfig::default() };
    run::simulation(&loaded(case), config).unwrap_or_else(|e| panic!("{e}"))
}

/// Traffic, steps and searches of a run from now to a time.
fn spent(scene: &mut Simulation, until: f64) -> (Traffic, u64, u64) {
    let (before, steps, searches) = (scene.backend().traffic().unwrap(), scene.step(), scene.searches());
    scene.advance(until, |_| false).unwrap_or_else(|e| panic!("{e}"));
    let after = scene.backend().traffic().unwrap();
    (after - before, scene.step() - steps, scene.searches() - searches)
}

/// A body at rest needs one wait per window: energies before and after the motion, status and timestamps come back together.
/// Steps are submitted a few at a time meanwhile.
#[test]
fn a_window_is_waited_for_once() {
    let Some(device) = device() else { return };
    let cube = block("cube", [2, 2, 2], [[0.0; 3], [1.0; 3]], 1e-9, neo_hookean(100.0, 0.3));
    let case = with(
        bare(),
        &[
            ("/domain/mesh/blocks", json!([cube])),
            ("/effects/contact", Value::Null),
            ("/steps", json!([{ "hold": { "time_s": 1 } }])),
            ("/integration", json!({ "dt_s": 1e-7 })),
        ],
    );
    let mut scene = start(&case, device);
    spent(&mut scene, 4.0 * WINDOW as f64 * 1e-7);
    let until = scene.time() + 10.0 * WINDOW as f64 * 1e-7;
    let (traffic, steps, _) = spent(&mut scene, until);
    assert_eq!((steps, traffic.waits), (10 * WINDOW, 10));
    assert!(traffic.submissions >= steps / 8, "the device computes while the host records: {traffic:?}");
}

/// With contact, the host waits once for every burst of at least eight steps and once for every search.
#[test]
fn bursts_and_searches_are_waited_for_once() {
    let Some(device) = device() else { return };
    for (name, case, time) in [("free", free(), 2e-5), ("cell", coarse_cell(), 5e-5)] {
        let mut scene = start(&case, device.clone());
        spent(&mut scene, 0.2 * time);
        let (traffic, steps, searches) = spent(&mut scene, time);
        println!("{name}: {steps} steps, {searches} searches: {traffic:?}");
        assert!(searches > 0 || steps > 8 * WINDOW, "{name}: {searches} searches in {steps} steps");
        // the last burst of a window or of the run may be shorter
        let bursts = steps / 8 + 2 * (steps / WINDOW + 1);
        assert!(traffic.waits <= bursts + searches, "{name}: {traffic:?} in {steps} steps with {searches} searches");
    }
}

/// A row of tables waits for the device once, a frame of the same state once more, a snapshot once. Nothing is read from a state
/// that has changed since.
#[test]
fn rows_frames_and_snapshots_are_waited_for_once() {
    let Some(device) = device() else { return };
    let mut scene = start(&coarse_cell(), device);
    spent(&mut scene, 2e-5);
    let waits = |scene: &Simulation| scene.backend().traffic().unwrap().waits;
    let before = waits(&scene);
    scene.bring_row();
    let (shape, tensions) = (scene.shape(), scene.tensions());
    scene.reactions();
    assert_eq!(waits(&scene) - before, 1);
    scene.bring_frame();
    let frame = scene.frame();
    assert_eq!(waits(&scene) - before, 2);
    assert_eq!(frame.positions, shape.positions);
    scene.snapshot();
    assert_eq!(waits(&scene) - before, 3);
    spent(&mut scene, 3e-5);
    scene.bring_row();
    assert_ne!(scene.shape().positions, shape.positions);
    assert_ne!(scene.tensions(), tensions);
}
