//! The program and its files: cases, folders, checkpoints, faults, studies, and the house rules.

#[path = "../common/mod.rs"]
mod common;

mod bad_cases;
mod characterise;
mod checkpoint;
mod constituents;
mod decks;
mod faults;
mod fuzz;
mod grips;
mod notes;
mod report;
mod reproducible;
mod retries;
mod rigs;
mod run;
mod schema;
mod structure;
mod study;
mod study_effects;
