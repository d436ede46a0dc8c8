//! Commands of the program: each makes one library call.

pub mod arguments;

use arguments::{Command, StudyCommand};
use std::path::{Path, PathBuf};
use tricot::case::schema;
use tricot::error::Result;
use tricot::output::directory;
use tricot::output::picture::View;
use tricot::run;
use tricot::study::accuracy::{self, accuracy};
use tricot::study::characterise::{self, characterise};
use tricot::study::compare::compare;
use tricot::study::effects::{self, effects};
use tricot::study::stability::stability;
use tricot::study::step::step;

/// Exit codes in addition to those of errors.
pub const UNEXPECTED: u8 = 1;
pub const BAD_INPUT: u8 = 2;
const STOPPED: u8 = 3;
const INTERRUPTED: u8 = 130;

/// Output of a command for the terminal.
pub struct Done {
    pub text: String,
    pub code: u8,
}

/// Performs a command.
///
/// # Errors
/// The error of the library call.
pub fn perform(command: Command) -> Result<Done> {
    let text = match command {
        Command::Run { case, output, precision, threads, backend, adapter, force, resume, from, quiet } => {
            let loaded = case.read()?;
            let options = run::Options {
                output: output.unwrap_or_else(|| directory::default(&case.case)),
                precision: precision.map(Into::into),
                threads: threads.map(usize::from),
                machine: backend.into(),
                adapter,
                force,
                resume,
                from,
                quiet,
            };
            if !resume {
                directory::check(&options.output, force)?;
            }
            let outcome = run::run(&loaded, &options)?;
            let code = if outcome.interrupted { INTERRUPTED } else { 0 };
            return Ok(Done { text: outcome.to_string(), code });
        }
        Command::Mesh { case, output, force } => {
            let dir = output.unwrap_or_else(|| beside(&case.case, "-mesh"));
            run::mesh(&case.read()?, &dir, force)?
        }
        Command::Check { case, explain } => run::check(&case.read()?, explain)?,
        Command::Devices => run::devices(),
        Command::Schema { fabric } => schema::text(&if fabric { schema::fabric() } else { schema::case() }),
        Command::Report { source, output } => {
            let out = output.unwrap_or_else(|| source.join("report.html"));
            run::report(&source, &out)?
        }
        Command::Compare { a, b, output, json } => {
            let comparison = compare(&a, &b)?;
            output.map_or(Ok(()), |path| comparison.write(&path))?;
            if json { format!("{:#}", comparison.json()) } else { comparison.text() }
        }
        Command::Characterise { fabric, set, preset, only, output, backend, threads, quiet } => {
            let options = characterise::Options {
                output: output.unwrap_or_else(|| beside(&fabric, "-characterise")),
                preset: preset.into(),
                only,
                machine: backend.into(),
                threads: threads.map(usize::from),
                quiet,
            };
            let found = characterise(&fabric, &set, &options)?;
            let code = if found.interrupted { INTERRUPTED } else { u8::from(found.stopped) * STOPPED };
            return Ok(Done { text: found.text, code });
        }
        Command::Study { study: StudyCommand::Accuracy { case, output, points, backend, threads, quiet } } => {
            let options = accuracy::Options {
                output: output.unwrap_or_else(|| beside(&case.case, "-accuracy")),
                points,
                machine: backend.into(),
                threads: threads.map(usize::from),
                quiet,
            };
            let study = accuracy(&case.case, &case.set, &options)?;
            return Ok(Done { text: study.text, code: if study.interrupted { INTERRUPTED } else { 0 } });
        }
        Command::Study { study: StudyCommand::Stability { folder, backend, longest, output } } => {
            let study = stability(&folder, backend.into(), longest, &output)?;
            return Ok(Done { text: study.text, code: if study.held { 0 } else { UNEXPECTED } });
        }
        Command::Study { study: StudyCommand::Effects { case, only, precision, threads, backend, output, force } } => {
            let loaded = case.read()?;
            let table = output.unwrap_or_else(|| beside(&case.case, "-effects.csv"));
            let precision = precision.map_or(loaded.case.integration.precision, Into::into);
            let config = run::backend_config(precision, backend.into(), threads.map(usize::from), "")?;
            let study = effects(&loaded, &effects::Options { config, only, table, force })?;
            return Ok(Done { text: study.text, code: if study.interrupted { INTERRUPTED } else { 0 } });
        }
        Command::Study { study: StudyCommand::Step { case, every, confirm } } => {
            let study = step(&case.read()?, every, confirm)?;
            return Ok(Done { text: study.text, code: if study.held { 0 } else { UNEXPECTED } });
        }
        Command::Picture { source, frame, field, range, width, output } => {
            let out = output.unwrap_or_else(|| picture_path(&source));
            let view = View { field, range, width_px: width.into(), ..View::default() };
            run::picture(&source, frame.as_deref(), &view, &out)?
        }
    };
    Ok(Done { text, code: 0 })
}

/// The default results folder of a case, with a suffix.
fn beside(case: &Path, what: &str) -> PathBuf {
    let mut dir = directory::default(case).into_os_string();
    dir.push(what);
    dir.into()
}

fn picture_path(source: &Path) -> PathBuf {
    if source.is_dir() { source.join("picture.png") } else { source.with_extension("png") }
}
