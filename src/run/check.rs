//! Checks a case before it runs: sizes, effects, expected time and, on request, the cost of each effect and the stages of the
//! algorithm.

use super::effects::{Effect, effects};
use super::interleaved_timing::{Ratio, ratio, step_time, trial, wall};
use super::notes::notes;
use super::{probes, simulation};
use crate::error::{Error, Result};
use crate::rigs::read::Loaded;
use crate::simulate::{BackendConfig, Simulation};
use std::fmt::Write as _;

/// Longest duration of a turn when the share of an effect is measured, s, and the number of turns.
const TURNS_S: f64 = 1.0;
const TURNS: usize = 7;

/// Sizes and cost of a case; with `explain` also the cause and cost of each effect, every stage of the plan, and the defaults
/// in use.
pub fn check(loaded: &Loaded, explain: bool) -> Result<String> {
    let mut probe = simulation(loaded, BackendConfig::default())?;
    probes::nodes(&loaded.case.output.probes, probe.mesh())?;
    let bytes: usize = probe.model.plan.buffers.iter().map(|b| 4 * b.len).sum();
    probe.advance(0.0, |_| false)?;
    let (dt, end) = (probe.dt(), probe.schedule.end());
    // a few steps to estimate the run time; the first burst is a warm-up
    probe.advance(16.0 * dt, |_| false)?;
    let before = probe.timings();
    let per_step = step_time(&mut probe, 64, wall)?;
    let stages = since(&before, probe.timings());
    let found = effects(loaded, &probe);
    let settled = loaded
        .case
        .integration
        .dt_s
        .unwrap_or(loaded.case.integration.dt_max_s.min(loaded.case.integration.safety * probe.health().dt_limit));
    let steps = end / settled;
    let mut t = String::new();
    // writing to a String does not fail
    let _ = writeln!(t, "{}: valid", loaded.case.title);
    let _ = writeln!(
        t,
        "mesh       {} hexes, {} beams, {} nodes; {:.1} MB of buffers in f32",
        probe.mesh().hexes(),
        probe.mesh().beams(),
        probe.mesh().nodes.len(),
        bytes as f64 / 1e6
    );
    for note in notes(loaded, probe.mesh()) {
        let _ = writeln!(t, "note       {note}");
    }
    let _ = writeln!(t, "effects    {}", found.iter().map(|e| e.name).collect::<Vec<_>>().join(", "));
    let _ = write!(
        t,
        "time       {:.3} ms; limit {:.2e} s at node {} ({}), step {settled:.2e} s, about {steps:.0} steps of {:.3} ms: {:.0} s on {}",
        1e3 * end,
        probe.health().dt_limit,
        probe.health().limiting_node,
        probe.node_owner(probe.health().limiting_node),
        1e3 * per_step,
        per_step * steps,
        probe.backend().describe()
    );
    if explain {
        costs(&mut t, loaded, &found, &stages, per_step)?;
        let plan = &probe.model.plan;
        for (list, stages) in [
            ("step", &plan.step),
            ("watch", &plan.watch),
            ("search", &plan.search),
            ("diagnose", &plan.diagnose),
            ("collect", &plan.collect),
        ] {
            let _ = write!(t, "\n{list}");
            for stage in stages {
                let names = |buffers: Vec<_>| {
                    let names: Vec<&str> =
                        buffers.into_iter().map(|b: crate::kernel::buffer::Buffer| plan.buffers[b.0].name).collect();
                    names.join(", ")
                };
                let _ = write!(
                    t,
                    "\n  {:<24} {:>7} items  reads {}; writes {}",
                    stage.name,
                    stage.count,
                    names(stage.reads.clone()),
                    names(stage.writes.iter().map(|w| w.0).collect())
                );
            }
        }
        let _ = write!(t, "\ndefaults");
        for (path, value) in &loaded.defaults {
            let _ = write!(t, "\n  {path} = {value}");
        }
    }
    Ok(t)
}

/// Names and seconds of the stages since an earlier reading.
fn since(before: &[(String, f64)], mut now: Vec<(String, f64)>) -> Vec<(String, f64)> {
    for (name, seconds) in &mut now {
        *seconds -= before.iter().find(|(known, _)| known == name).map_or(0.0, |(_, seconds)| *seconds);
    }
    now
}

/// A scene for a trial, after its first contact search.
fn begun(loaded: &Loaded) -> Result<Simulation> {
    let mut simulation = simulation(loaded, trial(&BackendConfig::default()))?;
    simulation.advance(0.0, |_| false)?;
    Ok(simulation)
}

/// Cause of each effect and its share of the time of all stages: the time of its own stages or, where it shares stages with
/// other effects, from trials without it.
fn costs(t: &mut String, loaded: &Loaded, found: &[Effect], stages: &[(String, f64)], per_step: f64) -> Result<()> {
    let total: f64 = stages.iter().map(|(_, seconds)| seconds).sum();
    let steps = ((TURNS_S / (2 * TURNS) as f64 / per_step) as u64).clamp(32, 256);
    let mut all = begun(loaded)?;
    let _ = write!(t, "\neffects, their share of the time of a step where the run starts, and what called for them");
    for effect in found {
        let own = stages.iter().filter(|(name, _)| effect.stages.contains(&&name[..]));
        let share = 100.0 * own.map(|(_, seconds)| seconds).sum::<f64>() / total;
        let shown = match effect.without(loaded).filter(|_| effect.stages.is_empty()) {
            Some(without) => match begun(&without) {
                Ok(mut without) => {
                    let Ratio { median, spread } = ratio(&mut without, &mut all, steps, TURNS)?;
                    format!("{:5.1} ± {:3.1} % *", 100.0 * (1.0 - median), 100.0 * spread)
                }
                Err(Error::Guard(guard)) => format!("{} guard", guard.cause),
                Err(error) => return Err(error),
            },
            None if effect.stages.is_empty() => "".into(),
            None => format!("{share:5.1} %"),
        };
        let _ = write!(t, "\n  {:<22} {shown:<15} {}", effect.name, effect.cause);
    }
    let _ = write!(
        t,
        "\n  * inside stages that others share: the difference from a trial without it, {TURNS} turns of {steps} steps each"
    );
    Ok(())
}
