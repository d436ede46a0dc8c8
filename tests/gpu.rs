//! The GPU backend against the CPU: every stage from identical input, on every buffer that it writes. Without an adapter the
//! tests say so and go on, unless TRICOT_REQUIRE_ADAPTER is set.

mod common;

use common::{
    Random, advance, bare, block, charmetant, coarse_cell, held_specimen, loaded, neo_hookean, reduced, with,
};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};
use tricot::backend::Backend;
use tricot::backend::cpu::Cpu;
use tricot::backend::gpu::{Device, Gpu};
use tricot::kernel::buffer::{Buffer, Kind};
use tricot::kernel::lane::Isa;
use tricot::kernel::position::QUANTUM;
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
            // bodies start pressed together
            ("/integration", json!({ "energy_tolerance": 100 })),
        ],
    )
}

/// The numbers of a buffer, whatever they are.
fn numbers(backend: &dyn Backend, kind: Kind, buffer: Buffer) -> Vec<f64> {
    match kind {
        Kind::Scalar => backend.scalars(buffer),
        Kind::Int => backend.ints(buffer).into_iter().map(f64::from).collect(),
        Kind::Uint => backend.uints(buffer).into_iter().map(f64::from).collect(),
    }
}

/// Largest difference of two lists of numbers over the largest number, and how many differ at all.
fn difference(ours: &[f64], theirs: &[f64]) -> (f64, usize) {
    assert_eq!(ours.len(), theirs.len());
    let largest = theirs.iter().fold(1e-30, |m: f64, x| m.max(x.abs()));
    let mut worst = 0.0f64;
    let mut unequal = 0;
    for (a, b) in ours.iter().zip(theirs).filter(|(a, b)| a != b) {
        unequal += 1;
        let error = (a - b).abs() / largest;
        worst = if error.is_finite() { worst.max(error) } else { f64::INFINITY };
    }
    (worst, unequal)
}

/// Mean of the squares of the differences of a list of numbers from exact ones, where these are finite.
fn mean_square(ours: &[f64], exact: &[f64]) -> f64 {
    let squares = ours.iter().zip(exact).filter(|(_, e)| e.is_finite()).map(|(x, e)| (x - e).powi(2));
    let sum: f64 = squares.clone().sum();
    if sum.is_nan() { f64::INFINITY } else { sum / squares.count().max(1) as f64 }
}

/// What is allowed of the GPU against the CPU in f32, over the largest number of a buffer.
const ALLOWED: f64 = 2e-5;
/// Where f32 itself is further off than that (fibre stress at small strain): the GPU may be so many times further from f64 than
/// the CPU in f32 is, both in the root mean square. That of one number is a matter of luck, but a wrong one shows in the mean.
const ROUNDING: f64 = 1.5;

/// What was found of one buffer of one stage.
#[derive(Default, Clone, Copy)]
struct Found {
    /// Largest difference between the GPU and the CPU in f32, and numbers that differ.
    difference: f64,
    unequal: usize,
    /// Largest differences of the GPU and of the CPU in f32 from the CPU in f64.
    from_f64: [f64; 2],
    failed: bool,
}

