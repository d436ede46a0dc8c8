//! Interleaved timing of steps: scenes run in turns, so that other load on the machine affects all compared scenes alike. On
//! the CPU a trial has one thread and counts its CPU time, which excludes waiting for a core.

use super::clock;
use crate::error::Error;
use crate::simulate::{BackendConfig, Simulation};
use std::sync::LazyLock;
use std::time::Instant;

/// The backend of a trial: one CPU thread, or the device.
pub fn trial(config: &BackendConfig) -> BackendConfig {
    BackendConfig { threads: 1, ..config.clone() }
}

/// Ratio of the step times of two scenes: median over the turns, and half the interquartile range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ratio {
    pub median: f64,
    pub spread: f64,
}

impl Ratio {
    /// Ratio from a list of samples; NaN if the list is empty.
    fn of(mut ratios: Vec<f64>) -> Self {
        ratios.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let place = share * ratios.len().saturating_sub(1) as f64;
            let (low, high) = (place.floor(), place.ceil());
            let value = |i: f64| ratios.get(i as usize).copied().unwrap_or(f64::NAN);
            value(low) + (value(high) - value(low)) * (place - low)
        };
        Self { median: at(0.5), spread: 0.5 * (at(0.75) - at(0.25)) }
    }
}

/// Advances two scenes on the backend of a [`trial`] by about `steps` steps each, `rounds` times, in alternating order. A scene
/// that a guard stops takes no further turns.
///
/// # Errors
/// A device that failed.
pub fn ratio(scene: &mut Simulation, beside: &mut Simulation, steps: u64, rounds: usize) -> Result<Ratio, Error> {
    let clock = if scene.on_device() { wall } else { ran };
    let mut ratios = Vec::with_capacity(rounds);
    // the first round is a warm-up
    for round in 0..=rounds {
        let pair = [&mut *scene, &mut *beside];
        let mut times = [0.0; 2];
        let mut stopped = false;
        for place in if round % 2 == 0 { [0, 1] } else { [1, 0] } {
            match step_time(pair[place], steps, clock) {
                Ok(time) => times[place] = time,
                Err(Error::Guard(_)) => stopped = true,
                Err(error) => return Err(error),
            }
        }
        if stopped {
            break;
        }
        if round > 0 {
            ratios.push(times[0] / times[1]);
        }
    }
    Ok(Ratio::of(ratios))
}

/// Time per step by a clock, s, over about `steps` steps.
pub(super) fn step_time(scene: &mut Simulation, steps: u64, clock: impl Fn() -> f64) -> Result<f64, Error> {
    let (before, started) = (scene.step(), clock());
    scene.advance(scene.time() + steps as f64 * scene.dt(), |_| false)?;
    Ok((clock() - started) / (scene.step() - before).max(1) as f64)
}

/// Wall time since a fixed moment, s.
pub(super) fn wall() -> f64 {
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    START.elapsed().as_secs_f64()
}

/// CPU time of this thread, s; wall time where the system does not provide it.
fn ran() -> f64 {
    clock::thread().unwrap_or_else(wall)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ratio_is_the_median_and_forgets_what_disturbed_single_turns() {
        let Ratio { median, spread } = Ratio::of(vec![1.1, 9.0, 1.2, 1.0, 1.3]);
        assert!((median - 1.2).abs() < 1e-12 && (spread - 0.1).abs() < 1e-12, "{median} {spread}");
        let two = Ratio::of(vec![2.0, 1.0]);
        assert!((two.median - 1.5).abs() < 1e-12 && (two.spread - 0.25).abs() < 1e-12);
        assert!(Ratio::of(Vec::new()).median.is_nan());
    }
}
