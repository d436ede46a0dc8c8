//! The points of a study: the case of each, the place of its results, and how it is run or found again.

use super::Options;
use super::stopwatch::{Clocks, Stopwatch};
use super::variations::{CHANCE, Flags, PLACES, REFERENCE, Variation, chosen};
use crate::backend::gpu;
use crate::case::differences::differences;
use crate::case::parse;
use crate::error::{Error, Result};
use crate::output::checkpoint::FOLDER;
use crate::output::file;
use crate::rigs::read::{Loaded, read};
use crate::run::{self, CASE, Machine};
use crate::settings::integration::Precision;
use crate::settings::steps::Step;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// File that a run leaves beside its results.
const RAN: &str = "point.json";
/// Overrides that turn off outputs no point needs.
const OUTPUTS: [&str; 4] =
    ["output.pictures=false", "output.frames_at_deg=[]", "output.frames_per_step=0", "output.checkpoint_wall_s=null"];
/// Checkpoints at the ends of load steps only, for the case itself.
const STATES: &str = "output.checkpoint_wall_s=1e6";

/// Purpose of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The case as it is.
    Default,
    /// The case again, with its own random perturbation.
    Chance,
    /// The case with nodes at other places.
    Places,
    Reference,
    /// A check that the reference has converged.
    Check,
    /// One knob turned.
    Turned,
}

/// A point of the study.
#[derive(Debug, Clone)]
pub struct Point {
    pub role: Role,
    pub knob: &'static str,
    pub label: &'static str,
    flags: Flags,
}

impl Point {
    /// Whether its knob is the number of threads or the device.
    fn has_own_machine(&self) -> bool {
        self.flags.threads.is_some() || self.flags.cpu
    }

    /// Its folder among those of the points.
    pub fn folder(&self) -> String {
        let letters = self.label.chars().map(|c| match c {
            'β' => 'b',
            c if c.is_ascii_alphanumeric() || c == '.' => c.to_ascii_lowercase(),
            _ => '-',
        });
        let name: String = letters.collect();
        name.split('-').filter(|part| !part.is_empty()).collect::<Vec<_>>().join("-")
    }
}

/// Outcome of the run of a point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ran {
    /// `finished`, the cause of the guard that stopped it, or `impossible`.
    pub ended: String,
    /// Message of the guard, or why the case is impossible.
    pub message: String,
    /// Options of `tricot run` after the name of the case, besides those of the study.
    pub flags: String,
    /// Machine of the study.
    pub base: String,
    /// Time without that of the stopwatch, s.
    pub seconds: Clocks,
    /// The same in steps of the stopwatch's scene, in total and until the end of tightening.
    pub work: Clocks,
    pub tightening: Clocks,
    /// Whether it runs on the default number of threads and no device, so that processor time measures its cost.
    pub by_processors: bool,
    /// Whether it started from the tightened state of the case.
    pub from_state: bool,
}

/// A study being run.
pub(super) struct Runner<'a> {
    case: &'a Path,
    sets: &'a [String],
    options: &'a Options,
    /// The case with all defaults.
    default: Value,
    /// Load steps before the first shear or move.
    phases: usize,
    /// Whether points run on a GPU unless told otherwise.
    on_gpu: bool,
    stopwatch: Stopwatch,
}

impl<'a> Runner<'a> {
    /// # Errors
    /// A case that cannot be run.
    pub(super) fn new(case: &'a Path, sets: &'a [String], options: &'a Options) -> Result<Self> {
        let loaded = read(case, sets)?;
        let loads = |step: &Step| matches!(step, Step::Shear { .. } | Step::Move { .. });
        let phases = loaded.case.steps.iter().position(loads).unwrap_or(loaded.case.steps.len());
        let stopwatch = Stopwatch::new(case, sets, options.threads)?;
        let on_gpu = match options.machine {
            Machine::Cpu => false,
            Machine::Gpu => true,
            Machine::Auto => gpu::devices().first().is_some_and(|d| d.is_discrete),
        };
        Ok(Self { case, sets, options, default: value(&loaded)?, phases, on_gpu, stopwatch })
    }

