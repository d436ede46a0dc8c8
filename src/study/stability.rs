//! `tricot study stability`: runs every scene of a folder on every machine and tabulates the outcome.

use super::scene::Scenes;
use crate::backend::gpu::Device;
use crate::error::{Error, Result};
use crate::output::table::Table;
use crate::run::Machine;
use crate::settings::integration::Precision;
use crate::simulate::BackendConfig;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Columns of `stability.csv`. Steps and limits are the smallest of a run, errors and penetrations the largest; the limit is the
/// estimate in use, without factors.
const STABILITY: &[&str] = &[
    "scene",
    "backend",
    "steps",
    "retries",
    "dt_s",
    "estimated_limit_s",
    "energy_balance_error",
    "penetration_mm",
    "min_jacobian",
    "verdict",
    "as_expected",
];

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
    let mut rows = Table::create(table, STABILITY)?;
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
            rows.row(&[
                name.as_ref().into(),
                machine.into(),
                (seen.steps as f64).into(),
                (seen.retries as f64).into(),
                seen.dt.into(),
                seen.dt_limit.into(),
                seen.balance.into(),
                seen.penetration.into(),
                seen.min_jacobian.into(),
                ended.into(),
                if seen.cut {
                    "-"
                } else if broken.is_empty() {
                    "yes"
                } else {
                    "no"
                }
                .into(),
            ])?;
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
