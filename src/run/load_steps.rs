//! The load steps of a run, row by row, with the frames and checkpoints due in between.

use super::session::{Place, Run};
use crate::error::Result;
use crate::settings::steps::Step;
use crate::simulate::Simulation;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

impl Run<'_> {
    /// Runs all load steps, or those that remain.
    pub(super) fn load_steps(&mut self, watch: &mut dyn FnMut() -> Duration) -> Result<()> {
        let output = &self.loaded.case.output;
        let phases = self.simulation.schedule.phases().to_vec();
        let bar = self.bar();
        self.keep();
        self.simulation.advance(0.0, |_| false)?;
        if self.frames.is_empty() {
            // before there are rows: without a checkpoint they could not be resumed
            self.save(None)?;
            self.writer.wait()?;
            self.write_frame("start")?;
        }
        self.wait();
        for (number, (phase, step)) in phases.iter().zip(&self.loaded.case.steps).enumerate().skip(self.place.phase) {
            let (marks, unit, reach) = match step {
                Step::Shear { .. } => (output.frames_at_deg.clone(), "deg", 1.0),
                Step::Move { .. } => (output.frames_at_mm.clone(), "mm", self.simulation.scene.reach()),
                _ => (Vec::new(), "", 1.0),
            };
            let rows = output.rows_per_step.max(1);
            let time = |row: usize| phase.start + (phase.end - phase.start) * row as f64 / rows as f64;
            let schedule = self.simulation.schedule.clone();
            // in a load step only one of angle and displacement changes
            let way = |row: usize| {
                let load = schedule.load(time(row));
                load.angle.to_degrees() + load.motion * reach
            };
            let places = places(&marks, [way(0), way(rows)]);
            for row in self.place.row + 1..=rows {
                let steps = self.simulation.step();
                let arrived = self.reach(time(row))?;
                // there may be more rows than time steps
                if self.simulation.step() > steps {
                    self.write_row(phase.name)?;
                }
                self.started += watch();
                self.tell(&bar, phase.name);
                self.writer.check()?;
                let [from, to] = [way(row - 1), way(row)];
                for place in places.iter().filter(|place| (*place - from) * (*place - to) < 0.0 || **place == to) {
                    self.write_frame(&format!("{place}{unit}"))?;
                }
                if output.frames_per_step > 0
                    && row < rows
                    && row * output.frames_per_step / rows != (row - 1) * output.frames_per_step / rows
                {
                    self.write_frame(&format!("{}-{}-{row}", number + 1, phase.name))?;
                }
                self.place.row = row;
                let stopped = self.stopped.load(Ordering::Relaxed);
                if arrived {
                    self.keep();
                }
                if arrived && (stopped || self.is_due()) {
                    self.save(None)?;
                }
                if stopped {
                    bar.finish_and_clear();
                    return self.write_frame("interrupted");
                }
            }
            self.observer.end_of_step(&self.simulation, step)?;
            if matches!(step, Step::Settle { .. } | Step::Hold { .. }) {
                let e = self.simulation.energies();
                let all = e.kinetic_total + e.internal() + e.contact;
                self.rest = Some((number, if all > 0.0 { e.kinetic_total / all } else { 0.0 }));
            }
            let name = format!("{}-{}", number + 1, phase.name);
            self.write_frame(&name)?;
            self.place = Place { phase: number + 1, ..Place::default() };
            self.save(Some(&name))?;
        }
        bar.finish_and_clear();
        Ok(())
    }

    /// Advances to a time and writes the checkpoints due in between; false if the user stopped the run earlier.
    pub(super) fn reach(&mut self, until: f64) -> Result<bool> {
        loop {
            let (stopped, due) = (Arc::clone(&self.stopped), self.due);
            let pause =
                |_: &Simulation| stopped.load(Ordering::Relaxed) || due.is_some_and(|due| Instant::now() >= due);
            self.simulation.advance(until, pause)?;
            if self.simulation.time() >= until * (1.0 - 1e-12) {
                return Ok(true);
            }
            self.save(None)?;
            if self.stopped.load(Ordering::Relaxed) {
                return Ok(false);
            }
        }
    }
}

/// Shear angles, degrees, or displacements, mm, between the `ends` at which a frame is due: `marks` of either sign. Both ends
/// of a load step already have frames.
fn places(marks: &[f64], ends: [f64; 2]) -> Vec<f64> {
    /// Rounding of an angle.
    const SAME: f64 = 1e-9;
    let signed = marks.iter().flat_map(|mark| [-mark, *mark]);
    let mut places: Vec<f64> = signed.filter(|place| ends.iter().all(|end| (place - end).abs() > SAME)).collect();
    places.sort_by(|a, b| (a - ends[0]).abs().total_cmp(&(b - ends[0]).abs()));
    places.dedup();
    places
}
