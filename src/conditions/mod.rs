//! Prescribed motion of nodes in free scenes.

pub mod prescribed;
