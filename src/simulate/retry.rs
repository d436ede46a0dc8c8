//! Going back: a scene that a guard stops returns to an earlier state and goes on with shorter steps, as often as its case
//! allows.
//!
//! What a guard notices has begun some time before. Therefore two states are kept, some steps apart, and the older one is where a
//! scene goes back to. They are taken by the number of steps, never by wall time: going back leaves the bits reproducible.

use super::Simulation;
use crate::error::{Error, Guard, Result};
use crate::kernel::record::{Record, Recorded};

/// Fewest steps between two states that are kept.
const APART: u64 = 1000;
/// Factor on the time step each time that a scene goes back.
const SHORTER: f64 = 0.5;

/// The states that a scene may go back to, each with what its owner carries, and the guards that sent it back.
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
    /// As of [`Simulation::snapshot`]: on the host, names and bytes of the buffers, and what they hold.
    host: Vec<u8>,
    layout: Vec<(String, usize)>,
    contents: Vec<Vec<u8>>,
    own: T,
}

impl<T: Clone + Default> Retries<T> {
    /// As many as the case of a simulation allows.
    pub fn of(simulation: &Simulation) -> Self {
        Self { allowed: simulation.scene.integration.retries, guards: Vec::new(), kept: Vec::new() }
    }

    /// What each guard said that sent the scene back.
    pub fn guards(&self) -> &[String] {
        &self.guards
    }

    /// Whether the state of now is one to keep.
    pub fn due(&self, simulation: &Simulation) -> bool {
        let last = self.kept.last().map(|kept| kept.step);
        self.allowed > 0 && last.is_none_or(|last| simulation.step >= last + APART)
    }

    /// Keeps the state of now with what its owner carries. Call it where [`Simulation::advance`] has returned.
    pub fn keep(&mut self, simulation: &mut Simulation, own: T) {
        let (host, buffers) = simulation.snapshot();
        let layout = buffers.iter().map(|(name, bytes)| ((*name).to_owned(), bytes.len())).collect();
        let contents = buffers.into_iter().map(|(_, bytes)| bytes).collect();
        if self.kept.len() > 1 {
            self.kept.remove(0);
        }
        self.kept.push(Kept { step: simulation.step, host, layout, contents, own });
    }

    /// Puts a scene that a guard stopped back to the older state, with shorter steps; returns what its owner carried then.
    ///
    /// # Errors
    /// The guard, if the scene has gone back as often as it may.
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

    /// Writes or reads back everything but what the case says; `own` does so for what the owner carries.
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
