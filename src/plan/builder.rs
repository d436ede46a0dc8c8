//! Adds buffers to a plan, and stages to its lists.

use crate::kernel::buffer::{Buffer, Description, Initial, Kind};
use crate::kernel::stage::Plan;

/// Items of a chunk of light work on nodes.
pub(super) const NODE_GRAIN: usize = 512;

/// A plan that is built piece by piece.
#[derive(Default)]
pub(super) struct Builder {
    pub plan: Plan,
}

impl Builder {
    /// A buffer; it is part of the state if it is `persistent`.
    pub fn add(&mut self, name: &'static str, kind: Kind, len: usize, persistent: bool, initial: Initial) -> Buffer {
        self.plan.buffers.push(Description { name, kind, len, persistent, initial });
        Buffer(self.plan.buffers.len() - 1)
    }

    /// Scalars that start at zero and live for one step or one output.
    pub fn scratch(&mut self, name: &'static str, len: usize) -> Buffer {
        self.add(name, Kind::Scalar, len, false, Initial::Zero)
    }

    /// Scalars that do not change.
    pub fn table(&mut self, name: &'static str, values: Vec<f64>) -> Buffer {
        self.add(name, Kind::Scalar, values.len(), false, Initial::Scalar(values))
    }

    /// Unsigned integers that do not change.
    pub fn indices(&mut self, name: &'static str, values: Vec<u32>) -> Buffer {
        self.add(name, Kind::Uint, values.len(), false, Initial::Uint(values))
    }
}
