//! Fabrics, materials and loads at random: at least 95 % of the cases that the program accepts run for 2,000 steps without a
//! guard, and then satisfy checks of their own: energies computed anew from positions and velocities, momentum, and a mirrored
//! copy. A case stopped by a guard runs again with a quarter of the step in f64, which confirms or refutes the guard.
//!
//! TRICOT_FABRICS sets how many are drawn, TRICOT_SEED which ones. With TRICOT_SHRINK, a failing case is moved closer to the
//! shipped fabric as long as it fails; the result belongs in `REGRESSIONS`.

use crate::common::loaded;
use proptest::strategy::{Strategy, ValueTree};
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::time::Instant;
use tricot::error::Error;
use tricot::materials::charmetant::Charmetant;
use tricot::materials::{Material, Tensor, choose, jacobian};
use tricot::mesh::vector::{cross, dot, norm, sub};
use tricot::mesh::{Mesh, Ply, Thread};
use tricot::rigs;
use tricot::rigs::read::{Loaded, read};
use tricot::scene::Scene;
use tricot::settings::integration::Precision;
use tricot::settings::steps::Step;
use tricot::simulate::{BackendConfig, Simulation};

/// Steps that a case must run.
const STEPS: u64 = 2000;
/// Numbers that make a case, each from −1 to 1; with zeros it is the shipped fabric, coarsely meshed.
const NUMBERS: usize = 39;

/// Shrunk failures, by their fault.
const REGRESSIONS: [(&str, [f64; NUMBERS]); 1] =
    [("threads that are not at rest as they are generated start with bending energy", only(9, 0.7))];

/// The shipped fabric except for one number.
const fn only(at: usize, value: f64) -> [f64; NUMBERS] {
    let mut numbers = [0.0; NUMBERS];
    numbers[at] = value;
    numbers
}

type Numbers = Vec<f64>;

/// Takes numbers one after the other.
struct Draw<'a>(std::slice::Iter<'a, f64>);

impl Draw<'_> {
    fn next(&mut self) -> f64 {
        *self.0.next().expect("a case takes no more than NUMBERS")
    }
    /// From `low` to `high`, with zero for `middle`.
    fn between(&mut self, low: f64, middle: f64, high: f64) -> f64 {
        let x = self.next();
        let value = middle + x.abs() * if x < 0.0 { low - middle } else { high - middle };
        (value * 1e6).round() / 1e6
    }
    fn whole(&mut self, low: f64, middle: f64, high: f64) -> u64 {
        self.between(low, middle, high).round() as u64
    }
    fn yes(&mut self) -> bool {
        self.next() > 0.5
    }
}

fn yarn(draw: &mut Draw, [pitch, width, thickness]: [f64; 3], radius: f64) -> Value {
    let pitch = pitch * draw.between(0.7, 1.0, 1.4);
    // room for a thread, and up to half of the pitch
    let gap = draw.between(2.0 * radius + 0.005, (pitch - width).max(2.0 * radius + 0.02), 0.5 * pitch);
    json!({
        "pitch_mm": pitch,
        "width_mm": pitch - gap,
        "thickness_mm": thickness * draw.between(0.6, 1.0, 1.6),
        "areal_mass_g_m2": 300.0 * draw.between(0.4, 1.0, 1.5),
        "truncation": draw.between(0.85, 0.95, 0.97),
        "material": { "charmetant": {
            "k_elong_mpa": 108_500.0 * draw.between(0.2, 1.0, 1.5),
            "k_comp_mpa": 1.25 * draw.between(0.3, 1.0, 8.0),
            "p_comp": draw.between(1.5, 1.84, 2.2),
            "k_dist_mpa": 0.6 * draw.between(0.3, 1.0, 8.0),
            "k_sh_mpa": 2.2 * draw.between(0.3, 1.0, 8.0)
        } }
    })
}

