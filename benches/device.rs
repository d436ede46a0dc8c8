//! Cost of a step on a GPU: microseconds per step, hexahedra per second, the time of each stage by the device's own clock and its
//! distance from the performance limits of the device, what the host asks of the device, the time of a row of tables and of a frame,
//! and the distance from the CPU after some more steps. One scene per run:
//! `cargo bench --bench device -- WARPS WEFTS` is a sheet of the cell (2 4: the 10 × 10 mm cell; 6 12: 30 × 30 mm; 20 40:
//! 100 × 100 mm), `cargo bench --bench device -- CASE` the beginning of a case. The last line is the table as JSON. `--adapter NAME`
//! takes an adapter by a part of its name, `--steps COUNT` times another number of steps.

use naga::{Expression, MathFunction, Statement, TypeInner};
use serde_json::json;
use std::collections::HashSet;
use std::path::Path;
use std::time::Instant;
use tricot::backend::gpu::Device;
use tricot::kernel::shader::{ENTRY, Text, WORKGROUP};
use tricot::kernel::stage::Stage;
use tricot::rigs::read::{Loaded, read};
use tricot::run::simulation;
use tricot::simulate::{BackendConfig, Simulation};

/// A quick pretension, so that contact is as busy as in most of a run, and the start of timing, s.
const QUICK: [&str; 2] = ["steps.0.pretension.time_s=6e-4", "steps.1.stretch.time_s=5e-5"];
const START: f64 = 6.6e-4;
/// Number of timed steps, and of steps after which positions are compared with the CPU.
const STEPS: u64 = 1024;
const PARITY: u64 = 64;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let option = |name: &str| {
        let at = arguments.iter().position(|a| a == name)?;
        arguments.get(at + 1).cloned()
    };
    let wanted: u64 = option("--steps").and_then(|n| n.parse().ok()).unwrap_or(STEPS);
    let device = match Device::open(&option("--adapter").unwrap_or_default()) {
        Ok(device) => device,
        Err(error) => return println!("{error}"),
    };
    let (scene, loaded) = chosen(&arguments);
    let config = BackendConfig { device: Some(device.clone()), ..BackendConfig::default() };
    let mut sheet = simulation(&loaded, config).unwrap_or_else(|e| panic!("{e}"));
    let hexes = sheet.mesh().hexes();
    let (beams, nodes) = (sheet.mesh().beams(), sheet.mesh().nodes.len());
    println!("{scene}: {hexes} hexes, {beams} beams, {nodes} nodes; {}", sheet.backend().describe());
    go(&mut sheet, START);
    let (before, searches, timed, asked) =
        (sheet.step(), sheet.searches(), sheet.backend().timings(), sheet.backend().traffic().unwrap_or_default());
    let started = Instant::now();
    let until = sheet.time() + wanted as f64 * sheet.dt();
    go(&mut sheet, until);
    let (steps, wall) = (sheet.step() - before, started.elapsed().as_secs_f64());
    let (step, per_step) = (wall / steps as f64, |count: u64| count as f64 / steps as f64);
    println!("{:.1} µs a step, {:.2} million hexes a second, {steps} steps", 1e6 * step, 1e-6 * hexes as f64 / step);
    let traffic = sheet.backend().traffic().unwrap_or_default() - asked;
    let searches = sheet.searches() - searches;
    let dispatches = per_step(traffic.dispatches);
    let [submissions, waits, found, bytes] =
        [traffic.submissions, traffic.waits, searches, traffic.bytes_read].map(|count| 1e3 * per_step(count));
    let [recording, waiting] = [traffic.recording_s, traffic.waiting_s].map(|time| 1e6 * time / steps as f64);
    println!("host, µs a step: recording {recording:.1}, waiting {waiting:.1}; {dispatches:.1} dispatches a step");
    println!(
        "in 1,000 steps: {submissions:.0} submissions, {waits:.0} waits, {found:.0} searches, {:.2} MB read back",
        1e-6 * bytes
    );

    let rates = device.rates();
    println!("device at best: {:.0} GB/s, {:.0} GFLOP/s", 1e-9 * rates.bytes, 1e-9 * rates.operations);
    println!("{:60} {:>12} {:>12} {:>12}", "dispatch", "µs a step", "floor, µs", "of floor");
    let plan = sheet.model.plan.clone();
    let (mut sum, mut stages) = (0.0, serde_json::Map::new());
    for (name, time) in sheet.backend().timings() {
        let old = timed.iter().find(|(n, _)| *n == name).map_or(0.0, |(_, t)| *t);
        let spent = (time - old) / steps as f64;
        sum += spent;
        let of_step =
            plan.step.iter().filter(|s| name.split(" + ").any(|one| one == s.name()) && !s.items().is_empty());
        let floor = of_step.map(|s| floor(&sheet, s, rates.bytes, rates.operations)).fold(0.0, |a, b| a + b);
        // only the stages of every step have a lower bound
        let floor = (floor > 0.0).then_some(floor);
        let shown = floor.map(|floor| format!("{:12.2} {:10.0} %", 1e6 * floor, 100.0 * floor / spent));
        println!("{name:60} {:12.2} {}", 1e6 * spent, shown.unwrap_or_default());
        stages.insert(name, json!({ "us": 1e6 * spent, "floor_us": floor.map(|floor| 1e6 * floor) }));
    }
    println!("between dispatches: {:.0} % of the step", 100.0 * (1.0 - sum / step));
    let [row, frame] = [seen(&mut sheet, Simulation::bring_row), seen(&mut sheet, Simulation::bring_frame)];
    println!("on the host: what a row of tables needs in {:.2} ms, a frame in {:.2} ms", 1e3 * row, 1e3 * frame);
    let apart = apart(&mut sheet, &loaded);
    println!("{PARITY} steps later, nodes are at most {apart:.1e} mm from where the CPU has them");
    let adapter = device.listed();
    let table = json!({
        "scene": scene, "adapter": adapter.name, "driver": adapter.driver, "interface": adapter.interface, "hexes": hexes,
        "beams": beams, "nodes": nodes, "steps": steps, "us_per_step": 1e6 * step, "hexes_per_s": hexes as f64 / step,
        "recording_us_per_step": recording, "waiting_us_per_step": waiting, "dispatches_per_step": dispatches,
        "submissions_per_1000_steps": submissions, "waits_per_1000_steps": waits, "searches_per_1000_steps": found,
        "bytes_read_per_1000_steps": bytes, "row_s": row, "frame_s": frame, "mm_from_cpu": apart,
        "device_bytes_per_s": rates.bytes, "device_operations_per_s": rates.operations,
        "stages": stages
    });
    println!("{table}");
}

