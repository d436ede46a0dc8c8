//! Friction of the fabric on a tool: a rectangle of fabric, clamped at both ends, on a plate that slides along it, pressed by a smooth
//! plate from above.
//!
//! Clamps hold the ends of yarns in the plane of the fabric only, so that all of the pressure passes to the sliding plate. The coefficient is the force
//! along the plate over that across it, as of a sled test. While the fabric is pressed it spreads sideways, and a part of the friction
//! points across the way: the way must be long compared with that.

mod observer;

use super::cell_compaction::{heights, plate};
use super::check::{fabric, steps};
use super::constituents::{force, section};
use super::observer::{Observer, Tables};
use super::ties::ties;
use super::{Piece, Rig};
use crate::case::Case;
use crate::case::domain::{Specimen, ToolFriction};
use crate::case::provenance::Provenance;
use crate::error::{Error, Result};
use crate::fabric::specimen;
use crate::mesh::Mesh;
use crate::output::page::Page;
use crate::output::results::Results;
use crate::rigs::bias_extension::clamped;
use crate::scene::Motion;
use crate::settings::steps::Step;
use crate::settings::tool::ToolFriction as Coefficient;
use crate::simulate::Simulation;

impl ToolFriction {
    /// The piece as a specimen with its warps along x.
    fn specimen(&self) -> Specimen {
        Specimen { length_mm: self.length_mm, width_mm: self.width_mm, warp_angle_deg: 0.0, ..Specimen::default() }
    }

    /// Places the plates.
    fn plates(&self, mesh: &mut Mesh) -> Result<()> {
        let [low, high] = heights(mesh);
        if self.thickness_mm >= high - low {
            let message = format!(
                "{} mm is no compaction of a fabric that is {:.4} mm thick before it is tightened: give less",
                self.thickness_mm,
                high - low
            );
            return Err(Error::case("domain.tool_friction.thickness_mm", message));
        }
        let way = 0.5 * (high - low - self.thickness_mm);
        let mut lower = plate("sliding plate", low, 0.0, way);
        lower.displacement_mm[0] = self.slide_mm;
        lower.friction = Coefficient::All(self.coefficient);
        mesh.tools = vec![lower, plate("upper plate", high, 180.0, -way)];
        Ok(())
    }
}

impl Rig for ToolFriction {
    fn check(&self, case: &Case, provenance: &Provenance) -> Result<()> {
        fabric(case, "friction test", provenance)?;
        steps(case, provenance, |step| match step {
            Step::Shear { .. } => Some("shear needs a periodic cell or a picture frame: move the plates"),
            Step::Stretch { .. } => Some("only a cell has a stretch of its own: move the plates"),
            _ => None,
        })?;
        if case.effects.contact.as_ref().is_none_or(|contact| !contact.friction) {
            let message =
                "there is no friction, since effects.contact or effects.contact.friction turns it off: turn it on";
            return Err(provenance.error("domain.tool_friction.coefficient", message));
        }
        if case.steps.iter().all(|step| !matches!(step, Step::Move { .. })) {
            return Err(provenance.error("domain.tool_friction.slide_mm", "is never applied: add a move step"));
        }
        Ok(())
    }

    fn piece(&self, case: &Case) -> Result<Piece> {
        let mut mesh = specimen::build(case, case.fabric()?, &self.specimen())?;
        self.plates(&mut mesh)?;
        let yarns = mesh.first_thread_node();
        let nodes: Vec<usize> =
            clamped(&self.specimen(), &mesh).concat().into_iter().filter(|node| *node < yarns).collect();
        let ties = ties(&mesh, nodes.clone());
        let held = Motion { name: "clamps".into(), nodes, components: [true, true, false], ..Motion::default() };
        Ok(Piece { mesh, motions: vec![held], ties })
    }

    fn observer(&self, _: &Case, _: &Simulation, _: &Tables) -> Result<Box<dyn Observer>> {
        Ok(Box::new(observer::Slid::of(self.coefficient)))
    }

    fn curves(&self, results: &Results, page: &mut Page) -> Result<()> {
        force(results, page, "Of the plate on the fabric, along the way that it slides.");
        Ok(())
    }

    fn sections(&self, _: &Case, results: &Results, page: &mut Page) -> Result<Vec<String>> {
        Ok(section(results, page))
    }
}
