//! The periodic cell: homogenised shear of fabric without edges.

mod check;
mod observer;
mod page;

pub(super) use check::check;
pub(super) use observer::Sheared;
pub use page::tension;
pub(super) use page::{curves, effective_angles};

use super::check::steps;
use super::observer::{Observer, Tables};
use super::{Piece, Rig, crossings};
use crate::case::Case;
use crate::case::domain::Cell;
use crate::case::provenance::Provenance;
use crate::error::Result;
use crate::fabric;
use crate::output::page::Page;
use crate::output::results::Results;
use crate::settings::steps::Step;
use crate::simulate::Simulation;

impl Rig for Cell {
    fn check(&self, case: &Case, provenance: &Provenance) -> Result<()> {
        check(case, self, "domain.cell", provenance)?;
        steps(case, provenance, |step| match step {
            Step::Move { .. } => Some("a cell has no conditions to move: use shear, or a domain.mesh with conditions"),
            _ => None,
        })
    }

    fn piece(&self, case: &Case) -> Result<Piece> {
        let mesh = fabric::cell::build(case, case.fabric()?, self.warps, self.wefts)?;
        Ok(Piece { mesh, ..Piece::default() })
    }

    fn observer(&self, case: &Case, simulation: &Simulation, tables: &Tables) -> Result<Box<dyn Observer>> {
        Ok(Box::new(Sheared::of(case.fabric()?, simulation, tables)?))
    }

    fn curves(&self, results: &Results, page: &mut Page) -> Result<()> {
        curves(results, page)
    }

    fn sections(&self, _: &Case, results: &Results, page: &mut Page) -> Result<Vec<String>> {
        crossings::maps(results, page, 1)?;
        Ok(Vec::new())
    }

    fn columns(&self, results: &Results) -> Vec<&'static str> {
        let axis = results.axis();
        vec![axis.column, if axis.is_angle() { "f_nor_n_per_mm" } else { "force_n" }]
    }
}
