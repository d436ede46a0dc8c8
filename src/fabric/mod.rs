//! The mesh of a piece of fabric from the parameters of the fabric.

pub mod cell;
mod check;
mod laps;
pub mod polyline;
pub mod section;
pub mod specimen;
pub mod stitch;

use crate::error::{Error, Result};

/// Positions are kept in whole quanta of 2⁻²³ mm, which reach ±256 mm.
const QUANTA_PER_MM: f64 = 8_388_608.0;
/// Largest number of nodes.
pub(crate) const MOST_NODES: f64 = 1e8;

/// The nearest length that is a whole number of position quanta, mm.
pub(crate) fn quantised(x: f64) -> f64 {
    (x * QUANTA_PER_MM).round() / QUANTA_PER_MM
}

/// Refuses a value at a JSON path unless a condition holds.
pub(crate) fn require(holds: bool, place: &str, message: impl FnOnce() -> String) -> Result<()> {
    if holds { Ok(()) } else { Err(Error::case(place, message())) }
}

/// Refuses a number that is not finite and above zero.
pub(crate) fn positive(value: f64, place: &str) -> Result<()> {
    require(value.is_finite() && value > 0.0, place, || format!("is {value}, but must be above 0"))
}

/// Refuses a number that is not finite and at least zero.
fn not_negative(value: f64, place: &str) -> Result<()> {
    require(value.is_finite() && value >= 0.0, place, || format!("is {value}, but must be at least 0"))
}