/// The scene of the arguments: a case, or a sheet of the cell, tightened quickly.
fn chosen(arguments: &[String]) -> (String, Loaded) {
    if let Some(case) = arguments.iter().find(|a| a.ends_with(".json")) {
        let quick = [QUICK[0].to_owned(), "steps.1.hold.time_s=5e-5".to_owned()];
        return (case.clone(), read(Path::new(case), &quick).unwrap_or_else(|e| panic!("{e}")));
    }
    let numbers: Vec<usize> = arguments.iter().map_while(|a| a.parse().ok()).collect();
    let [warps, wefts] = if let [warps, wefts, ..] = numbers[..] { [warps, wefts] } else { [2, 4] };
    let sets = [format!("domain.cell.warps={warps}"), format!("domain.cell.wefts={wefts}")];
    let sets: Vec<String> = QUICK.map(String::from).into_iter().chain(sets).collect();
    let loaded = read(Path::new("cases/unit_cell_shear.json"), &sets).unwrap_or_else(|e| panic!("{e}"));
    (format!("sheet of {warps} × {wefts}"), loaded)
}

/// Seconds until the host has what it asks for and the positions computed from it.
fn seen(sheet: &mut Simulation, bring: impl Fn(&mut Simulation)) -> f64 {
    let started = Instant::now();
    bring(sheet);
    std::hint::black_box(sheet.shape());
    started.elapsed().as_secs_f64()
}

