//! Rollback: a scene that a guard stops returns to an earlier state and continues with shorter steps, as often as its case
//! allows.
//!
//! A guard notices a fault some time after it began. Two states are therefore kept, some steps apart, and a rollback returns to
//! the older one. They are taken by the number of steps, never by wall time, so rollbacks leave the bits reproducible.

use super::Simulation;
use crate::error::{Error, Guard, Result};
use crate::kernel::record::{Record, Recorded};

/// Fewest steps between two states that are kept.
const APART: u64 = 1000;
/// Factor on the time step at each rollback.
const SHORTER: f64 = 0.5;

/// States for rollbacks, each with its owner's data, and the guards that caused rollbacks.
#[derive(Debug)]
pub struct Retries<T> {
    allowed: usize,
    guards: Vec<String>,
    /// The older one first; at most two.
    kept: Vec<Kept<T>>,
}

#[derive(Debug, Clone, Default)]
struct Kept<T> {
    step: u64,
    /// As of [`Simulation::snapshot`]: state on the host, names and sizes of the buffers, and their contents.
    host: Vec<u8>,
    layout: Vec<(String, usize)>,
    contents: Vec<Vec<u8>>,
    own: T,
}

impl<T: Clone + Default> Retries<T> {
    /// As many rollbacks as the case of a simulation allows.
    pub fn of(simulation: &Simulation) -> Self {
        Self { allowed: simulation.scene.integration.retries, guards: Vec::new(), kept: Vec::new() }
    }

    /// Messages of the guards that caused rollbacks.
    pub fn guards(&self) -> &[String] {
        &self.guards
    }

    /// Whether the present state is to be kept.
    pub fn due(&self, simulation: &Simulation) -> bool {
        let last = self.kept.last().map(|kept| kept.step);
        self.allowed > 0 && last.is_none_or(|last| simulation.step >= last + APART)
    }

    /// Keeps the present state with its owner's data. Call it after [`Simulation::advance`] has returned.
    pub fn keep(&mut self, simulation: &mut Simulation, own: T) {
        let (host, buffers) = simulation.snapshot();
        let layout = buffers.iter().map(|(name, bytes)| ((*name).to_owned(), bytes.len())).collect();
        let contents = buffers.into_iter().map(|(_, bytes)| bytes).collect();
        if self.kept.len() > 1 {
            self.kept.remove(0);
        }
        self.kept.push(Kept { step: simulation.step, host, layout, contents, own });
    }

    /// Rolls a scene that a guard stopped back to the older state, with shorter steps; returns the owner's data of that state.
    ///
    /// # Errors
    /// The guard, if all allowed rollbacks are spent.
    pub fn go_back(&mut self, simulation: &mut Simulation, mut guard: Guard) -> Result<T> {
        self.kept.truncate(1);
        let kept = match self.kept.first() {
            Some(kept) if self.guards.len() < self.allowed => kept,
            _ => {
                if !self.guards.is_empty() {
                    let tried = format!(" ({} retries with shorter steps did not help)", self.guards.len());
                    guard.advice.push_str(&tried);
                }
                return Err(Error::Guard(guard));
            }
        };
        let share = SHORTER * simulation.share;
        simulation.restore(kept.host.clone(), &kept.layout, &kept.contents)?;
        self.guards.push(guard.to_string());
        simulation.dt *= share / simulation.share;
        simulation.share = share;
        Ok(kept.own.clone())
    }

    /// Writes or reads everything but the settings of the case; `own` does so for the owner's data.
    pub fn record(&mut self, record: &mut Record, mut own: impl FnMut(&mut T, &mut Record)) {
        self.guards.record(record);
        let mut count = self.kept.len();
        count.record(record);
        self.kept.resize_with(count.min(2), Kept::default);
        for kept in &mut self.kept {
            kept.step.record(record);
            record.bytes(&mut kept.host);
            kept.layout.record(record);
            kept.contents.resize_with(kept.layout.len(), Vec::new);
            kept.contents.iter_mut().for_each(|bytes| record.bytes(bytes));
            own(&mut kept.own, record);
        }
    }
}
