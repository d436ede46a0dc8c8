//! The observer interface: what a rig measures while a scene runs.

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

/// The folder of a run, in which tables are created or continued.
pub struct Tables {
    pub dir: PathBuf,
    /// Whether the run resumes from a checkpoint, so that its tables exist.
    pub goes_on: bool,
}

impl Tables {
    /// Opens a table by its file name.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn open<R: Serialize + Default>(&self, name: &str) -> Result<Table<R>> {
        let path = self.dir.join(name);
        if self.goes_on { Table::open(&path) } else { Table::create(&path) }
    }

    /// Opens a table whose columns depend on the scene.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn named(&self, name: &str, columns: &[String]) -> Result<Named> {
        let path = self.dir.join(name);
        if self.goes_on { Named::open(&path, columns.len()) } else { Named::create(&path, columns) }
    }
}

/// The state of a scene at a row of the tables.
pub struct Seen<'a> {
    /// Name of the load step.
    pub phase: &'a str,
    /// The deformed state and its yarn sizes; `None` unless the scene has both plies.
    pub yarns: Option<(&'a Frame, &'a [Yarn])>,
    /// Machine force from the reactions of all prescribed nodes, N.
    pub machine: f64,
}

/// Shear angle and forces of a history row.
#[derive(Debug, Clone, Copy)]
pub struct Loading {
    /// Shear angle, degrees.
    pub degrees: f64,
    /// Machine force, N.
    pub force: f64,
    /// F_nor, N/mm; NaN where it is undefined.
    pub normalised: f64,
}

/// Measures, tables and files that are specific to a rig; everything common to all runs is written elsewhere.
pub trait Observer {
    /// Writes a row of the rig's own tables.
    ///
    /// # Errors
    /// A state that cannot be measured, or a table that cannot be written.
    fn row(&mut self, simulation: &mut Simulation, seen: &Seen) -> Result<Loading>;

    /// Starts from a state that another run left after some load steps.
    ///
    /// # Errors
    /// A state that cannot be measured.
    fn start(&mut self, _simulation: &Simulation, _behind: &[Step]) -> Result<()> {
        Ok(())
    }

    /// Handles the end of a load step.
    ///
    /// # Errors
    /// A state that cannot be measured.
    fn end_of_step(&mut self, _simulation: &Simulation, _step: &Step) -> Result<()> {
        Ok(())
    }

    /// Handles a frame before it is written: adds fields, and writes companion files under the given name in `frames/`.
    ///
    /// # Errors
    /// A state that cannot be measured, or a file that cannot be written.
    fn frame(&mut self, _simulation: &Simulation, _frame: &mut Frame, _dir: &Path, _name: &str) -> Result<()> {
        Ok(())
    }

    /// Whether inertia is judged now: the scene is loaded, and the transient at the start of loading has decayed.
    fn is_loaded(&self, _simulation: &Simulation, _phase: &str) -> bool {
        false
    }

    /// Files of the rig's tables, always in the same order.
    fn tables(&mut self) -> Vec<&mut Appended> {
        Vec::new()
    }

    /// Saves or restores the data carried from row to row.
    fn record(&mut self, _record: &mut Record) {}

    /// Fields of the summary.
    fn summary(&self, _simulation: &Simulation) -> Vec<(&'static str, Value)> {
        Vec::new()
    }

    /// Closing lines for the user.
    fn lines(&self, _simulation: &Simulation) -> String {
        String::new()
    }
}
