//! Compaction of a periodic cell between two smooth plates, tightened, stretched or sheared before.
//!
//! The plates are rigid tools that move towards each other by the same way. They have no friction: a plate does not shear with the
//! cell, so that its friction would be a load along the plane that a periodic cell cannot bear.

mod observer;

use super::cell;
use super::observer::{Observer, Tables};
use super::{Piece, Rig, crossings};
use crate::case::Case;
use crate::case::domain::{Cell, CellCompaction};
use crate::case::provenance::Provenance;
use crate::error::{Error, Result};
use crate::fabric;
use crate::mesh::Mesh;
use crate::output::chart::{self, Curve};
use crate::output::page::Page;
use crate::output::results::Results;
use crate::settings::steps::Step;
use crate::settings::tool::{Shape, Tool};
use crate::simulate::Simulation;

/// Gap between the fabric and each plate at the start, mm.
const CLEARANCE: f64 = 0.01;

impl CellCompaction {
    fn cell(&self) -> Cell {
        Cell { warps: self.warps, wefts: self.wefts }
    }
}

impl Rig for CellCompaction {
    fn check(&self, case: &Case, provenance: &Provenance) -> Result<()> {
        cell::check(case, &self.cell(), "domain.cell_compaction", provenance)?;
        if case.effects.contact.is_none() {
            let message = "the plates touch nothing, since effects.contact is null: give it";
            return Err(provenance.error("domain.cell_compaction", message));
        }
        if case.steps.iter().all(|step| !matches!(step, Step::Move { .. })) {
            let message = "is never reached: add a move step, which brings the plates together";
            return Err(provenance.error("domain.cell_compaction.thickness_mm", message));
        }
        Ok(())
    }

    fn piece(&self, case: &Case) -> Result<Piece> {
        let mut mesh = fabric::cell::build(case, case.fabric()?, self.warps, self.wefts)?;
        let [low, high] = heights(&mesh);
        let way = 0.5 * (high - low + 2.0 * CLEARANCE - self.thickness_mm);
        if way <= 0.0 {
            let message = format!(
                "{} mm is no compaction of a fabric that is {:.4} mm thick before it is tightened: give less",
                self.thickness_mm,
                high - low
            );
            return Err(Error::case("domain.cell_compaction.thickness_mm", message));
        }
        mesh.tools =
            vec![plate("lower plate", low - CLEARANCE, 0.0, way), plate("upper plate", high + CLEARANCE, 180.0, -way)];
        Ok(Piece { mesh, ..Piece::default() })
    }

    fn observer(&self, case: &Case, simulation: &Simulation, tables: &Tables) -> Result<Box<dyn Observer>> {
        Ok(Box::new(observer::Compacted::of(case.fabric()?, self.fibre_density_g_cm3, simulation, tables)?))
    }

    fn curves(&self, results: &Results, page: &mut Page) -> Result<()> {
        if let Some(plates) = results.other("plates.csv")? {
            let phases = results.history.texts("phase");
            let figure = |page: &mut Page, column: &str, label: &str, title: &str, caption: &str| {
                let (at, pressure) = (plates.numbers(column), plates.numbers("upper_pressure_mpa"));
                let rows = at.into_iter().zip(pressure).zip(&phases);
                let points = rows.filter(|(_, phase)| **phase == "move").map(|((x, p), _)| [x, p]).collect();
                let curve = Curve { name: "pressure", points, spread: Vec::new() };
                if let Some(svg) = chart::curves([label, "MPa"], &[curve]) {
                    page.figure(title, &svg, caption);
                }
            };
            let caption = "Force of the upper plate over the present area of the cell.";
            figure(page, "thickness_mm", "thickness, mm", "Pressure over thickness, MPa", caption);
            let caption = "The fibres of both plies in the volume between the plates.";
            let title = "Pressure over fibre volume fraction, MPa";
            figure(page, "fibre_volume_fraction", "fibre volume fraction", title, caption);
        }
        cell::curves(results, page)
    }

    fn sections(&self, _: &Case, results: &Results, page: &mut Page) -> Result<Vec<String>> {
        crossings::maps(results, page, 1)?;
        Ok(Vec::new())
    }
}

/// A smooth plate at a height, mm, turned about x by an angle, degrees, that moves along z by a way, mm.
pub(super) fn plate(name: &str, z: f64, turned: f64, way: f64) -> Tool {
    Tool {
        turned_deg: [turned, 0.0, 0.0],
        displacement_mm: [0.0, 0.0, way],
        ..Tool::held(name, Shape::Plane, [0.0, 0.0, z])
    }
}

/// Lowest and highest point of yarns and threads, mm.
pub(super) fn heights(mesh: &Mesh) -> [f64; 2] {
    let yarns = mesh.nodes[..mesh.first_thread_node()].iter().map(|node| (node[2], 0.0));
    let threads = mesh.threads.iter().flat_map(|thread| {
        mesh.nodes[thread.first..thread.first + thread.count].iter().map(|node| (node[2], thread.radius))
    });
    let fold = |[low, high]: [f64; 2], (z, radius): (f64, f64)| [low.min(z - radius), high.max(z + radius)];
    yarns.chain(threads).fold([f64::INFINITY, f64::NEG_INFINITY], fold)
}
