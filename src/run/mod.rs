//! Case in, results out: owns the plan, the backend, the schedule, the measures and the outputs of one run.

mod check;
pub mod clock;
mod devices;
pub mod effects;
mod grips;
pub mod interleaved_timing;
mod log;
mod mesh;
mod notes;
mod picture;
mod probes;
mod report;
mod resume;
mod rows;
mod summary;

pub use check::check;
pub use devices::devices;
pub use mesh::mesh;
pub use picture::picture;
pub use report::report;
pub use resume::may_differ;

use crate::backend::gpu::{self, Device};
use crate::case::Case;
use crate::error::{Error, Result};
use crate::mesh::Ply;
use crate::output::checkpoint::Checkpoint;
use crate::output::lock::Lock;
use crate::output::table::{CONTACTS, HISTORY, STITCHES, Table, YARNS, YARNS_EACH};
use crate::output::{directory, file, vtu};
use crate::rigs;
use crate::rigs::observer::{Observer, Tables};
use crate::rigs::read::Loaded;
use crate::settings::integration::Precision;
use crate::settings::steps::Step;
use crate::simulate::{BackendConfig, Retries, Simulation};
use grips::Grips;
use indicatif::{HumanDuration, ProgressBar, ProgressStyle};
use log::Log;
use picture::draw;
use probes::Probes;
use resume::Start;
use std::fmt;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock};
use std::time::{Duration, Instant, SystemTime};

/// The case in a folder of results, with every default written out.
pub const CASE: &str = "case.json";

/// The verdict of a run that has come to its end.
const FINISHED: &str = "finished";

/// What the command line says about a run, beyond the case.
#[derive(Debug, Clone)]
pub struct Options {
    /// Folder of the results.
    pub output: PathBuf,
    /// Scalar type; `None` as the case says.
    pub precision: Option<Precision>,
    /// Number of threads; `None` for all cores.
    pub threads: Option<usize>,
    /// What the scene runs on.
    pub machine: Machine,
    /// Part of the name of the adapter; empty for any.
    pub adapter: String,
    /// Move earlier results in the folder aside.
    pub force: bool,
    /// Go on from the last checkpoint in the folder.
    pub resume: bool,
    /// Start from a checkpoint that another run left at the end of a load step.
    pub from: Option<PathBuf>,
    /// No progress.
    pub quiet: bool,
}

/// What a scene runs on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Machine {
    /// A discrete GPU if there is one and the scene is in f32, else the CPU.
    Auto,
    Cpu,
    Gpu,
}

/// The machine that was asked for, ready to make backends.
///
/// # Errors
/// No such machine here.
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

/// What a run found, in a dozen lines.
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

/// Writes the case, its fabric inline, so that a folder of results can be drawn and run again by itself.
fn write_case(case: &Case, dir: &Path) -> Result<()> {
    file::replace(&dir.join(CASE), |w| serde_json::to_writer_pretty(w, case).map_err(Into::into))
}

/// Prepares a case for running, without files.
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
/// Bad input, a folder that cannot be used, a guard that stopped the run, or a device that failed; what was computed by then
/// stays on disk.
pub fn run(loaded: &Loaded, options: &Options) -> Result<Outcome> {
    run_watched(loaded, options, &mut || Duration::ZERO)
}

/// Runs a case on a machine that is ready, whatever the options say of it.
///
/// # Errors
/// As of [`run`].
pub fn run_on(loaded: &Loaded, options: &Options, config: BackendConfig) -> Result<Outcome> {
    drive(loaded, options, config, &mut || Duration::ZERO)
}

/// Runs a case and calls `watch` behind every row of the tables; the time that it says to have taken does not count.
///
/// # Errors
/// As of [`run`].
pub fn run_watched(loaded: &Loaded, options: &Options, watch: &mut dyn FnMut() -> Duration) -> Result<Outcome> {
    let precision = options.precision.unwrap_or(loaded.case.integration.precision);
    drive(loaded, options, backend_config(precision, options.machine, options.threads, &options.adapter)?, watch)
}

