//! The solver against known answers: closed forms, balances, symmetries, differences of energies.

#[path = "../common/mod.rs"]
mod common;

mod arc_offset;
mod beams;
mod bounce;
mod brute_force;
mod contact;
mod crossings;
mod drag;
mod effects;
mod elements;
mod frame;
mod friction;
mod geometry;
mod gravity;
mod guards;
mod hourglass;
mod materials;
mod mesh_export;
mod potential;
mod search;
mod segments;
mod specimen;
mod stretch;
mod time_step;
mod tools;
mod totals;