    /// The points in running order: those for comparison come first.
    ///
    /// # Errors
    /// A selection that matches no point.
    pub(super) fn points(&self) -> Result<Vec<Point>> {
        let own = Point { role: Role::Default, knob: "default", label: "default", flags: Flags::default() };
        let point = |role: Role, variation: &'static Variation| {
            let flags = variation.flags(&self.default, self.phases)?;
            Some(Point { role, knob: variation.knob, label: variation.label, flags })
        };
        let turned = chosen(&self.options.points)?.into_iter().filter_map(|variation| {
            let role = if variation.knob == REFERENCE.knob { Role::Check } else { Role::Turned };
            point(role, variation)
        });
        let differs = |p: &Point| {
            let same_threads = p.flags.threads.is_some() && p.flags.threads == self.options.threads;
            let same_machine = p.flags.cpu && !self.on_gpu;
            !same_threads && !same_machine
        };
        let mut points = vec![own];
        points.extend(CHANCE.iter().filter_map(|variation| point(Role::Chance, variation)));
        points.extend(PLACES.iter().filter_map(|variation| point(Role::Places, variation)));
        points.extend(point(Role::Reference, &REFERENCE));
        points.extend(turned.filter(differs));
        Ok(points)
    }

    /// Title of the case.
    pub(super) fn title(&self) -> String {
        self.default["title"].as_str().unwrap_or_default().to_owned()
    }

    /// Folder of the results of a point.
    pub(super) fn folder(&self, point: &Point) -> PathBuf {
        self.options.output.join("points").join(point.folder())
    }

    /// Runs a point, or finds it run already; `None` if the user stopped it.
    ///
    /// # Errors
    /// A failure that stops the whole study, such as a full disk. A guard that stops the run is a result.
    pub(super) fn perform(&mut self, point: &Point) -> Result<Option<Ran>> {
        let outputs = OUTPUTS.map(String::from);
        let mut sets = [self.sets, &point.flags.sets, &outputs].concat();
        if point.role == Role::Default {
            sets.push(STATES.into());
        }
        let loaded = match read(self.case, &sets) {
            Err(error) if is_impossible(&error) => return Ok(Some(impossible(&error))),
            loaded => loaded?,
        };
        let from = self.state(point, &loaded)?;
        let flags = self.flags(point, from.as_deref());
        let folder = self.folder(point);
        let base = format!(
            "{:?}, {} threads",
            self.options.machine,
            self.options.threads.map_or("all".into(), |n| n.to_string())
        );
        if let Some(ran) = found(&folder, &loaded)?.filter(|ran| ran.flags == flags && ran.base == base) {
            return Ok(Some(ran));
        }
        let f64_on_gpu = loaded.case.integration.precision == Precision::F64 && self.options.machine == Machine::Gpu;
        let machine = if point.flags.cpu || f64_on_gpu { Machine::Cpu } else { self.options.machine };
        let options = run::Options {
            output: folder.clone(),
            precision: None,
            threads: point.flags.threads.or(self.options.threads),
            machine,
            adapter: String::new(),
            force: true,
            resume: false,
            from: from.clone(),
            quiet: true,
        };
        let tightened = if from.is_some() { 0 } else { self.phases * loaded.case.output.rows_per_step };
        let (mut rows, mut tightening) = (0, Clocks::default());
        let stopwatch = &mut self.stopwatch;
        stopwatch.start();
        let outcome = run::run_watched(&loaded, &options, &mut || {
            rows += 1;
            if rows != tightened {
                return stopwatch.tick();
            }
            let spent = stopwatch.lap();
            tightening = stopwatch.work();
            spent
        });
        let [work, seconds] = stopwatch.stop()?;
        let (ended, message) = match outcome {
            Ok(outcome) if outcome.interrupted => return Ok(None),
            Ok(_) => ("finished".to_owned(), String::new()),
            Err(Error::Guard(guard)) => (guard.cause.clone(), guard.to_string()),
            Err(error) if is_impossible(&error) => return Ok(Some(impossible(&error))),
            Err(error) => return Err(error),
        };
        let by_processors = !self.on_gpu && !point.has_own_machine();
        let from_state = from.is_some();
        let ran = Ran { ended, message, flags, base, seconds, work, tightening, by_processors, from_state };
        file::replace(&folder.join(RAN), |w| serde_json::to_writer_pretty(w, &ran).map_err(Into::into))?;
        Ok(Some(ran))
    }

    /// The state of the tightened case, for a point that differs only after it.
    fn state(&self, point: &Point, loaded: &Loaded) -> Result<Option<PathBuf>> {
        if point.role != Role::Turned || point.has_own_machine() || self.phases == 0 {
            return Ok(None);
        }
        let case = value(loaded)?;
        let later = |place: &str| run::may_differ(place, self.phases);
        if !differences(&self.default, &case, &later).is_empty() {
            return Ok(None);
        }
        let end = format!("-{}-{}.state", self.phases, loaded.case.steps[self.phases - 1].name());
        let folder = self.options.output.join("points/default").join(FOLDER);
        let entries = std::fs::read_dir(&folder).map_err(|e| Error::file(&folder, parse::reason(&e)))?;
        let paths = entries.filter_map(|entry| entry.ok().map(|entry| entry.path()));
        Ok(paths.into_iter().find(|path| path.to_string_lossy().ends_with(&end)))
    }

    /// Options of `tricot run` that reproduce a point, besides the overrides of the study.
    fn flags(&self, point: &Point, from: Option<&Path>) -> String {
        let Flags { sets, threads, cpu } = &point.flags;
        let sets = sets.iter().map(|set| format!("--set {set}"));
        let threads = threads.map(|count| format!("--threads {count}"));
        let cpu = cpu.then(|| "--backend cpu".to_owned());
        let from =
            from.and_then(Path::file_name).map(|name| format!("--from points/default/{FOLDER}/{}", name.display()));
        sets.chain(threads).chain(cpu).chain(from).collect::<Vec<_>>().join(" ")
    }
}