fn drive(
    loaded: &Loaded,
    options: &Options,
    config: BackendConfig,
    watch: &mut dyn FnMut() -> Duration,
) -> Result<Outcome> {
    let mut loaded = loaded.clone();
    loaded.case.integration.precision = config.precision;
    let mut simulation = simulation(&loaded, config)?;
    probes::nodes(&loaded.case.output.probes, simulation.mesh())?;
    let held = if options.resume && options.output.is_dir() { Some(Lock::take(&options.output)?) } else { None };
    let start = Start::of(&loaded.case, options, &mut simulation)?;
    let _held = match start {
        Start::Finished => {
            let text = format!("{} is finished already: nothing is left to do", options.output.display());
            return Ok(Outcome { interrupted: false, text });
        }
        Start::Resumed(_) => held,
        Start::Again => {
            directory::tidy(&options.output, 0)?;
            held
        }
        Start::New | Start::From(_) => {
            drop(held);
            let held = directory::prepare(&options.output, options.force)?;
            write_case(&loaded.case, &options.output)?;
            Some(held)
        }
    };
    let mut run = Run::new(&loaded, options, simulation, Arc::clone(&STOPPED), matches!(start, Start::Resumed(_)))?;
    run.take_up(start)?;
    run.taken_up = (run.simulation.step(), run.wall());
    run.log.add(&format!("step {}: {}", run.simulation.step(), std::env::args().collect::<Vec<_>>().join(" ")));
    let result = run.go(watch);
    run.finish(result)
}

/// Set by an interrupt: every run of the process stops then. The handler of a process cannot be replaced.
static STOPPED: LazyLock<Arc<AtomicBool>> = LazyLock::new(|| {
    let stopped = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stopped);
    // without a handler an interrupt ends the process, as it would end any other
    let _ = ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed));
    stopped
});

/// One run with its files.
struct Run<'a> {
    loaded: &'a Loaded,
    options: &'a Options,
    simulation: Simulation,
    stopped: Arc<AtomicBool>,
    history: Table,
    energies: Table,
    contacts: Table,
    yarns: Option<[Table; 2]>,
    stitches: Option<Table>,
    grips: Option<Grips>,
    probes: Option<Probes>,
    /// What only the rig measures.
    observer: Box<dyn Observer>,
    frames: Vec<(f64, String)>,
    pictures: Vec<String>,
    /// Number of the last load step in which nothing was loaded, and the share of kinetic in all energy at its end.
    rest: Option<(usize, f64)>,
    worst_balance: f64,
    worst_kinetic: Option<f64>,
    largest_added: [f64; 2],
    dt_range: [f64; 2],
    place: Place,
    /// States to go back to, each with the record of the run.
    retries: Retries<Vec<u8>>,
    /// When the next checkpoint is due.
    due: Option<Instant>,
    /// Wall time of the runs that this one goes on from, s.
    wall_before: f64,
    started: Instant,
    /// Step and wall time, s, at which this process took the run up.
    taken_up: (u64, f64),
    began: SystemTime,
    /// Lines about the progress, and when the last one was written.
    log: Log,
    told: Instant,
}

/// How far a run has come: complete load steps, and complete rows of the next one.
#[derive(Debug, Clone, Copy, Default)]
struct Place {
    phase: usize,
    row: usize,
}

/// Shear angles, degrees, or displacements, mm, on a way from one to another where a frame is due: `marks`, whatever their sign. A
/// load step has frames of its own where it starts and ends.
fn places(marks: &[f64], ends: [f64; 2]) -> Vec<f64> {
    /// Rounding of an angle.
    const SAME: f64 = 1e-9;
    let signed = marks.iter().flat_map(|mark| [-mark, *mark]);
    let mut places: Vec<f64> = signed.filter(|place| ends.iter().all(|end| (place - end).abs() > SAME)).collect();
    places.sort_by(|a, b| (a - ends[0]).abs().total_cmp(&(b - ends[0]).abs()));
    places.dedup();
    places
}

