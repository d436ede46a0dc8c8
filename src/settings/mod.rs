//! Settings of physics and numerics: plain structs that the solver reads and that a case contains unchanged. Each has a JSON form
//! (serde), and ranges, units and defaults in the schema (schemars).

pub mod effects;
pub mod friction;
pub mod integration;
pub mod material;
pub mod steps;
pub mod tool;