/// A case from its numbers.
fn case(numbers: &[f64]) -> Value {
    let mut draw = Draw(numbers.iter());
    let radius = draw.between(0.05, 0.1, 0.13);
    // without added mass and with one rate of damping the momentum of the whole keeps its value
    let free = draw.yes();
    let effects = if free {
        json!({ "contact_mass": null, "damping": { "rate_per_s": 2000, "thread_settle_rate_per_s": 2000 } })
    } else {
        json!({})
    };
    let lap = if draw.yes() { "open" } else { "closed" };
    let stitch = json!({
        "radius_mm": radius,
        "lap": lap,
        "young_mpa": 350.0 * draw.between(0.3, 1.0, 3.0),
        "bending_n_mm2": 5.6e-4 * draw.between(0.0, 1.0, 3.0),
        "linear_density_tex": 43.4 * draw.between(0.2, 1.0, 2.0),
        "thermal_strain": draw.between(-0.22, -0.15, 0.0),
        "clearance_thread_mm": draw.between(0.03, 0.19, 0.3),
        "leg_shift_mm": draw.between(0.0, 0.12, 0.2),
        "rest_curvature": 1.0 - draw.between(0.0, 0.0, 1.0),
    });
    let tighten = 1e-4 * draw.between(2.0, 4.0, 8.0);
    json!({
        "title": "random fabric",
        "domain": { "cell": { "warps": 2, "wefts": 2 } },
        "fabric": {
            "name": "random",
            "warp": yarn(&mut draw, [5.0, 4.77, 0.37], radius),
            "weft": yarn(&mut draw, [2.5, 2.08, 0.378], radius),
            "stitch": stitch,
            "friction": draw.between(0.0, 0.2, 0.7),
            "ply_gap_mm": draw.between(0.0, 0.0, 0.1)
        },
        "resolution": {
            "warp_columns": draw.whole(5.0, 6.0, 9.0),
            "weft_columns": draw.whole(4.0, 4.0, 6.0),
            "layers": draw.whole(1.0, 2.0, 2.0),
            "slice_mm": draw.between(0.5, 0.7, 0.8),
            "beams_per_lap": draw.whole(32.0, 40.0, 60.0)
        },
        "effects": effects,
        "steps": [
            { "pretension": { "time_s": tighten } },
            { "shear": { "angle_deg": draw.between(-8.0, 4.0, 8.0), "time_s": 5e-4 } }
        ]
    })
}

/// Outcome of a case.
enum End {
    /// It reached the last step; the failed checks, in words.
    Ran(Vec<String>),
    /// A guard stopped it, and whether a run with a quarter of the step in f64 was stopped too.
    Stopped { guard: String, confirmed: bool },
}

/// Allowed relative differences, and the largest observed ones.
#[derive(Default)]
struct Margins(BTreeMap<&'static str, (f64, f64)>);

impl Margins {
    /// Notes a difference; says so if it is too large.
    fn hold(&mut self, what: &'static str, error: f64, allowed: f64, broken: &mut Vec<String>) {
        let seen = self.0.entry(what).or_insert((0.0, allowed));
        seen.0 = seen.0.max(error);
        if !(error <= allowed) {
            broken.push(format!("{what} is off by {error:.2e} (allowed {allowed:.0e})"));
        }
    }
}

fn config(precision: Precision) -> BackendConfig {
    BackendConfig { precision, threads: 1, ..BackendConfig::default() }
}

/// A simulation of a case on a mesh.
fn simulation(loaded: &Loaded, mesh: Mesh, precision: Precision) -> Result<Simulation, Error> {
    Simulation::new(Scene { mesh, ..rigs::scene(&loaded.case)? }, config(precision))
}

/// The mesh of a case that the program accepts.
fn accepted(case: &Value) -> Option<(Loaded, Mesh)> {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), case.to_string()).unwrap();
    let built = read(file.path(), &[]).and_then(|loaded| {
        let mesh = rigs::scene(&loaded.case)?.mesh;
        simulation(&loaded, mesh.clone(), Precision::F32)?;
        Ok((loaded, mesh))
    });
    if let Err(error) = &built {
        let message = error.to_string();
        println!("refused: {}", message.split_once(": ").map_or(message.as_str(), |(_, what)| what));
    }
    built.ok()
}

/// Goes on to the last step, as a run of the program does.
fn run(simulation: &mut Simulation) -> Result<(), Error> {
    let end = simulation.schedule.end();
    simulation.advance(end, |s| s.step() >= STEPS)
}

/// Goes on to the last step; the energy stored at the start, and the work of the thermal strain from the tensions that the host sees
/// every few steps.
fn run_and_look(simulation: &mut Simulation) -> Result<[f64; 2], Error> {
    simulation.advance(0.0, |_| false)?;
    let start = simulation.energies().bending + simulation.energies().contact;
    let thermal = |s: &Simulation| {
        let lengths = s.mesh().threads.iter().flat_map(|t| (0..t.beams()).map(|i| (t.beam(i), shrinks(t, i))));
        let products = lengths
            .zip(s.tensions())
            .map(|(([a, b], strain), n)| -n * strain * norm(sub(s.mesh().position(b), s.mesh().position(a))));
        (s.load().thermal, products.sum::<f64>())
    };
    let (mut work, mut before) = (0.0, (0.0, 0.0));
    while simulation.step() < STEPS {
        simulation.advance(simulation.time() + 7.5 * simulation.dt(), |_| true)?;
        let now = thermal(simulation);
        work += 0.5 * (now.1 + before.1) * (now.0 - before.0);
        before = now;
    }
    Ok([start, work])
}

