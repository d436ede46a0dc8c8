//! Case in, results out.

use crate::case::read::Loaded;
use crate::case::steps::Precision;
use crate::error::{Error, Result};
use std::fmt;
use std::path::{Path, PathBuf};

/// What the command line says about a run, beyond the case.
#[derive(Debug, Clone)]
pub struct Options {
    /// Folder of the results.
    pub output: PathBuf,
    /// Scalar type; `None` as the case says.
    pub precision: Option<Precision>,
    /// Number of threads; `None` for all cores.
    pub threads: Option<usize>,
    /// Move earlier results in the folder aside.
    pub force: bool,
    /// No progress.
    pub quiet: bool,
}

/// What a run found, in ten lines.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The user stopped the run; results so far are complete files.
    pub interrupted: bool,
    /// The lines.
    pub text: String,
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// Runs a case.
pub fn run(_case: &Loaded, _options: &Options) -> Result<Outcome> {
    Err(missing("run"))
}

/// Writes the mesh of a case to a folder.
pub fn mesh(_case: &Loaded, _dir: &Path) -> Result<String> {
    Err(missing("mesh"))
}

/// Sizes and cost of a case; with `explain` every stage of its plan.
pub fn check(_case: &Loaded, _explain: bool) -> Result<String> {
    Err(missing("check"))
}

/// Renders a frame, or the last frame of a run, to a PNG.
pub fn picture(_source: &Path, _field: Option<&str>, _width: usize, _out: &Path) -> Result<String> {
    Err(missing("picture"))
}

fn missing(command: &str) -> Error {
    Error::Unsupported(format!("this build has no `{command}`"))
}