impl<'a> Run<'a> {
    fn new(
        loaded: &'a Loaded,
        options: &'a Options,
        simulation: Simulation,
        stopped: Arc<AtomicBool>,
        goes_on: bool,
    ) -> Result<Self> {
        let dir = &options.output;
        let energies: Vec<&str> = ["time_s", "shear_angle_deg"]
            .into_iter()
            .chain(simulation.energies().columns().map(|(name, _)| name))
            .collect();
        let mesh = simulation.mesh();
        let plies = mesh.blocks.iter().any(|b| b.ply == Ply::Warp) && mesh.blocks.iter().any(|b| b.ply == Ply::Weft);
        let threads = !mesh.threads.is_empty();
        let folder = dir.join("frames");
        std::fs::create_dir_all(&folder).map_err(|e| Error::file(&folder, e))?;
        let tables = Tables { dir: dir.clone(), goes_on };
        let table = |name: &str, header: &[&str]| tables.open(name, header);
        Ok(Self {
            loaded,
            options,
            history: table("history.csv", HISTORY)?,
            energies: table("energies.csv", &energies)?,
            contacts: table("contacts.csv", CONTACTS)?,
            yarns: if plies { Some([table("yarns.csv", YARNS)?, table("yarns_each.csv", YARNS_EACH)?]) } else { None },
            stitches: if threads { Some(table("stitches.csv", STITCHES)?) } else { None },
            grips: Grips::of(&simulation, table)?,
            probes: Probes::of(&loaded.case.output.probes, mesh, table)?,
            observer: rigs::of(&loaded.case.domain).observer(&loaded.case, &simulation, &tables)?,
            retries: Retries::of(&simulation),
            simulation,
            stopped,
            frames: Vec::new(),
            pictures: Vec::new(),
            rest: None,
            worst_balance: 0.0,
            worst_kinetic: None,
            largest_added: [0.0; 2],
            dt_range: [f64::INFINITY, 0.0],
            place: Place::default(),
            due: None,
            wall_before: 0.0,
            started: Instant::now(),
            taken_up: (0, 0.0),
            began: SystemTime::now(),
            log: Log::of(dir),
            told: Instant::now(),
        })
    }

    /// Everything that is left of the case, from an earlier state with shorter steps where a guard stops it and the case allows.
    fn go(&mut self, watch: &mut dyn FnMut() -> Duration) -> Result<()> {
        loop {
            match self.load_steps(watch) {
                Err(Error::Guard(guard)) => self.go_back(guard)?,
                result => return result,
            }
        }
    }

    /// All load steps, or those that are left.
    fn load_steps(&mut self, watch: &mut dyn FnMut() -> Duration) -> Result<()> {
        let output = &self.loaded.case.output;
        let phases = self.simulation.schedule.phases().to_vec();
        let bar = self.bar();
        self.keep();
        self.simulation.advance(0.0, |_| false)?;
        if self.frames.is_empty() {
            self.write_frame("start")?;
            self.save(None)?;
        }
        self.wait();
        for (number, (phase, step)) in phases.iter().zip(&self.loaded.case.steps).enumerate().skip(self.place.phase) {
            let (marks, unit, reach) = match step {
                Step::Shear { .. } => (output.frames_at_deg.clone(), "deg", 1.0),
                Step::Move { .. } => (output.frames_at_mm.clone(), "mm", self.simulation.scene.reach()),
                _ => (Vec::new(), "", 1.0),
            };
            let rows = output.rows_per_step.max(1);
            let time = |row: usize| phase.start + (phase.end - phase.start) * row as f64 / rows as f64;
            let schedule = self.simulation.schedule.clone();
            // of angle and displacement one does not change on the way
            let way = |row: usize| {
                let load = schedule.load(time(row));
                load.angle.to_degrees() + load.motion * reach
            };
            let places = places(&marks, [way(0), way(rows)]);
            for row in self.place.row + 1..=rows {
                let steps = self.simulation.step();
                let arrived = self.reach(time(row))?;
                // where there are more rows than time steps
                if self.simulation.step() > steps {
                    self.write_row(phase.name)?;
                }
                self.started += watch();
                self.tell(&bar, phase.name);
                let [from, to] = [way(row - 1), way(row)];
                for place in places.iter().filter(|place| (*place - from) * (*place - to) < 0.0 || **place == to) {
                    self.write_frame(&format!("{place}{unit}"))?;
                }
                if output.frames_per_step > 0
                    && row < rows
                    && row * output.frames_per_step / rows != (row - 1) * output.frames_per_step / rows
                {
                    self.write_frame(&format!("{}-{}-{row}", number + 1, phase.name))?;
                }
                self.place.row = row;
                let stopped = self.stopped.load(Ordering::Relaxed);
                if arrived {
                    self.keep();
                }
                if arrived && (stopped || self.is_due()) {
                    self.save(None)?;
                }
                if stopped {
                    bar.finish_and_clear();
                    return self.write_frame("interrupted");
                }
            }
            self.observer.end_of_step(&self.simulation, step)?;
            if matches!(step, Step::Settle { .. } | Step::Hold { .. }) {
                let e = self.simulation.energies();
                let all = e.kinetic_total + e.internal() + e.contact;
                self.rest = Some((number, if all > 0.0 { e.kinetic_total / all } else { 0.0 }));
            }
            let name = format!("{}-{}", number + 1, phase.name);
            self.write_frame(&name)?;
            self.place = Place { phase: number + 1, ..Place::default() };
            self.save(Some(&name))?;
        }
        bar.finish_and_clear();
        Ok(())
    }

