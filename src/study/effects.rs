//! `tricot study effects`: turns off every effect of a scene in turn, and measures its cost and its influence.
//!
//! Each variant runs to its end, and its curves are compared with those of the full scene. Step times are not taken from these
//! runs, since the load of the machine varies: a variant and the scene take turns from the start of the last load step. One
//! variant has every effect and starts a micrometre aside: changes no larger than its own are chance.

use super::difference::difference;
use super::results::{MEASURES, Measure, Results};
use crate::error::{Error, Guard, Result};
use crate::output::directory;
use crate::output::table::{Named, text as number};
use crate::rigs::read::Loaded;
use crate::run::effects::effects as effects_of;
use crate::run::interleaved_timing::{Ratio, ratio, trial};
use crate::run::{self, Machine};
use crate::simulate::{BackendConfig, Simulation};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Columns of the table before those of the measures, which hold relative differences in L2 (see
/// [`difference`](super::difference::Difference)).
const COLUMNS: [&str; 6] = ["without", "verdict", "steps", "step_time_ratio", "step_time_spread", "run_time_ratio"];
/// Turns of a variant and the scene, and seconds of a turn.
const TURNS: usize = 9;
const TURN_S: f64 = 0.05;
/// Steps of a turn.
const STEPS: [u64; 2] = [64, 1024];
/// Name of the variant that has every effect.
const NOTHING: &str = "nothing (a µm aside)";

/// Options of a study of effects.
#[derive(Debug, Clone)]
pub struct Options {
    pub config: BackendConfig,
    /// Names of the effects to turn off; empty for all.
    pub only: Vec<String>,
    /// Path of the table; runs go into the folder of the same name beside it.
    pub table: PathBuf,
    /// Move earlier runs aside.
    pub force: bool,
}

/// Result of a study.
#[derive(Debug, Clone)]
pub struct Study {
    /// The table as text.
    pub text: String,
    /// Whether the user stopped it; the table holds the results up to then.
    pub interrupted: bool,
}

/// A completed run.
struct Done {
    loaded: Loaded,
    folder: PathBuf,
    /// The guard that stopped it; `None` if it finished.
    guard: Option<Guard>,
    results: Results,
}

impl Done {
    fn verdict(&self) -> &str {
        self.guard.as_ref().map_or("finished", |guard| &guard.cause)
    }
}

/// One row of the table.
struct Row {
    name: &'static str,
    verdict: String,
    steps: f64,
    step_time: Ratio,
    run_time: f64,
    /// Difference in every measure; NaN where the variant has no curve in common with the scene.
    changes: Vec<f64>,
}

/// Runs a scene with all its effects and without each, and writes the table row by row.
///
/// # Errors
/// An effect that the scene does not have, a folder in use, a table that cannot be written. A guard that stops a variant is its
/// verdict; a guard that stops the scene itself is an error, since nothing remains to compare with.
pub fn effects(loaded: &Loaded, options: &Options) -> Result<Study> {
    let scene = plain(loaded, options);
    let mut variants = vec![(NOTHING, aside(&scene))];
    variants.extend(chosen(&scene, options)?);
    let folder = options.table.with_extension("");
    directory::check(&folder, options.force)?;
    let interrupted = || Study { text: "interrupted".into(), interrupted: true };
    let Some(whole) = finish(&scene, &folder.join("all"), options)? else { return Ok(interrupted()) };
    if let Some(guard) = whole.guard {
        return Err(Error::Guard(guard));
    }
    let measures: Vec<&Measure> = MEASURES.iter().filter(|m| !whole.results.curve(m).is_empty()).collect();
    let header = COLUMNS.map(String::from).into_iter().chain(measures.iter().map(|m| m.name.replace(' ', "_") + "_l2"));
    let header: Vec<String> = header.collect();
    let mut table = Named::create(&options.table, &header)?;
    let mut rows = Vec::new();
    for (name, variant) in variants {
        let Some(done) = finish(&variant, &folder.join(slug(name)), options)? else { return Ok(interrupted()) };
        let row = compare(name, &done, &whole, &measures, options)?;
        let numbers = [row.steps, row.step_time.median, row.step_time.spread, row.run_time];
        let numbers = numbers.iter().chain(&row.changes).map(|value| number(*value));
        table.row(&[row.name.to_owned(), row.verdict.clone()].into_iter().chain(numbers).collect::<Vec<_>>())?;
        rows.push(row);
    }
    Ok(Study { text: text(&whole, &measures, &rows, &options.table), interrupted: false })
}

/// The scene with a checkpoint after every load step, and no pictures.
fn plain(loaded: &Loaded, options: &Options) -> Loaded {
    let mut plain = loaded.clone();
    plain.case.integration.precision = options.config.precision;
    let output = &mut plain.case.output;
    (output.pictures, output.frames_per_step, output.checkpoint_wall_s) = (false, 0, Some(1e6));
    output.frames_at_deg.clear();
    plain
}

/// The same scene with its bodies up to a micrometre aside.
fn aside(scene: &Loaded) -> Loaded {
    let mut aside = scene.clone();
    aside.case.integration.perturbation_mm += 1e-3;
    aside
}

/// One scene without each requested effect that can be turned off.
fn chosen(scene: &Loaded, options: &Options) -> Result<Vec<(&'static str, Loaded)>> {
    let mut simulation = run::simulation(scene, options.config.clone())?;
    simulation.advance(0.0, |_| false)?;
    let found = effects_of(scene, &simulation);
    let mut variants: Vec<_> = found.iter().filter_map(|e| e.without(scene).map(|without| (e.name, without))).collect();
    if let Some(unknown) = options.only.iter().find(|name| !variants.iter().any(|(known, _)| known == name)) {
        let names: Vec<&str> = variants.iter().map(|(name, _)| *name).collect();
        let message =
            format!("the scene has no effect of this name that can be turned off; it has: {}", names.join(", "));
        return Err(Error::case(format!("--only {unknown}"), message));
    }
    variants.retain(|(name, _)| options.only.is_empty() || options.only.iter().any(|only| only == name));
    Ok(variants)
}

/// Name of a folder.
fn slug(name: &str) -> String {
    let letters = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    name.split(" (").next().unwrap_or(name).chars().map(letters).collect()
}

/// Runs a scene until its end or a guard; `None` if the user stopped it.
fn finish(scene: &Loaded, folder: &Path, options: &Options) -> Result<Option<Done>> {
    let how = run::Options {
        output: folder.into(),
        precision: None,
        threads: None,
        machine: Machine::Cpu,
        adapter: String::new(),
        force: options.force,
        resume: false,
        from: None,
        quiet: true,
    };
    let guard = match run::run_on(scene, &how, options.config.clone()) {
        Ok(outcome) if outcome.interrupted => return Ok(None),
        Ok(_) => None,
        Err(Error::Guard(guard)) => Some(guard),
        Err(error) => return Err(error),
    };
    let results = Results::read(folder)?;
    Ok(Some(Done { loaded: scene.clone(), folder: folder.into(), guard, results }))
}

/// Cost and influence of the effect that a variant lacks.
fn compare(name: &'static str, variant: &Done, whole: &Done, measures: &[&Measure], options: &Options) -> Result<Row> {
    let step_time = match (start(variant, options)?, start(whole, options)?) {
        (Some(mut scene), Some(mut beside)) => {
            let wall = whole.results.number("wall_s") / whole.results.number("steps");
            let steps = ((TURN_S / wall) as u64).clamp(STEPS[0], STEPS[1]);
            ratio(&mut scene, &mut beside, steps, TURNS)?
        }
        _ => Ratio { median: f64::NAN, spread: f64::NAN },
    };
    let [steps, all] = [variant, whole].map(|done| done.results.number("steps"));
    let change = |measure: &&Measure| {
        difference(&variant.results.curve(measure), &whole.results.curve(measure)).map_or(f64::NAN, |d| d.l2)
    };
    Ok(Row {
        name,
        verdict: variant.verdict().to_owned(),
        steps,
        step_time,
        run_time: if variant.guard.is_none() { step_time.median * steps / all } else { f64::NAN },
        changes: measures.iter().map(change).collect(),
    })
}

/// The scene at the start of its last load step; `None` if it did not get there.
fn start(done: &Done, options: &Options) -> Result<Option<Simulation>> {
    let steps = &done.loaded.case.steps;
    let Some(before) = steps.len().checked_sub(2) else {
        return run::simulation(&done.loaded, trial(&options.config)).map(Some);
    };
    let end = format!("-{}-{}.state", before + 1, steps[before].name());
    let states = done.folder.join("state");
    let entries = std::fs::read_dir(&states).map_err(|e| Error::file(&states, e))?;
    let mut paths = entries.filter_map(|entry| entry.ok().map(|entry| entry.path()));
    let found = paths.find(|path| path.to_string_lossy().ends_with(&end));
    found.map(|state| run::simulation_at(&done.loaded, trial(&options.config), &state)).transpose()
}

/// The table as text.
fn text(whole: &Done, measures: &[&Measure], rows: &[Row], table: &Path) -> String {
    let mut t = String::new();
    // writing to a String does not fail
    let _ = writeln!(
        t,
        "{}: {} steps; without each of its effects, times over those with all, and changes of curves over {} in L2",
        whole.loaded.case.title,
        whole.results.number("steps"),
        whole.results.axis().name()
    );
    let split = |m: &&&Measure| m.name.rsplit_once(' ').unwrap_or(("", m.name));
    for line in 0..2 {
        let lead = ["", "without"][line];
        let words = [["", "steps"], ["time of", "a step"], ["of the", "run"]].map(|pair| pair[line]);
        let _ = write!(t, "{lead:<26} {:>8} {:>15} {:>8}", words[0], words[1], words[2]);
        for measure in measures {
            let (first, second) = split(&measure);
            let _ = write!(t, " {:>11}", [first, second][line]);
        }
        let _ = writeln!(t);
    }
    for row in rows {
        let Ratio { median, spread } = row.step_time;
        let time = format!("{median:.3} ± {spread:.3}");
        let _ = write!(t, "{:<26} {:>8} {time:>15} {:>8.3}", row.name, row.steps, row.run_time);
        for change in &row.changes {
            let _ = write!(t, " {:>9.2} %", 100.0 * change);
        }
        let stopped = if row.verdict == "finished" { String::new() } else { format!("  stopped: {}", row.verdict) };
        let _ = writeln!(t, "{stopped}");
    }
    let _ = write!(t, "changes that are no larger than those of \"{NOTHING}\" are chance; written {}", table.display());
    t
}
