//! Test rigs: how a piece of fabric is held and loaded, what is measured, and the abscissa of its curves.
//!
//! A rig is a folder here plus the description of its domain in [`crate::case::domain`]. [`of`] is the only place in the
//! program that distinguishes the rigs.

pub mod bias_extension;
mod cantilever;
pub mod cell;
mod cell_compaction;
mod check;
mod constituents;
mod crossings;
pub mod inline;
pub mod observer;
mod picture_frame;
mod pull_out;
pub mod read;
mod thread_tension;
mod ties;
mod tool_friction;
mod tools;
mod yarn_compaction;
mod yarn_shear;

use crate::case::Case;
use crate::case::domain::Domain;
use crate::case::provenance::Provenance;
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::mesh::centre::{self, REACH};
use crate::mesh::vector::add;
use crate::output::page::Page;
use crate::output::results::Results;
use crate::scene::{Motion, Scene, Tie};
use crate::simulate::Simulation;
use observer::{Observer, Tables};

/// A test rig with the dimensions given by a case.
pub trait Rig {
    /// Checks that dimensions, load steps and resolution of a case are consistent.
    ///
    /// # Errors
    /// The first contradiction, by its JSON path.
    fn check(&self, case: &Case, provenance: &Provenance) -> Result<()>;

    /// Builds the piece of fabric, its prescribed motion, and the ties of its threads.
    ///
    /// # Errors
    /// Geometry that cannot be meshed.
    fn piece(&self, case: &Case) -> Result<Piece>;

    /// The observer that measures during a run.
    ///
    /// # Errors
    /// A table that cannot be opened.
    fn observer(&self, case: &Case, simulation: &Simulation, tables: &Tables) -> Result<Box<dyn Observer>>;

    /// The curves of a report.
    ///
    /// # Errors
    /// A table of the run that cannot be read.
    fn curves(&self, results: &Results, page: &mut Page) -> Result<()>;

    /// The report sections that follow the curves; returns their findings as sentences.
    ///
    /// # Errors
    /// Files of the run that cannot be read.
    fn sections(&self, case: &Case, results: &Results, page: &mut Page) -> Result<Vec<String>>;

    /// History columns of the abscissa and of the force.
    fn columns(&self, results: &Results) -> Vec<&'static str> {
        vec![results.axis().column, "force_n"]
    }

    /// Frees the ends of cut threads.
    fn free_thread_ends(&mut self) {}

    /// Removes the thermal strain of threads that do not belong to a fabric.
    fn relax_threads(&mut self) {}
}

/// A piece of fabric in a rig.
#[derive(Debug, Clone, Default)]
pub struct Piece {
    pub mesh: Mesh,
    pub motions: Vec<Motion>,
    pub ties: Vec<Tie>,
}

/// The rig of a case.
pub fn of(domain: &Domain) -> &dyn Rig {
    match domain {
        Domain::Cell(cell) => cell,
        Domain::CellCompaction(compaction) => compaction,
        Domain::Specimen(specimen) => specimen,
        Domain::PictureFrame(frame) => frame,
        Domain::PullOut(pulled) => pulled,
        Domain::ToolFriction(friction) => friction,
        Domain::ThreadTension(tension) => tension,
        Domain::Cantilever(cantilever) => cantilever,
        Domain::YarnShear(shear) => shear,
        Domain::YarnCompaction(compaction) => compaction,
        Domain::Mesh(inline) => inline,
    }
}

/// The rig of a case, mutable.
pub fn of_mut(domain: &mut Domain) -> &mut dyn Rig {
    match domain {
        Domain::Cell(cell) => cell,
        Domain::CellCompaction(compaction) => compaction,
        Domain::Specimen(specimen) => specimen,
        Domain::PictureFrame(frame) => frame,
        Domain::PullOut(pulled) => pulled,
        Domain::ToolFriction(friction) => friction,
        Domain::ThreadTension(tension) => tension,
        Domain::Cantilever(cantilever) => cantilever,
        Domain::YarnShear(shear) => shear,
        Domain::YarnCompaction(compaction) => compaction,
        Domain::Mesh(inline) => inline,
    }
}

/// The scene of a case.
///
/// # Errors
/// Geometry that cannot be meshed, or that exceeds the range of positions.
pub fn scene(case: &Case) -> Result<Scene> {
    let Piece { mesh, motions, ties } = of(&case.domain).piece(case)?;
    let shift = centre::shift(&mesh);
    tools::near(&mesh)?;
    for (node, position) in mesh.nodes.iter().enumerate() {
        if add(*position, shift).iter().any(|x| x.abs() > REACH) {
            let message = format!(
                "node {node} lies at {position:?} mm, but nodes must stay within ±{REACH} mm of the middle of the scene; \
                 make the domain smaller"
            );
            return Err(Error::geometry("domain", message));
        }
    }
    let (steps, effects, integration) = (case.steps.clone(), case.effects.clone(), case.integration.clone());
    Ok(Scene { mesh, motions, ties, steps, effects, integration })
}
