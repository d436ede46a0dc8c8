//! `tricot study stability`: runs every scene of a folder on every machine and tabulates the outcome.

use super::scene::Scenes;
use crate::backend::gpu::Device;
use crate::error::{Error, Result};
use crate::output::rows::number;
use crate::output::table::Table;
use crate::run::Machine;
use crate::settings::integration::Precision;
use crate::simulate::BackendConfig;
use serde::Serialize;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// A row of `stability.csv`. Steps and limits are the smallest of a run, errors and penetrations the largest.
#[serde_with::apply(f64 => #[serde(serialize_with = "number")])]
#[derive(Default, Serialize)]
struct Row {
    scene: String,
    backend: &'static str,
    steps: u64,
    retries: usize,
    dt_s: f64,
    /// The estimate in use, without factors.
    estimated_limit_s: f64,
    energy_balance_error: f64,
    penetration_mm: f64,
    min_jacobian: f64,
    verdict: &'static str,
    /// `yes`, `no`, or `-` where the run was cut short.
    as_expected: &'static str,
}

/// Result of a study.
pub struct Study {
    /// The table as text, and the failed expectations.
    pub text: String,
    /// Whether every expectation held.
    pub held: bool,
}

/// The machines for the scenes, with their names: the CPU in both precisions, and an adapter. By default a study uses an adapter
/// if there is one.
fn machines(wanted: Machine) -> Result<Vec<(&'static str, BackendConfig)>> {
    let cpu = |precision| BackendConfig { precision, ..BackendConfig::default() };
    let mut machines = Vec::new();
    if wanted != Machine::Gpu {
        machines = vec![("cpu f32", cpu(Precision::F32)), ("cpu f64", cpu(Precision::F64))];
    }
    let device = match wanted {
        Machine::Cpu => None,
        Machine::Gpu => Some(Device::open("")?),
        Machine::Auto => Device::open("").ok(),
    };
    machines.extend(device.map(|device| ("gpu", BackendConfig { device: Some(device), ..BackendConfig::default() })));
    Ok(machines)
}

/// Paths of the cases in a folder, sorted.
///
/// # Errors
/// A folder that cannot be read or holds no case.
pub fn scenes(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder).map_err(|e| Error::file(folder, e))?;
    let mut paths: Vec<PathBuf> = entries.filter_map(|entry| entry.ok().map(|entry| entry.path())).collect();
    paths.retain(|path| path.extension().is_some_and(|e| e == "json"));
    paths.sort();
    if paths.is_empty() {
        return Err(Error::file(folder, "holds no case (*.json)"));
    }
    Ok(paths)
}

/// Runs every scene of a folder on every machine, each for at most `longest` steps, and writes the table row by row.
///
/// # Errors
/// A case that cannot be run, a table that cannot be written, or no adapter where one is wanted.
pub fn stability(folder: &Path, machine: Machine, longest: Option<u64>, table: &Path) -> Result<Study> {
    let machines = machines(machine)?;
    let paths = scenes(folder)?;
    if let Some(parent) = table.parent() {
        std::fs::create_dir_all(parent).map_err(|e| Error::file(parent, e))?;
    }
    let mut rows = Table::create(table)?;
    let (mut text, mut failed) = (String::new(), 0);
    for (machine, config) in machines {
        let mut scenes = Scenes::new(config).longest(longest.unwrap_or(u64::MAX));
        for path in &paths {
            let (seen, mut broken) = scenes.examine(path, &[])?;
            if seen.cut {
                // expectations at the end cannot be judged yet
                broken.clear();
            }
            let ended = if seen.cut { "cut short" } else { seen.verdict.name() };
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            rows.row(&Row {
                scene: name.to_string(),
                backend: machine,
                steps: seen.steps,
                retries: seen.retries,
                dt_s: seen.dt,
                estimated_limit_s: seen.dt_limit,
                energy_balance_error: seen.balance,
                penetration_mm: seen.penetration,
                min_jacobian: seen.min_jacobian,
                verdict: ended,
                as_expected: match (seen.cut, broken.is_empty()) {
                    (true, _) => "-",
                    (false, true) => "yes",
                    (false, false) => "no",
                },
            })?;
            // writing to a String does not fail
            let _ = writeln!(
                text,
                "{name:<32} {machine:<8} {:>8} steps of {:.2e} s (limit {:.2e} s), balance {:>6.2} %, penetration {:.4} mm, \
                 det F {:>6.3}, {}",
                seen.steps,
                seen.dt,
                seen.dt_limit,
                100.0 * seen.balance,
                seen.penetration,
                seen.min_jacobian,
                ended
            );
            for what in &broken {
                let _ = writeln!(text, "    not as expected: {what}");
            }
            failed += usize::from(!broken.is_empty());
        }
    }
    let _ = write!(text, "{} scenes, {failed} runs not as expected; written {}", paths.len(), table.display());
    Ok(Study { text, held: failed == 0 })
}
