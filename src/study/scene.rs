//! One scene from start to end without files: it records extremes on the way and checks the expectations of the case.

use crate::case::expect::{Expect, Quantity, Verdict};
use crate::error::{Error, Result};
use crate::mesh::{Mesh, vector};
use crate::rigs::read::read;
use crate::run;
use crate::schedule::Phase;
use crate::simulate::{BackendConfig, Energies, Retries, Simulation};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Observations of a run.
#[derive(Debug, Clone)]
pub struct Observed {
    pub verdict: Verdict,
    /// Message of the guard; empty if the run finished.
    pub message: String,
    pub steps: u64,
    /// Number of rollbacks.
    pub retries: usize,
    /// Whether it was left before its end, at the given number of steps.
    pub cut: bool,
    /// Smallest step, and smallest estimated limit without factors, s.
    pub dt: f64,
    pub dt_limit: f64,
    /// Largest absolute error of the energy balance before a guard stops the scene, over the largest energy.
    pub balance: f64,
    /// Largest penetration of any kind, mm.
    pub penetration: f64,
    /// Smallest det F.
    pub min_jacobian: f64,
    /// Energies at the end.
    pub energies: Energies,
    /// Distances between initial and final positions of all nodes, sorted, mm.
    pub displacements: Vec<f64>,
    /// Largest distance between the positions of a node at the beginning and end of the last load step, mm.
    pub drift: f64,
    pub thickness_ratio: f64,
    /// Largest force in a beam at the end, N.
    pub tension: f64,
    /// Force in the last beam of the first thread over the force in its first beam, at looks in the middle half of the last load
    /// step.
    pub tension_ratios: Vec<f64>,
}

/// Scenes on one machine; each runs once.
pub struct Scenes {
    config: BackendConfig,
    /// Steps after which a scene is left.
    longest: u64,
    /// By case and overrides.
    seen: BTreeMap<(PathBuf, Vec<String>), Observed>,
}

impl Scenes {
    pub fn new(config: BackendConfig) -> Self {
        Self { config, longest: u64::MAX, seen: BTreeMap::new() }
    }

    /// Leaves every scene after this number of steps.
    pub fn longest(self, steps: u64) -> Self {
        Self { longest: steps, ..self }
    }

    /// Runs a case with overrides, and returns the expectations that fail.
    ///
    /// # Errors
    /// A case that cannot be run. A guard that stops the run is a verdict.
    pub fn examine(&mut self, path: &Path, overrides: &[String]) -> Result<(Observed, Vec<String>)> {
        let loaded = read(path, overrides)?;
        let mut case = loaded.clone();
        case.case.integration.precision = self.config.precision;
        let key = (path.to_path_buf(), overrides.to_vec());
        let observed = match self.seen.get(&key) {
            Some(observed) => observed.clone(),
            None => observe(run::simulation(&case, self.config.clone())?, self.longest)?,
        };
        self.seen.insert(key, observed.clone());
        let Some(expect) = &loaded.case.expect else { return Ok((observed, Vec::new())) };
        let mut broken = observed.broken(expect);
        if let Some(same) = &expect.same_as {
            let other = path.parent().unwrap_or(Path::new("")).join(&same.case);
            let (other, _) = self.examine(&other, &[])?;
            let apart = observed.apart(&other, same.quantity);
            let agree = apart <= same.within;
            if !agree {
                broken.push(format!("differs from {} by {apart:.3e}", same.case.display()));
            }
        }
        Ok((observed, broken))
    }
}

