//! Cost of a whole step of the default cell early in shear at its usual rate, after a quick pretension, on one thread and on
//! all cores. Searches, energies and guards are included, as in a run.

use criterion::{Criterion, SamplingMode};
use std::path::Path;
use std::time::{Duration, Instant};
use tricot::rigs::read::read;
use tricot::run::simulation;
use tricot::simulate::BackendConfig;

/// A quick pretension, so that contact is as busy as in most of a run.
const QUICK: [&str; 2] = ["steps.0.pretension.time_s=3e-4", "steps.1.stretch.time_s=1e-4"];
/// Start of timing, shortly after the start of shear, s.
const START: f64 = 4.5e-4;
/// Steps per iteration: the interval between two evaluations of energies and limits.
const STEPS: u64 = 64;

fn main() {
    let loaded = read(Path::new("cases/unit_cell_shear.json"), &QUICK.map(String::from)).expect("the case is valid");
    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(8))
        .configure_from_args();
    let mut lines = Vec::new();
    for (name, threads) in [("one thread", 1), ("all cores", 0)] {
        let mut cell =
            simulation(&loaded, BackendConfig { threads, ..BackendConfig::default() }).expect("the cell can be built");
        cell.advance(START, |_| false).expect("the cell runs");
        let (mut steps, mut spent) = (0, Duration::ZERO);
        let mut group = criterion.benchmark_group("64 steps");
        group.sampling_mode(SamplingMode::Flat).bench_function(name, |bencher| {
            bencher.iter_custom(|count| {
                let (before, started) = (cell.step(), Instant::now());
                let until = cell.time() + (STEPS * count) as f64 * cell.dt();
                cell.advance(until, |_| false).expect("the cell runs");
                let (done, time) = (cell.step() - before, started.elapsed());
                steps += done;
                spent += time;
                time.mul_f64((STEPS * count) as f64 / done.max(1) as f64)
            });
        });
        group.finish();
        let step = spent.as_secs_f64() / steps.max(1) as f64;
        lines.push(format!(
            "{:.3} ms per step, {:.2} M hexes/s; {} hexes, {} beams; {}",
            1e3 * step,
            1e-6 * cell.mesh().hexes() as f64 / step,
            cell.mesh().hexes(),
            cell.mesh().beams(),
            cell.backend().describe()
        ));
    }
    criterion.final_summary();
    println!("\n{}", lines.join("\n"));
}
