//! From forces to motion: assembly, fibre lines, integration, and the limit of the time step.

pub mod assemble;
pub mod fibre_lines;
pub mod integrate;
pub mod time_step;
