//! One run with its files, from the start or a checkpoint to the end.

use super::grips::Grips;
use super::log::Log;
use super::probes::{self, Probes};
use super::resume::Start;
use super::writer::Writer;
use super::{FINISHED, Options, Outcome, simulation, write_case};
use crate::error::{Error, Result};
use crate::mesh::{Mesh, Ply};
use crate::output::directory;
use crate::output::lock::Lock;
use crate::output::rows::{Contacts, History, Stitches, Yarn, Yarns};
use crate::output::table::{Named, Table};
use crate::rigs;
use crate::rigs::observer::{Observer, Tables};
use crate::rigs::read::Loaded;
use crate::simulate::{BackendConfig, Retries, Simulation};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock};
use std::time::{Duration, Instant, SystemTime};

/// Runs a case and calls `watch` after every row of the tables.
pub(super) fn drive(
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

/// Set by an interrupt, which stops every run of the process. The handler of a process cannot be replaced.
static STOPPED: LazyLock<Arc<AtomicBool>> = LazyLock::new(|| {
    let stopped = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stopped);
    // without a handler an interrupt ends the process by default
    let _ = ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed));
    stopped
});

/// One run with its files.
pub(super) struct Run<'a> {
    pub(super) loaded: &'a Loaded,
    pub(super) options: &'a Options,
    pub(super) simulation: Simulation,
    pub(super) stopped: Arc<AtomicBool>,
    pub(super) history: Table<History>,
    pub(super) energies: Named,
    pub(super) contacts: Table<Contacts>,
    pub(super) yarns: Option<(Table<Yarns>, Table<Yarn>)>,
    pub(super) stitches: Option<Table<Stitches>>,
    pub(super) grips: Option<Grips>,
    pub(super) probes: Option<Probes>,
    /// Measures specific to the rig.
    pub(super) observer: Box<dyn Observer>,
    /// Frames with their times, and pictures: those on disk, followed by those that the writer still has.
    pub(super) frames: Vec<(f64, String)>,
    pub(super) pictures: Vec<String>,
    /// Writes frames, pictures and checkpoints.
    pub(super) writer: Writer,
    /// A copy of the mesh, to share with the writer.
    pub(super) mesh: Arc<Mesh>,
    /// Number of the last load step without load, and the ratio of kinetic to total energy at its end.
    pub(super) rest: Option<(usize, f64)>,
    pub(super) worst_balance: f64,
    pub(super) worst_kinetic: Option<f64>,
    pub(super) largest_added: [f64; 2],
    pub(super) dt_range: [f64; 2],
    pub(super) place: Place,
    /// Rollback states, each with the record of the run.
    pub(super) retries: Retries<Vec<u8>>,
    /// When the next checkpoint is due.
    pub(super) due: Option<Instant>,
    /// Wall time of the runs that this run continues, s.
    pub(super) wall_before: f64,
    pub(super) started: Instant,
    /// Step and wall time, s, at which this process started or resumed the run.
    pub(super) taken_up: (u64, f64),
    pub(super) began: SystemTime,
    /// Progress log, and the time of its last line.
    pub(super) log: Log,
    pub(super) told: Instant,
}

/// Progress of a run: completed load steps, and completed rows of the next one.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Place {
    pub(super) phase: usize,
    pub(super) row: usize,
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
        let energies: Vec<String> = ["time_s", "shear_angle_deg"]
            .into_iter()
            .chain(simulation.energies().columns().map(|(name, _)| name))
            .map(str::to_owned)
            .collect();
        let mesh = simulation.mesh();
        let plies = mesh.blocks.iter().any(|b| b.ply == Ply::Warp) && mesh.blocks.iter().any(|b| b.ply == Ply::Weft);
        let threads = !mesh.threads.is_empty();
        let folder = dir.join("frames");
        std::fs::create_dir_all(&folder).map_err(|e| Error::file(&folder, e))?;
        let tables = Tables { dir: dir.clone(), goes_on };
        Ok(Self {
            loaded,
            options,
            history: tables.open("history.csv")?,
            energies: tables.named("energies.csv", &energies)?,
            contacts: tables.open("contacts.csv")?,
            yarns: if plies { Some((tables.open("yarns.csv")?, tables.open("yarns_each.csv")?)) } else { None },
            stitches: if threads { Some(tables.open("stitches.csv")?) } else { None },
            grips: Grips::of(&simulation, &tables)?,
            probes: Probes::of(&loaded.case.output.probes, mesh, &tables)?,
            observer: rigs::of(&loaded.case.domain).observer(&loaded.case, &simulation, &tables)?,
            retries: Retries::of(&simulation),
            writer: Writer::default(),
            mesh: Arc::new(mesh.clone()),
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

    /// Runs the rest of the case. After a guard stops it, the run rolls back to an earlier state with shorter steps if the case
    /// allows.
    fn go(&mut self, watch: &mut dyn FnMut() -> Duration) -> Result<()> {
        loop {
            match self.load_steps(watch) {
                Err(Error::Guard(guard)) => self.go_back(guard)?,
                result => return result,
            }
        }
    }

    /// Writes the summary and the closing lines, however the run ended.
    fn finish(mut self, result: Result<()>) -> Result<Outcome> {
        let interrupted = self.stopped.load(Ordering::Relaxed);
        // a file that could not be written was due before whatever else ended the run
        let result = self.writer.wait().and(result);
        if matches!(result, Err(Error::Guard(_))) {
            // shows the scene where it failed; a failure to write must not hide the guard
            let _ = self.write_frame("stopped").and_then(|()| self.writer.wait());
        }
        if result.is_err() {
            self.list_what_is_there();
        }
        let verdict = match &result {
            Ok(()) if interrupted => "interrupted".to_owned(),
            Ok(()) => FINISHED.to_owned(),
            Err(error) => error.to_string(),
        };
        self.log.add(&format!("step {}: {verdict}", self.simulation.step()));
        let written = self.write_summary(&verdict);
        // the cause of the stop is the error to report, even if the summary cannot be written
        result?;
        written?;
        Ok(Outcome { interrupted, text: self.lines(&verdict) })
    }
}