/// Runs a simulation to its end, for `longest` steps, or until a guard stops it for good.
fn observe(mut simulation: Simulation, longest: u64) -> Result<Observed> {
    let mut retries = Retries::of(&simulation);
    let mut way = Way::default();
    while way.phase < simulation.schedule.phases().len() && simulation.step() < longest {
        if retries.due(&simulation) {
            retries.keep(&mut simulation, way.clone());
        }
        match way.go(&mut simulation, &retries, longest) {
            Err(Error::Guard(guard)) => match retries.go_back(&mut simulation, guard) {
                Ok(earlier) => way = earlier,
                Err(error) => {
                    // the state that trips a guard is not part of the results whose balance is judged
                    way.seen.look(&simulation);
                    way.seen.stop(error)?;
                    break;
                }
            },
            result => result?,
        }
    }
    let Way { phase, mut seen, ledger, before } = way;
    seen.retries = retries.guards().len();
    seen.cut = seen.verdict == Verdict::Finished && phase < simulation.schedule.phases().len();
    seen.balance = ledger.error / ledger.largest;
    seen.end(&simulation, &before);
    simulation.alive()?;
    Ok(seen)
}

/// Progress of a scene, and its observations.
#[derive(Debug, Clone, Default)]
struct Way {
    /// Load steps that are complete.
    phase: usize,
    seen: Observed,
    ledger: Ledger,
    /// Displacements when the present load step began.
    before: Vec<[f64; 3]>,
}

impl Way {
    /// Continues to the end of the load step, to a number of steps, or until a state is due to be kept.
    fn go(&mut self, simulation: &mut Simulation, retries: &Retries<Self>, longest: u64) -> Result<()> {
        let Phase { start, end, .. } = simulation.schedule.phases()[self.phase];
        if self.before.is_empty() {
            self.before = simulation.fluctuations();
            self.seen.tension_ratios.clear();
        }
        simulation.advance(start, |_| false)?;
        self.ledger.look(simulation.energies());
        simulation.advance(end, |s| {
            self.look(s);
            if (s.time() - 0.5 * (start + end)).abs() < 0.25 * (end - start) {
                self.seen.slide(s);
            }
            retries.due(s) || s.step() >= longest
        })?;
        if simulation.time() >= end * (1.0 - 1e-12) {
            self.phase += 1;
            if self.phase < simulation.schedule.phases().len() {
                self.before.clear();
            }
        }
        Ok(())
    }

    fn look(&mut self, simulation: &Simulation) {
        self.seen.look(simulation);
        self.ledger.look(simulation.energies());
    }
}

/// The energy balance over a whole run. It relates the error to the largest energy of the run, not to the energy at the time the
/// error arose.
#[derive(Debug, Clone)]
struct Ledger {
    /// Value at the first look, mJ.
    start: Option<f64>,
    /// Largest error and largest energy so far, mJ.
    error: f64,
    largest: f64,
}

impl Default for Ledger {
    fn default() -> Self {
        Self { start: None, error: 0.0, largest: f64::MIN_POSITIVE }
    }
}

impl Ledger {
    fn look(&mut self, e: &Energies) {
        let kept = e.output() - e.input();
        let error = (kept - *self.start.get_or_insert(kept)).abs();
        // a maximum would drop NaN
        if error.is_nan() || error > self.error {
            self.error = error;
        }
        self.largest = self.largest.max(e.output());
    }
}

impl Default for Observed {
    fn default() -> Self {
        Self {
            verdict: Verdict::Finished,
            message: String::new(),
            steps: 0,
            retries: 0,
            cut: false,
            dt: f64::INFINITY,
            dt_limit: f64::INFINITY,
            balance: 0.0,
            penetration: 0.0,
            min_jacobian: f64::INFINITY,
            energies: Energies::default(),
            displacements: Vec::new(),
            drift: 0.0,
            thickness_ratio: f64::NAN,
            tension: f64::NAN,
            tension_ratios: Vec::new(),
        }
    }
}

impl Observed {
    /// Records a window.
    fn look(&mut self, s: &Simulation) {
        let h = s.health();
        self.steps = s.step();
        self.dt = self.dt.min(s.dt());
        self.dt_limit = self.dt_limit.min(h.dt_limit);
        self.penetration = h.penetration.iter().copied().fold(self.penetration, f64::max);
        self.min_jacobian = self.min_jacobian.min(h.min_jacobian);
    }

