//! The results of a run on one page: what was run, warnings, sizes beside their targets, curves, maps and pictures. It is
//! made from the files in the folder alone, so that a run that still goes on can be looked at too.

use super::{CASE, FINISHED};
use crate::case::fabric::Measured;
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
/// Frames of a specimen whose crossings are mapped, the last one included.
const MAPS: usize = 3;
/// Share of the values at each end that the colours of a specimen's maps leave out: gaps at its edges are no gaps.
const OUTER: f64 = 0.02;
/// Rows of the table that compares the zones with the theory.
const COMPARED: usize = 8;

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
    results.zones(&mut page)?;
    let found = if results.is_specimen() { results.findings()? } else { Vec::new() };
    if !found.is_empty() {
        page.heading("What the pull shows");
        page.list("findings", &found);
    }
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
    let mut lines = vec![format!("{} written, {:.1} MB", out.display(), text.len() as f64 / 1e6)];
    lines.extend(found);
    Ok(lines.join("\n"))
}

/// The files of a run.
pub(super) struct Results<'a> {
    pub(super) dir: &'a Path,
    pub(super) history: Columns,
    /// Null while the run goes on.
    summary: Value,
    pub(super) case: Value,
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
const OVER_EFFECTIVE: Axis = Axis {
    label: "effective shear angle in zone C, degrees",
    column: "shear_angle_deg",
    factor: 1.0,
    phase: Some("move"),
};
const OVER_TIME: Axis = Axis { label: "time, ms", column: "time_s", factor: 1e3, phase: None };

