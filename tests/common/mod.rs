//! Shared by the verification tests: cases from JSON snippets, and checks that print their results.
#![allow(dead_code)]

pub mod program;

use serde_json::{Value, json};
use std::path::PathBuf;
use tricot::rigs::read::{Loaded, read};
use tricot::run::{self, Machine, Options};
use tricot::settings::integration::Precision;
use tricot::simulate::{BackendConfig, Simulation};

/// Prints a number beside its expected value, and fails if the relative difference exceeds `tolerance` (the absolute one where
/// zero is expected).
#[track_caller]
pub fn near(what: &str, got: f64, expected: f64, tolerance: f64) {
    let scale = if expected == 0.0 { 1.0 } else { expected.abs() };
    let error = (got - expected).abs() / scale;
    println!("{what}: expected {expected:.6e}, got {got:.6e}, error {error:.1e} (allowed {tolerance:.0e})");
    assert!(error <= tolerance, "{what}: expected {expected:e}, got {got:e}, error {error:.2e} > {tolerance:e}");
}

/// Prints an error, and fails if it is larger than allowed.
#[track_caller]
pub fn below(what: &str, error: f64, allowed: f64) {
    println!("{what}: {error:.2e} (allowed {allowed:.0e})");
    assert!(error <= allowed, "{what}: {error:.3e} > {allowed:e}");
}

/// Reads a case as if it were a file.
pub fn loaded(case: &Value) -> Loaded {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("case.json");
    std::fs::write(&path, case.to_string()).unwrap();
    read(&path, &[]).unwrap_or_else(|e| panic!("{e}"))
}

/// A case on one thread, in a precision.
pub fn start(case: &Value, precision: Precision) -> Simulation {
    run::simulation(&loaded(case), BackendConfig { precision, threads: 1, ..BackendConfig::default() })
        .unwrap_or_else(|e| panic!("{e}"))
}

/// Advances to a time without a check.
#[track_caller]
pub fn advance(simulation: &mut Simulation, until: f64) {
    simulation.advance(until, |_| false).unwrap_or_else(|e| panic!("{e}"));
}

/// A free scene without effects, to be filled in.
pub fn bare() -> Value {
    json!({
        "title": "verification",
        "domain": { "mesh": { "blocks": [], "threads": [], "conditions": [] } },
        "effects": { "contact": null, "damping": null, "fibre_lines": null, "contact_mass": null, "mass_floor": 0 },
        "steps": [{ "hold": { "time_s": 1.0 } }]
    })
}

/// A coarse cell of the shipped fabric with every effect, tightened fast so that threads and yarns touch.
pub fn coarse_cell() -> Value {
    let fabric: Value = serde_json::from_str(include_str!("../../cases/fabrics/px35.json")).unwrap();
    json!({
        "title": "coarse cell",
        "fabric": fabric,
        "domain": { "cell": {} },
        "resolution": { "warp_columns": 6, "weft_columns": 4, "slice_mm": 0.8, "beams_per_lap": 32 },
        "steps": [{ "pretension": { "time_s": 1.5e-4 } }, { "shear": { "angle_deg": 3, "time_s": 1e-4 } }],
        "integration": { "energy_tolerance": 100 },
        "effects": {}
    })
}

/// The coarse cell with driven fibres, frames and frequent checkpoints: a run of a second.
pub fn short_cell() -> Value {
    let steps = json!([
        { "pretension": { "time_s": 1.5e-4 } },
        { "stretch": { "warp": "corner_driven", "weft": "corner_driven", "time_s": 2e-5 } },
        { "shear": { "angle_deg": 3, "time_s": 1e-4 } }
    ]);
    let output = json!({ "rows_per_step": 6, "frames_at_deg": [1, 2], "pictures": false, "checkpoint_wall_s": 0.02 });
    with(coarse_cell(), &[("/steps", steps), ("/output", output)])
}

/// A small specimen with threads held at its cuts, tightened fast.
pub fn held_specimen() -> Value {
    let domain = json!({ "specimen": { "length_mm": 20, "width_mm": 14, "displacement_mm": 0.01 } });
    with(
        coarse_cell(),
        &[
            ("/domain", domain),
            ("/steps", json!([{ "pretension": { "time_s": 1.5e-4 } }, { "move": { "time_s": 1e-4 } }])),
        ],
    )
}