    /// Goes on to a time, with checkpoints on the way; false if the user stopped it before.
    fn reach(&mut self, until: f64) -> Result<bool> {
        loop {
            let (stopped, due) = (Arc::clone(&self.stopped), self.due);
            let pause =
                |_: &Simulation| stopped.load(Ordering::Relaxed) || due.is_some_and(|due| Instant::now() >= due);
            self.simulation.advance(until, pause)?;
            if self.simulation.time() >= until * (1.0 - 1e-12) {
                return Ok(true);
            }
            self.save(None)?;
            if self.stopped.load(Ordering::Relaxed) {
                return Ok(false);
            }
        }
    }

    fn bar(&self) -> ProgressBar {
        if self.options.quiet {
            return ProgressBar::hidden();
        }
        let style = ProgressStyle::with_template("{bar:24} {percent:>3}% {elapsed} {msg}");
        ProgressBar::new(1_000_000).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
    }

    /// Shows how far the run is: on a bar, or without a terminal by a line a minute, which is in `run.log` in any case.
    fn tell(&mut self, bar: &ProgressBar, phase: &str) {
        const EVERY: Duration = Duration::from_secs(60);
        let s = &self.simulation;
        let e = s.energies();
        let done = s.time() / s.schedule.end();
        bar.set_position((done * 1e6) as u64);
        // by steps of the present length: how fast the load moves differs from step to step
        let steps = (s.schedule.end() - s.time()) / s.dt();
        let each = (self.wall() - self.taken_up.1) / s.step().saturating_sub(self.taken_up.0).max(1) as f64;
        let left = HumanDuration(Duration::from_secs_f64((steps * each).clamp(0.0, 1e8)));
        let load = s.load();
        let loaded = match s.mesh().period {
            Some(_) => format!("γ {:.1}°", load.angle.to_degrees()),
            None => format!("d {:.2} mm", s.displacement()),
        };
        let message = format!(
            "{left} left: {phase} {loaded} step {} dt {:.2e} s, internal {:.3e} mJ, kinetic {:.1e} mJ, balance {:+.2} %",
            s.step(),
            s.dt(),
            e.internal(),
            e.kinetic,
            100.0 * s.health().balance
        );
        if self.told.elapsed() >= EVERY {
            self.told = Instant::now();
            let line = format!("{:.1} %, {:.0} s, {message}", 100.0 * done, self.wall());
            self.log.add(&line);
            if bar.is_hidden() && !self.options.quiet {
                // a reader that has gone away does not stop a run
                let _ = writeln!(std::io::stderr(), "{line}");
            }
        }
        bar.set_message(message);
    }

    /// A frame for ParaView, and a picture of it.
    fn write_frame(&mut self, name: &str) -> Result<()> {
        let s = &self.simulation;
        let mut frame = s.frame();
        s.alive()?;
        let dir = &self.options.output;
        let name = format!("{:04}-{name}", self.frames.len());
        self.observer.frame(s, &mut frame, dir, &name)?;
        let file = format!("frames/{name}.vtu");
        vtu::write(s.mesh(), &frame, &dir.join(&file))?;
        self.frames.push((frame.time, file));
        vtu::write_collection(&dir.join("run.pvd"), &self.frames)?;
        if self.loaded.case.output.pictures {
            let file = format!("{name}.png");
            draw(s.mesh(), &frame, &self.loaded.case.title, 1200, &dir.join(&file))?;
            self.pictures.push(file);
        }
        Ok(())
    }

    /// Summary and the last lines, whatever the end was.
    fn finish(mut self, result: Result<()>) -> Result<Outcome> {
        let interrupted = self.stopped.load(Ordering::Relaxed);
        if matches!(result, Err(Error::Guard(_))) {
            // what the scene looks like where it went wrong; a failure to write must not hide the guard
            let _ = self.write_frame("stopped");
        }
        let verdict = match &result {
            Ok(()) if interrupted => "interrupted".to_owned(),
            Ok(()) => FINISHED.to_owned(),
            Err(error) => error.to_string(),
        };
        self.log.add(&format!("step {}: {verdict}", self.simulation.step()));
        let written = self.write_summary(&verdict);
        // what stopped the run is the error to report, even if it keeps the summary from being written too
        result?;
        written?;
        Ok(Outcome { interrupted, text: self.lines(&verdict) })
    }
}
