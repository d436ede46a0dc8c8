//! `tricot compare`: differences of two results in their cases, curves and cost.

use super::difference::{Difference, common, difference, value};
use super::results::{MEASURES, Measure, Results};
use crate::case::differences::differences;
use crate::case::validate::brief;
use crate::error::{Error, Result};
use crate::output::rows::number;
use crate::output::table::Table;
use serde::Serialize;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;

/// Largest number of listed differences between the cases.
const PLACES: usize = 40;
/// Numbers of the summary: name there, name and unit here.
const FACTS: [[&str; 3]; 3] =
    [["steps", "steps", "1"], ["wall_s", "wall time", "s"], ["worst_energy_balance", "energy balance error", "1"]];

/// A row of the table: a measure or a number of the summary of both runs.
#[serde_with::apply(f64 => #[serde(serialize_with = "number")])]
#[derive(Default, Serialize)]
struct Row {
    measure: &'static str,
    unit: &'static str,
    /// Relative differences of the first run from the second one.
    relative_l2: f64,
    relative_rms: f64,
    /// Values of both runs at the end of their common range.
    a: f64,
    b: f64,
}

/// Differences between the results of two runs.
#[derive(Debug, Clone)]
pub struct Comparison {
    runs: [Results; 2],
    /// For every measure that both have: difference, and both values at the end of the common range.
    measures: Vec<(&'static Measure, Difference, [f64; 2])>,
    range: [f64; 2],
}

/// Compares the results of a run with those of another.
///
/// # Errors
/// Folders without results, or results with nothing in common.
pub fn compare(a: &Path, b: &Path) -> Result<Comparison> {
    let runs = [Results::read(a)?, Results::read(b)?];
    let axes = [runs[0].axis(), runs[1].axis()];
    if axes[0] != axes[1] {
        let [own, other] = axes.map(|axis| axis.name());
        let message = format!("its curves are over {own}, those of {} over {other}: nothing to compare", b.display());
        return Err(Error::file(a, message));
    }
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    let mut measures = Vec::new();
    for measure in MEASURES {
        let [a, b] = [runs[0].curve(measure), runs[1].curve(measure)];
        let (Some(difference), Some(shared)) = (difference(&a, &b), common(&[&a, &b])) else { continue };
        range = [range[0].min(shared[0]), range[1].max(shared[1])];
        measures.push((measure, difference, [value(&a, shared[1]), value(&b, shared[1])]));
    }
    if measures.is_empty() {
        let message = format!("no measure of it has a range in common with {}", b.display());
        return Err(Error::file(a, message));
    }
    Ok(Comparison { runs, measures, range })
}

impl Comparison {
    fn facts(&self) -> impl Iterator<Item = ([&'static str; 3], [f64; 2])> {
        FACTS.into_iter().map(|fact| (fact, [0, 1].map(|i| self.runs[i].number(fact[0]))))
    }

    /// Writes the numbers as a table.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        let mut table = Table::create(path)?;
        for &(measure, Difference { l2, rms }, [a, b]) in &self.measures {
            table.row(&Row { measure: measure.name, unit: measure.unit, relative_l2: l2, relative_rms: rms, a, b })?;
        }
        for ([_, measure, unit], [a, b]) in self.facts() {
            table.row(&Row { measure, unit, relative_l2: f64::NAN, relative_rms: f64::NAN, a, b })?;
        }
        Ok(())
    }

    /// JSON for programs; NaN becomes null.
    pub fn json(&self) -> Value {
        let [a, b] = &self.runs;
        let measure = |(m, d, [a, b]): &(&Measure, Difference, [f64; 2])| json!({ "measure": m.name, "unit": m.unit, "relative_l2": d.l2, "relative_rms": d.rms, "a": a, "b": b });
        let places = differences(&a.case, &b.case, &|_| false);
        json!({
            "folders": [a.folder, b.folder],
            "verdicts": [a.verdict(), b.verdict()],
            "over": a.axis().name(),
            "range": self.range,
            "measures": self.measures.iter().map(measure).collect::<Vec<_>>(),
            "numbers": self.facts().map(|([name, ..], values)| (name.to_owned(), json!(values)))
                .collect::<serde_json::Map<_, _>>(),
            "case": places.iter().map(|d| json!({ "path": d.place, "a": d.values[0], "b": d.values[1] }))
                .collect::<Vec<_>>(),
        })
    }

    /// The comparison as text.
    pub fn text(&self) -> String {
        let mut t = String::new();
        let [low, high] = self.range;
        // writing to a String does not fail
        for (name, run) in ["A", "B"].into_iter().zip(&self.runs) {
            let _ = writeln!(
                t,
                "{name}  {}: {}, {} steps, {:.1} s, energy balance within {:.2} %",
                run.folder.display(),
                run.verdict(),
                run.number("steps"),
                run.number("wall_s"),
                100.0 * run.number("worst_energy_balance")
            );
        }
        let _ = writeln!(
            t,
            "over {} {low:.4} to {high:.4}; A from B in L2, and root mean square point by point",
            self.runs[0].axis().name()
        );
        let _ = writeln!(t, "{:<18} {:>10} {:>10}   at the end: A and B", "", "L2", "RMS");
        for (measure, Difference { l2, rms }, [a, b]) in &self.measures {
            let _ = writeln!(
                t,
                "{:<18} {:>8.3} % {:>8.3} %   {a:.5} and {b:.5} {}",
                measure.name,
                100.0 * l2,
                100.0 * rms,
                measure.unit
            );
        }
        let [a, b] = &self.runs;
        let places = differences(&a.case, &b.case, &|_| false);
        let _ = writeln!(t, "case       {}", if places.is_empty() { "the same" } else { "A and B" });
        for place in places.iter().take(PLACES) {
            let [a, b] = place.values.map(|v| v.map_or("absent".into(), brief));
            let _ = writeln!(t, "  {}: {a} and {b}", place.place);
        }
        if places.len() > PLACES {
            let _ = writeln!(t, "  and {} more", places.len() - PLACES);
        }
        t
    }
}
