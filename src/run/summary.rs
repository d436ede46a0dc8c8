//! What a run says at its end: `summary.json` for programs, a dozen lines for a person.

use super::Run;
use super::notes::notes;
use super::pulled::Pulled;
use crate::error::Result;
use crate::measure::stitches;
use crate::output::{file, lock};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::time::SystemTime;

/// Share of kinetic in all energy below which a scene is at rest.
const AT_REST: f64 = 0.01;

impl Run<'_> {
    /// Writes `summary.json`.
    pub(super) fn write_summary(&self, verdict: &str) -> Result<()> {
        let s = &self.simulation;
        let (e, h) = (s.energies(), s.health());
        let floor = s.model.whole_mass.map(|[truly, added]| if truly > 0.0 { added / truly } else { 0.0 });
        let hash = s.state_hash();
        let hash = s.alive().ok().map(|()| format!("{hash:016x}"));
        let summary = json!({
            "verdict": verdict,
            "program": {
                "version": env!("CARGO_PKG_VERSION"),
                // builds that are given to others say where they come from
                "commit": option_env!("TRICOT_COMMIT"),
                "command": std::env::args().collect::<Vec<_>>().join(" "),
                "host": lock::host(),
                "started": humantime::format_rfc3339_seconds(self.began).to_string(),
                "ended": humantime::format_rfc3339_seconds(SystemTime::now()).to_string(),
            },
            "case": self.loaded.case,
            "defaults": self.loaded.defaults.iter().map(|(path, value)| json!({"path": path, "value": value})).collect::<Vec<_>>(),
            "hexes": s.mesh.hexes(),
            "beams": s.mesh.beams(),
            "nodes": s.mesh.nodes.len(),
            "backend": s.backend().describe(),
            "steps": s.step(),
            "time_s": s.time(),
            "dt_smallest_s": self.dt_range[0],
            "dt_largest_s": self.dt_range[1],
            "dt_limit_s": h.dt_limit,
            "dt_share": s.share(),
            "retries": self.retries.guards(),
            "contact_searches": s.searches(),
            "wall_s": self.wall(),
            "stage_wall_s": s.timings().into_iter().map(|(name, t)| json!({"stage": name, "s": t})).collect::<Vec<_>>(),
            "added_mass": {
                "floor_solids": floor[0],
                "floor_threads": floor[1],
                "contact_solids_largest": self.largest_added[0] - floor[0],
                "contact_threads_largest": self.largest_added[1] - floor[1],
            },
            "worst_energy_balance": self.worst_balance,
            "worst_kinetic_over_internal_in_shear": self.worst_kinetic,
            "kinetic_share_at_rest": self.rest.map(|(_, share)| share),
            "notes": notes(self.loaded),
            "fibres": s.mesh.period.map(|_| self.fibres()),
            "specimen": self.pulled.as_ref().map(Pulled::summary),
            "energies_mj": e.columns().map(|(name, value)| (name.to_owned(), json!(value))).collect::<serde_json::Map<_, _>>(),
            "state_hash": hash,
            "pictures": self.pictures,
            "frames": self.frames.iter().map(|(time, file)| json!({"time_s": time, "file": file})).collect::<Vec<_>>(),
        });
        let path = self.options.output.join("summary.json");
        file::replace(&path, |w| serde_json::to_writer_pretty(w, &summary).map_err(Into::into))
    }

    /// Root mean square by which the membrane force along x or y missed its aim over the rows of shear, N/mm; `None` without an aim.
    fn missed(&self, axis: usize) -> Option<f64> {
        let rows = self.missed[2];
        let driven = self.simulation.fibres()[axis].error.is_some() && rows > 0.0;
        driven.then(|| libm::sqrt(self.missed[axis] / rows))
    }

    /// Stretch and membrane force along the fibres of a cell, by ply.
    fn fibres(&self) -> Value {
        let [weft, warp] = [0, 1].map(|axis| {
            let fibres = self.simulation.fibres()[axis];
            json!({
                "stretch": fibres.stretch,
                "membrane_n_per_mm": fibres.force,
                "error_in_shear_n_per_mm": self.missed(axis),
            })
        });
        json!({ "warp": warp, "weft": weft })
    }

    /// The lines a person wants to read.
    pub(super) fn lines(&self, verdict: &str) -> String {
        let s = &self.simulation;
        let (e, h) = (s.energies(), s.health());
        let mut t = String::new();
        let wall = self.wall();
        // writing to a String does not fail
        let _ = writeln!(t, "{}: {verdict}", self.loaded.case.title);
        let _ = writeln!(
            t,
            "mesh       {} hexes, {} beams, {} nodes; {}",
            s.mesh.hexes(),
            s.mesh.beams(),
            s.mesh.nodes.len(),
            s.backend().describe()
        );
        let _ = writeln!(
            t,
            "time       {:.3} ms in {} steps of {:.2e} to {:.2e} s, {} contact searches; {wall:.1} s of wall time",
            1e3 * s.time(),
            s.step(),
            self.dt_range[0],
            self.dt_range[1],
            s.searches()
        );
        if let Some(guard) = self.retries.guards().last() {
            let times = match self.retries.guards().len() {
                1 => "once".to_owned(),
                n => format!("{n} times"),
            };
            let _ = writeln!(t, "retries    went back {times}, steps {} of what they were; {guard}", s.share());
        }
        if let Some(pulled) = &self.pulled {
            t.push_str(&pulled.lines());
        } else {
            self.sizes(&mut t);
        }
        if let Ok(tension) = stitches::measure(&s.mesh, &s.tensions())
            && !s.mesh.threads.is_empty()
        {
            let all = tension.all;
            let _ = writeln!(
                t,
                "stitch     tension {:.3} / {:.3} / {:.3} N (min / mean / max), {:.0} % slack",
                all.min_n,
                all.mean_n,
                all.max_n,
                100.0 * all.slack_share
            );
        }
        if !self.curve.is_empty() {
            // on the way out: coming back is another curve
            let mut furthest = 0.0f64;
            let out: Vec<&(f64, f64)> = self
                .curve
                .iter()
                .filter(|(angle, _)| {
                    let is_new = angle.abs() >= furthest;
                    furthest = furthest.max(angle.abs());
                    is_new
                })
                .collect();
            let at = |angle: f64| {
                let near = out.iter().filter(|(a, _)| (a.abs() - angle).abs() <= 1.0).map(|(_, f)| *f);
                let (sum, count) = near.fold((0.0, 0), |(s, n), f| (s + f, n + 1));
                (count > 0).then(|| format!("{:.4} at {angle}°", sum / f64::from(count)))
            };
            let forces: Vec<String> = [5.0, 15.0, 25.0, 35.0, 45.0].into_iter().filter_map(at).collect();
            if !forces.is_empty() {
                let _ = writeln!(t, "F_nor      {} N/mm (mean over ±1°)", forces.join(", "));
            }
        }
        if s.mesh.period.is_some() {
            let [weft, warp] = s.fibres();
            let misses = [1, 0].map(|axis| self.missed(axis));
            let missed = if misses.iter().any(Option::is_some) {
                let [warp, weft] = misses.map(|miss| miss.map_or("–".into(), |miss| format!("{miss:.4}")));
                format!("; off its aim by {warp} / {weft} (rms in shear)")
            } else {
                String::new()
            };
            let _ = writeln!(
                t,
                "fibres     warp / weft {:+.3} / {:+.3} % longer, membrane force {:.3} / {:.3} N/mm at the end{missed}",
                100.0 * (warp.stretch - 1.0),
                100.0 * (weft.stretch - 1.0),
                warp.force,
                weft.force
            );
        }
        if let Some((number, share)) = self.rest {
            let (verdict, advice) =
                if share < AT_REST { ("at rest", "") } else { ("still moving", ": hold longer, or damp more") };
            let _ = writeln!(
                t,
                "rest       {verdict} after load step {} ({}), {:.2} % of the energy is kinetic{advice}",
                number + 1,
                self.loaded.case.steps[number].name(),
                100.0 * share
            );
        }
        for note in notes(self.loaded) {
            let _ = writeln!(t, "note       {note}");
        }
        let when = if self.pulled.is_some() { "while pulled" } else { "in shear" };
        let kinetic = self.worst_kinetic.map_or(String::new(), |worst| {
            if worst > 1.0 {
                format!("; kinetic exceeds internal {when}, as where nothing is strained")
            } else {
                format!("; kinetic under {:.2} % of internal {when}", 100.0 * worst)
            }
        });
        let _ = writeln!(
            t,
            "energy     internal {} mJ, friction {} mJ; balance within {:.2} %{kinetic}",
            shown(e.internal()),
            shown(e.friction),
            100.0 * self.worst_balance
        );
        let bodies = [(s.mesh.hexes(), "yarns"), (s.mesh.beams(), "threads")].into_iter().zip(self.largest_added);
        let added = bodies.filter(|((count, _), _)| *count > 0);
        let added: Vec<String> = added.map(|((_, what), share)| format!("{:.1} % of {what}", 100.0 * share)).collect();
        let squeezed =
            if s.mesh.hexes() > 0 { format!("smallest det F {:.3}; ", h.min_jacobian) } else { String::new() };
        let _ =
            writeln!(t, "checks     {squeezed}added mass at most {}; state {:016x}", added.join(", "), s.state_hash());
        let picture = self
            .pictures
            .last()
            .map_or(String::new(), |p| format!("; picture {}", self.options.output.join(p).display()));
        let _ = write!(t, "results    {}{picture}", self.options.output.display());
        t
    }

    /// Sizes of yarns before shear, beside those of the real fabric where they were measured.
    fn sizes(&self, t: &mut String) {
        let fabric = self.loaded.fabric.as_ref();
        let plies = [("warp", fabric.map(|f| &f.warp)), ("weft", fabric.map(|f| &f.weft))];
        for ((name, yarn), [width, thickness, gap]) in plies.into_iter().zip(self.settled.into_iter().flatten()) {
            let measured = yarn.and_then(|yarn| yarn.measured.as_ref());
            let target = measured.map_or(String::new(), |m| format!(" ({} {})", m.by, m.texts().join(" / ")));
            // writing to a String does not fail
            let _ = writeln!(
                t,
                "{name}       width / thickness / gap {width:.2} / {thickness:.2} / {gap:.2} mm before shear{target}"
            );
        }
    }
}

/// A number with three decimals, or with three digits where these would be zeros.
fn shown(number: f64) -> String {
    if number == 0.0 || number.abs() >= 0.1 { format!("{number:.3}") } else { format!("{number:.2e}") }
}
