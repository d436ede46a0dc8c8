//! Checks across fields that need no mesh, for every test rig. Ranges of single numbers are in the schema.

use super::Case;
use super::provenance::Provenance;
use crate::error::Result;
use crate::settings::steps::{Along, Step};
use std::collections::BTreeMap;

/// Maximum number of time steps of a case.
pub const MAX_TIME_STEPS: f64 = 1e9;

/// The first contradiction in a case whose single values are in range. `provenance` names files in messages.
pub fn check(case: &Case, provenance: &Provenance) -> Result<()> {
    if case.title.chars().any(char::is_control) {
        return Err(provenance.error("title", "holds a line break or control character, write one line"));
    }
    steps(case, provenance)?;
    probes(case, provenance)
}

/// Refuses duplicate names and names with line breaks or control characters.
pub fn distinct<'a>(
    names: impl Iterator<Item = (String, &'a String)>,
    what: &str,
    provenance: &Provenance,
) -> Result<()> {
    let mut known = BTreeMap::new();
    for (path, name) in names {
        if name.chars().any(char::is_control) {
            return Err(provenance.error(&path, "holds a line break or control character, write one line"));
        }
        if let Some(first) = known.insert(name, path.clone()) {
            return Err(
                provenance.error(&path, format!("\"{name}\" is the name of {first} too, give each {what} its own"))
            );
        }
    }
    Ok(())
}

/// Refuses probes whose names are duplicate or unfit for a table.
fn probes(case: &Case, provenance: &Provenance) -> Result<()> {
    let probes = case.output.probes.iter().enumerate();
    distinct(probes.map(|(i, probe)| (format!("output.probes.{i}.name"), &probe.name)), "probe", provenance)
}

fn steps(case: &Case, provenance: &Provenance) -> Result<()> {
    let mut tightened = None;
    for (i, step) in case.steps.iter().enumerate() {
        if let Step::Pretension { .. } = step
            && let Some(first) = tightened.replace(i)
        {
            let message = format!("the stitch is tightened by steps.{first} already, keep one pretension step");
            return Err(provenance.error(&format!("steps.{i}"), message));
        }
    }
    let (mut angle, mut moved) = (0.0, 0.0);
    for (i, step) in case.steps.iter().enumerate() {
        let (now, next, what, field) = match step {
            Step::Shear { angle_deg, .. } => (&mut angle, *angle_deg, "the shear angle", "angle_deg"),
            Step::Move { to, through, .. } if through.is_empty() => {
                (&mut moved, *to, "the share of the displacement", "to")
            }
            Step::Move { to, .. } => {
                moved = *to;
                continue;
            }
            _ => continue,
        };
        if *now == next {
            let message = format!("{next} is {what} already: give another one, or use hold");
            return Err(provenance.error(&format!("steps.{i}.{field}"), message));
        }
        *now = next;
    }
    for (i, step) in case.steps.iter().enumerate() {
        let Step::Move { through, .. } = step else { continue };
        let mut before = 0.0;
        for (k, [share, _]) in through.iter().enumerate() {
            if !(*share > before && *share < 1.0) {
                let message =
                    format!("{share} of the duration is not between {before} and 1: give shares that increase");
                return Err(provenance.error(&format!("steps.{i}.move.through.{k}.0"), message));
            }
            before = *share;
        }
    }
    let mut along = [Along::Held; 2];
    for (i, step) in case.steps.iter().enumerate() {
        let Step::Stretch { warp, weft, .. } = step else { continue };
        if along == [*weft, *warp] {
            let message = "both directions are so already: say what changes in warp or weft, or use hold";
            return Err(provenance.error(&format!("steps.{i}"), message));
        }
        along = [*weft, *warp];
    }
    let total: f64 = case.steps.iter().map(Step::time).sum();
    let (name, dt) = match case.integration.dt_s {
        Some(dt) => ("dt_s", dt),
        None => ("dt_max_s", case.integration.dt_max_s),
    };
    let path = format!("integration.{name}");
    if total / dt > MAX_TIME_STEPS {
        let message = format!(
            "{dt:e} s makes {:.1e} time steps of the {total} s of all load steps, at most {MAX_TIME_STEPS:e}: \
             raise it or shorten the steps",
            total / dt
        );
        return Err(provenance.error(&path, message));
    }
    let shortest = case.steps.iter().map(Step::time).fold(f64::INFINITY, f64::min);
    if case.integration.dt_s.is_some() && dt > shortest {
        let message = format!("{dt:e} s is longer than the shortest load step, {shortest:e} s: lower it");
        return Err(provenance.error(&path, message));
    }
    Ok(())
}
