//! From forces to motion: assembly, fibre lines, integration, the limit of the time step, and totals for the host.

pub mod assemble;
pub mod energy;
pub mod fibre_lines;
pub mod integrate;
pub mod time_step;
pub mod totals;
pub mod tridiagonal;

/// Nodes treated together, so that loops over each axis fill registers.
const BLOCK: usize = 64;