/// Runs every stage of a plan on three backends from the state of a simulation.
fn compare(device: &Arc<Device>, simulation: &Simulation, found: &mut BTreeMap<(&'static str, &'static str), Found>) {
    let model = &simulation.model;
    let plan = &model.plan;
    let mut gpu = Gpu::new(Arc::clone(device), &plan.buffers).unwrap_or_else(|e| panic!("{e}"));
    let mut cpu = Cpu::<f32>::new(&plan.buffers, 1, Isa::best());
    let mut double = Cpu::<f64>::new(&plan.buffers, 1, Isa::best());
    for buffer in (0..plan.buffers.len()).map(Buffer) {
        cpu.set_bytes(buffer, &simulation.backend().bytes(buffer));
    }
    let (time, dt) = (simulation.time(), simulation.dt());
    let row = Row { approach: 100.0, ..simulation.schedule.row(time, dt, dt) };
    let stages = [&plan.search, &plan.diagnose, &plan.step, &plan.watch, &plan.collect];
    for stage in stages.into_iter().flatten().filter(|s| s.count > 0) {
        for buffer in stage.reads.iter().chain(stage.writes.iter().map(|(b, _)| b)) {
            gpu.set_bytes(*buffer, &cpu.bytes(*buffer));
            match plan.buffers[buffer.0].kind {
                Kind::Scalar => double.set_scalars(*buffer, &cpu.scalars(*buffer)),
                _ => double.set_bytes(*buffer, &cpu.bytes(*buffer)),
            }
        }
        let backends: [&mut dyn Backend; 3] = [&mut gpu, &mut cpu, &mut double];
        backends.into_iter().for_each(|b| b.run(std::slice::from_ref(stage), &[row]));
        assert_eq!(gpu.fault(), None);
        for (buffer, access) in &stage.writes {
            let description = &plan.buffers[buffer.0];
            // lists of cells are in any order, and a quantum may be in the whole part or in the remainder
            if description.name == "cells" && *access == Access::Scatter || *buffer == model.buffers.quanta {
                continue;
            }
            let of = |backend: &dyn Backend| {
                let values = numbers(backend, description.kind, *buffer);
                if *buffer == model.buffers.remainder {
                    let whole = backend.ints(model.buffers.quanta);
                    return values.iter().zip(whole).map(|(r, q)| f64::from(q) * QUANTUM + r).collect();
                }
                values
            };
            let (ours, theirs, exact) = (of(&gpu), of(&cpu), of(&double));
            let (worst, unequal) = difference(&ours, &theirs);
            let from_f64 = [&ours, &theirs].map(|x| difference(x, &exact).0);
            let entry = found.entry((stage.name, description.name)).or_default();
            let [gpu, cpu] = [&ours, &theirs].map(|x| mean_square(x, &exact));
            entry.failed |= worst > ALLOWED && gpu > ROUNDING * ROUNDING * cpu;
            entry.difference = entry.difference.max(worst);
            entry.unequal = entry.unequal.max(unequal);
            entry.from_f64 = [0, 1].map(|i| entry.from_f64[i].max(from_f64[i]));
        }
    }
}

#[test]
fn every_stage_agrees_with_the_cpu_on_every_buffer() {
    let Some(device) = device() else { return };
    println!("{:?}", device.listed());
    let mut found = BTreeMap::new();
    let make = || Make { threads: 1, ..Make::default() };
    for case in [coarse_cell(), held_specimen(), free(), reduced(coarse_cell()), reduced(free())] {
        let end = 2.5e-4f64.min(if case["domain"].get("mesh").is_none() { 1.0 } else { 1e-4 });
        let mut simulation = run::simulation(&loaded(&case), make()).unwrap();
        // a state in mid-run, then random ones
        advance(&mut simulation, end);
        compare(&device, &simulation, &mut found);
        let mut random = Random(1);
        for size in [1e-3, 1e-2] {
            let mut noise = |v: Vec<[f64; 3]>, size: f64| -> Vec<[f64; 3]> {
                v.into_iter().map(|x| x.map(|x| x + size * random.draw())).collect()
            };
            let (w, v) = (noise(simulation.fluctuations(), size), noise(simulation.velocities(), 1e4 * size));
            simulation.set_fluctuations(&w);
            simulation.set_velocities(&v);
            compare(&device, &simulation, &mut found);
        }
    }
    println!("{:16} {:32} GPU from CPU (numbers that differ)   GPU, CPU from f64", "stage", "buffer");
    for ((stage, buffer), f) in &found {
        let [gpu, cpu] = f.from_f64;
        println!("{stage:16} {buffer:32} {:8.1e} ({:6})   {gpu:8.1e} {cpu:8.1e}", f.difference, f.unequal);
    }
    let failed: Vec<_> = found.iter().filter(|(_, f)| f.failed).map(|(place, _)| place).collect();
    assert!(failed.is_empty(), "{failed:?} differ");
}
