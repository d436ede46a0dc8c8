//! Elements: they read the state of their nodes and write only their own corner slots.

pub mod beam2;
pub mod bend;
pub mod hex8;
