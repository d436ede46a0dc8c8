//! `tricot study step`: the true limit of the time step beside the estimated one, in the course of a run.
//!
//! Contact adds the mass that the current time step requires, and the measured limit is the longest stable step with its own
//! added mass. The estimate uses the mass of the step in use. For a fair comparison, steps here may grow to `LIFTED` times the
//! longest step of the case, in effect up to the estimate.

use crate::error::{Error, Result};
use crate::rigs::read::Loaded;
use crate::run;
use crate::schedule::Schedule;
use crate::settings::integration::Precision;
use crate::settings::steps::Step;
use crate::simulate::{BackendConfig, Simulation};
use std::fmt::Write as _;

/// Number of steps within which too long a step must fail.
const TRIAL: u64 = 2000;
/// Factor on the longest step that the case allows.
const LIFTED: f64 = 10.0;
/// Relative width at which the search for the longest stable step ends.
const NARROW: f64 = 0.05;

/// A state in the course of a run.
#[derive(Debug, Clone)]
pub struct State {
    pub time: f64,
    pub angle_deg: f64,
    /// Step in use, estimated and measured limit, s.
    pub dt: f64,
    pub estimate: f64,
    pub limit: f64,
    /// Bodies that determine the estimate and the limit.
    pub estimate_set_by: String,
    pub limit_set_by: String,
}

impl State {
    /// Whether the estimate is at most the limit, and at least half of it.
    pub fn estimate_holds(&self) -> bool {
        self.estimate <= self.limit && self.estimate >= 0.5 * self.limit
    }
}

/// Result of a study.
pub struct Study {
    pub text: String,
    pub held: bool,
}

/// Times at which load steps end and at which the shear angle passes a multiple of `every_deg`.
fn moments(schedule: &Schedule, every_deg: f64) -> Vec<f64> {
    /// Number of looks per load step.
    const LOOKS: u32 = 2000;
    let count = |time: f64| (schedule.load(time).angle.to_degrees() / every_deg + 1e-9).floor();
    let mut moments = Vec::new();
    for phase in schedule.phases() {
        let times = (1..=LOOKS).map(|i| phase.start + (phase.end - phase.start) * f64::from(i) / f64::from(LOOKS));
        let mut before = count(phase.start);
        for time in times {
            if std::mem::replace(&mut before, count(time)) != before {
                moments.push(time);
            }
        }
        if moments.last() != Some(&phase.end) {
            moments.push(phase.end);
        }
    }
    moments
}

/// Measures the limit at the present state.
///
/// # Errors
/// A run that is not in f64.
pub fn measure(scene: &mut Simulation) -> Result<State> {
    let limit = scene.measured_limit()?;
    let health = *scene.health();
    let d = limit.direction;
    Ok(State {
        time: scene.time(),
        angle_deg: scene.load().angle.to_degrees(),
        dt: scene.dt(),
        estimate: health.dt_limit,
        limit: limit.dt,
        estimate_set_by: format!("node {} ({})", health.limiting_node, scene.node_owner(health.limiting_node)),
        limit_set_by: format!(
            "node {} ({}) along ({:.2}, {:.2}, {:.2})",
            limit.node,
            scene.node_owner(limit.node),
            d[0],
            d[1],
            d[2]
        ),
    })
}

/// The longest fixed time step that is stable for 2,000 steps from the present state under its load, between the estimate and
/// `most`, s.
///
/// # Errors
/// A scene that cannot be built again.
pub fn longest_step(loaded: &Loaded, scene: &mut Simulation, most: f64) -> Result<(f64, f64)> {
    let (host, buffers) = scene.snapshot();
    let names: Vec<(String, usize)> = buffers.iter().map(|(name, bytes)| ((*name).into(), bytes.len())).collect();
    let contents: Vec<Vec<u8>> = buffers.into_iter().map(|(_, bytes)| bytes).collect();
    let phase = scene.schedule.phase_at(scene.time());
    let lasts = |dt: f64| -> Result<bool> {
        let mut trial = loaded.clone();
        trial.case.integration.dt_s = Some(dt);
        trial.case.steps.truncate(phase + 1);
        trial.case.steps.push(Step::Hold { time_s: 2.0 * TRIAL as f64 * dt });
        let mut scene =
            run::simulation(&trial, BackendConfig { precision: Precision::F64, ..BackendConfig::default() })?;
        scene.restore(host.clone(), &names, &contents)?;
        let until = scene.time() + TRIAL as f64 * dt;
        match scene.advance(until, |_| false) {
            Ok(()) => Ok(true),
            Err(Error::Guard(_)) => Ok(false),
            Err(error) => Err(error),
        }
    };
    let (mut low, mut high) = (scene.health().dt_limit, most);
    if !lasts(low)? {
        return Ok((0.0, low));
    }
    while high / low > 1.0 + NARROW {
        let middle = (low * high).sqrt();
        *if lasts(middle)? { &mut low } else { &mut high } = middle;
    }
    Ok((low, high))
}

/// Runs a case in f64 with steps up to the estimate, and measures the limit at the end of every load step and at every multiple
/// of `every_deg` of shear. If `confirm`, also tries fixed steps at the end of the first load step.
///
/// # Errors
/// A case that cannot be run, or a guard that stopped it.
pub fn step(loaded: &Loaded, every_deg: f64, confirm: bool) -> Result<Study> {
    let mut loaded = loaded.clone();
    loaded.case.integration.precision = Precision::F64;
    loaded.case.integration.dt_max_s *= LIFTED;
    let mut scene = run::simulation(&loaded, BackendConfig { precision: Precision::F64, ..BackendConfig::default() })?;
    let (mut text, mut held) = (String::new(), true);
    let moments = moments(&scene.schedule, every_deg);
    let first_end = scene.schedule.phases().first().map_or(0.0, |phase| phase.end);
    for (number, time) in [0.0].into_iter().chain(moments).enumerate() {
        scene.advance(time, |_| false)?;
        let state = measure(&mut scene)?;
        held &= state.estimate_holds();
        // writing to a String does not fail
        let _ = writeln!(
            text,
            "{:.4e} s, {:5.1}°: step {:.3e} s, estimate {:.3e} s by {}, limit {:.3e} s by {}: {:.2} of it{}",
            state.time,
            state.angle_deg,
            state.dt,
            state.estimate,
            state.estimate_set_by,
            state.limit,
            state.limit_set_by,
            state.estimate / state.limit,
            if state.estimate_holds() { "" } else { ", NOT between half and all" }
        );
        if confirm && number > 0 && time == first_end {
            let (lasts, fails) = longest_step(&loaded, &mut scene, 1.5 * state.limit)?;
            held &= lasts <= state.limit * 1.1 && fails >= state.limit * 0.9;
            let _ = writeln!(
                text,
                "    by trial: a fixed step of {lasts:.3e} s lasts {TRIAL} steps, one of {fails:.3e} s does not"
            );
        }
    }
    Ok(Study { text, held })
}
