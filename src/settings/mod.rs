//! What a user chooses about the physics and its numerics: plain structs, which the solver reads and which are a part of a case as they
//! are. Each has its JSON form (serde), and its ranges, units and defaults in the schema (schemars).

pub mod effects;
pub mod integration;
pub mod material;
pub mod steps;