/// Strain of a beam's chord at zero force: from the arc length and the thermal strain.
fn shrinks(thread: &Thread, beam: usize) -> f64 {
    (1.0 + thread.excess[beam]) * (1.0 + thread.thermal_strain) - 1.0
}

/// Strain energy of the yarns and of the threads' stretching, from positions: Gauss points and shape functions of the textbook.
fn energies(s: &Simulation) -> [f64; 2] {
    let frame = s.frame();
    let point = 1.0 / 3.0f64.sqrt();
    let mut yarns = 0.0;
    for block in &s.mesh().blocks {
        let (_, parameters, _) = choose(&block.material);
        // any frame with the fibre first
        let across = cross([0.0, 0.0, 1.0], block.fibre);
        let axes: Tensor<f64> = [block.fibre, across, cross(block.fibre, across)];
        let cells = (0..block.layers)
            .flat_map(|l| (0..block.columns).flat_map(move |c| (0..block.slices).map(move |s| (s, c, l))));
        for (slice, column, layer) in cells {
            let corners = block.corners(slice, column, layer);
            let at = corners.map(|n| s.mesh().position(n));
            let moved = corners.map(|n| sub(frame.position(s.mesh(), n), s.mesh().position(n)));
            for gauss in tricot::mesh::CORNER_SIGNS {
                let gauss = gauss.map(|sign| sign * point);
                // ∂N/∂ξ of the eight corners
                let slopes = tricot::mesh::CORNER_SIGNS.map(|sign| {
                    let n = [0, 1, 2].map(|k| 0.5 * (1.0 + sign[k] * gauss[k]));
                    [0.5 * sign[0] * n[1] * n[2], 0.5 * sign[1] * n[0] * n[2], 0.5 * sign[2] * n[0] * n[1]]
                });
                let sum = |values: &[[f64; 3]; 8]| -> Tensor<f64> {
                    [0, 1, 2].map(|i| [0, 1, 2].map(|j| (0..8).map(|a| values[a][i] * slopes[a][j]).sum()))
                };
                let (j, du) = (sum(&at), sum(&moved));
                let det = dot(j[0], cross(j[1], j[2]));
                // rows of the cofactors over the determinant: ∂ξ/∂X, transposed
                let inverse = [cross(j[1], j[2]), cross(j[2], j[0]), cross(j[0], j[1])].map(|r| r.map(|x| x / det));
                let h: Tensor<f64> = [0, 1, 2].map(|i| [0, 1, 2].map(|k| dot(du[i], inverse[k])));
                let local: Tensor<f64> =
                    [0, 1, 2].map(|a| [0, 1, 2].map(|b| (0..3).map(|i| axes[a][i] * dot(h[i], axes[b])).sum()));
                assert!(jacobian(&local) > 0.0);
                yarns += det * Charmetant::energy::<f64>(&parameters, &local).iter().sum::<f64>();
            }
        }
    }
    let strain = s.load().thermal;
    let mut stretching = 0.0;
    for thread in &s.mesh().threads {
        for beam in 0..thread.beams() {
            let [a, b] = thread.beam(beam);
            let rest = norm(sub(s.mesh().position(b), s.mesh().position(a)));
            let now = norm(sub(frame.position(s.mesh(), b), frame.position(s.mesh(), a)));
            let e = now / rest - 1.0 - strain * shrinks(thread, beam);
            stretching += 0.5 * thread.axial / (1.0 + thread.excess[beam]) * rest * e * e;
        }
    }
    [yarns, stretching]
}

/// The mesh of a cell mirrored in x.
fn mirrored(mesh: &Mesh) -> Mesh {
    let mut other = mesh.clone();
    let width = mesh.period.unwrap()[0];
    let flip = |x: [f64; 3]| [width - x[0], x[1], x[2]];
    other.nodes.iter_mut().for_each(|x| *x = flip(*x));
    for block in &mesh.blocks {
        // right-handed again: slices in the other order where they run along x, else columns
        for layer in 0..=block.layers {
            for column in 0..=block.columns {
                for slice in 0..block.stations() {
                    let from = match block.ply {
                        Ply::Weft => block.line(column, layer) + block.stations() - 1 - slice,
                        _ => block.line(block.columns - column, layer) + slice,
                    };
                    other.nodes[block.line(column, layer) + slice] = flip(mesh.nodes[from]);
                }
            }
        }
    }
    other
}

