//! From the parameters of a case to a mesh.

pub mod cell;
mod check;
pub mod inline;
mod laps;
pub mod polyline;
pub mod section;
pub mod specimen;
pub mod stitch;

use crate::case::Case;
use crate::case::domain::Domain;
use crate::case::fabric::Fabric;
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::mesh::centre::{self, REACH};
use crate::mesh::vector::add;

/// Positions are kept in whole quanta of 2⁻²³ mm, which reach ±256 mm.
const QUANTA_PER_MM: f64 = 8_388_608.0;
/// Largest number of nodes.
const MOST_NODES: f64 = 1e8;

/// Builds the mesh of a case. `fabric` is the case's fabric, read from its file where it has one.
pub fn build(case: &Case, fabric: Option<&Fabric>) -> Result<Mesh> {
    let needed = |what: &str| {
        fabric.ok_or_else(|| Error::case("fabric", format!("a {what} needs a fabric: its path, or the fabric")))
    };
    let mesh = match &case.domain {
        Domain::Cell { warps, wefts } => cell::build(case, needed("cell")?, *warps, *wefts)?,
        Domain::Specimen(specimen) => specimen::build(case, needed("specimen")?, specimen)?,
        Domain::Mesh(inline) => inline::build(inline)?,
    };
    let shift = centre::shift(&mesh);
    for (node, position) in mesh.nodes.iter().enumerate() {
        if add(*position, shift).iter().any(|x| x.abs() > REACH) {
            return Err(Error::geometry(
                "domain",
                format!(
                    "node {node} lies at {position:?} mm, but nodes must stay within ±{REACH} mm of the middle of the scene; make the domain smaller"
                ),
            ));
        }
    }
    Ok(mesh)
}

/// The nearest length that is a whole number of position quanta, mm.
fn quantised(x: f64) -> f64 {
    (x * QUANTA_PER_MM).round() / QUANTA_PER_MM
}

/// Refuses a value at a JSON path unless it holds a condition.
fn require(holds: bool, place: &str, message: impl FnOnce() -> String) -> Result<()> {
    if holds { Ok(()) } else { Err(Error::case(place, message())) }
}

/// Refuses a number that is not finite and above zero.
fn positive(value: f64, place: &str) -> Result<()> {
    require(value.is_finite() && value > 0.0, place, || format!("is {value}, but must be above 0"))
}

/// Refuses a number that is not finite and at least zero.
fn not_negative(value: f64, place: &str) -> Result<()> {
    require(value.is_finite() && value >= 0.0, place, || format!("is {value}, but must be at least 0"))
}
