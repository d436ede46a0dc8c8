//! Rigid tools now: where they are, and what presses on them.

use super::Simulation;
use crate::kernel::buffer::Buffer;
use crate::kernel::position::QUANTUM;
use crate::tools::shape::{MOTION, MOVED, SEAT};
use crate::tools::touch::{MOMENT, NOTES, TOUCHED};

/// A rigid tool now, and the forces of the last step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ToolState {
    /// Displacement, mm, and velocity, mm/s.
    pub displacement: [f64; 3],
    pub velocity: [f64; 3],
    /// Force of yarns and threads on it, N, and their moment about its origin, N·mm.
    pub force: [f64; 3],
    pub moment: [f64; 3],
    /// Area of yarn surfaces that touch it, mm².
    pub area: f64,
}

impl Simulation {
    /// The buffers of [`tools`](Self::tools).
    pub(super) fn tool_buffers(&self) -> impl Iterator<Item = Buffer> + use<> {
        let buffers = self.model.buffers.tools.map(|tools| [tools.seats, tools.motions, tools.results]);
        buffers.into_iter().flatten()
    }

    /// The tools of the scene; none without contact.
    pub fn tools(&self) -> Vec<ToolState> {
        let (Some(b), Some(contact)) = (self.model.buffers.tools, &self.scene.effects.contact) else {
            return Vec::new();
        };
        let (seats, motions) = (self.backend.ints(b.seats), self.backend.scalars(b.motions));
        let results = self.backend.scalars(b.results);
        let tools = seats.chunks_exact(SEAT).zip(motions.chunks_exact(MOTION)).zip(results.chunks_exact(NOTES));
        let state = |((seat, motion), result): ((&[i32], &[f64]), &[f64])| ToolState {
            displacement: [0, 1, 2].map(|k| f64::from(seat[MOVED + k]) * QUANTUM + motion[k]),
            velocity: [0, 1, 2].map(|k| motion[3 + k]),
            force: [0, 1, 2].map(|k| result[k]),
            moment: [0, 1, 2].map(|k| result[MOMENT + k]),
            area: result[TOUCHED] / contact.yarn_penalty_n_mm3,
        };
        tools.map(state).collect()
    }
}
