//! A piece of the stitching thread that bends under its own weight (Fig. 11 of Zheng et al.). The angle of the line from the clamp to
//! the free end gives the bending stiffness, by Eq. 9 of the paper and by the heavy elastica, which Eq. 9 approximates.

mod elastica;
mod observer;

use super::constituents::{grip, section, thread, unused};
use super::observer::{Observer, Tables};
use super::{Piece, Rig, check};
use crate::case::Case;
use crate::case::domain::Cantilever;
use crate::case::provenance::Provenance;
use crate::error::Result;
use crate::output::page::Page;
use crate::output::results::{OVER_TIME, Results};
use crate::settings::steps::Step;
use crate::simulate::Simulation;

impl Rig for Cantilever {
    fn check(&self, case: &Case, provenance: &Provenance) -> Result<()> {
        let fabric = check::fabric(case, "cantilever", provenance)?;
        unused(case, &case.resolution, "a thread, whose beams are counted in its domain", provenance)?;
        check::steps(case, provenance, |step| match step {
            Step::Settle { .. } | Step::Hold { .. } => None,
            _ => Some("a cantilever is loaded by its weight alone: use settle"),
        })?;
        if case.effects.gravity_mm_s2.is_none_or(|[x, y, z]| x != 0.0 || y >= 0.0 || z != 0.0) {
            let message = "a cantilever bends under its weight, down along y, as pictures show it: give [0, -9810, 0]";
            return Err(provenance.error("effects.gravity_mm_s2", message));
        }
        if !case.effects.bending {
            return Err(provenance.error("effects.bending", "is off, but the test evaluates it: remove it"));
        }
        if fabric.stitch.bending_n_mm2 == 0.0 {
            let message = "is 0, so that the thread hangs straight down: give a bending stiffness";
            return Err(provenance.error("fabric.stitch.bending_n_mm2", message));
        }
        Ok(())
    }

    fn piece(&self, case: &Case) -> Result<Piece> {
        // the clamp holds one beam more by its middle, and with it the direction: the first bend is then one beam away from it, as
        // bends are from each other
        let beam = self.length_mm / (self.elements as f64 + 0.5);
        let mesh = thread(&case.fabric()?.stitch, -0.5 * beam, self.length_mm + 0.5 * beam, self.elements + 1);
        Ok(Piece { mesh, motions: vec![grip("clamp", vec![0, 1], 0.0)], ..Piece::default() })
    }

    fn observer(&self, case: &Case, _: &Simulation, tables: &Tables) -> Result<Box<dyn Observer>> {
        Ok(Box::new(observer::Bent::of(self, case, tables)?))
    }

    fn curves(&self, results: &Results, page: &mut Page) -> Result<()> {
        if let Some(bent) = results.other("cantilever.csv")? {
            let caption = "Of the line from the clamp to the free end, below the horizontal.";
            let angle = [("chord_angle_deg", "angle")];
            results.chart(page, &bent, &OVER_TIME, ["Angle", "degrees"], &angle, caption);
            let stiffness = [("bending_eq_9_n_mm2", "Eq. 9"), ("bending_elastica_n_mm2", "heavy elastica")];
            let caption = "Of a rod at rest with this angle.";
            results.chart(page, &bent, &OVER_TIME, ["Bending stiffness", "N mm²"], &stiffness, caption);
        }
        Ok(())
    }

    fn sections(&self, _: &Case, results: &Results, page: &mut Page) -> Result<Vec<String>> {
        Ok(section(results, page))
    }
}
