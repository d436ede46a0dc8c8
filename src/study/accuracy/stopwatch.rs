//! Timing on a machine with other work: at short intervals during a run, the same small scene is timed, and the run is measured
//! in steps of that scene. Slowdowns of both cancel. A second clock does not count processor time of other processes at all.

use crate::error::{Error, Result};
use crate::rigs::read::read;
use crate::run::{self, clock};
use crate::settings::integration::Precision;
use crate::simulate::{BackendConfig, Simulation};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::{Duration, Instant};

/// Timed steps of the scene, and steps before them that warm the caches.
const TIMED: f64 = 64.0;
const WARM: f64 = 16.0;
/// Time of a run between two timings, over the duration of one timing.
const SELDOM: f64 = 10.0;
/// Length of the first load step, in time steps, of a scene that is timed while it is held still: longer than any measurement.
const MOST_STEPS: f64 = 1e8;

/// Two clocks: wall time, and processor time of this process.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Clocks {
    pub wall: f64,
    pub cpu: f64,
}

impl Clocks {
    /// Both clocks now, s, from a common moment.
    fn now(start: Instant) -> Self {
        let wall = start.elapsed().as_secs_f64();
        Self { wall, cpu: clock::process().unwrap_or(wall) }
    }

    fn with(self, other: Self, both: impl Fn(f64, f64) -> f64) -> Self {
        Self { wall: both(self.wall, other.wall), cpu: both(self.cpu, other.cpu) }
    }

    /// Mean of several.
    pub(super) fn mean(of: &[Self]) -> Self {
        let sum = of.iter().fold(Self::default(), |sum, clocks| sum.with(*clocks, |a, b| a + b));
        let count = of.len() as f64;
        Self { wall: sum.wall / count, cpu: sum.cpu / count }
    }

    fn since(self, before: Self) -> Self {
        self.with(before, |now, before| now - before)
    }
}

/// A scene to time beside a run, and the measurements of the run.
pub(super) struct Stopwatch {
    scene: Simulation,
    start: Instant,
    /// Seconds per step of the scene, as last timed.
    pace: Clocks,
    /// Duration of the last timing.
    cost: Duration,
    /// When the last timing ended.
    mark: Clocks,
    /// Time of the run so far: in steps of the scene, and in s.
    work: Clocks,
    spent: Clocks,
    fault: Option<Error>,
}

impl Stopwatch {
    /// The scene is the case in f32, with a first load step so long that it stays nearly as built.
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
        let scene =
            run::simulation(&loaded, BackendConfig { threads: threads.unwrap_or(0), ..BackendConfig::default() })?;
        let mut stopwatch = Self {
            scene,
            start: Instant::now(),
            pace: Clocks::default(),
            cost: Duration::ZERO,
            mark: Clocks::default(),
            work: Clocks::default(),
            spent: Clocks::default(),
            fault: None,
        };
        stopwatch.scene.advance(0.0, |_| false)?;
        Ok(stopwatch)
    }

    /// A run starts.
    pub(super) fn start(&mut self) {
        self.measure();
        (self.work, self.spent) = (Clocks::default(), Clocks::default());
    }

    /// Times the scene if due; returns the duration.
    pub(super) fn tick(&mut self) -> Duration {
        let span = self.start.elapsed().as_secs_f64() - self.mark.wall;
        if span < SELDOM * self.cost.as_secs_f64() { Duration::ZERO } else { self.lap() }
    }

    /// Times the scene now; returns the duration.
    pub(super) fn lap(&mut self) -> Duration {
        let (span, before) = (Clocks::now(self.start).since(self.mark), self.pace);
        self.measure();
        let pace = before.with(self.pace, |before, after| 0.5 * (before + after));
        self.work = self.work.with(span.with(pace, |span, pace| span / pace), |sum, more| sum + more);
        self.spent = self.spent.with(span, |sum, more| sum + more);
        self.cost
    }

    /// Time of the run until the last lap, in steps of the scene.
    pub(super) fn work(&self) -> Clocks {
        self.work
    }

    /// Ends the run; returns its time in steps of the scene, and in s.
    ///
    /// # Errors
    /// A failure of the scene meanwhile.
    pub(super) fn stop(&mut self) -> Result<[Clocks; 2]> {
        self.lap();
        self.fault.take().map_or(Ok([self.work, self.spent]), Err)
    }

    fn measure(&mut self) {
        let started = Instant::now();
        let advanced = self.advance(WARM).and_then(|_| {
            let (before, steps) = (Clocks::now(self.start), self.advance(TIMED)?);
            let span = Clocks::now(self.start).since(before);
            Ok(Clocks { wall: span.wall / steps, cpu: span.cpu / steps })
        });
        match advanced {
            Ok(pace) => self.pace = pace,
            Err(error) => self.fault = Some(error),
        }
        self.cost = started.elapsed();
        self.mark = Clocks::now(self.start);
    }

    /// Runs some steps of the scene; returns their number.
    fn advance(&mut self, steps: f64) -> Result<f64> {
        let before = self.scene.step();
        self.scene.advance(self.scene.time() + steps * self.scene.dt(), |_| false)?;
        Ok((self.scene.step() - before).max(1) as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn a_process_that_sleeps_has_no_processor() {
        let start = Instant::now();
        let before = Clocks::now(start);
        std::thread::sleep(Duration::from_millis(200));
        let slept = Clocks::now(start).since(before);
        assert!(slept.wall >= 0.2, "{slept:?}");
        let mut sum = 0u64;
        let busy = Clocks::now(start);
        while Clocks::now(start).since(busy).cpu < 0.05 {
            sum = std::hint::black_box(sum + 1);
        }
        assert!(Clocks::now(start).since(busy).cpu >= 0.05 && sum > 0);
    }
}
