//! Whole scenes, which run for minutes: the shipped cell, specimens, hard cases, random fabrics.

#[path = "../common/mod.rs"]
mod common;

mod bias_extension;
mod hard_cases;
mod random_fabrics;
mod shipped_cell;
mod specimen_pull;
