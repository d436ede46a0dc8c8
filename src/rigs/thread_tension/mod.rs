//! Tension of a piece of the stitching thread (Fig. 10 and Eq. 8 of Zheng et al.): F = E A ΔL/L.

use super::constituents::{Property, Pull, force, grip, section, steps, thread, unused};
use super::observer::{Observer, Tables};
use super::{Piece, Rig, check};
use crate::case::Case;
use crate::case::domain::ThreadTension;
use crate::case::provenance::Provenance;
use crate::error::Result;
use crate::output::page::Page;
use crate::output::results::Results;
use crate::simulate::Simulation;
use std::f64::consts::PI;

impl Rig for ThreadTension {
    fn check(&self, case: &Case, provenance: &Provenance) -> Result<()> {
        check::fabric(case, "thread", provenance)?;
        unused(case, &case.resolution, "a thread, whose beams are counted in its domain", provenance)?;
        steps(case, "domain.thread_tension.displacement_mm", self.displacement_mm, provenance)
    }

    fn piece(&self, case: &Case) -> Result<Piece> {
        let mesh = thread(&case.fabric()?.stitch, 0.0, self.length_mm, self.elements);
        let motions =
            vec![grip("held end", vec![0], 0.0), grip("moved end", vec![self.elements], self.displacement_mm)];
        Ok(Piece { mesh, motions, ..Piece::default() })
    }

    fn observer(&self, case: &Case, _: &Simulation, _: &Tables) -> Result<Box<dyn Observer>> {
        let stitch = &case.fabric()?.stitch;
        let area = PI * stitch.radius_mm * stitch.radius_mm;
        let given = stitch.young_mpa;
        let property = Property { symbol: "E", unit: "MPa", by: "F L/(A ΔL)", evaluated: f64::NAN, given };
        Ok(Box::new(Pull::new(property, area / self.length_mm)))
    }

    fn curves(&self, results: &Results, page: &mut Page) -> Result<()> {
        let caption = "Of the moved end, over its displacement.";
        force(results, page, caption);
        Ok(())
    }

    fn sections(&self, _: &Case, results: &Results, page: &mut Page) -> Result<Vec<String>> {
        Ok(section(results, page))
    }
}
