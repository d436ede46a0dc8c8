//! The results of a run on one page: what was run, warnings, sizes beside their targets, curves, maps and pictures. It is
//! made from the files in the folder alone, so that a run that still goes on can be looked at too.

use super::CASE;
use crate::case::parse;
use crate::error::{Error, Result};
use crate::output::chart::{self, Curve};
use crate::output::columns::Columns;
use crate::output::file;
use crate::output::page::Page;
use serde_json::Value;
use std::path::Path;

/// Kinetic over internal energy, and error of the energy balance, above which a run deserves a second look.
const KINETIC: f64 = 0.05;
const BALANCE: f64 = 0.02;
/// Smallest det F below which the mesh deserves one.
const JACOBIAN: f64 = 0.1;
/// Mass added by contact, as a share, above which inertia may count.
const ADDED: f64 = 0.1;
/// Rows of the table of the curve.
const ROWS: usize = 16;
/// Sizes of the PX35 fabric by tomography: warp and weft, width, thickness and gap, mm.
const PX35: [[&str; 3]; 2] =
    [["4.59 ± 0.13", "0.38 ± 0.06", "0.39 ± 0.10"], ["2.08 ± 0.08", "0.38 ± 0.04", "0.40 ± 0.04"]];

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
    let results = Results { dir, history: Columns::read(&history)?, summary, case: parse::file(&dir.join(CASE))? };
    let title = results.case["title"].as_str().unwrap_or("a run of tricot").to_owned();
    let mut page = Page::new(&title);
    results.head(&mut page);
    let pictures = results.pictures();
    if let Some((last, _)) = pictures.split_last() {
        page.heading("Both faces at the end");
        page.picture(&dir.join(last), last)?;
    }
    results.sizes(&mut page)?;
    results.curves(&mut page)?;
    results.crossings(&mut page)?;
    results.table(&mut page);
    if let Some((_, before @ [_, ..])) = pictures.split_last() {
        page.heading("Both faces before");
        page.raw("<div class=\"charts\">");
        before.iter().try_for_each(|name| page.picture(&dir.join(name), name))?;
        page.raw("</div>");
    }
    results.case(&mut page);
    let text = page.finish(&title);
    file::replace(out, |w| w.write_all(text.as_bytes()))?;
    Ok(format!("{} written, {:.1} MB", out.display(), text.len() as f64 / 1e6))
}

/// The files of a run.
struct Results<'a> {
    dir: &'a Path,
    history: Columns,
    /// Null while the run goes on.
    summary: Value,
    case: Value,
}

/// What curves are drawn over.
struct Axis {
    label: &'static str,
    /// Column, factor, and the name of the load steps that count; all where it is `None`.
    column: &'static str,
    factor: f64,
    phase: Option<&'static str>,
}

const OVER_ANGLE: Axis =
    Axis { label: "shear angle γ, degrees", column: "shear_angle_deg", factor: 1.0, phase: Some("shear") };
const OVER_DISPLACEMENT: Axis =
    Axis { label: "displacement, mm", column: "displacement_mm", factor: 1.0, phase: Some("move") };
const OVER_TIME: Axis = Axis { label: "time, ms", column: "time_s", factor: 1e3, phase: None };

