//! The bias-extension test: a rectangle cut from the fabric at an angle, clamped at both ends and pulled.

mod check;
mod clamps;
mod findings;
mod observer;
mod page;
pub mod theory;
pub mod zones;

pub use clamps::clamped;

use super::observer::{Observer, Tables};
use super::ties::ties;
use super::{Piece, Rig, crossings};
use crate::case::Case;
use crate::case::domain::{Specimen, ThreadEnds};
use crate::case::provenance::Provenance;
use crate::error::Result;
use crate::fabric;
use crate::output::page::Page;
use crate::output::results::Results;
use crate::simulate::Simulation;
use glam::DVec2;
use zones::Strip;

/// Number of frames whose crossings are mapped, including the last.
const MAPS: usize = 3;

impl Rig for Specimen {
    fn check(&self, case: &Case, provenance: &Provenance) -> Result<()> {
        check::check(case, self, provenance)
    }

    fn piece(&self, case: &Case) -> Result<Piece> {
        let mesh = fabric::specimen::build(case, case.fabric()?, self)?;
        let motions = clamps::motions(self, &mesh, &case.steps);
        let ties = match self.thread_ends {
            ThreadEnds::Held => ties(&mesh, clamped(self, &mesh).concat()),
            ThreadEnds::Free => Vec::new(),
        };
        Ok(Piece { mesh, motions, ties })
    }

    fn observer(&self, _: &Case, simulation: &Simulation, tables: &Tables) -> Result<Box<dyn Observer>> {
        Ok(Box::new(observer::Pulled::of(self, simulation, tables)?))
    }

    fn curves(&self, results: &Results, page: &mut Page) -> Result<()> {
        page::curves(results, page)
    }

    fn sections(&self, case: &Case, results: &Results, page: &mut Page) -> Result<Vec<String>> {
        page::zones(results, page)?;
        let found = findings::findings(self, case, results)?;
        if !found.is_empty() {
            page.heading("What the pull shows");
            page.list("findings", &found);
        }
        crossings::maps(results, page, MAPS)?;
        Ok(found)
    }

    fn columns(&self, _: &Results) -> Vec<&'static str> {
        vec!["displacement_mm", "force_n", "shear_angle_deg", "f_nor_n_per_mm"]
    }

    fn free_thread_ends(&mut self) {
        self.thread_ends = ThreadEnds::Free;
    }
}

/// The strip between the clamps.
fn strip(specimen: &Specimen) -> Strip {
    Strip { centre: DVec2::ZERO, axis: DVec2::X, length: specimen.length_mm, width: specimen.width_mm }
}
