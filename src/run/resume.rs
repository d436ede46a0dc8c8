//! Checkpoints of a run: when they are written, and how a run resumes from one.

use super::session::{Place, Run};
use super::{CASE, FINISHED, Options};
use crate::case::{Case, parse};
use crate::error::{Error, Guard, Result};
use crate::kernel::record::{Record, Recorded};
use crate::output::appended::Appended;
use crate::output::checkpoint::{self, Checkpoint};
use crate::output::columns::Columns;
use crate::output::directory;
use crate::simulate::Simulation;
use serde_json::Value;
use std::path::Path;
use std::time::{Duration, Instant};

/// Where a run begins.
pub(super) enum Start {
    /// At rest.
    New,
    /// At rest, in a folder where this run stopped before its first checkpoint.
    Again,
    /// Not at all: this run is finished.
    Finished,
    /// After this number of load steps of another run.
    From(usize),
    /// At the last checkpoint of this run; holds the record of the run.
    Resumed(Vec<u8>),
}

impl Start {
    /// Determines the requested start and brings the simulation into that state. Nothing on disk is changed.
    pub(super) fn of(case: &Case, options: &Options, simulation: &mut Simulation) -> Result<Self> {
        let path = match &options.from {
            Some(path) => path.clone(),
            None if options.resume => match checkpoint::latest(&options.output)? {
                Some(path) => path,
                None => return without_checkpoint(case, &options.output),
            },
            None => return Ok(Self::New),
        };
        let Checkpoint { header, records: [host, run], buffers } = Checkpoint::read(&path)?;
        let here = value(case)?;
        let phases = header.phases;
        let free = |place: &str| options.from.is_some() && may_differ(place, phases);
        if let Some(difference) = checkpoint::difference(&here, &header.case, &free) {
            let message = format!("belongs to another case: {difference}");
            return Err(Error::file(&path, message));
        }
        simulation.restore(host, &header.buffers, &buffers).map_err(|e| Error::file(&path, e))?;
        if !options.resume {
            if !header.end_of_step {
                let message = "is from the midst of a load step: --from needs one from its end (STEP-N-NAME.state)";
                return Err(Error::file(&path, message));
            }
            if phases >= case.steps.len() {
                let message = format!("the case has {} load steps, and this state is behind all of them", phases);
                return Err(Error::file(&path, message));
            }
            return Ok(Self::From(phases));
        }
        let is_complete = header.end_of_step && phases == case.steps.len();
        Ok(if is_complete && verdict(&options.output)? == FINISHED { Self::Finished } else { Self::Resumed(run) })
    }
}

/// Start of a run that is to resume but has no checkpoint.
fn without_checkpoint(case: &Case, dir: &Path) -> Result<Start> {
    let known = dir.join(CASE);
    if !known.is_file() {
        // foreign files are detected when the folder is prepared
        return Ok(Start::New);
    }
    let history = dir.join("history.csv");
    let rows = if history.is_file() { Columns::read(&history)?.len() } else { 0 };
    if rows > 0 {
        let message =
            "there is no checkpoint in state/, but there are rows: start anew with --force, which moves them aside";
        return Err(Error::file(dir, message));
    }
    let there = parse::file(&known)?;
    match checkpoint::difference(&value(case)?, &there, &|_| false) {
        Some(difference) => Err(Error::file(&known, format!("belongs to another case: {difference}"))),
        None => Ok(Start::Again),
    }
}

/// The final verdict in the summary of a folder; empty if there is no summary.
fn verdict(dir: &Path) -> Result<String> {
    let path = dir.join("summary.json");
    if !path.is_file() {
        return Ok(String::new());
    }
    Ok(parse::file(&path)?["verdict"].as_str().unwrap_or_default().to_owned())
}

/// Whether a field of the case may differ between a run and another run that starts from its state after `phases` load steps:
/// names, outputs, later steps, and time integration, except settings that fix the bits of the state and its energy.
pub fn may_differ(place: &str, phases: usize) -> bool {
    let later = |n: &str| n.parse::<usize>().is_ok_and(|n| n >= phases);
    match place.split_once('.') {
        None => matches!(place, "title" | "accuracy" | "output"),
        Some(("steps", n)) => later(n),
        Some(("integration", name)) => !matches!(name, "precision" | "perturbation_mm" | "hexahedra" | "hourglass"),
        Some(_) => false,
    }
}

fn value(case: &Case) -> Result<Value> {
    serde_json::to_value(case).map_err(|e| Error::case("case", e.to_string()))
}

impl Recorded for Place {
    fn record(&mut self, record: &mut Record) {
        let Self { phase, row } = self;
        [phase, row].into_iter().for_each(|n| n.record(record));
    }
}

