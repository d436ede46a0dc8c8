//! How much the shear curve of a case moves when its numerical choices change, beside how much it scatters by chance.
//!
//! Every variant is run three times, with one node offset by −1, 0 and 1 position quantum (1.2e-7 mm). F_nor is averaged over
//! ±2° at 5, 6, … 45°; the table holds the root mean square over those angles of the relative difference of a variant's mean
//! curve from the reference's, and of its three curves from their mean.
//!
//! `cargo run --release --example sensitivity -- cases/unit_cell_shear.json [variant …]`

use rayon::prelude::*;
use std::path::Path;
use std::time::Instant;
use tricot::case::read::read;
use tricot::error::Result;
use tricot::run::simulation;
use tricot::simulate::Make;
use tricot::study::difference::{averaged, mean, relative_rms, spread};

const VARIANTS: &[(&str, &[&str])] = &[
    ("reference", &[]),
    ("dt halved", &["integration.dt_max_s=2.5e-7"]),
    (
        "loading time doubled",
        &["steps.0.pretension.time_s=6e-3", "steps.1.hold.time_s=1e-3", "steps.2.shear.time_s=20e-3"],
    ),
    (
        "penalty doubled",
        &[
            "effects.contact.thread_penalty_n_mm2=280",
            "effects.contact.yarn_penalty_n_mm3=130",
            "effects.contact.thread_thread_penalty_n_mm=60",
        ],
    ),
    ("beams 0.22 to 0.12 mm", &["resolution.beams_per_lap=110"]),
    ("sheared to -50", &["steps.2.shear.angle_deg=-50"]),
    ("fibre lines off", &["effects.fibre_lines=null", "effects.contact_mass=null", "integration.dt_max_s=2.7e-8"]),
];

/// A shear curve: angle (degrees, positive) and F_nor (N/mm), and what it took.
struct Curve {
    points: Vec<[f64; 2]>,
    wall: f64,
    steps: u64,
    balance: f64,
}

fn curve(case: &Path, sets: &[&str], quanta: i32) -> Result<Curve> {
    let mut sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
    sets.push(format!("integration.perturbation_quanta={quanta}"));
    let loaded = read(case, &sets)?;
    let started = Instant::now();
    let mut simulation = simulation(&loaded, Make { threads: 1, ..Make::default() })?;
    let [x, y] = simulation.mesh.period.unwrap_or([f64::NAN; 2]);
    let end = simulation.schedule.end();
    let start = simulation.schedule.phases().last().map_or(0.0, |p| p.start);
    simulation.advance(start, |_| false)?;
    let mut points = Vec::new();
    let mut balance = 0.0f64;
    let mut last = [simulation.load().angle, simulation.energies().external];
    for row in 1..=400 {
        simulation.advance(start + (end - start) * f64::from(row) / 400.0, |_| false)?;
        let now = [simulation.load().angle, simulation.energies().external];
        let turned = libm::sin(now[0].abs()) - libm::sin(last[0].abs());
        points.push([0.5 * (now[0] + last[0]).abs().to_degrees(), (now[1] - last[1]) / (x * y * turned)]);
        balance = balance.max(simulation.health().balance.abs());
        last = now;
    }
    Ok(Curve { points, wall: started.elapsed().as_secs_f64(), steps: simulation.step(), balance })
}

/// Mean of F_nor over ±2° at 5, 6, … 45°.
fn smooth(curve: &Curve) -> Vec<f64> {
    averaged(&curve.points, &(5..=45).map(f64::from).collect::<Vec<_>>(), 2.0)
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let case = arguments.next().unwrap_or_else(|| "cases/unit_cell_shear.json".into());
    let wanted: Vec<String> = arguments.collect();
    let variants: Vec<_> = VARIANTS
        .iter()
        .filter(|(name, _)| {
            *name == "reference" || wanted.is_empty() && *name != "fibre lines off" || wanted.iter().any(|w| w == name)
        })
        .collect();
    let runs: Vec<(usize, i32)> = (0..variants.len()).flat_map(|v| [(v, -1), (v, 0), (v, 1)]).collect();
    let curves: Vec<(usize, Result<Curve>)> = runs
        .into_par_iter()
        .with_max_len(1)
        .map(|(v, quanta)| {
            let curve = curve(Path::new(&case), variants[v].1, quanta);
            match &curve {
                Ok(c) => eprintln!(
                    "{} {quanta:+}: {} steps, {:.0} s, balance {:.2} %",
                    variants[v].0,
                    c.steps,
                    c.wall,
                    100.0 * c.balance
                ),
                Err(error) => eprintln!("{} {quanta:+}: {error}", variants[v].0),
            }
            (v, curve)
        })
        .collect();
    println!(
        "{:<24} {:>10} {:>10} {:>9} {:>8} {:>9}  F_nor at 5/15/25/35/45° (N/mm)",
        "variant", "moves (%)", "spread (%)", "balance", "steps", "wall (s)"
    );
    let mut reference = Vec::new();
    for (v, (name, _)) in variants.iter().enumerate() {
        let done: Vec<&Curve> = curves.iter().filter(|(of, _)| *of == v).filter_map(|(_, c)| c.as_ref().ok()).collect();
        if done.is_empty() {
            println!("{name:<24} failed");
            continue;
        }
        let smoothed: Vec<Vec<f64>> = done.iter().map(|c| smooth(c)).collect();
        let mean = mean(&smoothed);
        if v == 0 {
            reference.clone_from(&mean);
        }
        let spread = 100.0 * spread(&smoothed, relative_rms);
        let forces: Vec<String> = [0, 10, 20, 30, 40].iter().map(|i| format!("{:.4}", mean[*i])).collect();
        println!(
            "{name:<24} {:>10.2} {spread:>10.2} {:>8.2}% {:>8} {:>9.0}  {}",
            100.0 * relative_rms(&mean, &reference),
            100.0 * done.iter().map(|c| c.balance).fold(0.0, f64::max),
            done[0].steps,
            done.iter().map(|c| c.wall).sum::<f64>() / done.len() as f64,
            forces.join(" ")
        );
    }
}
