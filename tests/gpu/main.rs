//! Shaders: the same numbers on a device as on the CPU, stage by stage and run by run.

#[path = "../common/mod.rs"]
mod common;

mod cell;
mod dispatches;
mod numbers;
mod scenes;
mod shaders;
mod stages;
mod traffic;