/// A small sample in a picture frame, tightened fast, whose yarns are stretched and then sheared.
pub fn framed() -> Value {
    let domain = json!({ "picture_frame": { "frame_mm": 20, "fabric_mm": 12, "tension_strain": 1e-4 } });
    let steps = json!([
        { "pretension": { "time_s": 1.5e-4 } }, { "move": { "time_s": 5e-5 } },
        { "shear": { "angle_deg": 0.5, "time_s": 1e-4 } }
    ]);
    with(coarse_cell(), &[("/domain", domain), ("/steps", steps)])
}

/// A quiet run on the CPU that leaves its results in a folder.
pub fn options(output: PathBuf, threads: usize) -> Options {
    Options {
        output,
        precision: None,
        threads: Some(threads),
        machine: Machine::Cpu,
        adapter: String::new(),
        force: false,
        resume: false,
        from: None,
        quiet: true,
    }
}

/// Replaces or adds values at paths such as `/effects/mass_floor`.
pub fn with(mut value: Value, changes: &[(&str, Value)]) -> Value {
    for (path, new) in changes {
        if let Some(place) = value.pointer_mut(path) {
            *place = new.clone();
            continue;
        }
        let (parent, key) = path.rsplit_once('/').unwrap();
        value.pointer_mut(parent).unwrap_or_else(|| panic!("{path}"))[key] = new.clone();
    }
    value
}

/// The case with hexahedra of one Gauss point.
pub fn reduced(mut case: Value) -> Value {
    case["integration"]["hexahedra"] = json!("reduced");
    case
}

pub fn neo_hookean(young: f64, poisson: f64) -> Value {
    json!({ "neo_hookean": { "young_mpa": young, "poisson": poisson } })
}

pub fn charmetant() -> Value {
    json!({ "charmetant": { "k_elong_mpa": 108500, "k_comp_mpa": 1.25, "p_comp": 1.84, "k_dist_mpa": 0.6, "k_sh_mpa": 2.2 } })
}

/// A straight block with the fibre along x.
pub fn block(name: &str, elements: [usize; 3], corners: [[f64; 3]; 2], density: f64, material: Value) -> Value {
    json!({ "name": name, "elements": elements, "corners": corners, "density_t_mm3": density, "material": material })
}

/// A block whose node at slice, column and layer (0 to 1 each) lies where `place` puts it.
pub fn shaped(
    name: &str,
    elements: [usize; 3],
    density: f64,
    material: Value,
    place: impl Fn([f64; 3]) -> [f64; 3],
) -> Value {
    let [slices, columns, layers] = elements;
    let mut nodes = vec![];
    for l in 0..=layers {
        for c in 0..=columns {
            for s in 0..=slices {
                nodes.push(place([s as f64 / slices as f64, c as f64 / columns as f64, l as f64 / layers as f64]));
            }
        }
    }
    json!({ "name": name, "elements": elements, "nodes": nodes, "density_t_mm3": density, "material": material })
}

/// Forces on all nodes at the start of the last step, N; zero where a node is held.
pub fn forces(simulation: &Simulation) -> Vec<[f64; 3]> {
    let b = &simulation.model.buffers;
    let (acceleration, inverse) =
        (simulation.backend().scalars(b.acceleration), simulation.backend().scalars(b.inverse_mass));
    let force = |node: usize| [0, 1, 2].map(|k| acceleration[node + k * inverse.len()] / inverse[node]);
    (0..inverse.len()).map(|node| if inverse[node] == 0.0 { [0.0; 3] } else { force(node) }).collect()
}

/// Current positions of all nodes, mm.
pub fn positions(simulation: &Simulation) -> Vec<[f64; 3]> {
    let moved = simulation.fluctuations();
    simulation.mesh().nodes.iter().zip(moved).map(|(x, w)| [0, 1, 2].map(|k| x[k] + w[k])).collect()
}

pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub fn norm(a: [f64; 3]) -> f64 {
    a.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Linear momentum, and angular momentum about the origin: tonne mm/s and tonne mm²/s.
pub fn momenta(simulation: &Simulation) -> ([f64; 3], [f64; 3]) {
    let (mut linear, mut angular) = ([0.0; 3], [0.0; 3]);
    let mass = &simulation.model.mass;
    for ((x, v), m) in positions(simulation).into_iter().zip(simulation.velocities()).zip(mass) {
        let turn = cross(x, v);
        for k in 0..3 {
            linear[k] += m * v[k];
            angular[k] += m * turn[k];
        }
    }
    (linear, angular)
}

/// A pseudo-random number in −1 to 1, the same in every run.
pub struct Random(pub u64);

impl Random {
    pub fn draw(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}
