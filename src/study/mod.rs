//! Many cases at once: what a table over a folder of scenes needs.

pub mod scene;
pub mod stability;
pub mod step;
