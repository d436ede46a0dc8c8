//! Conditions on nodes of free scenes.

pub mod prescribed;
