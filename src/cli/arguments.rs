//! The command-line arguments of the program.

use clap::{Parser, Subcommand, ValueEnum};
use std::path::PathBuf;
use tricot::error::Result;
use tricot::rigs::read::{Loaded, read};
use tricot::run;
use tricot::settings::integration::Precision;
use tricot::study::characterise;

/// Explicit finite elements for dry stitched non-crimp fabrics at the scale of their yarns.
#[derive(Parser)]
#[command(version, max_term_width = 100, after_help = AFTER)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
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
  tricot characterise cases/fabrics/px35.json
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
pub enum Command {
    /// Run a case and write its results.
    Run {
        #[command(flatten)]
        case: CaseArguments,
        /// Results folder [default: results/<name of the case>]
        #[arg(short, long, value_name = "DIR")]
        output: Option<PathBuf>,
        /// Scalar type, overriding the case
        #[arg(long)]
        precision: Option<Scalar>,
        /// Number of threads [default: all cores]; it does not affect the results
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
        threads: Option<u16>,
        /// Machine that runs the scene; auto takes a discrete GPU if there is one
        #[arg(long, default_value = "auto")]
        backend: Machine,
        /// Part of the name of the adapter, for a machine with several (see `tricot devices`)
        #[arg(long, value_name = "NAME", default_value = "", hide_default_value = true)]
        adapter: String,
        /// Use a folder that already holds results: they are moved to DIR/previous-N
        #[arg(long)]
        force: bool,
        /// Resume from the last checkpoint in the results folder; the results have the same bits as without the stop
        #[arg(long, conflicts_with_all = ["force", "from"])]
        resume: bool,
        /// Start from a checkpoint that another run left at the end of a load step: DIR/state/STEP-N-NAME.state
        #[arg(long, value_name = "STATE")]
        from: Option<PathBuf>,
        /// No progress display
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
        /// Use a folder that already holds results: they are moved to DIR/previous-N
        #[arg(long)]
        force: bool,
    },
    /// Check a case without running it.
    Check {
        #[command(flatten)]
        case: CaseArguments,
        /// Also print the cause and cost of each effect, every stage of the algorithm, and the defaults in use
        #[arg(long)]
        explain: bool,
    },
    /// Print the JSON Schema of a case: every field, its meaning, unit, range and default.
    Schema {
        /// Print the schema of a fabric file instead
        #[arg(long)]
        fabric: bool,
    },
    /// List the adapters that --backend gpu can use, with their limits.
    Devices,
    /// Write the results of a run to one self-contained HTML page.
    Report {
        /// Folder of a run
        #[arg(value_name = "DIR")]
        source: PathBuf,
        /// Output file [default: report.html in the folder]
        #[arg(short, long, value_name = "FILE")]
        output: Option<PathBuf>,
    },
    /// Compare two runs: curves, numbers, and input.
    Compare {
        /// Folder of a run
        #[arg(value_name = "A")]
        a: PathBuf,
        /// Folder of the reference run for relative differences
        #[arg(value_name = "B")]
        b: PathBuf,
        /// Also write the numbers to a table
        #[arg(short, long, value_name = "FILE")]
        output: Option<PathBuf>,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// Run the tests that describe a fabric, and put what they give on one page. The same command goes on with tests that were
    /// stopped.
    Characterise {
        /// The fabric, a JSON file
        #[arg(value_name = "FABRIC")]
        fabric: PathBuf,
        /// Change a value of the fabric; may be repeated, e.g. fabric.stitch.thermal_strain=-0.1
        #[arg(long, value_name = "PATH=VALUE")]
        set: Vec<String>,
        /// quick: coarse meshes of the fabric and no specimen; full: the shipped meshes and a small specimen
        #[arg(long, default_value = "quick")]
        preset: Preset,
        /// Run only these tests, e.g. shear,warp-tension
        #[arg(long, value_name = "TESTS", value_delimiter = ',')]
        only: Vec<String>,
        /// Folder of the tests [default: results/<name of the fabric>-characterise]
        #[arg(short, long, value_name = "DIR")]
        output: Option<PathBuf>,
        /// Machine that runs the tests
        #[arg(long, default_value = "auto")]
        backend: Machine,
        /// Number of threads [default: all cores]
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
        threads: Option<u16>,
        /// No progress display
        #[arg(short, long)]
        quiet: bool,
    },
    /// Run many cases and put them into one table.
    Study {
        #[command(subcommand)]
        study: StudyCommand,
    },
    /// Draw a frame as a PNG.
    Picture {
        /// Folder of a run (its last frame is drawn), or a frame (.vtu)
        #[arg(value_name = "DIR_OR_FRAME")]
        source: PathBuf,
        /// Frame of the folder: its number, or the part of its name after the number, such as 25deg [default: the last one]
        #[arg(long, value_name = "FRAME")]
        frame: Option<String>,
        /// Field that colours the surface, a vector with its component (NAME.x, .y, .z or .length) [default: the bodies]
        #[arg(long, value_name = "NAME")]
        field: Option<String>,
        /// Values at both ends of the colour scale [default: the range of the frame]
        #[arg(long, value_name = "LOW,HIGH", value_parser = ends, allow_hyphen_values = true, requires = "field")]
        range: Option<[f64; 2]>,
        /// Width of the picture in pixels
        #[arg(long, default_value_t = 1600, value_parser = clap::value_parser!(u16).range(300..=6000))]
        width: u16,
        /// Output file [default: picture.png in the folder, or next to the frame under its name]
        #[arg(short, long, value_name = "FILE")]
        output: Option<PathBuf>,
    },
}

#[derive(Subcommand)]
pub enum StudyCommand {
    /// Measure the cost of accuracy: vary each numerical parameter of a case, and compare with a much finer run.
    Accuracy {
        #[command(flatten)]
        case: CaseArguments,
        /// Folder of the study [default: results/<name of the case>-accuracy]
        #[arg(short, long, value_name = "DIR")]
        output: Option<PathBuf>,
        /// Run only points whose name contains one of these words, e.g. mesh,beams,f64
        #[arg(long, value_name = "WORDS", value_delimiter = ',')]
        points: Vec<String>,
        /// Machine that runs the points
        #[arg(long, default_value = "auto")]
        backend: Machine,
        /// Number of threads [default: all cores]
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
        threads: Option<u16>,
        /// No progress display
        #[arg(short, long)]
        quiet: bool,
    },
    /// Run every case of a folder to its end, and list those that do not meet their `expect`.
    Stability {
        /// Folder of cases
        #[arg(value_name = "FOLDER", default_value = "cases/hard")]
        folder: PathBuf,
        /// Machine that runs the scenes: cpu in f32 and f64, gpu, or auto for every machine available
        #[arg(long, default_value = "auto")]
        backend: Machine,
        /// Stop every scene after this many steps, for a software device [default: none]
        #[arg(long, value_name = "STEPS", value_parser = clap::value_parser!(u64).range(1..))]
        longest: Option<u64>,
        /// Output table
        #[arg(short, long, value_name = "FILE", default_value = "results/stability.csv")]
        output: PathBuf,
    },
    /// Turn off each effect of a case in turn: measure its cost and its influence.
    Effects {
        #[command(flatten)]
        case: CaseArguments,
        /// Turn off only this effect, by its name in `tricot check CASE`; may be repeated
        #[arg(long, value_name = "EFFECT")]
        only: Vec<String>,
        /// Scalar type, overriding the case
        #[arg(long)]
        precision: Option<Scalar>,
        /// Number of threads [default: all cores]
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
        threads: Option<u16>,
        /// Machine that runs the scenes
        #[arg(long, default_value = "auto")]
        backend: Machine,
        /// Output table [default: results/<name of the case>-effects.csv]; the runs go into the folder of this name without suffix
        #[arg(short, long, value_name = "FILE")]
        output: Option<PathBuf>,
        /// Use a folder that already holds runs: each is moved aside
        #[arg(long)]
        force: bool,
    },
    /// Measure the limit of the time step during a case, in f64, and compare it with the estimate that a run follows.
    Step {
        #[command(flatten)]
        case: CaseArguments,
        /// Shear between two states, degrees; the end of every load step is also a state
        #[arg(long, value_name = "DEGREES", default_value_t = 15.0)]
        every: f64,
        /// Also try fixed steps at the end of the first load step, to find the longest stable one
        #[arg(long)]
        confirm: bool,
    },
}

/// How much time a characterisation takes.
#[derive(Clone, Copy, ValueEnum)]
pub enum Preset {
    Quick,
    Full,
}

impl From<Preset> for characterise::Preset {
    fn from(preset: Preset) -> Self {
        match preset {
            Preset::Quick => Self::Quick,
            Preset::Full => Self::Full,
        }
    }
}

#[derive(clap::Args)]
pub struct CaseArguments {
    /// The case, a JSON file
    #[arg(value_name = "CASE")]
    pub case: PathBuf,
    /// Change a value of the case or its fabric; may be repeated, e.g. fabric.stitch.thermal_strain=-0.1
    #[arg(long, value_name = "PATH=VALUE")]
    pub set: Vec<String>,
}

impl CaseArguments {
    /// # Errors
    /// A case that cannot be read or is not valid.
    pub fn read(&self) -> Result<Loaded> {
        read(&self.case, &self.set)
    }
}

/// Two numbers separated by a comma.
fn ends(text: &str) -> std::result::Result<[f64; 2], String> {
    let numbers = text.split(',').map(|number| number.trim().parse().ok()).collect::<Option<Vec<f64>>>();
    numbers.and_then(|numbers| numbers.try_into().ok()).ok_or_else(|| "give two numbers, as 0,0.4".into())
}

#[derive(Clone, Copy, ValueEnum)]
pub enum Scalar {
    F32,
    F64,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum Machine {
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
