//! Elements: they read the state of their nodes and write only their own corner slots.

pub mod beam2;
pub mod bend;
pub mod block;
pub mod hex8;
pub mod hex8_reduced;

use crate::kernel::interface::{Constant, constants};

/// Hexahedra in a block, and fibre lines in a group.
pub const LANES: usize = 16;
/// What twins know of them.
pub const CONSTANTS: [Constant; 1] = constants![uint: LANES];