/// The case with its shear the other way.
fn sheared_back(loaded: &Loaded) -> Loaded {
    let mut other = loaded.clone();
    for step in &mut other.case.steps {
        if let Step::Shear { angle_deg, .. } = step {
            *angle_deg = -*angle_deg;
        }
    }
    other
}

/// Runs a case and checks it; `None` if the program does not accept it.
fn examine(numbers: &[f64], margins: &mut Margins) -> Option<End> {
    let (loaded, mesh) = accepted(&case(numbers))?;
    let mut s = simulation(&loaded, mesh.clone(), Precision::F32).unwrap();
    match run(&mut s) {
        Ok(()) => {}
        Err(Error::Guard(guard)) => {
            let mut slow = loaded.clone();
            slow.case.integration.safety *= 0.25;
            slow.case.integration.dt_max_s *= 0.25;
            let mut again = simulation(&slow, mesh, Precision::F64).unwrap();
            let result = again.advance(guard.time, |_| false);
            return Some(End::Stopped { guard: guard.to_string(), confirmed: result.is_err() });
        }
        Err(error) => panic!("{error}"),
    }
    let mut broken = vec![];
    // the program reports energies at the start of its last step
    let [yarns, stretching] = energies(&s);
    let before = s.velocities();
    s.advance(s.time() + 0.5 * s.dt(), |_| false).unwrap();
    let e = *s.energies();
    let scale = e.output().max(1e-6);
    let ledger = e.elongation + e.compaction + e.distortion + e.shear;
    margins.hold("strain energy of yarns", (yarns - ledger).abs() / scale, 1e-5, &mut broken);
    margins.hold("strain energy of threads", (stretching - e.axial).abs() / scale, 1e-5, &mut broken);
    let (velocities, masses) = (s.velocities(), s.model.mass.clone());
    let pairs = || velocities.iter().zip(&masses);
    let beside = before.iter().zip(&masses).chain(pairs());
    let kinetic: f64 = beside.map(|(v, m)| 0.25 * m * dot(*v, *v)).sum();
    margins.hold("kinetic energy", (kinetic - e.kinetic).abs() / scale, 1e-5, &mut broken);
    let forces = crate::common::forces(&s);
    // whatever inertia is added, internal forces have no resultant
    let sum = forces.iter().fold([0.0; 3], |sum, f| [0, 1, 2].map(|k| sum[k] + f[k]));
    margins.hold("sum of forces", norm(sum) / forces.iter().map(|f| norm(*f)).sum::<f64>(), 1e-5, &mut broken);
    let sum = pairs().fold([0.0; 3], |sum, (v, m)| [0, 1, 2].map(|k| sum[k] + m * v[k]));
    let size: f64 = pairs().map(|(v, m)| m * norm(*v)).sum();
    // inertia that comes and goes with contact carries its own momentum
    if loaded.case.effects.contact_mass.is_none() {
        margins.hold("momentum", norm(sum) / size, 1e-5, &mut broken);
    }

    let mut looked = simulation(&loaded, mesh.clone(), Precision::F32).unwrap();
    match run_and_look(&mut looked) {
        Ok([start, thermal]) => {
            let e = looked.energies();
            let scale = e.output().max(1e-6);
            margins.hold("thermal work", (thermal - e.thermal).abs() / scale, 0.02, &mut broken);
            let stored = energies(&looked).iter().sum::<f64>() + e.bending + e.contact + e.kinetic;
            let lost = e.friction + e.contact_damping + e.damping;
            let put_in = thermal + e.external + e.radius + e.inertia;
            margins.hold("balance of energies", (stored + lost - start - put_in).abs() / scale, 0.05, &mut broken);
        }
        Err(error) => broken.push(format!("looking at it more often, {error}")),
    }

    let mut copy = simulation(&sheared_back(&loaded), mirrored(&mesh), Precision::F32).unwrap();
    match run(&mut copy) {
        Ok(()) => {
            let other = copy.energies();
            margins.hold(
                "mirrored internal energy",
                (other.internal() - e.internal()).abs() / scale,
                0.02,
                &mut broken,
            );
            margins.hold("mirrored friction", (other.friction - e.friction).abs() / scale, 0.02, &mut broken);
            margins.hold("mirrored energy of threads", (other.axial - e.axial).abs() / scale, 0.02, &mut broken);
        }
        Err(error) => broken.push(format!("the mirrored copy is stopped: {error}")),
    }
    Some(End::Ran(broken))
}

