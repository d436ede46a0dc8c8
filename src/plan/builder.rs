//! Adds buffers to a plan, and stages to its lists.

use crate::kernel::buffer::{Buffer, Description, Initial, Kind};
use crate::kernel::stage::Plan;

/// Items per chunk of light work on nodes.
pub(super) const NODE_GRAIN: usize = 512;

/// A plan under construction.
#[derive(Default)]
pub(super) struct Builder {
    pub plan: Plan,
}

impl Builder {
    /// Adds a buffer; a `persistent` buffer is part of the state.
    pub fn add(&mut self, name: &'static str, kind: Kind, len: usize, persistent: bool, initial: Initial) -> Buffer {
        self.plan.buffers.push(Description { name, kind, len, persistent, initial });
        Buffer(self.plan.buffers.len() - 1)
    }

    /// Adds scalars that start at zero and live for one step or one output.
    pub fn scratch(&mut self, name: &'static str, len: usize) -> Buffer {
        self.add(name, Kind::Scalar, len, false, Initial::Zero)
    }

    /// Adds constant scalars.
    pub fn table(&mut self, name: &'static str, values: Vec<f64>) -> Buffer {
        self.add(name, Kind::Scalar, values.len(), false, Initial::Scalar(values))
    }

    /// Adds constant unsigned integers.
    pub fn indices(&mut self, name: &'static str, values: Vec<u32>) -> Buffer {
        self.add(name, Kind::Uint, values.len(), false, Initial::Uint(values))
    }
}
