//! The results of a run on one page: case, warnings, sizes compared with their targets, curves, maps and pictures. The page
//! uses only the files in the folder, so an unfinished run can be inspected too.

use super::{CASE, FINISHED};
use crate::case::fabric::Measured;
use crate::case::{Case, parse};
use crate::error::{Error, Result};
use crate::output::columns::Columns;
use crate::output::file;
use crate::output::page::Page;
use crate::output::results::{OVER_TIME, Results, short};
use crate::rigs::{self, Rig};
use serde_json::Value;
use std::path::Path;

/// Ratio of kinetic to internal energy, and error of the energy balance, above which a run deserves a second look.
const KINETIC: f64 = 0.05;
const BALANCE: f64 = 0.02;
/// Smallest det F below which the mesh deserves a second look.
const JACOBIAN: f64 = 0.1;
/// Mass added by contact, as a share, above which inertia may matter.
const ADDED: f64 = 0.1;
/// Rows of the table of the curve.
const ROWS: usize = 16;

/// Writes the report of the run in a folder.
///
/// # Errors
/// A folder without a run, or a file that cannot be read or written.
pub fn report(dir: &Path, out: &Path) -> Result<String> {
    let history = dir.join("history.csv");
    if !history.is_file() {
        return Err(Error::file(dir, "no history.csv in this folder: give the folder of a run"));
    }
    let summary = dir.join("summary.json");
    let summary = if summary.is_file() { parse::file(&summary)? } else { Value::Null };
    let folder_case = dir.join(CASE);
    let value = parse::file(&folder_case)?;
    let case: Case = serde_json::from_value(value.clone()).map_err(|e| Error::file(&folder_case, e.to_string()))?;
    let results = Results { dir, history: Columns::read(&history)?, summary, case: value };
    let report = Report { results, rig: rigs::of(&case.domain) };
    let mut page = Page::new(&case.title);
    report.head(&mut page);
    let pictures = report.pictures();
    if let Some((last, _)) = pictures.split_last() {
        page.heading("Both faces at the end");
        page.picture(&dir.join(last), last)?;
    }
    report.sizes(&mut page)?;
    report.curves(&mut page)?;
    let found = report.rig.sections(&case, &report.results, &mut page)?;
    report.table(&mut page);
    if let Some((_, before @ [_, ..])) = pictures.split_last() {
        page.heading("Both faces before");
        page.raw("<div class=\"charts\">");
        before.iter().try_for_each(|name| page.picture(&dir.join(name), name))?;
        page.raw("</div>");
    }
    report.case(&mut page);
    let text = page.finish(&case.title);
    file::replace(out, |w| w.write_all(text.as_bytes()))?;
    let mut lines = vec![format!("{} written, {:.1} MB", out.display(), text.len() as f64 / 1e6)];
    lines.extend(found);
    Ok(lines.join("\n"))
}

/// A run with its test rig.
struct Report<'a> {
    results: Results<'a>,
    rig: &'a dyn Rig,
}

