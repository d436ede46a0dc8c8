//! A yarn pulled out of the fabric: a rectangle whose yarns across the pull are held at both ends, and the yarn in the middle pulled at
//! one of its ends. Friction with the other ply and with the stitch holds it.

mod observer;

use super::check::{fabric, pitches, steps};
use super::constituents::force;
use super::observer::{Observer, Tables};
use super::ties::ties;
use super::{Piece, Rig};
use crate::case::Case;
use crate::case::domain::{OnePly, PullOut, Specimen};
use crate::case::provenance::Provenance;
use crate::error::{Error, Result};
use crate::fabric::specimen;
use crate::mesh::{Mesh, Ply};
use crate::output::page::Page;
use crate::output::results::Results;
use crate::scene::Motion;
use crate::settings::steps::Step;
use crate::simulate::Simulation;

/// Nodes within this distance of an edge are held, mm.
const TOLERANCE: f64 = 1e-3;
/// Smallest number of pitches of each ply along each side.
const FEWEST_PITCHES: f64 = 3.0;

impl PullOut {
    /// The pulled ply and the one across.
    fn plies(&self) -> [Ply; 2] {
        match self.ply {
            OnePly::Warp => [Ply::Warp, Ply::Weft],
            OnePly::Weft => [Ply::Weft, Ply::Warp],
        }
    }

    /// The piece as a specimen with the pulled ply along x.
    fn specimen(&self) -> Specimen {
        let warp_angle_deg = if self.ply == OnePly::Warp { 0.0 } else { 90.0 };
        Specimen { length_mm: self.length_mm, width_mm: self.width_mm, warp_angle_deg, ..Specimen::default() }
    }

    /// Motions of the held ends and of the pulled one.
    fn motions(&self, mesh: &Mesh) -> Result<Vec<Motion>> {
        let [pulled, across] = self.plies();
        let nodes = |ply: Ply| mesh.blocks.iter().filter(move |block| block.ply == ply);
        let ends = nodes(across).flat_map(|block| block.first..block.first + block.count());
        let held = ends.filter(|node| mesh.nodes[*node][1].abs() >= 0.5 * self.width_mm - TOLERANCE).collect();
        let aside = |first: usize, count: usize| {
            (mesh.nodes[first..first + count].iter().map(|node| node[1]).sum::<f64>() / count as f64).abs()
        };
        let middle = nodes(pulled)
            .min_by(|a, b| aside(a.first, a.count()).total_cmp(&aside(b.first, b.count())))
            .ok_or_else(|| Error::geometry("domain.pull_out", "holds no yarn to pull: make it wider"))?;
        let own = middle.first..middle.first + middle.count();
        let end = own.filter(|node| mesh.nodes[*node][0] >= 0.5 * self.length_mm - TOLERANCE).collect();
        let motion = |name: &str, nodes, way| Motion {
            name: name.into(),
            nodes,
            components: [true; 3],
            displacement: [way, 0.0, 0.0],
            ..Motion::default()
        };
        Ok(vec![motion("held edges", held, 0.0), motion("pulled yarn", end, self.displacement_mm)])
    }
}

impl Rig for PullOut {
    fn check(&self, case: &Case, provenance: &Provenance) -> Result<()> {
        let fabric = fabric(case, "pull-out", provenance)?;
        steps(case, provenance, |step| match step {
            Step::Shear { .. } => Some("shear needs a periodic cell or a picture frame: move the yarn"),
            Step::Stretch { .. } => Some("only a cell has a stretch of its own: move the yarn"),
            _ => None,
        })?;
        if self.displacement_mm == 0.0 {
            let message = "is 0, so that nothing is pulled: give a displacement";
            return Err(provenance.error("domain.pull_out.displacement_mm", message));
        }
        if case.steps.iter().all(|step| !matches!(step, Step::Move { .. })) {
            let message = "is never applied: add a move step";
            return Err(provenance.error("domain.pull_out.displacement_mm", message));
        }
        let sides = [("domain.pull_out.length_mm", self.length_mm), ("domain.pull_out.width_mm", self.width_mm)];
        pitches(fabric, FEWEST_PITCHES, &sides, provenance)
    }

    fn piece(&self, case: &Case) -> Result<Piece> {
        let mesh = specimen::build(case, case.fabric()?, &self.specimen())?;
        let motions = self.motions(&mesh)?;
        let held = motions.iter().flat_map(|motion| motion.nodes.iter().copied()).collect();
        let ties = ties(&mesh, held);
        Ok(Piece { mesh, motions, ties })
    }

    fn observer(&self, _: &Case, _: &Simulation, _: &Tables) -> Result<Box<dyn Observer>> {
        Ok(Box::new(observer::PulledOut::of(self.length_mm)))
    }

    fn curves(&self, results: &Results, page: &mut Page) -> Result<()> {
        force(results, page, "Of the pulled end, over its displacement.");
        Ok(())
    }

    fn sections(&self, _: &Case, _: &Results, _: &mut Page) -> Result<Vec<String>> {
        Ok(Vec::new())
    }
}