/// Largest distance of a node from where the CPU has it, mm, after both go on from the same state.
fn apart(sheet: &mut Simulation, loaded: &Loaded) -> f64 {
    let mut host = simulation(loaded, BackendConfig::default()).unwrap_or_else(|e| panic!("{e}"));
    let (record, buffers) = sheet.snapshot();
    let sizes: Vec<(String, usize)> = buffers.iter().map(|(name, bytes)| ((*name).into(), bytes.len())).collect();
    let contents: Vec<Vec<u8>> = buffers.into_iter().map(|(_, bytes)| bytes).collect();
    host.restore(record, &sizes, &contents).unwrap_or_else(|e| panic!("{e}"));
    let until = sheet.time() + PARITY as f64 * sheet.dt();
    [&mut *sheet, &mut host].into_iter().for_each(|scene| go(scene, until));
    let (ours, theirs) = (sheet.fluctuations(), host.fluctuations());
    let far = |(a, b): (&[f64; 3], &[f64; 3])| (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max);
    ours.iter().zip(&theirs).map(far).fold(0.0, f64::max)
}

fn go(sheet: &mut Simulation, until: f64) {
    sheet.advance(until, |_| false).unwrap_or_else(|e| panic!("{e}"));
}

/// Lower bound of the time of a stage, s: all its buffers moved once, or its operations at the peak rate, whichever takes longer.
fn floor(sheet: &Simulation, stage: &Stage, bytes_per_s: f64, operations_per_s: f64) -> f64 {
    let buffers: HashSet<usize> =
        stage.reads().iter().chain(stage.writes().iter().map(|(b, _)| b)).map(|b| b.number()).collect();
    let written: usize = stage.writes().iter().map(|(b, _)| sheet.model.plan.describe(*b).len).sum();
    let bytes = 4 * (buffers.iter().map(|b| sheet.model.plan.buffers[*b].len).sum::<usize>() + written);
    let invocations = WORKGROUP * stage.kernel().shader.share.workgroups(stage.items().len());
    let operations = operations(stage) * invocations as f64;
    (bytes as f64 / bytes_per_s).max(operations / operations_per_s)
}

/// Number of f32 operations per invocation of a stage, if its shader has no loops; else 0, since loop counts depend on data.
fn operations(stage: &Stage) -> f64 {
    let text = Text::of(stage).unwrap_or_else(|e| panic!("{e}"));
    let (module, info) = text.module().unwrap_or_else(|e| panic!("{e}"));
    let entry = module.entry_points.iter().position(|e| e.name == ENTRY).expect("checked by a test");
    count(&module, &module.entry_points[entry].function, info.get_entry_point(entry), &info).unwrap_or(0.0)
}

fn count(
    module: &naga::Module,
    function: &naga::Function,
    info: &naga::valid::FunctionInfo,
    all: &naga::valid::ModuleInfo,
) -> Option<f64> {
    let mut sum = 0.0;
    for (handle, expression) in function.expressions.iter() {
        let inner = info[handle].ty.inner_with(&module.types);
        let size = match inner {
            TypeInner::Scalar(s) if s.kind == naga::ScalarKind::Float => 1.0,
            TypeInner::Vector { size, scalar } if scalar.kind == naga::ScalarKind::Float => f64::from(*size as u8),
            TypeInner::Matrix { columns, rows, .. } => f64::from(*columns as u8) * f64::from(*rows as u8),
            _ => continue,
        };
        sum += match expression {
            Expression::Binary { .. } => size,
            Expression::Math { fun: MathFunction::Fma, .. } => 2.0 * size,
            Expression::Math { fun: MathFunction::Dot, .. } => 5.0,
            Expression::Math { fun: MathFunction::Cross, .. } => 9.0,
            Expression::Math { .. } => size,
            _ => 0.0,
        };
    }
    for statement in &function.body {
        sum += called(module, statement, all)?;
    }
    Some(sum)
}

/// Number of operations of the functions called by a statement; `None` for loops.
fn called(module: &naga::Module, statement: &Statement, all: &naga::valid::ModuleInfo) -> Option<f64> {
    let block = |block: &naga::Block| block.iter().map(|s| called(module, s, all)).sum::<Option<f64>>();
    match statement {
        Statement::Call { function, .. } => count(module, &module.functions[*function], &all[*function], all),
        Statement::Block(inner) => block(inner),
        Statement::If { accept, reject, .. } => Some(block(accept)? + block(reject)?),
        Statement::Switch { cases, .. } => cases.iter().map(|case| block(&case.body)).sum(),
        Statement::Loop { .. } => None,
        _ => Some(0.0),
    }
}