impl Report<'_> {
    fn head(&self, page: &mut Page) {
        let verdict =
            self.results.summary["verdict"].as_str().unwrap_or("not finished: it still goes on, or was killed");
        let class = if verdict == FINISHED { "verdict" } else { "verdict bad" };
        page.paragraph(class, verdict);
        let last = |column: &str| self.results.history.numbers(column).last().copied().unwrap_or(f64::NAN);
        let count = |name: &str| self.results.summary[name].as_u64().map_or_else(|| "–".into(), |n| n.to_string());
        let share = |x: f64| if x.is_nan() { "–".into() } else { format!("{:.2} %", 100.0 * x) };
        let mut facts = vec![
            ("mesh", format!("{} hexes, {} beams, {} nodes", count("hexes"), count("beams"), count("nodes"))),
            ("time", format!("{:.3} ms in {} steps", 1e3 * last("time_s"), last("step"))),
            (
                "time step",
                format!(
                    "{:.2e} to {:.2e} s",
                    self.results.number("dt_smallest_s"),
                    self.results.number("dt_largest_s")
                ),
            ),
            ("wall time", format!("{:.1} s", self.results.number("wall_s"))),
            ("energy balance", format!("within {}", share(self.results.number("worst_energy_balance")))),
            (
                "kinetic over internal",
                format!("under {}", share(self.results.number("worst_kinetic_over_internal_in_shear"))),
            ),
            ("backend", self.results.summary["backend"].as_str().unwrap_or("–").into()),
            ("state", self.results.summary["state_hash"].as_str().unwrap_or("–").into()),
            ("made by", self.provenance()),
        ];
        if self.results.summary.is_null() {
            facts.retain(|(name, _)| *name == "time");
        }
        page.facts(&facts);
        let warnings = self.warnings(verdict);
        if !warnings.is_empty() {
            page.heading("Warnings");
            page.list("warnings", &warnings);
        }
    }

    /// Version and commit of the program, machine, and time.
    fn provenance(&self) -> String {
        let of = |name: &str| self.results.summary["program"][name].as_str();
        let version = of("version").map_or("–".into(), |version| format!("tricot {version}"));
        let commit = of("commit").map_or(String::new(), |commit| format!(" ({commit})"));
        let place = of("host").map_or(String::new(), |host| format!(" on {host}"));
        let time = of("ended").map_or(String::new(), |ended| format!(", {ended}"));
        format!("{version}{commit}{place}{time}")
    }

    /// Warnings to read before trusting the numbers.
    fn warnings(&self, verdict: &str) -> Vec<String> {
        let mut found = Vec::new();
        if verdict != FINISHED {
            found.push(format!("The run has not come to its end: {verdict}."));
        }
        let notes = self.results.summary["notes"].as_array().into_iter().flatten().filter_map(Value::as_str);
        found.extend(notes.map(|note| format!("{note}.")));
        let kinetic = self.results.number("worst_kinetic_over_internal_in_shear");
        if kinetic > KINETIC {
            found.push(format!(
                "Kinetic energy reaches {:.1} % of internal energy under load (above {:.0} %): load more slowly.",
                100.0 * kinetic,
                100.0 * KINETIC
            ));
        }
        let worst = |column: &str| self.results.history.numbers(column).into_iter().map(f64::abs).fold(0.0, f64::max);
        let balance = worst("e_balance_error");
        if balance > BALANCE {
            found.push(format!(
                "The energy balance is off by up to {:.1} % (above {:.0} %).",
                100.0 * balance,
                100.0 * BALANCE
            ));
        }
        let jacobian = self.results.history.numbers("min_jacobian").into_iter().fold(f64::INFINITY, f64::min);
        if jacobian < JACOBIAN {
            found.push(format!("A hexahedron is squeezed to det F = {jacobian:.3}: refine the mesh there."));
        }
        for (name, what) in [("contact_solids_largest", "yarns"), ("contact_threads_largest", "threads")] {
            let added = self.results.summary["added_mass"][name].as_f64().unwrap_or(0.0);
            if added > ADDED {
                found.push(format!(
                    "Contact adds up to {:.0} % to the mass of {what}: inertia may count.",
                    100.0 * added
                ));
            }
        }
        found
    }

    /// Existing pictures, in the order of their frames.
    fn pictures(&self) -> Vec<&str> {
        let pictures = self.results.summary["pictures"].as_array().map_or(&[][..], Vec::as_slice);
        pictures.iter().filter_map(Value::as_str).filter(|name| self.results.dir.join(name).is_file()).collect()
    }

    /// Yarn sizes before shear and at the end, compared with the real fabric where it is known.
    fn sizes(&self, page: &mut Page) -> Result<()> {
        let Some(yarns) = self.results.other("yarns.csv")?.filter(|y| !y.is_empty()) else { return Ok(()) };
        let phases = self.results.history.texts("phase");
        let loaded = phases.iter().position(|p| matches!(*p, "shear" | "move")).unwrap_or(phases.len());
        let last = yarns.len().min(phases.len()) - 1;
        let before = loaded.checked_sub(1).map(|row| row.min(last));
        let measured = |ply: &str| -> Option<Measured> {
            serde_json::from_value(self.results.case["fabric"][ply]["measured"].clone()).ok().flatten()
        };
        let rows = ["warp", "weft"].into_iter().flat_map(|name| {
            let (yarns, targets) = (&yarns, measured(name).map(|m| m.texts()));
            ["width", "thickness", "gap"].into_iter().enumerate().map(move |(k, size)| {
                let values = yarns.numbers(&format!("{name}_{size}_mm"));
                let spread = yarns.numbers(&format!("{name}_{size}_std_mm"));
                let at =
                    |row: Option<usize>| row.map_or("–".into(), |r| format!("{:.3} ± {:.3}", values[r], spread[r]));
                let target = targets.as_ref().map_or("–".into(), |targets| targets[k].clone());
                vec![format!("{name} {size}"), at(before), target, at(Some(last))]
            })
        });
        page.heading("Sizes of yarns, mm");
        page.table(&["", "tightened", "measured", "at the end"], &rows.collect::<Vec<_>>());
        let by = measured("warp").map_or(String::new(), |m| format!(" Measured on the real fabric by {}.", m.by));
        let text = "Mean and standard deviation over all stations, across the yarn in its deformed mid-plane.";
        page.paragraph("soft", &format!("{text}{by}"));
        Ok(())
    }

    fn curves(&self, page: &mut Page) -> Result<()> {
        page.heading("Curves");
        page.raw("<div class=\"charts\">");
        let history = &self.results.history;
        self.rig.curves(&self.results, page)?;
        if let Some(stitches) = self.results.other("stitches.csv")? {
            let tensions = [
                ("tension_mean_n", "mean"),
                ("loop_tension_mean_n", "loops"),
                ("underlap_tension_mean_n", "underlaps"),
                ("tension_max_n", "largest"),
            ];
            let title = ["Tension of the stitch", "N"];
            self.results.chart(page, &stitches, &OVER_TIME, title, &tensions, "Weighted by length.");
            let axis = self.results.axis();
            if axis.column != OVER_TIME.column {
                self.results.chart(page, &stitches, &axis, title, &tensions, "Weighted by length, under load.");
            }
            let slack = [("slack_share", "all"), ("loop_slack_share", "loops"), ("underlap_slack_share", "underlaps")];
            let caption = "Share of slack thread by length, below 0.02 N.";
            self.results.chart(page, &stitches, &OVER_TIME, ["Slack", "share"], &slack, caption);
        }
        let energies = [("e_internal_mj", "internal"), ("e_kinetic_mj", "kinetic")];
        let caption = "Strain energy of yarns and threads; kinetic energy.";
        self.results.chart(page, history, &OVER_TIME, ["Energies", "mJ"], &energies, caption);
        let balance = [("e_balance_error", "error")];
        self.results.chart(
            page,
            history,
            &OVER_TIME,
            ["Energy balance", "share"],
            &balance,
            "What is unaccounted for.",
        );
        page.raw("</div>");
        Ok(())
    }

    /// Evenly spaced rows of the history, verbatim.
    fn table(&self, page: &mut Page) {
        let axis = self.results.axis();
        let phases = self.results.history.texts("phase");
        let rows: Vec<usize> = (0..phases.len()).filter(|r| axis.phase.is_none_or(|p| p == phases[*r])).collect();
        let Some(last) = rows.len().checked_sub(1) else { return };
        let state = ["e_internal_mj", "e_kinetic_mj", "e_balance_error", "max_penetration_mm", "min_jacobian"];
        let columns: Vec<&str> = self.rig.columns(&self.results).into_iter().chain(state).collect();
        let cells: Vec<Vec<&str>> = columns.iter().map(|c| self.results.history.texts(c)).collect();
        let count = ROWS.min(rows.len());
        let chosen = (1..=count).map(|k| rows[(last * k) / count]);
        let body: Vec<Vec<String>> =
            chosen.map(|row| cells.iter().map(|column| short(column[row])).collect()).collect();
        page.heading("The curve in numbers");
        page.table(&columns, &body);
        page.paragraph("soft", "Rows of history.csv, to five digits.");
    }

    fn case(&self, page: &mut Page) {
        page.heading("What was run");
        let text = |value: &Value| serde_json::to_string_pretty(value).unwrap_or_default();
        page.details("The case with its fabric and all defaults", &text(&self.results.case));
        let defaults = self.results.summary["defaults"].as_array().map_or(&[][..], Vec::as_slice);
        let line = |d: &Value| format!("{} = {}", d["path"].as_str().unwrap_or("?"), d["value"]);
        if !defaults.is_empty() {
            page.details("Defaults in use", &defaults.iter().map(line).collect::<Vec<_>>().join("\n"));
        }
        let stage = |s: &Value| {
            format!("{:>9.2} s  {}", s["s"].as_f64().unwrap_or(f64::NAN), s["stage"].as_str().unwrap_or("?"))
        };
        if let Some(stages) = self.results.summary["stage_wall_s"].as_array() {
            page.details("Time by stage", &stages.iter().map(stage).collect::<Vec<_>>().join("\n"));
        }
    }
}
