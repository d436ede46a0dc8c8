//! What a rig measures while a scene runs.

use crate::error::Result;
use crate::kernel::record::Record;
use crate::measure::yarns::Yarn;
use crate::mesh::frame::Frame;
use crate::output::appended::Appended;
use crate::output::table::{Named, Table};
use crate::settings::steps::Step;
use crate::simulate::Simulation;
use serde::Serialize;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// The folder of a run, in which tables are begun, or gone on with.
pub struct Tables {
    pub dir: PathBuf,
    /// Whether the run goes on from a checkpoint: its tables are there.
    pub goes_on: bool,
}

impl Tables {
    /// A table by its file name.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn open<R: Serialize + Default>(&self, name: &str) -> Result<Table<R>> {
        let path = self.dir.join(name);
        if self.goes_on { Table::open(&path) } else { Table::create(&path) }
    }

    /// A table whose columns depend on the scene.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn named(&self, name: &str, columns: &[String]) -> Result<Named> {
        let path = self.dir.join(name);
        if self.goes_on { Named::open(&path, columns.len()) } else { Named::create(&path, columns) }
    }
}

/// What is seen at a row of the tables.
pub struct Seen<'a> {
    /// Name of the load step.
    pub phase: &'a str,
    /// The deformed state, and the sizes of yarns in it; nothing where the scene does not have both plies.
    pub yarns: Option<(&'a Frame, &'a [Yarn])>,
    /// Force of the machine from the reactions of all prescribed nodes, N.
    pub machine: f64,
}

/// Angle and forces of a row of the history.
#[derive(Debug, Clone, Copy)]
pub struct Loading {
    /// Shear angle, degrees.
    pub degrees: f64,
    /// N.
    pub force: f64,
    /// F_nor, N/mm; not a number where it has no meaning.
    pub normalised: f64,
}

/// Measures of a rig, and the tables and files that only it has. A rig says only what it adds to what every run has.
pub trait Observer {
    /// A row of the rig's own tables.
    ///
    /// # Errors
    /// A state that cannot be measured, or a table that cannot be written.
    fn row(&mut self, simulation: &mut Simulation, seen: &Seen) -> Result<Loading>;

    /// Goes on from a state that another run left behind some load steps.
    ///
    /// # Errors
    /// A state that cannot be measured.
    fn start(&mut self, _simulation: &Simulation, _behind: &[Step]) -> Result<()> {
        Ok(())
    }

    /// The end of a load step.
    ///
    /// # Errors
    /// A state that cannot be measured.
    fn end_of_step(&mut self, _simulation: &Simulation, _step: &Step) -> Result<()> {
        Ok(())
    }

    /// A frame about to be written: adds its fields, and writes what lies beside it under a name in `frames/`.
    ///
    /// # Errors
    /// A state that cannot be measured, or a file that cannot be written.
    fn frame(&mut self, _simulation: &Simulation, _frame: &mut Frame, _dir: &Path, _name: &str) -> Result<()> {
        Ok(())
    }

    /// Whether inertia is judged now: the scene is loaded, and its motion has settled since that began.
    fn is_loaded(&self, _simulation: &Simulation, _phase: &str) -> bool {
        false
    }

    /// Files of its tables, always in the same order.
    fn tables(&mut self) -> Vec<&mut Appended> {
        Vec::new()
    }

    /// What it carries from row to row.
    fn record(&mut self, _record: &mut Record) {}

    /// Fields of the summary.
    fn summary(&self, _simulation: &Simulation) -> Vec<(&'static str, Value)> {
        Vec::new()
    }

    /// Lines for a person at the end of a run.
    fn lines(&self, _simulation: &Simulation) -> String {
        String::new()
    }
}
