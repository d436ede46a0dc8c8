//! A study as a table, as JSON, as a chart and as a page.

use super::findings::{Findings, Row};
use super::points::Role;
use super::variations::VARIATIONS;
use crate::error::Result;
use crate::output::file;
use crate::output::page::Page;
use crate::output::scatter::{Mark, Scatter};
use crate::output::table::{Named, text as number};
use crate::study::difference::Difference;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;

/// A study to be written.
pub(super) struct Report<'a> {
    pub title: &'a str,
    /// `tricot run` and the case, with the overrides of the study.
    pub command: &'a str,
    pub findings: &'a Findings,
}

impl Report<'_> {
    /// Writes `accuracy.csv`, `.json`, `.svg` and `.html`.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(super) fn write(&self, folder: &Path) -> Result<()> {
        self.table(&folder.join("accuracy.csv"))?;
        let json = self.json();
        file::replace(&folder.join("accuracy.json"), |w| serde_json::to_writer_pretty(w, &json).map_err(Into::into))?;
        if let Some(svg) = self.chart(0) {
            file::replace(&folder.join("accuracy.svg"), |w| w.write_all(svg.as_bytes()))?;
        }
        let page = self.page();
        file::replace(&folder.join("accuracy.html"), |w| w.write_all(page.as_bytes()))
    }

    /// One row per point; relative L2 differences, with `<` before those within chance or the effect of node positions.
    fn table(&self, path: &Path) -> Result<()> {
        let f = self.findings;
        let names: Vec<String> = f.measures.iter().map(|m| m.name.to_lowercase().replace(' ', "_")).collect();
        let columns = [
            "number",
            "point",
            "knob",
            "ended",
            "steps",
            "wall_s",
            "cpu_s",
            "time_over_default",
            "energy_balance_error",
        ];
        let mut header = columns.map(String::from).to_vec();
        header.extend(names.iter().map(|name| format!("error_{name}")));
        header.extend(names.iter().map(|name| format!("change_{name}")));
        header.extend(names.first().map(|name| format!("error_rms_{name}")));
        header.extend(["front", "flags"].map(String::from));
        let mut table = Named::create(path, &header)?;
        for (at, row) in f.rows.iter().enumerate() {
            let claims = |of: &dyn Fn(usize) -> Option<(f64, bool)>| -> Vec<String> {
                (0..names.len()).map(|k| of(k).map_or("NaN".into(), exact)).collect()
            };
            let [wall, cpu] = [row.ran.seconds.wall, row.ran.seconds.cpu];
            let mut cells = vec![at.to_string(), row.point.label.into(), row.point.knob.into(), row.ran.ended.clone()];
            cells.extend([row.number("steps"), wall, cpu, row.time, row.number("worst_energy_balance")].map(number));
            cells.extend(claims(&|k| f.claim(row, k)));
            cells.extend(claims(&|k| f.effect(row, k)));
            if !names.is_empty() {
                cells.push(number(row.errors[0].map_or(f64::NAN, |d| d.rms)));
            }
            cells.extend([if row.front { "yes" } else { "no" }.into(), row.ran.flags.clone()]);
            table.row(&cells)?;
        }
        Ok(())
    }

    fn json(&self) -> Value {
        let f = self.findings;
        // a difference within chance or the effect of node positions is only known to be below that
        let differences = |list: &[Option<Difference>], claim: &dyn Fn(usize) -> Option<(f64, bool)>| {
            let value = |(k, d): (usize, &Option<Difference>)| match (d, claim(k)) {
                (Some(_), Some((bound, false))) => json!({ "below": bound }),
                (Some(d), _) => json!({ "l2": d.l2, "rms": d.rms }),
                (None, _) => Value::Null,
            };
            let named = f.measures.iter().zip(list.iter().enumerate().map(value));
            named.map(|(m, value)| (m.name.to_owned(), value)).collect::<serde_json::Map<_, _>>()
        };
        let row = |(number, row): (usize, &Row)| {
            let mut value = row.ran.json();
            value["number"] = json!(number);
            value["point"] = json!(row.point.label);
            value["knob"] = json!(row.point.knob);
            value["steps"] = json!(row.number("steps"));
            value["energy_balance_error"] = json!(row.number("worst_energy_balance"));
            value["time_over_default"] = json!(row.time);
            value["errors"] = json!(differences(&row.errors, &|k| f.claim(row, k)));
            value["changes"] = json!(differences(&row.changes, &|k| f.effect(row, k)));
            value["front"] = json!(row.front);
            value
        };
        let named = |values: &[f64]| {
            let values = f.measures.iter().zip(values).map(|(m, value)| (m.name.to_owned(), json!(value)));
            values.collect::<serde_json::Map<_, _>>()
        };
        json!({
            "title": self.title,
            "command": self.command,
            "by_chance": named(&f.chance),
            "by_places_of_nodes": named(&f.places),
            "repeated_time_over_default": f.repeated(),
            "points": f.rows.iter().enumerate().map(row).collect::<Vec<_>>(),
        })
    }

    /// Time against error in a measure; `None` while there is no reference.
    fn chart(&self, measure: usize) -> Option<String> {
        let f = self.findings;
        let name = f.measures.get(measure)?.name;
        let mut knobs: Vec<&str> = VARIATIONS.iter().map(|variation| variation.knob).collect();
        knobs.dedup();
        let mut marks = Vec::new();
        for (number, row) in f.rows.iter().enumerate().filter(|(_, row)| row.is_offer()) {
            let Some((error, sure)) = f.claim(row, measure) else { continue };
            let group = knobs.iter().position(|knob| *knob == row.point.knob);
            let at = [row.time, 100.0 * error];
            let strong = row.point.role == Role::Default || row.point.knob == "accuracy";
            marks.push(Mark { number, name: row.point.label, group, at, filled: sure, strong });
        }
        let front = f.rows.iter().filter(|row| measure == 0 && row.front);
        let mut front: Vec<[f64; 2]> = front.filter_map(|row| Some([row.time, 100.0 * f.claim(row, 0)?.0])).collect();
        front.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let places = 100.0 * f.places[measure];
        let mut lines = vec![(places, format!("by places of nodes: {places:.3} %"))];
        match f.row(Role::Check).and_then(|row| f.claim(row, measure)) {
            Some((error, true)) => lines.push((100.0 * error, format!("finer reference: {:.3} %", 100.0 * error))),
            Some(_) => lines[0].1 += "; finer reference below it",
            None => {}
        }
        Scatter { axes: ["time over that of the default", &format!("error of {name}, %")], marks, front, lines }.svg()
    }

    fn page(&self) -> String {
        let f = self.findings;
        let mut page = Page::new(&format!("What accuracy costs: {}", self.title));
        let wall = |role: Role| f.row(role).map_or("–".into(), |row| format!("{:.1} s", row.ran.seconds.wall));
        let [low, high] = f.repeated();
        let check = f.row(Role::Check).and_then(|row| f.claim(row, 0));
        page.facts(&[
            ("default", wall(Role::Default)),
            ("reference", wall(Role::Reference)),
            ("finer reference differs by", check.map_or("not run".into(), |claim| format!("{} %", percent(claim)))),
            ("places of nodes make", f.places.first().map_or("–".into(), |places| format!("{:.3} %", 100.0 * places))),
            ("repeated runs take", format!("{low:.3} to {high:.3} of their mean")),
        ]);
        page.heading("Time against error");
        page.raw("<div class=\"studies\">");
        for (k, measure) in f.measures.iter().enumerate() {
            if let Some(svg) = self.chart(k) {
                page.figure(measure.name, &svg, if k == 0 { CAPTION } else { "" });
            }
        }
        page.raw("</div>");
        self.errors(&mut page);
        self.changes(&mut page);
        let stopped = f.rows.iter().filter(|row| !row.ran.finished());
        let stopped: Vec<String> = stopped.map(|row| format!("{}: {}", row.point.label, row.ran.message)).collect();
        if !stopped.is_empty() {
            page.heading("Points that did not come to their end");
            page.list("warnings", &stopped);
        }
        page.finish(self.title)
    }

    /// Every point with its time, its errors and its flags.
    fn errors(&self, page: &mut Page) {
        let f = self.findings;
        let cells = |(number, row): (usize, &Row)| {
            let time = if row.ran.finished() { format!("{:.3}", row.time) } else { row.ran.ended.clone() };
            let mut cells = vec![
                format!("{number} {}{}", row.point.label, if row.front { " ◂" } else { "" }),
                row.number("steps").to_string(),
                format!("{:.1}", row.ran.seconds.wall),
                time,
            ];
            cells.extend((0..f.measures.len()).map(|k| error(f, row, k)));
            cells.push(format!("{:.2}", 100.0 * row.number("worst_energy_balance")));
            cells.push(row.ran.flags.clone());
            cells
        };
        let names = f.measures.iter().map(|m| m.name);
        let header: Vec<&str> = ["point", "steps", "wall, s", "time"]
            .into_iter()
            .chain(names)
            .chain(["energy balance, %", "options of tricot run"])
            .collect();
        page.heading("Points");
        page.table(&header, &f.rows.iter().enumerate().map(cells).collect::<Vec<_>>());
        let text = format!(
            "Errors in %, as in the charts; ◂ marks the front. Time is over that of the default: of processors where a point has the \
             same threads, of the wall elsewhere. The options go behind: {}",
            self.command
        );
        page.paragraph("soft", &text);
    }

    /// Changes that each knob makes to the default.
    fn changes(&self, page: &mut Page) {
        let f = self.findings;
        let cells = |row: &Row| {
            let effects = (0..f.measures.len()).map(|k| f.effect(row, k).map_or("–".into(), percent));
            [row.point.label.to_owned(), format!("{:.3}", row.time)].into_iter().chain(effects).collect::<Vec<_>>()
        };
        let turned = f.rows.iter().filter(|row| row.point.role == Role::Turned && row.ran.finished());
        let header: Vec<&str> = ["point", "time"].into_iter().chain(f.measures.iter().map(|m| m.name)).collect();
        page.heading("What each knob changes of the default, %");
        page.table(&header, &turned.map(cells).collect::<Vec<_>>());
    }

    /// The study as text.
    pub(super) fn text(&self) -> String {
        let f = self.findings;
        let shown: Vec<usize> = (0..f.measures.len()).filter(|k| !f.measures[*k].name.contains("thickness")).collect();
        let columns = |texts: &mut dyn Iterator<Item = String>| texts.map(|t| format!(" {t:>15}")).collect::<String>();
        let header = columns(&mut shown.iter().map(|k| f.measures[*k].name.to_owned()));
        let mut t = format!("{:<22} {:>8} {:>8} {:>8}{header}\n", "", "steps", "wall, s", "time");
        // writing to a String does not fail
        for row in &f.rows {
            let time = if row.ran.finished() { format!("{:.3}", row.time) } else { row.ran.ended.clone() };
            let (label, steps, wall) = (row.point.label, row.number("steps"), row.ran.seconds.wall);
            let errors = columns(&mut shown.iter().map(|k| error(f, row, *k)));
            let front = if row.front { " ◂" } else { "" };
            let _ = writeln!(t, "{label:<22} {steps:>8} {wall:>8.1} {time:>8}{errors}{front}");
        }
        let [low, high] = f.repeated();
        t += "errors in %: relative L2 difference from the reference, < where places of nodes may make it; ◂ on the front\n";
        let _ = write!(t, "time over the mean of runs that only differ by chance, which take {low:.3} to {high:.3}");
        t
    }
}

const CAPTION: &str = "Relative L2 difference of the force curve from that of the reference. Open marks lie below what runs differ by \
                       whose nodes lie at other places, and are drawn there. The line joins the points that no other one beats.";

/// A claim as a share, with all digits.
fn exact((error, sure): (f64, bool)) -> String {
    format!("{}{error:?}", if sure { "" } else { "<" })
}

/// A claim in per cent.
fn percent((error, sure): (f64, bool)) -> String {
    format!("{}{:.3}", if sure { "" } else { "<" }, 100.0 * error)
}

/// Error of a point in a measure as a cell of a table.
fn error(findings: &Findings, row: &Row, measure: usize) -> String {
    match row.point.role {
        Role::Reference => "0".into(),
        _ => findings.claim(row, measure).map_or("–".into(), percent),
    }
}