impl Results<'_> {
    fn number(&self, name: &str) -> f64 {
        self.summary[name].as_f64().unwrap_or(f64::NAN)
    }

    /// Another table of the run, if it has one.
    pub(super) fn other(&self, name: &str) -> Result<Option<Columns>> {
        let path = self.dir.join(name);
        path.is_file().then(|| Columns::read(&path)).transpose()
    }

    fn is_specimen(&self) -> bool {
        self.case["domain"]["specimen"].is_object()
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
        let class = if verdict == FINISHED { "verdict" } else { "verdict bad" };
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
            ("made by", self.provenance()),
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

    /// Version and commit of the program, machine, and time.
    fn provenance(&self) -> String {
        let of = |name: &str| self.summary["program"][name].as_str();
        let version = of("version").map_or("–".into(), |version| format!("tricot {version}"));
        let commit = of("commit").map_or(String::new(), |commit| format!(" ({commit})"));
        let place = of("host").map_or(String::new(), |host| format!(" on {host}"));
        let time = of("ended").map_or(String::new(), |ended| format!(", {ended}"));
        format!("{version}{commit}{place}{time}")
    }

    /// What a reader should know before trusting the numbers.
    fn warnings(&self, verdict: &str) -> Vec<String> {
        let mut found = Vec::new();
        if verdict != FINISHED {
            found.push(format!("The run has not come to its end: {verdict}."));
        }
        let notes = self.summary["notes"].as_array().into_iter().flatten().filter_map(Value::as_str);
        found.extend(notes.map(|note| format!("{note}.")));
        let kinetic = self.number("worst_kinetic_over_internal_in_shear");
        if kinetic > KINETIC {
            found.push(format!(
                "Kinetic energy reaches {:.1} % of internal energy under load (above {:.0} %): load more slowly.",
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
        let measured = |ply: &str| -> Option<Measured> {
            serde_json::from_value(self.case["fabric"][ply]["measured"].clone()).ok().flatten()
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
        let history = &self.history;
        if self.is_specimen() {
            self.specimen_curves(page)?;
        } else {
            self.cell_curves(page)?;
        }
        if let Some(stitches) = self.other("stitches.csv")? {
            let tensions = [
                ("tension_mean_n", "mean"),
                ("loop_tension_mean_n", "loops"),
                ("underlap_tension_mean_n", "underlaps"),
                ("tension_max_n", "largest"),
            ];
            let title = ["Tension of the stitch", "N"];
            self.chart(page, &stitches, &OVER_TIME, title, &tensions, "Weighted by length.");
            let axis = self.axis();
            if axis.column != OVER_TIME.column {
                self.chart(page, &stitches, &axis, title, &tensions, "Weighted by length, under load.");
            }
            let slack = [("slack_share", "all"), ("loop_slack_share", "loops"), ("underlap_slack_share", "underlaps")];
            let caption = "Share of slack thread by length, below 0.02 N.";
            self.chart(page, &stitches, &OVER_TIME, ["Slack", "share"], &slack, caption);
        }
        let energies = [("e_internal_mj", "internal"), ("e_kinetic_mj", "kinetic")];
        let caption = "Strain energy of yarns and threads; kinetic energy.";
        self.chart(page, history, &OVER_TIME, ["Energies", "mJ"], &energies, caption);
        let balance = [("e_balance_error", "error")];
        self.chart(page, history, &OVER_TIME, ["Energy balance", "share"], &balance, "What is unaccounted for.");
        page.raw("</div>");
        Ok(())
    }

    /// A chart of columns of a table with a row for each row of the history: title and unit, columns with their names.
    fn chart(
        &self,
        page: &mut Page,
        table: &Columns,
        axis: &Axis,
        [title, unit]: [&str; 2],
        columns: &[(&str, &str)],
        caption: &str,
    ) {
        let spread = |column: &str| {
            let points = spread_of(column).map_or_else(Vec::new, |column| self.points(table, axis, &column));
            points.iter().map(|p| p[1]).collect()
        };
        let curve = columns.iter().map(|(column, name)| Curve {
            name,
            points: self.points(table, axis, column),
            spread: spread(column),
        });
        let curves: Vec<Curve> = curve.collect();
        if let Some(svg) = chart::curves([axis.label, unit], &curves) {
            page.figure(&format!("{title}, {unit}"), &svg, caption);
        }
    }

    /// What a cell, or a free scene, is asked for.
    fn cell_curves(&self, page: &mut Page) -> Result<()> {
        let (axis, history) = (self.axis(), &self.history);
        if axis.column == OVER_ANGLE.column {
            let force = [("f_nor_n_per_mm", "F_nor")];
            let caption = "External work per area and angle over cos γ, mean over each row.";
            self.chart(page, history, &axis, ["Shear force", "N/mm"], &force, caption);
            if let Some(stress) = self.other("stress.csv")? {
                let fibres = [("warp_membrane_n_per_mm", "warp"), ("weft_membrane_n_per_mm", "weft")];
                let caption = "Along the fibres, per width of the fabric across them.";
                self.chart(page, &stress, &axis, ["Membrane force", "N/mm"], &fibres, caption);
            }
        } else {
            let caption = "Of the grips on their largest displacement; each of them is in reactions.csv.";
            self.chart(page, history, &axis, ["Force", "N"], &[("force_n", "force")], caption);
        }
        if let Some(shear) = self.other("shear.csv")? {
            let angles = [
                ("effective_angle_mean_deg", "mean"),
                ("effective_angle_min_deg", "smallest"),
                ("effective_angle_max_deg", "largest"),
            ];
            let caption = "Between the mid-lines at the crossings of warp and weft.";
            self.chart(page, &shear, &axis, ["Effective shear angle", "degrees"], &angles, caption);
            let slips = [("slip_mean_mm", "mean"), ("slip_max_mm", "largest")];
            let caption = "Between the material points of both yarns at a crossing.";
            self.chart(page, &shear, &axis, ["Slip of the plies", "mm"], &slips, caption);
        }
        if let Some(yarns) = self.other("yarns.csv")? {
            for (size, title) in [("gap", "Gaps"), ("width", "Widths")] {
                let [warp, weft] = ["warp", "weft"].map(|ply| format!("{ply}_{size}_mm"));
                let columns = [(warp.as_str(), "warp"), (&weft, "weft")];
                self.chart(page, &yarns, &axis, [title, "mm"], &columns, "Means over all stations.");
            }
        }
        Ok(())
    }

    /// What a specimen is asked for.
    fn specimen_curves(&self, page: &mut Page) -> Result<()> {
        let (axis, history) = (self.axis(), &self.history);
        let caption = "Of the clamp that moves, along the pull, mean over each row.";
        self.chart(page, history, &axis, ["Force of the machine", "N"], &[("force_n", "force")], caption);
        // an angle that falls back for a moment has no F_nor: the line goes on behind it
        let known = |p: &[f64; 2]| p[1].is_finite();
        let points = self.points(history, &OVER_EFFECTIVE, "f_nor_n_per_mm").into_iter().filter(known).collect();
        if let Some(svg) =
            chart::curves([OVER_EFFECTIVE.label, "N/mm"], &[Curve { name: "F_nor", points, spread: Vec::new() }])
        {
            let caption =
                "Eq. 19 with the effective angle: it presumes zones sheared by nothing, half and all of that angle.";
            page.figure("Shear force, N/mm", &svg, caption);
        }
        let Some(shear) = self.other("shear.csv")? else { return Ok(()) };
        let angles = [("zone_c_angle_deg", "effective"), ("theory_angle_deg", "without slip (Eq. 18)")];
        let caption = "Mean over the crossings well inside zone C, beside the theory of yarns that do not slide.";
        self.chart(page, &shear, &axis, ["Shear angle in zone C", "degrees"], &angles, caption);
        let zones = [("zone_a_angle_deg", "A"), ("zone_b_angle_deg", "B"), ("zone_c_angle_deg", "C")];
        let caption = "Effective angles. Without slip, A has none and B half of that in C.";
        self.chart(page, &shear, &axis, ["Shear angle by zone", "degrees"], &zones, caption);
        let slips =
            [("zone_a_slip_mm", "A"), ("zone_b_slip_mm", "B"), ("zone_c_slip_mm", "C"), ("slip_max_mm", "largest")];
        let caption = "Between the material points of both yarns at a crossing: means by zone, and the largest of all.";
        self.chart(page, &shear, &axis, ["Slip of the plies", "mm"], &slips, caption);
        for (size, title) in
            [("gap", "Gaps in zone C"), ("width", "Widths in zone C"), ("broadness", "Broadness in zone C")]
        {
            let [warp, weft] = ["warp", "weft"].map(|ply| format!("zone_c_{ply}_{size}_mm"));
            let columns = [(warp.as_str(), "warp"), (&weft, "weft")];
            self.chart(page, &shear, &OVER_EFFECTIVE, [title, "mm"], &columns, "Means over the crossings well inside.");
        }
        Ok(())
    }

    /// Zones of a specimen beside the theory, at evenly chosen rows of the pull.
    fn zones(&self, page: &mut Page) -> Result<()> {
        let Some(shear) = self.other("shear.csv")?.filter(|_| self.is_specimen()) else { return Ok(()) };
        let phases = self.history.texts("phase");
        let rows: Vec<usize> = (0..phases.len().min(shear.len())).filter(|r| phases[*r] == "move").collect();
        let Some(last) = rows.len().checked_sub(1) else { return Ok(()) };
        let columns = [
            "displacement_mm",
            "theory_angle_deg",
            "zone_c_angle_deg",
            "zone_c_angle_std_deg",
            "zone_b_angle_deg",
            "zone_a_angle_deg",
            "zone_c_slip_mm",
        ];
        let cells = columns.map(|column| shear.texts(column));
        let count = COMPARED.min(rows.len());
        let body: Vec<Vec<String>> =
            (1..=count).map(|k| cells.iter().map(|column| short(column[rows[last * k / count]])).collect()).collect();
        page.heading("Zones beside the theory");
        page.table(&["displacement, mm", "Eq. 18, °", "C, °", "± in C, °", "B, °", "A, °", "slip in C, mm"], &body);
        page.paragraph(
            "soft",
            "Effective angles, means over the crossings well inside each zone. Without slip, C follows Eq. 18.",
        );
        Ok(())
    }

    /// Maps of the crossings: at the last frame, and at some before it where a specimen is pulled.
    fn crossings(&self, page: &mut Page) -> Result<()> {
        let Some(table) = self.other("crossings.csv")?.filter(|t| !t.is_empty()) else { return Ok(()) };
        let times = table.texts("time_s");
        let mut frames = times.clone();
        frames.dedup();
        let pulled = self.is_specimen();
        let displacements = table.numbers("displacement_mm");
        let place = |time: &str| times.iter().position(|t| *t == time).map_or(f64::NAN, |row| displacements[row]);
        if pulled {
            frames.retain(|time| place(time) > 0.0);
        }
        if frames.is_empty() {
            frames.push(times[times.len() - 1]);
        }
        let (count, last) = (if pulled { MAPS.min(frames.len()) } else { 1 }, frames.len() - 1);
        let chosen: Vec<&str> = (1..=count).map(|k| frames[last * k / count]).collect();
        let (x, y) = (table.numbers("x_mm"), table.numbers("y_mm"));
        page.heading(if pulled { "Crossings while the specimen is pulled" } else { "Crossings at the last frame" });
        page.raw("<div class=\"charts\">");
        let maps = [
            ("effective_angle_deg", "effective shear angle, degrees"),
            ("warp_gap_mm", "gap of the warp, mm"),
            ("weft_gap_mm", "gap of the weft, mm"),
        ];
        for (column, name) in maps {
            let values = table.numbers(column);
            let range = if pulled { middle(chosen.iter().flat_map(|time| at(&times, time, &values))) } else { None };
            for time in &chosen {
                let points: Vec<[f64; 3]> = at(&times, time, &x)
                    .zip(at(&times, time, &y))
                    .zip(at(&times, time, &values))
                    .map(|((x, y), v)| [x, y, v])
                    .collect();
                let shown = points.iter().filter(|p| p.iter().all(|v| v.is_finite())).count();
                let mut caption = format!("{shown} crossings at t = {} s", short(time));
                if pulled {
                    caption += &format!(", d = {:.2} mm; colours as in the other maps of this size", place(time));
                }
                if let Some(svg) = chart::map(name, &points, range) {
                    page.figure(name, &svg, &caption);
                }
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
        let loading: &[&str] = if self.is_specimen() {
            &["displacement_mm", "force_n", "shear_angle_deg", "f_nor_n_per_mm"]
        } else if axis.column == OVER_ANGLE.column {
            &[OVER_ANGLE.column, "f_nor_n_per_mm"]
        } else {
            &[axis.column, "force_n"]
        };
        let state = ["e_internal_mj", "e_kinetic_mj", "e_balance_error", "max_penetration_mm", "min_jacobian"];
        let columns = [loading, &state].concat();
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

/// Values of the rows at a time.
fn at<'a>(times: &'a [&str], time: &'a str, values: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
    values.iter().zip(times).filter(move |(_, t)| **t == time).map(|(v, _)| *v)
}

/// Range of values without the outermost at both ends; `None` if there is none.
fn middle(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let mut values: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    let outer = (OUTER * last as f64) as usize;
    Some([values[outer], values[last - outer]])
}

/// Column of the standard deviation that belongs to that of a mean: `warp_gap_std_mm` to `warp_gap_mm`.
fn spread_of(column: &str) -> Option<String> {
    let (name, unit) = column.rsplit_once('_')?;
    Some(format!("{}_std_{unit}", name.strip_suffix("_mean").unwrap_or(name)))
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
