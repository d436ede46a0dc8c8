//! The closing report of a run: `summary.json` for programs, a dozen lines for the user.

use super::notes::notes;
use super::session::Run;
use crate::error::Result;
use crate::measure::stitches;
use crate::output::{file, lock};
use serde_json::json;
use std::fmt::Write as _;
use std::time::SystemTime;

/// Ratio of kinetic to total energy below which a scene is at rest.
const AT_REST: f64 = 0.01;

impl Run<'_> {
    /// Writes `summary.json`.
    pub(super) fn write_summary(&self, verdict: &str) -> Result<()> {
        let s = &self.simulation;
        let (e, h) = (s.energies(), s.health());
        let floor = s.model.whole_mass.map(|[truly, added]| if truly > 0.0 { added / truly } else { 0.0 });
        let hash = s.state_hash();
        let hash = s.alive().ok().map(|()| format!("{hash:016x}"));
        let mut summary = json!({
            "verdict": verdict,
            "program": {
                "version": env!("CARGO_PKG_VERSION"),
                // distributed builds state their commit
                "commit": option_env!("TRICOT_COMMIT"),
                "command": std::env::args().collect::<Vec<_>>().join(" "),
                "host": lock::host(),
                "started": humantime::format_rfc3339_seconds(self.began).to_string(),
                "ended": humantime::format_rfc3339_seconds(SystemTime::now()).to_string(),
            },
            "case": self.loaded.case,
            "defaults": self.loaded.defaults.iter().map(|(path, value)| json!({"path": path, "value": value})).collect::<Vec<_>>(),
            "hexes": s.mesh().hexes(),
            "beams": s.mesh().beams(),
            "nodes": s.mesh().nodes.len(),
            "backend": s.backend().describe(),
            "steps": s.step(),
            "time_s": s.time(),
            "dt_smallest_s": self.dt_range[0],
            "dt_largest_s": self.dt_range[1],
            "dt_limit_s": h.dt_limit,
            "dt_share": s.step_factor(),
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
            "notes": notes(self.loaded, s.mesh()),
            "energies_mj": e.columns().map(|(name, value)| (name.to_owned(), json!(value))).collect::<serde_json::Map<_, _>>(),
            "state_hash": hash,
            "pictures": self.pictures,
            "frames": self.frames.iter().map(|(time, file)| json!({"time_s": time, "file": file})).collect::<Vec<_>>(),
        });
        for (name, value) in self.observer.summary(s) {
            summary[name] = value;
        }
        let path = self.options.output.join("summary.json");
        file::replace(&path, |w| serde_json::to_writer_pretty(w, &summary).map_err(Into::into))
    }

    /// The closing lines for the user.
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
            s.mesh().hexes(),
            s.mesh().beams(),
            s.mesh().nodes.len(),
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
            let _ = writeln!(t, "retries    went back {times}, steps {} of what they were; {guard}", s.step_factor());
        }
        t.push_str(&self.observer.lines(s));
        if let Ok(tension) = stitches::measure(s.mesh(), &s.tensions())
            && !s.mesh().threads.is_empty()
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
        for note in notes(self.loaded, s.mesh()) {
            let _ = writeln!(t, "note       {note}");
        }
        let when = if s.mesh().period.is_some() { "in shear" } else { "while pulled" };
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
        let bodies = [(s.mesh().hexes(), "yarns"), (s.mesh().beams(), "threads")].into_iter().zip(self.largest_added);
        let added = bodies.filter(|((count, _), _)| *count > 0);
        let added: Vec<String> = added.map(|((_, what), share)| format!("{:.1} % of {what}", 100.0 * share)).collect();
        let squeezed =
            if s.mesh().hexes() > 0 { format!("smallest det F {:.3}; ", h.min_jacobian) } else { String::new() };
        let _ =
            writeln!(t, "checks     {squeezed}added mass at most {}; state {:016x}", added.join(", "), s.state_hash());
        let picture = self
            .pictures
            .last()
            .map_or(String::new(), |p| format!("; picture {}", self.options.output.join(p).display()));
        let _ = write!(t, "results    {}{picture}", self.options.output.display());
        t
    }
}

/// A number with three decimals, or with three significant digits if the decimals would be zeros.
fn shown(number: f64) -> String {
    if number == 0.0 || number.abs() >= 0.1 { format!("{number:.3}") } else { format!("{number:.2e}") }
}
