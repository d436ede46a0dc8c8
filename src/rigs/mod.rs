//! Test rigs: what a piece of fabric is held and loaded by, what is measured on it, and what its curves are drawn over.
//!
//! A rig is a folder here, and the description of its piece of fabric in [`crate::case::domain`]. Nothing else of the program asks
//! which rig a case has: [`of`] is the only place that does.

pub mod bias_extension;
pub mod cell;
mod check;
mod crossings;
pub mod inline;
pub mod observer;
pub mod read;

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

/// A test rig with the sizes that a case gives it.
pub trait Rig {
    /// Whether sizes, load steps and resolution of a case go together.
    ///
    /// # Errors
    /// The first contradiction, by its JSON path.
    fn check(&self, case: &Case, provenance: &Provenance) -> Result<()>;

    /// The piece of fabric, what moves it, and where its threads are tied.
    ///
    /// # Errors
    /// Geometry that cannot be meshed.
    fn piece(&self, case: &Case) -> Result<Piece>;

    /// What is measured during a run.
    ///
    /// # Errors
    /// A table that cannot be opened.
    fn observer(&self, case: &Case, simulation: &Simulation, tables: &Tables) -> Result<Box<dyn Observer>>;

    /// Curves of a report.
    ///
    /// # Errors
    /// A table of the run that cannot be read.
    fn curves(&self, results: &Results, page: &mut Page) -> Result<()>;

    /// Sections of a report behind its curves; returns what they say in sentences.
    ///
    /// # Errors
    /// Files of the run that cannot be read.
    fn sections(&self, case: &Case, results: &Results, page: &mut Page) -> Result<Vec<String>>;

    /// Columns of the history that state what the curves are drawn over and the force.
    fn columns(&self, results: &Results) -> Vec<&'static str>;

    /// Lets the ends of cut threads slide.
    fn free_thread_ends(&mut self) {}

    /// Takes the thermal strain out of threads that are not of a fabric.
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
        Domain::Specimen(specimen) => specimen,
        Domain::Mesh(inline) => inline,
    }
}

/// The rig of a case, to be changed.
pub fn of_mut(domain: &mut Domain) -> &mut dyn Rig {
    match domain {
        Domain::Cell(cell) => cell,
        Domain::Specimen(specimen) => specimen,
        Domain::Mesh(inline) => inline,
    }
}

/// The scene of a case.
///
/// # Errors
/// Geometry that cannot be meshed, or that reaches farther than positions do.
pub fn scene(case: &Case) -> Result<Scene> {
    let Piece { mesh, motions, ties } = of(&case.domain).piece(case)?;
    let shift = centre::shift(&mesh);
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
