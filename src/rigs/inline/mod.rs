//! A mesh written inline in the case, with conditions on its nodes: scenes that verify the solver.

mod check;
mod conditions;
mod mesh;
mod observer;

use super::constituents::force;
use super::observer::{Observer, Tables};
use super::{Piece, Rig};
use crate::case::Case;
use crate::case::domain::InlineMesh;
use crate::case::provenance::Provenance;
use crate::error::Result;
use crate::output::page::Page;
use crate::output::results::Results;
use crate::simulate::Simulation;

impl Rig for InlineMesh {
    fn check(&self, case: &Case, provenance: &Provenance) -> Result<()> {
        check::check(case, self, provenance)
    }

    fn piece(&self, _: &Case) -> Result<Piece> {
        let mesh = mesh::build(self)?;
        let motions = conditions::motions(self, &mesh)?;
        Ok(Piece { mesh, motions, ..Piece::default() })
    }

    fn observer(&self, _: &Case, _: &Simulation, _: &Tables) -> Result<Box<dyn Observer>> {
        Ok(Box::new(observer::Machine))
    }

    fn curves(&self, results: &Results, page: &mut Page) -> Result<()> {
        let caption = "Of the grips on their largest displacement; each of them is in reactions.csv.";
        force(results, page, caption);
        Ok(())
    }

    fn sections(&self, _: &Case, _: &Results, _: &mut Page) -> Result<Vec<String>> {
        Ok(Vec::new())
    }

    fn relax_threads(&mut self) {
        self.threads.iter_mut().for_each(|thread| thread.thermal_strain = 0.0);
    }
}
