//! The command line: arguments in, one library call, text or one line of error out.

use clap::error::ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand;
use clap::{Parser, Subcommand, ValueEnum};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use tricot::case::schema;
use tricot::error::{Error, Result};
use tricot::output::directory;
use tricot::output::picture::View;
use tricot::rigs::read::{Loaded, read};
use tricot::run;
use tricot::settings::integration::Precision;
use tricot::study::accuracy::{self, accuracy};
use tricot::study::compare::compare;
use tricot::study::effects::{self, effects};
use tricot::study::stability::stability;
use tricot::study::step::step;

const UNEXPECTED: u8 = 1;
const BAD_INPUT: u8 = 2;
const INTERRUPTED: u8 = 130;

/// Explicit finite elements for dry stitched non-crimp fabrics at the scale of their yarns.
#[derive(Parser)]
#[command(version, max_term_width = 100, after_help = AFTER)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

const AFTER: &str = "\
Examples:
  tricot check cases/unit_cell_shear.json
  tricot run cases/unit_cell_shear.json -o results/cell
  tricot run cases/unit_cell_shear.json --set steps.2.shear.angle_deg=30 --set fabric.friction=0.3
  tricot run cases/unit_cell_shear.json -o results/cell --resume
  tricot picture results/cell
  tricot report results/cell
  tricot compare results/cell results/other_way
  tricot study accuracy cases/unit_cell_shear.json
  tricot study stability cases/hard
  tricot study effects cases/unit_cell_shear.json --only friction --set steps.2.shear.angle_deg=10
  tricot schema > case.schema.json

Exit codes:
  0    done
  1    unexpected failure inside tricot, or a study whose scenes do not show what they should
  2    bad input: command line, case or fabric
  3    a guard stopped the run; results so far stay on disk
  4    a file or folder could not be read or written
  5    this build or machine cannot do it
  6    a GPU failed; results so far stay on disk
  130  interrupted; results so far stay on disk";

