//! The printed summary of a mesh.

use super::clearance::{Clearance, thread_thread, thread_yarn};
use super::quality::{ArealMass, areal_mass, length, scaled_jacobian};
use super::{Mesh, Part, Ply, linking};
use std::fmt;

/// Points along a beam at which its distance to yarns is measured.
const SAMPLES: usize = 8;

/// Counts, sizes and clearances of a mesh in its reference position.
#[derive(Debug, Clone)]
pub struct Report {
    pub title: String,
    pub nodes: usize,
    pub hexes: usize,
    pub beams: usize,
    pub warps: usize,
    pub wefts: usize,
    pub bodies: usize,
    pub threads: usize,
    /// Cell lengths, mm.
    pub period: Option<[f64; 2]>,
    /// Length of all threads, of their loops and of their underlaps, mm.
    pub lengths: [f64; 3],
    /// Number of loops whose next loop is whole: all laps of a cell.
    pub laps: usize,
    pub areal_mass: Option<ArealMass>,
    /// Smallest scaled Jacobian and its block.
    pub jacobian: Option<(f64, String)>,
    /// Smallest gaps of threads to warps, to wefts and to each other.
    pub clearances: [Option<Clearance>; 3],
    /// Loops whose head holds both legs of the next loop.
    pub held: usize,
}

/// Measures a mesh.
pub fn report(mesh: &Mesh, title: &str) -> Report {
    let count = |ply: Ply| mesh.blocks.iter().filter(|b| b.ply == ply).count();
    let total = |part: Option<Part>| mesh.threads.iter().map(|t| length(mesh, t, part)).sum();
    let links = linking::links(mesh);
    Report {
        title: title.to_owned(),
        nodes: mesh.nodes.len(),
        hexes: mesh.hexes(),
        beams: mesh.beams(),
        warps: count(Ply::Warp),
        wefts: count(Ply::Weft),
        bodies: count(Ply::Free),
        threads: mesh.threads.len(),
        period: mesh.period,
        lengths: [total(None), total(Some(Part::Loop)), total(Some(Part::Underlap))],
        laps: links.len(),
        areal_mass: areal_mass(mesh),
        jacobian: mesh
            .blocks
            .iter()
            .map(|b| (scaled_jacobian(mesh, b), b.name.clone()))
            .min_by(|a, b| a.0.total_cmp(&b.0)),
        clearances: [
            thread_yarn(mesh, Ply::Warp, SAMPLES),
            thread_yarn(mesh, Ply::Weft, SAMPLES),
            thread_thread(mesh, mesh.self_arc()),
        ],
        held: links.iter().filter(|l| l.holds()).count(),
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.title)?;
        if let Some([lx, ly]) = self.period {
            writeln!(f, "cell          {lx:.3} × {ly:.3} mm, {} warps, {} wefts", self.warps, self.wefts)?;
        } else if self.warps + self.wefts > 0 {
            writeln!(f, "specimen      {} warps, {} wefts, {} pieces of thread", self.warps, self.wefts, self.threads)?;
        } else {
            writeln!(f, "scene         {} blocks, {} threads, no period", self.bodies, self.threads)?;
        }
        writeln!(f, "mesh          {} nodes, {} hexahedra, {} beams", self.nodes, self.hexes, self.beams)?;
        if let Some((value, block)) = &self.jacobian {
            writeln!(f, "shape         scaled Jacobian ≥ {value:.3} ({block})")?;
        }
        if let Some(mass) = self.areal_mass {
            writeln!(f, "areal mass    warp {:.2}, weft {:.2}, stitch {:.2} g/m²", mass.warp, mass.weft, mass.stitch)?;
        }
        let [all, loops, underlaps] = self.lengths;
        if self.laps > 0 && self.period.is_some() {
            let laps = self.laps as f64;
            writeln!(f, "threads       {} of {all:.2} mm in all, {} laps", self.threads, self.laps)?;
            writeln!(f, "lap           loop {:.3} + underlap {:.3} mm", loops / laps, underlaps / laps)?;
        } else if self.threads > 0 {
            writeln!(f, "threads       {} of {all:.2} mm in all", self.threads)?;
        }
        let named = [("warp", &self.clearances[0]), ("weft", &self.clearances[1]), ("thread", &self.clearances[2])];
        let gaps: Vec<String> =
            named.iter().filter_map(|(n, c)| c.as_ref().map(|c| format!("{n} {:+.4}", c.gap))).collect();
        if !gaps.is_empty() {
            writeln!(f, "clearance     thread to {} mm", gaps.join(", "))?;
        }
        if self.laps > 0 {
            writeln!(f, "interlocking  {} of {} loops hold both legs of the next", self.held, self.laps)?;
        }
        Ok(())
    }
}