    /// Records a guard; any other error is passed on.
    fn stop(&mut self, error: Error) -> Result<()> {
        let Error::Guard(guard) = error else { return Err(error) };
        self.verdict = Verdict::of_cause(&guard.cause).unwrap_or(Verdict::Stopped);
        self.message = guard.to_string();
        Ok(())
    }

    /// Records the end.
    fn end(&mut self, s: &Simulation, before: &[[f64; 3]]) {
        let now = s.fluctuations();
        self.energies = *s.energies();
        self.drift = now.iter().zip(before).map(|(a, b)| vector::norm(vector::sub(*a, *b))).fold(0.0, f64::max);
        self.displacements = now.iter().map(|w| vector::norm(*w)).collect();
        self.displacements.sort_by(f64::total_cmp);
        self.thickness_ratio = thickness_ratio(s.mesh(), &now);
        let tensions = s.tensions();
        self.tension = tensions.iter().copied().fold(f64::NAN, f64::max);
    }

    /// Records the tension ratio of a sliding thread.
    fn slide(&mut self, s: &Simulation) {
        if let Some(thread) = s.mesh().threads.first() {
            let tensions = s.tensions();
            self.tension_ratios.push(tensions[thread.count - 2] / tensions[0]);
        }
    }

    /// Mean of the ratios of tension.
    fn tension_ratio(&self) -> f64 {
        self.tension_ratios.iter().sum::<f64>() / self.tension_ratios.len() as f64
    }

    /// Difference of two runs, relative to the other run.
    fn apart(&self, other: &Self, quantity: Quantity) -> f64 {
        match quantity {
            Quantity::Displacements if self.displacements.len() != other.displacements.len() => f64::NAN,
            Quantity::Displacements => {
                let pairs = self.displacements.iter().zip(&other.displacements);
                let most = other.displacements.last().copied().unwrap_or(f64::NAN);
                pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / most
            }
            Quantity::InternalEnergy => (self.energies.internal() / other.energies.internal() - 1.0).abs(),
        }
    }

    /// Every expectation that does not hold, in words.
    fn broken(&self, expect: &Expect) -> Vec<String> {
        let mut broken = Vec::new();
        if !expect.verdict.covers(self.verdict) {
            let message = if self.message.is_empty() { "it finished" } else { &self.message };
            broken.push(format!("expected {}, but {message}", expect.verdict.name()));
        }
        let e = &self.energies;
        let furthest = self.displacements.last().copied().unwrap_or(f64::NAN);
        for (name, bounds, number) in [
            ("energy_balance", expect.energy_balance, self.balance),
            ("min_jacobian", expect.min_jacobian, self.min_jacobian),
            ("penetration_mm", expect.penetration_mm, self.penetration),
            ("kinetic_mj", expect.kinetic_mj, e.kinetic),
            ("internal_mj", expect.internal_mj, e.internal()),
            ("friction_mj", expect.friction_mj, e.friction),
            ("displacement_mm", expect.displacement_mm, furthest),
            ("drift_mm", expect.drift_mm, self.drift),
            ("thickness_ratio", expect.thickness_ratio, self.thickness_ratio),
            ("tension_n", expect.tension_n, self.tension),
            ("tension_ratio", expect.tension_ratio, self.tension_ratio()),
        ] {
            if bounds.is_some_and(|bounds| !bounds.hold(number)) {
                broken.push(format!("{name} is {number:.4e}"));
            }
        }
        broken
    }
}

/// Smallest distance between the lowest and highest node layers of the first block, over the initial one.
fn thickness_ratio(mesh: &Mesh, moved: &[[f64; 3]]) -> f64 {
    let Some(block) = mesh.blocks.first() else { return f64::NAN };
    let layer = block.count() / (block.layers + 1);
    let ratio = |low: usize| {
        let high = low + layer * block.layers;
        let at_rest = vector::sub(mesh.nodes[high], mesh.nodes[low]);
        let change = vector::sub(moved[high], moved[low]);
        vector::norm([0, 1, 2].map(|k| at_rest[k] + change[k])) / vector::norm(at_rest)
    };
    (block.first..block.first + layer).map(ratio).fold(f64::INFINITY, f64::min)
}
