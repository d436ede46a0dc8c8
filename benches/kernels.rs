//! Cost of each stage of the default cell early in shear at its usual rate, after a quick pretension, on one thread.
//!
//! Criterion times every stage of a step alone, then search and diagnosis as a whole. The closing lines come from real steps:
//! the time of each stage, the share of contact, and the rate of hexahedra with assembly compared with the hexahedron kernel
//! alone ("bare"), repeated over blocks of consecutive nodes that fit the L2 cache.

use criterion::Criterion;
use std::hint::black_box;
use std::path::Path;
use std::time::{Duration, Instant};
use tricot::backend::{Backend, cpu::Cpu};
use tricot::elements::LANES;
use tricot::elements::block::Header;
use tricot::kernel::row::Row;
use tricot::kernel::stage::Stage;
use tricot::rigs::read::read;
use tricot::run::simulation;
use tricot::simulate::{BackendConfig, Simulation};

/// A quick pretension, so that contact is as busy as in most of a run.
const QUICK: [&str; 2] = ["steps.0.pretension.time_s=3e-4", "steps.1.stretch.time_s=1e-4"];
/// Start of timing, shortly after the start of shear, s.
const START: f64 = 4.5e-4;
/// Number of timed steps.
const STEPS: u64 = 512;
/// Blocks of the bare kernel: about 3 kB each.
const BARE_BLOCKS: usize = 32;

fn main() {
    let loaded = read(Path::new("cases/unit_cell_shear.json"), &QUICK.map(String::from)).expect("the case is valid");
    let config = BackendConfig { threads: 1, ..BackendConfig::default() };
    let mut cell = simulation(&loaded, config.clone()).expect("the cell can be built");
    cell.advance(START, |_| false).expect("the cell runs");

    let row = cell.schedule.row(cell.time(), cell.dt(), cell.dt(), |_| [1.0; 2]);
    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(500))
        .configure_from_args();
    let plan = cell.model.plan.clone();
    for stage in &plan.step {
        bench(&mut criterion, stage.name(), &cell, &config, std::slice::from_ref(stage), row);
    }
    for (name, stages) in
        [("all of search", &plan.search), ("all of diagnose", &plan.diagnose), ("all of collect", &plan.collect)]
    {
        bench(&mut criterion, name, &cell, &config, stages, row);
    }
    criterion.final_summary();

    let bare = bare(&cell, &config, row);
    report(&mut cell, bare);
}

/// Advances by about `steps` steps; returns the actual number.
fn advance(cell: &mut Simulation, steps: u64) -> u64 {
    let before = cell.step();
    while cell.step() < before + steps {
        let until = cell.time() + 64.0 * cell.dt();
        cell.advance(until, |_| false).expect("the cell runs");
    }
    cell.step() - before
}

/// A backend in the state of a simulation.
fn copy(cell: &Simulation, config: &BackendConfig) -> Cpu<f32> {
    let mut backend = Cpu::new(&cell.model.plan.buffers, config.threads, config.isa);
    for buffer in cell.model.plan.all() {
        backend.set_bytes(buffer, &cell.backend().bytes(buffer));
    }
    backend
}

fn bench(
    criterion: &mut Criterion,
    name: &str,
    cell: &Simulation,
    config: &BackendConfig,
    stages: &[Stage],
    row: Row<f64>,
) {
    let mut backend = copy(cell, config);
    criterion.bench_function(name, |bencher| {
        bencher.iter_custom(|count| {
            let rows = vec![row; count as usize];
            let started = Instant::now();
            backend.run(black_box(stages), &rows);
            started.elapsed()
        });
    });
}

/// Hexahedra per second of the kernel alone, the best of several repetitions.
fn bare(cell: &Simulation, config: &BackendConfig, row: Row<f64>) -> f64 {
    const ROUNDS: usize = 200;
    let model = &cell.model;
    let stage = model.plan.step.iter().find(|s| s.name() == "hex8").expect("the cell has hexahedra");
    let headers = cell.backend().uints(stage.reads()[0]);
    let headers: Vec<Header> = bytemuck::cast_slice(&headers).to_vec();
    // blocks of consecutive nodes come first
    let count = headers.iter().take_while(|h| h.contiguous == 1).count().min(BARE_BLOCKS);
    assert!(count > 0, "no block has consecutive nodes");
    let stage = stage.beginning(count);
    let mut backend = copy(cell, config);
    let rows = vec![row; ROUNDS];
    let best = (0..12).map(|_| {
        let started = Instant::now();
        backend.run(black_box(std::slice::from_ref(&stage)), &rows);
        started.elapsed().as_secs_f64()
    });
    (ROUNDS * count * LANES) as f64 / best.fold(f64::INFINITY, f64::min)
}

/// Times of the stages in real steps, as plain text.
fn report(cell: &mut Simulation, bare: f64) {
    let times = |cell: &Simulation| cell.backend().timings();
    let before = times(cell);
    let searches = cell.searches();
    let started = Instant::now();
    let steps = advance(cell, STEPS) as f64;
    let wall = started.elapsed().as_secs_f64() / steps;
    let spent: Vec<(String, f64)> = times(cell)
        .into_iter()
        .map(|(name, t)| {
            let earlier = before.iter().find(|(n, _)| *n == name).map_or(0.0, |(_, t)| *t);
            (name, (t - earlier) / steps)
        })
        .collect();
    let total: f64 = spent.iter().map(|(_, t)| t).sum();
    println!("\n{} hexes, {} beams; {}", cell.mesh().hexes(), cell.mesh().beams(), cell.backend().describe());
    println!(
        "stage                     us/step   share   (mean of {steps} steps, {} searches)",
        cell.searches() - searches
    );
    for (name, t) in &spent {
        println!("{name:<24} {:>8.1} {:>6.1} %", 1e6 * t, 100.0 * t / total);
    }
    println!("{:<24} {:>8.1}   of {:.1} us wall", "all stages", 1e6 * total, 1e6 * wall);
    let of = |chosen: &dyn Fn(&str) -> bool| spent.iter().filter(|(n, _)| chosen(n)).map(|(_, t)| t).sum::<f64>();
    let searching: Vec<&str> = cell.model.plan.search.iter().map(|s| s.name()).collect();
    let search = of(&|n| searching.contains(&n));
    let forces = of(&|n| n.ends_with(" contact"));
    println!(
        "contact share: {:.1} % of the step ({:.1} % forces, {:.1} % search)",
        100.0 * (search + forces) / total,
        100.0 * forces / total,
        100.0 * search / total
    );
    let hexes = cell.mesh().hexes() as f64;
    let real = hexes / of(&|n| n == "hex8" || n == "assemble");
    println!(
        "real/bare: {:.0} % (hexes with assembly in the loop {:.2} M/s, hexes alone in the loop {:.2} M/s, bare kernel {:.2} M/s)",
        100.0 * real / bare,
        1e-6 * real,
        1e-6 * hexes / of(&|n| n == "hex8"),
        1e-6 * bare
    );
}
