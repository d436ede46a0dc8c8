//! Time on a machine that has other work to do: beside a run, at short intervals, the same small scene is timed, and the run is
//! told in steps of that scene. What slows both down drops out.

use crate::case::read::read;
use crate::case::steps::Precision;
use crate::error::{Error, Result};
use crate::run;
use crate::simulate::{Make, Simulation};
use std::path::Path;
use std::time::{Duration, Instant};

/// Steps of the scene that are timed, and steps before them that bring it back into the caches.
const TIMED: f64 = 64.0;
const WARM: f64 = 16.0;
/// Time of a run between two timings, over the time that one takes.
const SELDOM: u32 = 10;
/// Steps until the scene has changed.
const MOST_STEPS: f64 = 1e8;

/// A scene to time beside a run, and what has been measured of the run.
pub(super) struct Stopwatch {
    scene: Simulation,
    /// Seconds of a step of the scene, when last timed.
    pace: f64,
    /// The time that the last timing took.
    cost: Duration,
    /// When the last timing ended.
    mark: Instant,
    /// Time of the run so far: in steps of the scene, and in s.
    work: f64,
    wall: f64,
    fault: Option<Error>,
}

impl Stopwatch {
    /// The scene is the case in f32, with a first load step that is so long that it stays nearly as it is built.
    ///
    /// # Errors
    /// A case that cannot be run.
    pub(super) fn new(case: &Path, sets: &[String], threads: Option<usize>) -> Result<Self> {
        let mut loaded = read(case, sets)?;
        let integration = &mut loaded.case.integration;
        let longest = (MOST_STEPS * integration.dt_s.unwrap_or(integration.dt_max_s)).min(1.0);
        integration.precision = Precision::F32;
        (integration.energy_tolerance, integration.penetration_tolerance) = (100.0, 100.0);
        if let Some(first) = loaded.case.steps.first_mut() {
            *first.time_mut() = longest;
        }
        let scene = run::simulation(&loaded, Make { threads: threads.unwrap_or(0), ..Make::default() })?;
        let now = Instant::now();
        let mut stopwatch =
            Self { scene, pace: 0.0, cost: Duration::ZERO, mark: now, work: 0.0, wall: 0.0, fault: None };
        stopwatch.scene.advance(0.0, |_| false)?;
        Ok(stopwatch)
    }

    /// A run starts.
    pub(super) fn start(&mut self) {
        self.measure();
        (self.work, self.wall) = (0.0, 0.0);
    }

    /// Times the scene if that is due; returns the time it took.
    pub(super) fn tick(&mut self) -> Duration {
        if self.mark.elapsed() < SELDOM * self.cost { Duration::ZERO } else { self.lap() }
    }

    /// Times the scene now; returns the time it took.
    pub(super) fn lap(&mut self) -> Duration {
        let (span, before) = (self.mark.elapsed().as_secs_f64(), self.pace);
        self.measure();
        self.work += span / (0.5 * (before + self.pace));
        self.wall += span;
        self.cost
    }

    /// Time of the run until the last lap, in steps of the scene.
    pub(super) fn work(&self) -> f64 {
        self.work
    }

    /// The run has ended: its time in steps of the scene, and in s.
    ///
    /// # Errors
    /// What went wrong in the scene meanwhile.
    pub(super) fn stop(&mut self) -> Result<[f64; 2]> {
        self.lap();
        self.fault.take().map_or(Ok([self.work, self.wall]), Err)
    }

    fn measure(&mut self) {
        let started = Instant::now();
        let advanced = self.advance(WARM).and_then(|_| {
            let (timed, steps) = (Instant::now(), self.advance(TIMED)?);
            Ok(timed.elapsed().as_secs_f64() / steps)
        });
        match advanced {
            Ok(pace) => self.pace = pace,
            Err(error) => self.fault = Some(error),
        }
        self.mark = Instant::now();
        self.cost = self.mark - started;
    }

    /// Some steps of the scene; returns how many.
    fn advance(&mut self, steps: f64) -> Result<f64> {
        let before = self.scene.step();
        self.scene.advance(self.scene.time() + steps * self.scene.dt(), |_| false)?;
        Ok((self.scene.step() - before).max(1) as f64)
    }
}