#[derive(Subcommand)]
enum Command {
    /// Run a case and write its results.
    Run {
        #[command(flatten)]
        case: CaseArguments,
        /// Folder of the results [default: results/<name of the case>]
        #[arg(short, long, value_name = "DIR")]
        output: Option<PathBuf>,
        /// Scalar type, instead of what the case says
        #[arg(long)]
        precision: Option<Scalar>,
        /// Number of threads [default: all cores]; results do not depend on it
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
        threads: Option<u16>,
        /// What runs the scene; auto takes a discrete GPU if there is one
        #[arg(long, default_value = "auto")]
        backend: Machine,
        /// Part of the name of the adapter, for a machine with several (see `tricot devices`)
        #[arg(long, value_name = "NAME", default_value = "", hide_default_value = true)]
        adapter: String,
        /// Use a folder that holds results: they are moved to DIR/previous-N
        #[arg(long)]
        force: bool,
        /// Go on from the last checkpoint in the folder of the results, to the same bits as without the stop
        #[arg(long, conflicts_with_all = ["force", "from"])]
        resume: bool,
        /// Start from a checkpoint that another run left at the end of a load step: DIR/state/STEP-N-NAME.state
        #[arg(long, value_name = "STATE")]
        from: Option<PathBuf>,
        /// No progress bar
        #[arg(short, long)]
        quiet: bool,
    },
    /// Build the mesh of a case and write it, without running it.
    Mesh {
        #[command(flatten)]
        case: CaseArguments,
        /// Folder of the mesh [default: results/<name of the case>-mesh]
        #[arg(short, long, value_name = "DIR")]
        output: Option<PathBuf>,
        /// Use a folder that holds results: they are moved to DIR/previous-N
        #[arg(long)]
        force: bool,
    },
    /// Check a case without running it.
    Check {
        #[command(flatten)]
        case: CaseArguments,
        /// Also print what called for each effect and what it costs, every stage of the algorithm, and the defaults in use
        #[arg(long)]
        explain: bool,
    },
    /// Print the JSON Schema of a case: every field, its meaning, unit, range and default.
    Schema {
        /// That of a fabric file instead
        #[arg(long)]
        fabric: bool,
    },
    /// List the adapters that --backend gpu can use, with their limits.
    Devices,
    /// Put the results of a run on one page of HTML that stands by itself.
    Report {
        /// Folder of a run
        #[arg(value_name = "DIR")]
        source: PathBuf,
        /// The page [default: report.html in the folder]
        #[arg(short, long, value_name = "FILE")]
        output: Option<PathBuf>,
    },
    /// Say how the results of a run differ from those of another: curves, numbers, and what was run.
    Compare {
        /// Folder of a run
        #[arg(value_name = "A")]
        a: PathBuf,
        /// Folder of the run that differences are relative to
        #[arg(value_name = "B")]
        b: PathBuf,
        /// Also write the numbers to a table
        #[arg(short, long, value_name = "FILE")]
        output: Option<PathBuf>,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// Run many cases and put them into one table.
    Study {
        #[command(subcommand)]
        study: StudyCommand,
    },
    /// Draw a frame as PNG.
    Picture {
        /// Folder of a run (its last frame is drawn), or a frame (.vtu)
        #[arg(value_name = "DIR_OR_FRAME")]
        source: PathBuf,
        /// Frame of the folder: its number, or what stands behind the number in its name, as 25deg [default: the last one]
        #[arg(long, value_name = "FRAME")]
        frame: Option<String>,
        /// Field that colours the surface, a vector with its component (NAME.x, .y, .z or .length) [default: the bodies]
        #[arg(long, value_name = "NAME")]
        field: Option<String>,
        /// Values at both ends of the colours [default: those of the frame]
        #[arg(long, value_name = "LOW,HIGH", value_parser = ends, allow_hyphen_values = true, requires = "field")]
        range: Option<[f64; 2]>,
        /// Width of the picture in pixels
        #[arg(long, default_value_t = 1600, value_parser = clap::value_parser!(u16).range(300..=6000))]
        width: u16,
        /// The picture [default: picture.png in the folder, or beside the frame under its name]
        #[arg(short, long, value_name = "FILE")]
        output: Option<PathBuf>,
    },
}

#[derive(Subcommand)]
enum StudyCommand {
    /// Measure what accuracy costs in time: turn each numerical knob of a case, and compare with a much finer run.
    Accuracy {
        #[command(flatten)]
        case: CaseArguments,
        /// Folder of the study [default: results/<name of the case>-accuracy]
        #[arg(short, long, value_name = "DIR")]
        output: Option<PathBuf>,
        /// Only points with one of these words in their name, e.g. mesh,beams,f64
        #[arg(long, value_name = "WORDS", value_delimiter = ',')]
        points: Vec<String>,
        /// What runs the points
        #[arg(long, default_value = "auto")]
        backend: Machine,
        /// Number of threads [default: all cores]
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
        threads: Option<u16>,
        /// No progress bar
        #[arg(short, long)]
        quiet: bool,
    },
    /// Run every case of a folder to its end, and say which do not show what their `expect` says.
    Stability {
        /// Folder of cases
        #[arg(value_name = "FOLDER", default_value = "cases/hard")]
        folder: PathBuf,
        /// What runs the scenes: cpu in f32 and f64, gpu, or auto for both as far as they are there
        #[arg(long, default_value = "auto")]
        backend: Machine,
        /// Leave every scene after so many steps, for a device in software [default: none]
        #[arg(long, value_name = "STEPS", value_parser = clap::value_parser!(u64).range(1..))]
        longest: Option<u64>,
        /// The table
        #[arg(short, long, value_name = "FILE", default_value = "results/stability.csv")]
        output: PathBuf,
    },
    /// Turn each effect of a case off in turn: what it costs, and what it changes.
    Effects {
        #[command(flatten)]
        case: CaseArguments,
        /// Turn off only this effect, by its name in `tricot check CASE`; may be repeated
        #[arg(long, value_name = "EFFECT")]
        only: Vec<String>,
        /// Scalar type, instead of what the case says
        #[arg(long)]
        precision: Option<Scalar>,
        /// Number of threads [default: all cores]
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
        threads: Option<u16>,
        /// What runs the scenes
        #[arg(long, default_value = "auto")]
        backend: Machine,
        /// The table [default: results/<name of the case>-effects.csv]; the runs go into the folder of this name without suffix
        #[arg(short, long, value_name = "FILE")]
        output: Option<PathBuf>,
        /// Use a folder that holds runs: each is moved aside
        #[arg(long)]
        force: bool,
    },
    /// Measure the limit of the time step on the way through a case, in f64, beside the estimate that a run follows.
    Step {
        #[command(flatten)]
        case: CaseArguments,
        /// Shear between two states, degrees; the end of every load step is one too
        #[arg(long, value_name = "DEGREES", default_value_t = 15.0)]
        every: f64,
        /// Also try fixed steps at the end of the first load step, to find the longest that lasts
        #[arg(long)]
        confirm: bool,
    },
}

#[derive(clap::Args)]
struct CaseArguments {
    /// The case, a JSON file
    #[arg(value_name = "CASE")]
    case: PathBuf,
    /// Change a value of the case or its fabric; may be repeated, e.g. fabric.stitch.thermal_strain=-0.1
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<String>,
}

impl CaseArguments {
    fn read(&self) -> Result<Loaded> {
        read(&self.case, &self.set)
    }
}

/// Two numbers with a comma between them.
fn ends(text: &str) -> std::result::Result<[f64; 2], String> {
    let numbers = text.split(',').map(|number| number.trim().parse().ok()).collect::<Option<Vec<f64>>>();
    numbers.and_then(|numbers| numbers.try_into().ok()).ok_or_else(|| "give two numbers, as 0,0.4".into())
}

#[derive(Clone, Copy, ValueEnum)]
enum Scalar {
    F32,
    F64,
}

#[derive(Clone, Copy, ValueEnum)]
enum Machine {
    Auto,
    Cpu,
    Gpu,
}

impl From<Machine> for run::Machine {
    fn from(machine: Machine) -> Self {
        match machine {
            Machine::Auto => Self::Auto,
            Machine::Cpu => Self::Cpu,
            Machine::Gpu => Self::Gpu,
        }
    }
}

impl From<Scalar> for Precision {
    fn from(scalar: Scalar) -> Self {
        match scalar {
            Scalar::F32 => Self::F32,
            Scalar::F64 => Self::F64,
        }
    }
}

/// What a command leaves for the terminal.
struct Done {
    text: String,
    code: u8,
}

fn main() -> ExitCode {
    // Mesa's layer that chooses a default device for windows complains on stderr where there are none; tricot opens none.
    // SAFETY: no other thread runs yet.
    unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) if !error.use_stderr() || error.kind() == DisplayHelpOnMissingArgumentOrSubcommand => {
            return finish(&error.to_string(), 0);
        }
        Err(error) => return fail(&usage(&error), BAD_INPUT),
    };
    std::panic::set_hook(Box::new(|panic| {
        _ = fail(&format!("unexpected failure, please report it with the case: {panic}"), UNEXPECTED);
    }));
    match std::panic::catch_unwind(|| perform(arguments.command)) {
        Ok(Ok(Done { text, code })) => finish(&text, code),
        Ok(Err(error)) => fail(&error.to_string(), error.exit_code()),
        Err(_) => ExitCode::from(UNEXPECTED),
    }
}

