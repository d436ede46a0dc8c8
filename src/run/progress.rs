//! Progress of a run, for the waiting user.

use super::session::Run;
use indicatif::{HumanDuration, ProgressBar, ProgressStyle};
use std::io::Write as _;
use std::time::{Duration, Instant};

impl Run<'_> {
    pub(super) fn bar(&self) -> ProgressBar {
        if self.options.quiet {
            return ProgressBar::hidden();
        }
        let style = ProgressStyle::with_template("{bar:24} {percent:>3}% {elapsed} {msg}");
        ProgressBar::new(1_000_000).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
    }

    /// Shows the progress on a bar or, without a terminal, as a line every minute; the line is written to `run.log` in either case.
    pub(super) fn tell(&mut self, bar: &ProgressBar, phase: &str) {
        const EVERY: Duration = Duration::from_secs(60);
        let s = &self.simulation;
        let e = s.energies();
        let done = s.time() / s.schedule.end();
        bar.set_position((done * 1e6) as u64);
        // in steps of the current length: the load rate differs between load steps
        let steps = (s.schedule.end() - s.time()) / s.dt();
        let each = (self.wall() - self.taken_up.1) / s.step().saturating_sub(self.taken_up.0).max(1) as f64;
        let left = HumanDuration(Duration::from_secs_f64((steps * each).clamp(0.0, 1e8)));
        let load = s.load();
        let loaded = match s.mesh().period {
            Some(_) => format!("γ {:.1}°", load.angle.to_degrees()),
            None => format!("d {:.2} mm", s.displacement()),
        };
        let message = format!(
            "{left} left: {phase} {loaded} step {} dt {:.2e} s, internal {:.3e} mJ, kinetic {:.1e} mJ, balance {:+.2} %",
            s.step(),
            s.dt(),
            e.internal(),
            e.kinetic,
            100.0 * s.health().balance
        );
        if self.told.elapsed() >= EVERY {
            self.told = Instant::now();
            let line = format!("{:.1} %, {:.0} s, {message}", 100.0 * done, self.wall());
            self.log.add(&line);
            if bar.is_hidden() && !self.options.quiet {
                // a reader that has closed the pipe does not stop a run
                let _ = writeln!(std::io::stderr(), "{line}");
            }
        }
        bar.set_message(message);
    }
}