fn number(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).map_or(otherwise, |text| text.parse().unwrap_or_else(|e| panic!("{name}={text}: {e}")))
}

/// The faults of a case, in words.
fn complaint(end: &End) -> Option<String> {
    match end {
        End::Ran(broken) if broken.is_empty() => None,
        End::Ran(broken) => Some(broken.join("; ")),
        End::Stopped { guard, confirmed } => {
            let verdict = if *confirmed { "confirmed" } else { "refuted" };
            Some(format!("{guard}; {verdict} by a quarter of the step in f64"))
        }
    }
}

/// Share of accepted cases that pass without a guard or a failed check, in per cent. Of the first forty fabrics of seed 1 and the
/// first twenty of seeds 2 to 4 it is 99: in one, of seed 2, the balance of energies is off by 6.5 % where 5 % are allowed.
const HELD: u64 = 99;

#[test]
fn random_fabrics_run_quietly_and_hold_their_checks() {
    let (wanted, seed) = (number("TRICOT_FABRICS", 40), number("TRICOT_SEED", 1));
    let mut bytes = [0; 32];
    bytes[..8].copy_from_slice(&seed.to_le_bytes());
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &bytes);
    let mut runner = TestRunner::new_with_rng(Config { failure_persistence: None, ..Config::default() }, rng);
    let strategy = proptest::collection::vec(-1.0..1.0f64, NUMBERS);
    let mut margins = Margins::default();
    let (mut quiet, mut run, mut drawn, mut wrong) = (0, 0, 0, vec![]);
    let started = Instant::now();
    while run < wanted {
        let mut tree = strategy.new_tree(&mut runner).unwrap();
        drawn += 1;
        assert!(drawn < 20 * wanted, "{run} of {drawn} cases are accepted");
        let Some(end) = examine(&tree.current(), &mut margins) else { continue };
        run += 1;
        quiet += u64::from(complaint(&end).is_none());
        if let Some(complaint) = complaint(&end) {
            println!("case {drawn}: {complaint}");
            let numbers = if std::env::var_os("TRICOT_SHRINK").is_some() { shrunk(&mut tree) } else { tree.current() };
            println!("  numbers {numbers:?}\n  {}", case(&numbers));
            wrong.push(complaint);
        }
    }
    let wall = started.elapsed().as_secs_f64();
    println!("seed {seed}: {quiet} of {run} accepted cases quiet and right, {drawn} drawn; {wall:.1} s");
    for (what, (seen, allowed)) in &margins.0 {
        println!("  {what}: off by at most {seen:.2e} (allowed {allowed:.0e})");
    }
    assert!(quiet * 100 >= run * HELD, "{quiet} of {run}:\n{}", wrong.join("\n"));
}

/// A case that fails, as close to the shipped fabric as some attempts bring it.
fn shrunk(tree: &mut dyn ValueTree<Value = Numbers>) -> Numbers {
    let mut worst = tree.current();
    for _ in 0..60 {
        if !tree.simplify() {
            break;
        }
        let fails = examine(&tree.current(), &mut Margins::default()).is_some_and(|end| complaint(&end).is_some());
        if fails {
            worst = tree.current();
        } else if !tree.complicate() {
            break;
        }
    }
    worst
}

#[test]
fn what_went_wrong_before_is_right() {
    let shipped = [0.0; NUMBERS];
    for (name, numbers) in [("the shipped fabric", shipped)].iter().chain(&REGRESSIONS) {
        let end = examine(numbers, &mut Margins::default()).unwrap_or_else(|| panic!("{name} is not accepted"));
        assert_eq!(complaint(&end), None, "{name}");
    }
    // the numbers of the shipped fabric are its own
    let own = loaded(&case(&shipped)).case.fabric().unwrap().clone();
    let px35 = include_str!("../../cases/fabrics/px35.json");
    let px35: tricot::case::fabric::Fabric = serde_json::from_str(px35).unwrap();
    assert!((own.warp.width_mm - px35.warp.width_mm).abs() < 1e-6 && own.warp.pitch_mm == px35.warp.pitch_mm);
    assert_eq!((own.stitch.thermal_strain, own.friction), (px35.stitch.thermal_strain, px35.friction));
}
