//! Runs one case: owns the plan, the backend, the schedule, the measures and the outputs of the run.

#![warn(clippy::too_many_lines)]

mod check;
pub mod clock;
mod devices;
pub mod effects;
mod frames;
mod grips;
pub mod interleaved_timing;
mod load_steps;
mod log;
mod mesh;
mod notes;
mod picture;
mod probes;
mod progress;
mod report;
mod resume;
mod rows;
mod session;
mod summary;
mod writer;

pub use check::check;
pub use devices::devices;
pub use mesh::mesh;
pub use picture::picture;
pub use report::report;
pub use resume::may_differ;

use crate::backend::gpu::{self, Device};
use crate::case::Case;
use crate::error::{Error, Result};
use crate::output::checkpoint::Checkpoint;
use crate::output::file;
use crate::rigs;
use crate::rigs::read::Loaded;
use crate::settings::integration::Precision;
use crate::simulate::{BackendConfig, Simulation};
use session::drive;
use std::fmt;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The case with all defaults written out, in a results folder.
pub const CASE: &str = "case.json";

/// The verdict of a completed run.
const FINISHED: &str = "finished";

/// Command-line options of a run, beyond the case.
#[derive(Debug, Clone)]
pub struct Options {
    /// Folder of the results.
    pub output: PathBuf,
    /// Scalar type; `None` to follow the case.
    pub precision: Option<Precision>,
    /// Number of threads that compute, besides one that writes files; `None` for all cores.
    pub threads: Option<usize>,
    /// The machine that runs the scene.
    pub machine: Machine,
    /// Part of the name of the adapter; empty for any.
    pub adapter: String,
    /// Move earlier results in the folder aside.
    pub force: bool,
    /// Resume from the last checkpoint in the folder.
    pub resume: bool,
    /// Start from a checkpoint that another run left at the end of a load step.
    pub from: Option<PathBuf>,
    /// No progress display.
    pub quiet: bool,
}

/// The machine that runs a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Machine {
    /// A discrete GPU if there is one and the scene is in f32, else the CPU.
    Auto,
    Cpu,
    Gpu,
}

/// Configuration of the requested machine, ready to make backends.
///
/// # Errors
/// The requested machine does not exist here.
pub fn backend_config(
    precision: Precision,
    machine: Machine,
    threads: Option<usize>,
    adapter: &str,
) -> Result<BackendConfig> {
    let wanted = match machine {
        Machine::Cpu => false,
        Machine::Gpu => true,
        Machine::Auto => precision == Precision::F32 && gpu::devices().first().is_some_and(|d| d.is_discrete),
    };
    let device = if wanted { Some(Device::open(adapter)?) } else { None };
    if let Some(device) = device.as_ref().filter(|device| adapter.is_empty() && device.is_software()) {
        let what = format!(
            "the only adapter here is {device:?}, which computes on the CPU and is slower than --backend cpu; give its name with \
             --adapter to use it all the same"
        );
        return Err(Error::Unsupported(what));
    }
    Ok(BackendConfig { precision, threads: threads.unwrap_or(0), device, ..BackendConfig::default() })
}

/// The findings of a run, in a dozen lines.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The user stopped the run; the files written so far are complete.
    pub interrupted: bool,
    /// The lines.
    pub text: String,
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// Writes the case with its fabric inline, so that a results folder is sufficient to draw and repeat the run.
fn write_case(case: &Case, dir: &Path) -> Result<()> {
    file::replace(&dir.join(CASE), |w| serde_json::to_writer_pretty(w, case).map_err(Into::into))
}

/// Prepares a case for running, without output files.
pub fn simulation(loaded: &Loaded, config: BackendConfig) -> Result<Simulation> {
    Simulation::new(rigs::scene(&loaded.case)?, config)
}

/// A scene in the state that a run of the same case left in a checkpoint.
///
/// # Errors
/// A file that cannot be read, or the state of another scene.
pub fn simulation_at(loaded: &Loaded, config: BackendConfig, state: &Path) -> Result<Simulation> {
    let mut simulation = simulation(loaded, config)?;
    let Checkpoint { header, records: [host, _], buffers } = Checkpoint::read(state)?;
    simulation.restore(host, &header.buffers, &buffers).map_err(|e| Error::file(state, e))?;
    Ok(simulation)
}

/// Runs a case.
///
/// # Errors
/// Bad input, a folder that cannot be used, a guard that stopped the run, or a device that failed; results computed so far stay
/// on disk.
pub fn run(loaded: &Loaded, options: &Options) -> Result<Outcome> {
    run_watched(loaded, options, &mut || Duration::ZERO)
}

/// Runs a case on a prepared machine, which overrides the options.
///
/// # Errors
/// As of [`run`].
pub fn run_on(loaded: &Loaded, options: &Options, config: BackendConfig) -> Result<Outcome> {
    drive(loaded, options, config, &mut || Duration::ZERO)
}

/// Runs a case and calls `watch` after every row of the tables; the duration that `watch` returns is excluded from the wall time.
///
/// # Errors
/// As of [`run`].
pub fn run_watched(loaded: &Loaded, options: &Options, watch: &mut dyn FnMut() -> Duration) -> Result<Outcome> {
    let precision = options.precision.unwrap_or(loaded.case.integration.precision);
    drive(loaded, options, backend_config(precision, options.machine, options.threads, &options.adapter)?, watch)
}