impl Run<'_> {
    /// The state of a run beyond its simulation; `lengths` are the lengths of its tables, in order.
    fn record(&mut self, lengths: &mut Vec<u64>, record: &mut Record) {
        lengths.record(record);
        self.place.record(record);
        self.frames.record(record);
        self.pictures.record(record);
        self.observer.record(record);
        self.rest.record(record);
        self.worst_balance.record(record);
        self.worst_kinetic.record(record);
        self.largest_added.record(record);
        self.dt_range.record(record);
        let mut wall = self.wall();
        wall.record(record);
        (self.wall_before, self.started) = (wall, Instant::now());
    }

    /// Files of the tables, always in the same order.
    fn tables(&mut self) -> Vec<&mut Appended> {
        let tables = [&mut self.history.file, &mut self.energies.file, &mut self.contacts.file];
        let grips = self.grips.iter_mut().flat_map(|grips| grips.tables());
        let probes = self.probes.iter_mut().map(|probes| &mut probes.table.file);
        let yarns = self.yarns.iter_mut().flat_map(|(plies, each)| [&mut plies.file, &mut each.file]);
        tables
            .into_iter()
            .chain(grips)
            .chain(probes)
            .chain(yarns)
            .chain(self.stitches.iter_mut().map(|table| &mut table.file))
            .chain(self.observer.tables())
            .collect()
    }

    /// Begins as `start` says: the simulation is already in that state; tables and frames follow.
    pub(super) fn take_up(&mut self, start: Start) -> Result<()> {
        match start {
            Start::New | Start::Again | Start::Finished => {}
            Start::From(phases) => {
                self.place.phase = phases;
                self.observer.start(&self.simulation, &self.loaded.case.steps[..phases])?;
            }
            Start::Resumed(own) => {
                let mut lengths = Vec::new();
                let mut record = Record::read(own);
                self.record(&mut lengths, &mut record);
                self.retries.record(&mut record, |own, record| record.bytes(own));
                let tables = self.tables();
                if !record.complete() || lengths.len() != tables.len() {
                    return Err(Error::file(&self.options.output, "its checkpoint was written for other tables"));
                }
                for (table, len) in tables.iter().zip(&lengths) {
                    table.check_length(*len)?;
                }
                let (case, Place { phase, row, .. }) = (&self.loaded.case, self.place);
                if phase > case.steps.len() || row > case.output.rows_per_step {
                    let message =
                        format!("its checkpoint is at row {row} behind load step {phase}, which is in no run");
                    return Err(Error::file(&self.options.output, message));
                }
                self.cut(&lengths)?;
            }
        }
        Ok(())
    }

    /// Gives a checkpoint to the writer if the case wants checkpoints; `end` names the completed load step.
    pub(super) fn save(&mut self, end: Option<&str>) -> Result<()> {
        if self.loaded.case.output.checkpoint_wall_s.is_none() {
            return Ok(());
        }
        let lengths = self.tables().into_iter().map(Appended::settled).collect::<Result<Vec<u64>>>()?;
        self.write_state(lengths, end)
    }

    /// Gives the writer a checkpoint of a run whose tables have these lengths.
    fn write_state(&mut self, mut lengths: Vec<u64>, end: Option<&str>) -> Result<()> {
        let mut record = Record::new();
        self.record(&mut lengths, &mut record);
        self.retries.record(&mut record, |own, record| record.bytes(own));
        let (host, buffers) = self.simulation.snapshot();
        self.simulation.alive()?;
        let case = value(&self.loaded.case)?;
        let at = (self.simulation.step(), self.place.phase);
        let checkpoint = Checkpoint::new(case, at, [host, record.into_bytes()], buffers);
        let (dir, end) = (self.options.output.clone(), end.map(str::to_owned));
        self.writer.add(move || checkpoint.write(&dir, end.as_deref()))?;
        self.wait();
        Ok(())
    }

    /// Keeps the current state for a rollback if one is due.
    pub(super) fn keep(&mut self) {
        if self.retries.due(&self.simulation) {
            let mut lengths = self.tables().into_iter().map(|table| table.written()).collect();
            let mut record = Record::new();
            self.record(&mut lengths, &mut record);
            self.retries.keep(&mut self.simulation, record.into_bytes());
        }
    }

    /// Rollback: returns to an earlier state with its tables and frames after a guard stopped the run. Even if the process is
    /// killed meanwhile, the last checkpoint and the tables are consistent.
    pub(super) fn go_back(&mut self, guard: Guard) -> Result<()> {
        // nothing is written while files are removed
        self.writer.wait()?;
        let wall = self.wall();
        let said = guard.to_string();
        let own = self.retries.go_back(&mut self.simulation, guard)?;
        let mut lengths = Vec::new();
        self.record(&mut lengths, &mut Record::read(own));
        self.wall_before = wall;
        self.log.add(&format!("{said}; back to step {} with shorter steps", self.simulation.step()));
        self.bar().println(format!("{said}; back to step {} with shorter steps", self.simulation.step()));
        if self.loaded.case.output.checkpoint_wall_s.is_some() {
            self.write_state(lengths.clone(), None)?;
            self.writer.wait()?;
            checkpoint::remove_after(&self.options.output, self.simulation.step())?;
        }
        self.cut(&lengths)
    }

    /// Removes the rows and frames written after the state from which the run continues.
    fn cut(&mut self, lengths: &[u64]) -> Result<()> {
        self.tables().into_iter().zip(lengths).try_for_each(|(table, len)| table.cut(*len))?;
        directory::tidy(&self.options.output, self.frames.len())
    }

    /// Sets when the next checkpoint is due.
    pub(super) fn wait(&mut self) {
        let interval = self.loaded.case.output.checkpoint_wall_s;
        self.due = interval.map(|seconds| Instant::now() + Duration::from_secs_f64(seconds));
    }

    pub(super) fn is_due(&self) -> bool {
        self.due.is_some_and(|due| Instant::now() >= due)
    }

    /// Wall time so far, s, including the runs that this run continues.
    pub(super) fn wall(&self) -> f64 {
        self.wall_before + self.started.elapsed().as_secs_f64()
    }
}
