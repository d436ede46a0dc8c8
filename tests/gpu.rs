//! The GPU backend against the CPU: every stage from identical input, on every buffer that it writes. Without an adapter the
//! tests say so and go on, unless TRICOT_REQUIRE_ADAPTER is set.

mod common;

use common::{Random, advance, bare, block, charmetant, loaded, neo_hookean, with};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};
use tricot::backend::Backend;
use tricot::backend::cpu::Cpu;
use tricot::backend::gpu::{Device, Gpu};
use tricot::kernel::buffer::{Buffer, Kind};
use tricot::kernel::lane::Isa;
use tricot::kernel::row::Row;
use tricot::kernel::stage::Access;
use tricot::run;
use tricot::simulate::{Make, Simulation};

/// The adapter that all tests share.
fn device() -> Option<Arc<Device>> {
    static DEVICE: OnceLock<Option<Arc<Device>>> = OnceLock::new();
    let open = || match Device::open("") {
        Ok(device) => Some(device),
        Err(error) if std::env::var_os("TRICOT_REQUIRE_ADAPTER").is_none() => {
            println!("skipped: {error}");
            None
        }
        Err(error) => panic!("{error}"),
    };
    DEVICE.get_or_init(open).clone()
}

/// A coarse cell of the shipped fabric, tightened fast so that threads and yarns touch.
fn cell() -> Value {
    let fabric: Value = serde_json::from_str(include_str!("../cases/fabrics/px35.json")).unwrap();
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

/// Two blocks of different laws that touch, one held, with a loose thread, gravity and open fibre lines.
fn free() -> Value {
    let held = json!({ "within": [[-0.1, -0.1, -0.1], [0.1, 1.1, 1.1]], "displacement_mm": [0.01, 0, 0] });
    let thread = json!({
        "name": "thread", "nodes": [[0, 0.5, 1.6], [1, 0.5, 1.6], [2, 0.7, 1.6], [3, 0.5, 1.6]], "radius_mm": 0.1,
        "axial_n": 100, "bending_n_mm2": 0.01, "linear_density_tex": 10, "rest_curvature": 0.5
    });
    with(
        bare(),
        &[
            (
                "/domain/mesh/blocks",
                json!([
                    block("rubber", [19, 2, 1], [[0.0; 3], [3.0, 1.0, 1.0]], 1e-9, neo_hookean(1.0, 0.3)),
                    block("yarn", [5, 2, 1], [[0.0, 0.0, 0.999], [3.0, 1.0, 1.501]], 1e-9, charmetant()),
                ]),
            ),
            ("/domain/mesh/threads", json!([thread])),
            ("/domain/mesh/conditions", json!([held])),
            ("/effects/gravity_mm_s2", json!([0, 0, -9810])),
            ("/effects/fibre_lines", json!({})),
            ("/effects/contact", json!({})),
            ("/steps", json!([{ "move": { "time_s": 1e-4 } }])),
        ],
    )
}

/// Largest difference of two buffers over the largest number, and how many integers differ at all.
fn difference(kind: Kind, ours: &[u8], theirs: &[u8]) -> (f64, usize) {
    let numbers = |bytes: &[u8]| -> Vec<f64> {
        bytes
            .chunks_exact(4)
            .map(|b| {
                let b = b.try_into().unwrap();
                match kind {
                    Kind::Scalar => f64::from(f32::from_ne_bytes(b)),
                    Kind::Int => f64::from(i32::from_ne_bytes(b)),
                    Kind::Uint => f64::from(u32::from_ne_bytes(b)),
                }
            })
            .collect()
    };
    let (ours, theirs) = (numbers(ours), numbers(theirs));
    let largest = theirs.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let mut worst = 0.0f64;
    let mut unequal = 0;
    for (a, b) in ours.iter().zip(&theirs) {
        unequal += usize::from(a != b);
        let error = if a == b { 0.0 } else { (a - b).abs() / largest.max(1e-30) };
        worst = if error.is_finite() { worst.max(error) } else { f64::INFINITY };
    }
    (worst, unequal)
}

/// Largest difference per stage and buffer that is allowed, relative to the buffer's largest number.
fn allowed(buffer: &str) -> f64 {
    match buffer {
        // bits of maxima, counts and flags
        "status" => 1e-6,
        _ => 2e-5,
    }
}

/// Runs every stage of a plan on both backends from the state of a simulation, and returns the worst difference per stage and
/// buffer.
fn compare(device: &Arc<Device>, simulation: &Simulation, worst: &mut BTreeMap<(String, &'static str), (f64, usize)>) {
    let plan = &simulation.model.plan;
    let mut cpu = Cpu::<f32>::new(&plan.buffers, 1, Isa::best());
    let mut gpu = Gpu::new(Arc::clone(device), &plan.buffers).unwrap_or_else(|e| panic!("{e}"));
    for buffer in (0..plan.buffers.len()).map(Buffer) {
        cpu.set_bytes(buffer, &simulation.backend().bytes(buffer));
    }
    let (time, dt) = (simulation.time(), simulation.dt());
    let row = Row { approach: 100.0, ..simulation.schedule.row(time, dt, dt) };
    for stage in [&plan.search, &plan.diagnose, &plan.step, &plan.watch].into_iter().flatten().filter(|s| s.count > 0) {
        for buffer in stage.reads.iter().chain(stage.writes.iter().map(|(b, _)| b)) {
            gpu.set_bytes(*buffer, &cpu.bytes(*buffer));
        }
        gpu.run(std::slice::from_ref(stage), &[row]);
        cpu.run(std::slice::from_ref(stage), &[row]);
        for (buffer, access) in &stage.writes {
            let description = &plan.buffers[buffer.0];
            // lists of cells are in any order
            if description.name == "cells" && *access == Access::Scatter {
                continue;
            }
            let now = difference(description.kind, &gpu.bytes(*buffer), &cpu.bytes(*buffer));
            if now.0 > allowed(description.name) {
                println!("{}: {} differs by {:.1e}, {} numbers", stage.name, description.name, now.0, now.1);
            }
            let entry = worst.entry((stage.name.to_owned(), description.name)).or_default();
            *entry = (entry.0.max(now.0), entry.1.max(now.1));
        }
        assert_eq!(gpu.fault(), None);
    }
}

#[test]
fn every_stage_agrees_with_the_cpu_on_every_buffer() {
    let Some(device) = device() else { return };
    println!("{:?}", device.listed());
    let mut worst = BTreeMap::new();
    let make = || Make { threads: 1, ..Make::default() };
    for case in [cell(), free()] {
        let end = 2.5e-4f64.min(if case["domain"].get("cell").is_some() { 1.0 } else { 1e-4 });
        let mut simulation = run::simulation(&loaded(&case), make()).unwrap();
        // a state in mid-run, then random ones
        advance(&mut simulation, end);
        compare(&device, &simulation, &mut worst);
        let mut random = Random(1);
        for size in [1e-3, 1e-2] {
            let mut noise = |v: Vec<[f64; 3]>, size: f64| -> Vec<[f64; 3]> {
                v.into_iter().map(|x| x.map(|x| x + size * random.draw())).collect()
            };
            let (w, v) = (noise(simulation.fluctuations(), size), noise(simulation.velocities(), 1e4 * size));
            simulation.set_fluctuations(&w);
            simulation.set_velocities(&v);
            compare(&device, &simulation, &mut worst);
        }
    }
    for ((stage, buffer), (error, unequal)) in &worst {
        println!("{stage:14} {buffer:32} {error:.1e} ({unequal} numbers are not the same)");
    }
    for ((stage, buffer), (error, _)) in worst {
        assert!(error <= allowed(buffer), "{stage}: {buffer} differs by {error:.1e}");
    }
}