fn perform(command: Command) -> Result<Done> {
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

/// The default folder of results of a case, with something behind its name.
fn beside(case: &Path, what: &str) -> PathBuf {
    let mut dir = directory::default(case).into_os_string();
    dir.push(what);
    dir.into()
}

fn picture_path(source: &Path) -> PathBuf {
    if source.is_dir() { source.join("picture.png") } else { source.with_extension("png") }
}

/// The first paragraph of a message about the command line, on one line.
fn usage(error: &clap::Error) -> String {
    let text = error.to_string();
    let first: Vec<&str> = text.lines().take_while(|l| !l.is_empty()).map(str::trim).collect();
    let tip = text.lines().find_map(|line| line.trim().strip_prefix("tip: "));
    let tip = tip.map_or(String::new(), |tip| format!("; {tip}"));
    format!("{}{tip} (try --help)", first.join(" ").trim_start_matches("error: "))
}

/// Prints to stdout; a reader that has gone away is no failure.
fn finish(text: &str, code: u8) -> ExitCode {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{}", text.trim_end()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            fail(&format!("standard output: {error}"), Error::file("", "").exit_code())
        }
        _ => ExitCode::from(code),
    }
}

/// Prints one line to stderr.
fn fail(message: &str, code: u8) -> ExitCode {
    let line: String = message.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    // Nothing is left to do when even this cannot be written.
    _ = writeln!(std::io::stderr(), "error: {line}");
    ExitCode::from(code)
}
