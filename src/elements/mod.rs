//! Elements: they read the state of their nodes and write only to their own corner slots.

pub mod beam2;
pub mod bend;
pub mod block;
pub mod hex8;
pub mod hex8_reduced;

use crate::kernel::interface::{Constant, constants};

/// Hexahedra per block, and fibre lines per group.
pub const LANES: usize = 16;
/// Constants shared with the twins.
pub const CONSTANTS: [Constant; 1] = constants![uint: LANES];
