//! The picture frame: a cross-shaped sample whose arms are clamped to a hinged frame (Fig. 14 of Zheng et al.).
//!
//! The sides of the frame keep their length and turn by half the shear angle γ each, so a clamped point X moves to F̄(γ) X with the F̄
//! of trellis shear: X (cos γ/2 − 1) along itself and sin γ/2 towards its mirror image at the diagonal. The machine pulls at opposite
//! hinges; its force is that which does the work of the clamps (see [`crate::measure::shear`]).

mod check;
mod observer;

use super::cell::effective_angles;
use super::observer::{Observer, Tables};
use super::ties::ties;
use super::{Piece, Rig, crossings};
use crate::case::Case;
use crate::case::domain::{FrameClamps, PictureFrame};
use crate::case::provenance::Provenance;
use crate::error::Result;
use crate::fabric;
use crate::mesh::{Block, Mesh, Ply};
use crate::output::page::Page;
use crate::output::results::{OVER_ANGLE, Results};
use crate::scene::Motion;
use crate::simulate::Simulation;

/// Nodes within this distance of the end of an arm are clamped, mm.
const TOLERANCE: f64 = 1e-3;
/// The clamps: name, ply, and the side of it.
const CLAMPS: [(&str, Ply, f64); 4] = [
    ("lower clamp of warps", Ply::Warp, -1.0),
    ("upper clamp of warps", Ply::Warp, 1.0),
    ("left clamp of wefts", Ply::Weft, -1.0),
    ("right clamp of wefts", Ply::Weft, 1.0),
];

/// Axis along which the yarns of a ply run.
fn axis(ply: Ply) -> usize {
    if ply == Ply::Warp { 1 } else { 0 }
}

impl PictureFrame {
    /// Nodes of a clamp.
    fn clamped(&self, mesh: &Mesh, (_, ply, side): (&str, Ply, f64)) -> Vec<usize> {
        let at_end = |node: &usize| side * mesh.nodes[*node][axis(ply)] >= 0.5 * self.frame_mm - TOLERANCE;
        let yarns = mesh.blocks.iter().filter(|block| block.ply == ply);
        let held = |block: &Block| -> Vec<usize> {
            let columns = match self.clamps {
                FrameClamps::Pinned => block.columns / 2..=block.columns / 2,
                FrameClamps::Glued => 0..=block.columns,
            };
            let lines = (0..=block.layers).flat_map(|layer| columns.clone().map(move |column| (column, layer)));
            lines
                .flat_map(|(column, layer)| (0..block.stations()).map(move |i| block.line(column, layer) + i))
                .collect()
        };
        let mut nodes: Vec<usize> = yarns.flat_map(held).filter(at_end).collect();
        nodes.sort_unstable();
        nodes
    }

    /// Motions of the clamps.
    fn motions(&self, mesh: &Mesh) -> Vec<Motion> {
        let motion = |clamp: (&str, Ply, f64)| {
            let nodes = self.clamped(mesh, clamp);
            let along = axis(clamp.1);
            let mut displacement = [0.0; 3];
            displacement[along] = clamp.2 * 0.5 * self.frame_mm * self.tension_strain;
            let arc = |node: &usize| {
                let [mut x, mut y, _] = mesh.nodes[*node];
                if along == 0 {
                    x += displacement[0]
                } else {
                    y += displacement[1]
                };
                [[x, y, 0.0], [y, x, 0.0]]
            };
            let arcs = nodes.iter().map(arc).collect();
            Motion { name: clamp.0.into(), nodes, components: [true; 3], displacement, arcs, after: 0 }
        };
        CLAMPS.map(motion).into()
    }
}

impl Rig for PictureFrame {
    fn check(&self, case: &Case, provenance: &Provenance) -> Result<()> {
        check::check(case, self, provenance)
    }

    fn piece(&self, case: &Case) -> Result<Piece> {
        let arm = 0.5 * (self.frame_mm - self.fabric_mm);
        let mesh = fabric::specimen::cross(case, case.fabric()?, self.fabric_mm, arm)?;
        let motions = self.motions(&mesh);
        let clamped = motions.iter().flat_map(|motion| motion.nodes.iter().copied()).collect();
        let ties = ties(&mesh, clamped);
        Ok(Piece { mesh, motions, ties })
    }

    fn observer(&self, _: &Case, simulation: &Simulation, tables: &Tables) -> Result<Box<dyn Observer>> {
        Ok(Box::new(observer::Framed::of(self, simulation, tables)?))
    }

    fn curves(&self, results: &Results, page: &mut Page) -> Result<()> {
        let caption = "By Eqs 16 and 17 from the force of the machine, mean over each row.";
        let force = [("f_nor_n_per_mm", "F_nor")];
        results.chart(page, &results.history, &OVER_ANGLE, ["Shear force", "N/mm"], &force, caption);
        if let Some(frame) = results.other("frame.csv")? {
            let caption = "On the diagonal of the frame.";
            let force = [("machine_force_n", "machine")];
            results.chart(page, &frame, &OVER_ANGLE, ["Machine force", "N"], &force, caption);
            let caption = "Force along the fibres in the clamps, per width of the fabric.";
            let tension = [("warp_tension_n_per_mm", "warp"), ("weft_tension_n_per_mm", "weft")];
            results.chart(page, &frame, &OVER_ANGLE, ["Tension", "N/mm"], &tension, caption);
        }
        if let Some(shear) = results.other("shear.csv")? {
            effective_angles(results, &shear, &OVER_ANGLE, page);
        }
        Ok(())
    }

    fn sections(&self, _: &Case, results: &Results, page: &mut Page) -> Result<Vec<String>> {
        crossings::maps(results, page, 1)?;
        Ok(Vec::new())
    }

    fn columns(&self, _: &Results) -> Vec<&'static str> {
        vec!["shear_angle_deg", "f_nor_n_per_mm"]
    }
}
