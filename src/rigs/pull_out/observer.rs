//! The force on a yarn that is pulled out of the fabric.

use crate::error::Result;
use crate::kernel::record::{Record, Recorded};
use crate::rigs::observer::{Loading, Observer, Seen};
use crate::simulate::Simulation;
use serde_json::{Value, json};

/// The observer of a pulled yarn.
pub(super) struct PulledOut {
    /// Length of the piece, mm.
    length: f64,
    /// Displacement, mm, and force, N, in every row of the pull.
    curve: Vec<(f64, f64)>,
}

impl PulledOut {
    pub(super) fn of(length: f64) -> Self {
        Self { length, curve: Vec::new() }
    }

    /// Displacement and force at the largest force.
    fn peak(&self) -> Option<(f64, f64)> {
        self.curve.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1))
    }
}

impl Observer for PulledOut {
    fn row(&mut self, simulation: &mut Simulation, seen: &Seen) -> Result<Loading> {
        if seen.phase == "move" {
            self.curve.push((simulation.displacement(), seen.machine));
        }
        Ok(Loading { degrees: 0.0, force: seen.machine, normalised: f64::NAN })
    }

    fn is_loaded(&self, simulation: &Simulation, phase: &str) -> bool {
        phase == "move" && simulation.load().motion.abs() > 0.1
    }

    fn record(&mut self, record: &mut Record) {
        let Self { length: _, curve } = self;
        curve.record(record);
    }

    fn summary(&self, _: &Simulation) -> Vec<(&'static str, Value)> {
        let found = self.peak().map(|(way, force)| {
            let value = json!({ "peak_n": force, "peak_n_per_mm": force / self.length, "peak_at_mm": way });
            ("pull_out", value)
        });
        found.into_iter().collect()
    }

    fn lines(&self, _: &Simulation) -> String {
        self.peak().map_or(String::new(), |(way, force)| {
            let per_length = force / self.length;
            format!("pull-out   at most {force:.4} N, {per_length:.5} N per mm of the piece, at {way:.3} mm\n")
        })
    }
}
