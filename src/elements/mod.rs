//! Elements: they read the state of their nodes and write only their own corner slots.

pub mod beam2;
pub mod bend;
pub mod block;
pub mod hex8;
pub mod hex8_reduced;

/// Hexahedra in a block, and fibre lines in a group.
pub const LANES: usize = 16;