/// The results of a point from an earlier study of the same case.
fn found(folder: &Path, loaded: &Loaded) -> Result<Option<Ran>> {
    let (ran, case) = (folder.join(RAN), folder.join(CASE));
    if !ran.is_file() || !case.is_file() {
        return Ok(None);
    }
    let same = differences(&value(loaded)?, &parse::file(&case)?, &|_| false).is_empty();
    let ran: Option<Ran> = serde_json::from_value(parse::file(&ran)?).ok();
    Ok(ran.filter(|_| same))
}

/// Whether no such case exists, for example since a mesh is too coarse to be built.
fn is_impossible(error: &Error) -> bool {
    matches!(error, Error::Case { .. } | Error::Geometry { .. })
}

fn impossible(error: &Error) -> Ran {
    Ran {
        ended: "impossible".into(),
        message: error.to_string(),
        flags: String::new(),
        base: String::new(),
        seconds: Clocks::default(),
        work: Clocks::default(),
        tightening: Clocks::default(),
        by_processors: false,
        from_state: false,
    }
}

fn value(loaded: &Loaded) -> Result<Value> {
    serde_json::to_value(&loaded.case).map_err(|e| Error::case("case", e.to_string()))
}

impl Ran {
    pub fn finished(&self) -> bool {
        self.ended == "finished"
    }

    /// The first of some runs with the mean of their times; `None` for none.
    pub(super) fn mean(runs: &[&Self]) -> Option<Self> {
        let mean = |of: &dyn Fn(&Self) -> Clocks| Clocks::mean(&runs.iter().map(|run| of(run)).collect::<Vec<_>>());
        let work = mean(&|run| run.work);
        let tightening = mean(&|run| run.tightening);
        runs.first().map(|first| Self { work, tightening, ..(*first).clone() })
    }

    /// Its time over that of another run, by the clock that measures cost; NaN if it did not finish.
    pub(super) fn over(&self, other: &Self) -> f64 {
        let clock = |clocks: Clocks| if self.by_processors { clocks.cpu } else { clocks.wall };
        let before = if self.from_state { clock(other.tightening) } else { 0.0 };
        if self.finished() { (clock(self.work) + before) / clock(other.work) } else { f64::NAN }
    }

    /// JSON for programs.
    pub(super) fn json(&self) -> Value {
        json!({ "ended": self.ended, "message": self.message, "flags": self.flags, "seconds": self.seconds })
    }
}
