//! `tricot study accuracy`: the cost of accuracy in time, for the user's own case.
//!
//! [`variations`] lists the knobs as data, [`points`] runs each of them, `stopwatch` times it on a machine that may have other
//! work, [`findings`] compares the runs with the reference, and `write` puts the result on disk. Existing runs are not repeated,
//! so a stopped study continues.

pub mod findings;
pub mod points;
mod stopwatch;
pub mod variations;
mod write;

use crate::case::parse::reason;
use crate::error::{Error, Result};
use crate::run::Machine;
use findings::Findings;
use indicatif::{ProgressBar, ProgressStyle};
use points::{Ran, Role, Runner};
use std::path::{Path, PathBuf};
use write::Report;

/// Options of a study, besides the case.
#[derive(Debug, Clone)]
pub struct Options {
    /// Folder of the study.
    pub output: PathBuf,
    /// Words that select points by knob or label; none for all points.
    pub points: Vec<String>,
    /// Machine for the points, unless it is their knob.
    pub machine: Machine,
    /// Number of threads; `None` for all cores.
    pub threads: Option<usize>,
    /// Whether to print no progress.
    pub quiet: bool,
}

/// Outcome of a study.
#[derive(Debug, Clone)]
pub struct Study {
    /// Whether the user stopped it; completed runs are found again.
    pub interrupted: bool,
    /// The table as text.
    pub text: String,
}

/// Runs the missing points of a study, and rewrites the study after each of them.
///
/// # Errors
/// A case that cannot be run, points that do not exist, a case or reference that does not finish, or files that cannot be
/// written.
pub fn accuracy(case: &Path, sets: &[String], options: &Options) -> Result<Study> {
    let mut runner = Runner::new(case, sets, options)?;
    let points = runner.points()?;
    std::fs::create_dir_all(&options.output).map_err(|e| Error::file(&options.output, reason(&e)))?;
    let command = ["tricot run".to_owned(), case.display().to_string()]
        .into_iter()
        .chain(sets.iter().map(|s| format!("--set {s}")));
    let (command, title) = (command.collect::<Vec<_>>().join(" "), runner.title());
    let bar = bar(points.len(), options.quiet);
    let mut done = Vec::new();
    let mut study = Study { interrupted: false, text: String::new() };
    for point in points {
        bar.set_message(point.label);
        let Some(ran) = runner.perform(&point)? else {
            study.interrupted = true;
            break;
        };
        needed(point.role, &ran, case)?;
        let folder = runner.folder(&point);
        done.push((point, ran, folder));
        let findings = Findings::of(&done)?;
        let report = Report { title: &title, command: &command, findings: &findings };
        report.write(&options.output)?;
        study.text = report.text();
        bar.inc(1);
    }
    bar.finish_and_clear();
    let end = if study.interrupted { "interrupted: the same command goes on" } else { "accuracy.html shows it" };
    let lines = [study.text, format!("results    {}: {end}", options.output.display())];
    study.text = lines.into_iter().filter(|line| !line.is_empty()).collect::<Vec<_>>().join("\n");
    Ok(study)
}

/// Fails without the case itself or the reference, which every finding needs.
fn needed(role: Role, ran: &Ran, case: &Path) -> Result<()> {
    if ran.finished() || !matches!(role, Role::Default | Role::Reference) {
        return Ok(());
    }
    let what = if role == Role::Default { "the case itself" } else { "the reference of the study" };
    Err(Error::geometry(case.display().to_string(), format!("{what} does not come to its end: {}", ran.message)))
}

fn bar(count: usize, quiet: bool) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{bar:24} {pos}/{len} {elapsed} {msg}");
    ProgressBar::new(count as u64).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}