impl Results<'_> {
    fn number(&self, name: &str) -> f64 {
        self.summary[name].as_f64().unwrap_or(f64::NAN)
    }

    /// Another table of the run, if it has one.
    fn other(&self, name: &str) -> Result<Option<Columns>> {
        let path = self.dir.join(name);
        path.is_file().then(|| Columns::read(&path)).transpose()
    }

    fn axis(&self) -> Axis {
        let phases = self.history.texts("phase");
        [OVER_ANGLE, OVER_DISPLACEMENT]
            .into_iter()
            .find(|a| a.phase.is_some_and(|p| phases.contains(&p)))
            .unwrap_or(OVER_TIME)
    }

    /// Points of a column of a table with a row for each row of the history.
    fn points(&self, table: &Columns, axis: &Axis, column: &str) -> Vec<[f64; 2]> {
        let phases = self.history.texts("phase");
        let xs = self.history.numbers(axis.column);
        let rows = xs.into_iter().zip(table.numbers(column)).zip(phases);
        let rows = rows.filter(|(_, phase)| axis.phase.is_none_or(|p| p == *phase));
        rows.map(|((x, y), _)| [x * axis.factor, y]).collect()
    }

    fn head(&self, page: &mut Page) {
        let verdict = self.summary["verdict"].as_str().unwrap_or("not finished: it still goes on, or was killed");
        let class = if verdict == "finished" { "verdict" } else { "verdict bad" };
        page.paragraph(class, verdict);
        let last = |column: &str| self.history.numbers(column).last().copied().unwrap_or(f64::NAN);
        let count = |name: &str| self.summary[name].as_u64().map_or_else(|| "–".into(), |n| n.to_string());
        let share = |x: f64| if x.is_nan() { "–".into() } else { format!("{:.2} %", 100.0 * x) };
        let mut facts = vec![
            ("mesh", format!("{} hexes, {} beams, {} nodes", count("hexes"), count("beams"), count("nodes"))),
            ("time", format!("{:.3} ms in {} steps", 1e3 * last("time_s"), last("step"))),
            ("time step", format!("{:.2e} to {:.2e} s", self.number("dt_smallest_s"), self.number("dt_largest_s"))),
            ("wall time", format!("{:.1} s", self.number("wall_s"))),
            ("energy balance", format!("within {}", share(self.number("worst_energy_balance")))),
            ("kinetic over internal", format!("under {}", share(self.number("worst_kinetic_over_internal_in_shear")))),
            ("backend", self.summary["backend"].as_str().unwrap_or("–").into()),
            ("state", self.summary["state_hash"].as_str().unwrap_or("–").into()),
        ];
        if self.summary.is_null() {
            facts.retain(|(name, _)| *name == "time");
        }
        page.facts(&facts);
        let warnings = self.warnings(verdict);
        if !warnings.is_empty() {
            page.heading("Warnings");
            page.list("warnings", &warnings);
        }
    }

    /// What a reader should know before trusting the numbers.
    fn warnings(&self, verdict: &str) -> Vec<String> {
        let mut found = Vec::new();
        if verdict != "finished" {
            found.push(format!("The run has not come to its end: {verdict}."));
        }
        let kinetic = self.number("worst_kinetic_over_internal_in_shear");
        if kinetic > KINETIC {
            found.push(format!(
                "Kinetic energy reaches {:.1} % of internal energy in shear (above {:.0} %): load more slowly.",
                100.0 * kinetic,
                100.0 * KINETIC
            ));
        }
        let worst = |column: &str| self.history.numbers(column).into_iter().map(f64::abs).fold(0.0, f64::max);
        let balance = worst("e_balance_error");
        if balance > BALANCE {
            found.push(format!(
                "The energy balance is off by up to {:.1} % (above {:.0} %).",
                100.0 * balance,
                100.0 * BALANCE
            ));
        }
        let jacobian = self.history.numbers("min_jacobian").into_iter().fold(f64::INFINITY, f64::min);
        if jacobian < JACOBIAN {
            found.push(format!("A hexahedron is squeezed to det F = {jacobian:.3}: refine the mesh there."));
        }
        for (name, what) in [("contact_solids_largest", "yarns"), ("contact_threads_largest", "threads")] {
            let added = self.summary["added_mass"][name].as_f64().unwrap_or(0.0);
            if added > ADDED {
                found.push(format!(
                    "Contact adds up to {:.0} % to the mass of {what}: inertia may count.",
                    100.0 * added
                ));
            }
        }
        found
    }

    /// Pictures that are there, in the order of their frames.
    fn pictures(&self) -> Vec<&str> {
        let pictures = self.summary["pictures"].as_array().map_or(&[][..], Vec::as_slice);
        pictures.iter().filter_map(Value::as_str).filter(|name| self.dir.join(name).is_file()).collect()
    }

    /// Sizes of yarns before shear and at the end, beside those of the real fabric where they are known.
    fn sizes(&self, page: &mut Page) -> Result<()> {
        let Some(yarns) = self.other("yarns.csv")?.filter(|y| !y.is_empty()) else { return Ok(()) };
        let phases = self.history.texts("phase");
        let loaded = phases.iter().position(|p| matches!(*p, "shear" | "move")).unwrap_or(phases.len());
        let last = yarns.len().min(phases.len()) - 1;
        let before = loaded.checked_sub(1).map(|row| row.min(last));
        let known = self.case["fabric"]["name"].as_str().is_some_and(|name| name.contains("PX35"));
        let rows = ["warp", "weft"].into_iter().enumerate().flat_map(|(ply, name)| {
            let yarns = &yarns;
            ["width", "thickness", "gap"].into_iter().enumerate().map(move |(k, size)| {
                let values = yarns.numbers(&format!("{name}_{size}_mm"));
                let spread = yarns.numbers(&format!("{name}_{size}_std_mm"));
                let at =
                    |row: Option<usize>| row.map_or("–".into(), |r| format!("{:.3} ± {:.3}", values[r], spread[r]));
                let target = if known { PX35[ply][k] } else { "–" };
                vec![format!("{name} {size}"), at(before), target.into(), at(Some(last))]
            })
        });
        page.heading("Sizes of yarns, mm");
        page.table(&["", "tightened", "tomography", "at the end"], &rows.collect::<Vec<_>>());
        let text = "Mean and standard deviation over all stations, across the yarn in its deformed mid-plane. Tomography is that of \
                    the PX35 fabric as delivered.";
        page.paragraph("soft", text);
        Ok(())
    }

    fn curves(&self, page: &mut Page) -> Result<()> {
        let axis = self.axis();
        page.heading("Curves");
        page.raw("<div class=\"charts\">");
        let mut chart =
            |table: &Columns, axis: &Axis, title: &str, unit: &str, columns: &[(&str, &str)], caption: &str| {
                let curves: Vec<Curve> = columns
                    .iter()
                    .map(|(column, name)| Curve { name, points: self.points(table, axis, column) })
                    .collect();
                if let Some(svg) = chart::curves([axis.label, unit], &curves) {
                    page.figure(&format!("{title}, {unit}"), &svg, caption);
                }
            };
        let history = &self.history;
        if axis.column == OVER_ANGLE.column {
            let force = [("f_nor_n_per_mm", "F_nor")];
            chart(
                history,
                &axis,
                "Shear force",
                "N/mm",
                &force,
                "External work per area and angle over cos γ, mean over each row.",
            );
        } else {
            let caption = "Size of the sum of the forces on prescribed nodes.";
            chart(history, &axis, "Force", "N", &[("force_n", "force")], caption);
        }
        if let Some(shear) = self.other("shear.csv")? {
            let angles = [
                ("effective_angle_mean_deg", "mean"),
                ("effective_angle_min_deg", "smallest"),
                ("effective_angle_max_deg", "largest"),
            ];
            chart(
                &shear,
                &axis,
                "Effective shear angle",
                "degrees",
                &angles,
                "Between the mid-lines at the crossings of warp and weft.",
            );
            let slips = [("slip_mean_mm", "mean"), ("slip_max_mm", "largest")];
            chart(
                &shear,
                &axis,
                "Slip of the plies",
                "mm",
                &slips,
                "Between the material points of both yarns at a crossing.",
            );
        }
        if let Some(yarns) = self.other("yarns.csv")? {
            let of = |size: &str| ["warp", "weft"].map(|ply| format!("{ply}_{size}_mm"));
            for (size, title) in [("gap", "Gaps"), ("width", "Widths")] {
                let [warp, weft] = of(size);
                chart(&yarns, &axis, title, "mm", &[(&warp, "warp"), (&weft, "weft")], "Means over all stations.");
            }
        }
        if let Some(stitches) = self.other("stitches.csv")? {
            let tensions = [
                ("tension_mean_n", "mean"),
                ("loop_tension_mean_n", "loops"),
                ("underlap_tension_mean_n", "underlaps"),
                ("tension_max_n", "largest"),
            ];
            chart(&stitches, &OVER_TIME, "Tension of the stitch", "N", &tensions, "Weighted by length.");
            chart(
                &stitches,
                &OVER_TIME,
                "Slack",
                "share",
                &[("slack_share", "share of slack thread")],
                "By length, below 0.02 N.",
            );
        }
        let energies = [("e_internal_mj", "internal"), ("e_kinetic_mj", "kinetic")];
        chart(history, &OVER_TIME, "Energies", "mJ", &energies, "Strain energy of yarns and threads; kinetic energy.");
        chart(
            history,
            &OVER_TIME,
            "Energy balance",
            "share",
            &[("e_balance_error", "error")],
            "What is unaccounted for.",
        );
        page.raw("</div>");
        Ok(())
    }

    /// Maps of the crossings at the last frame.
    fn crossings(&self, page: &mut Page) -> Result<()> {
        let Some(table) = self.other("crossings.csv")?.filter(|t| !t.is_empty()) else { return Ok(()) };
        let times = table.texts("time_s");
        let last = times[times.len() - 1];
        let of = |column: &str| {
            let values = table.numbers(column).into_iter().zip(&times);
            values.filter(|(_, time)| **time == last).map(|(v, _)| v).collect::<Vec<_>>()
        };
        let (x, y) = (of("x_mm"), of("y_mm"));
        page.heading("Crossings at the last frame");
        page.raw("<div class=\"charts\">");
        let maps = [
            ("effective_angle_deg", "effective shear angle, degrees"),
            ("warp_gap_mm", "gap of the warp, mm"),
            ("weft_gap_mm", "gap of the weft, mm"),
        ];
        for (column, name) in maps {
            let points: Vec<[f64; 3]> = x.iter().zip(&y).zip(of(column)).map(|((x, y), v)| [*x, *y, v]).collect();
            if let Some(svg) = chart::map(name, &points) {
                page.figure(name, &svg, &format!("{} crossings at t = {} s", points.len(), last));
            }
        }
        page.raw("</div>");
        Ok(())
    }

    /// Rows of the history, evenly chosen, as they are written.
    fn table(&self, page: &mut Page) {
        let axis = self.axis();
        let phases = self.history.texts("phase");
        let rows: Vec<usize> = (0..phases.len()).filter(|r| axis.phase.is_none_or(|p| p == phases[*r])).collect();
        let Some(last) = rows.len().checked_sub(1) else { return };
        let force = if axis.column == OVER_ANGLE.column { "f_nor_n_per_mm" } else { "force_n" };
        let columns = [
            axis.column,
            force,
            "e_internal_mj",
            "e_kinetic_mj",
            "e_balance_error",
            "max_penetration_mm",
            "min_jacobian",
        ];
        let cells: Vec<Vec<&str>> = columns.iter().map(|c| self.history.texts(c)).collect();
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
        page.details("The case with its fabric and all defaults", &text(&self.case));
        let defaults = self.summary["defaults"].as_array().map_or(&[][..], Vec::as_slice);
        let line = |d: &Value| format!("{} = {}", d["path"].as_str().unwrap_or("?"), d["value"]);
        if !defaults.is_empty() {
            page.details("Defaults in use", &defaults.iter().map(line).collect::<Vec<_>>().join("\n"));
        }
        let stage = |s: &Value| {
            format!("{:>9.2} s  {}", s["s"].as_f64().unwrap_or(f64::NAN), s["stage"].as_str().unwrap_or("?"))
        };
        if let Some(stages) = self.summary["stage_wall_s"].as_array() {
            page.details("Time by stage", &stages.iter().map(stage).collect::<Vec<_>>().join("\n"));
        }
    }
}

/// A number of a table with five digits.
fn short(cell: &str) -> String {
    match cell.parse::<f64>() {
        Ok(0.0) => "0".into(),
        Ok(x) if !x.is_finite() => "–".into(),
        Ok(x) if (1e-3..1e5).contains(&x.abs()) => {
            let digits = (4 - x.abs().log10().floor() as i32).max(0) as usize;
            format!("{x:.digits$}")
        }
        Ok(x) => format!("{x:.4e}"),
        Err(_) => cell.into(),
    }
}
