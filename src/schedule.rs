//! Load history: prescribed loads as smooth functions of time, and as the row of one time step.

use crate::kernel::row::Row;
use crate::measure::shear::gradient;
use crate::settings::effects::Effects;
use crate::settings::steps::{Along, Step};

/// The load steps of a case.
#[derive(Debug, Clone)]
pub struct Schedule {
    phases: Vec<Phase>,
    initial_radius: f64,
}

/// One load step: its times, and the loads at its start and end.
#[derive(Debug, Clone)]
pub struct Phase {
    pub name: &'static str,
    /// Start and end, s.
    pub start: f64,
    pub end: f64,
    /// Conditions on a cell along x and y, and whether this step ramps to them.
    pub along: [Along; 2],
    pub stretches: bool,
    from: Load,
    to: Load,
    /// Amplitudes of prescribed motion from the start to the end, if they are given in between: share of the duration, and value.
    amplitudes: Vec<[f64; 2]>,
    /// Damping rates of solids and of threads, 1/s.
    damping: [f64; 2],
}

/// Prescribed loads at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// Shear angle, rad.
    pub angle: f64,
    /// Share of the thermal strain.
    pub thermal: f64,
    /// Contact radius over full radius.
    pub radius: f64,
    /// Amplitude of prescribed motion.
    pub motion: f64,
}

/// S(τ) = τ²(3 − 2τ): zero velocity at both ends.
fn smooth(t: f64) -> f64 {
    t * t * (3.0 - 2.0 * t)
}

/// A ramp of constant velocity, except in the first and last tenths, where the velocity rises and falls linearly.
pub fn ramp(t: f64) -> f64 {
    const ENDS: f64 = 0.1;
    let rise = |t: f64| t * t / (2.0 * ENDS);
    let total = 1.0 - ENDS;
    if t < ENDS {
        rise(t) / total
    } else if t > 1.0 - ENDS {
        1.0 - rise(1.0 - t) / total
    } else {
        (t - 0.5 * ENDS) / total
    }
}

/// A monotone cubic curve through points whose abscissas increase (Fritsch and Carlson, 1980): it rises and falls as the points do,
/// with slope zero at both ends and at extremes.
fn curve(points: &[[f64; 2]], t: f64) -> f64 {
    let secant = |i: usize| (points[i + 1][1] - points[i][1]) / (points[i + 1][0] - points[i][0]);
    let slope = |i: usize| {
        if i == 0 || i + 1 == points.len() || secant(i - 1) * secant(i) <= 0.0 {
            return 0.0;
        }
        2.0 * secant(i - 1) * secant(i) / (secant(i - 1) + secant(i))
    };
    let i = (1..points.len() - 1).take_while(|i| points[*i][0] <= t).count();
    let [[from, low], [to, high]] = [points[i], points[i + 1]];
    let (width, s) = (to - from, (t - from) / (to - from));
    let tangents = width * (slope(i) * s * (1.0 - s) * (1.0 - s) - slope(i + 1) * s * s * (1.0 - s));
    low + (high - low) * smooth(s) + tangents
}

impl Schedule {
    /// The schedule of a case; `in_cell` for a periodic scene.
    pub fn new(steps: &[Step], effects: &Effects, in_cell: bool) -> Self {
        let initial_radius = effects.contact.as_ref().map_or(1.0, |c| c.initial_radius_ratio);
        let pretensioned = steps.iter().any(|s| matches!(s, Step::Pretension { .. }));
        let radius = if pretensioned { initial_radius } else { 1.0 };
        let mut load = Load { angle: 0.0, thermal: 0.0, radius, motion: 0.0 };
        let mut along = [Along::Held; 2];
        let mut start = 0.0;
        let mut phases = Vec::new();
        for step in steps {
            let to = match *step {
                Step::Settle { .. } | Step::Hold { .. } => load,
                Step::Stretch { warp, weft, .. } => {
                    along = [weft, warp];
                    load
                }
                Step::Pretension { .. } => Load { thermal: 1.0, radius: 1.0, ..load },
                Step::Shear { angle_deg, .. } => Load { angle: angle_deg.to_radians(), ..load },
                Step::Move { to, .. } => Load { motion: to, ..load },
            };
            let end = start + step.time();
            let damping = effects.damping.as_ref().map_or([0.0; 2], |d| match step {
                Step::Settle { .. } | Step::Pretension { .. } => [d.rate_per_s, d.thread_settle_rate_per_s],
                // in a cell damping acts on the fluctuation only
                Step::Shear { .. } if !in_cell => [d.move_rate_per_s.unwrap_or(d.rate_per_s); 2],
                Step::Hold { .. } | Step::Shear { .. } | Step::Stretch { .. } => [d.rate_per_s; 2],
                Step::Move { .. } => [d.move_rate_per_s.unwrap_or(d.rate_per_s); 2],
            });
            let stretches = matches!(step, Step::Stretch { .. });
            let amplitudes = match step {
                Step::Move { to, through, .. } if !through.is_empty() => {
                    [&[[0.0, load.motion]], &through[..], &[[1.0, *to]]].concat()
                }
                _ => Vec::new(),
            };
            phases.push(Phase { name: step.name(), start, end, along, stretches, from: load, to, amplitudes, damping });
            (load, start) = (to, end);
        }
        Self { phases, initial_radius: radius.min(initial_radius) }
    }

    pub fn phases(&self) -> &[Phase] {
        &self.phases
    }

    /// End of the last load step, s.
    pub fn end(&self) -> f64 {
        self.phases.last().map_or(0.0, |p| p.end)
    }

    /// Number of the load step at a time; a moment between two belongs to the earlier one.
    pub fn phase_at(&self, time: f64) -> usize {
        self.phases.iter().position(|p| time <= p.end).unwrap_or(self.phases.len().saturating_sub(1))
    }

    /// Prescribed loads at a time.
    pub fn load(&self, time: f64) -> Load {
        let Some(phase) = self.phases.get(self.phase_at(time)) else {
            return Load { angle: 0.0, thermal: 0.0, radius: self.initial_radius, motion: 0.0 };
        };
        let t = ((time - phase.start) / (phase.end - phase.start)).clamp(0.0, 1.0);
        let between = |a: f64, b: f64, t: f64| a + (b - a) * t;
        Load {
            angle: between(phase.from.angle, phase.to.angle, ramp(t)),
            thermal: between(phase.from.thermal, phase.to.thermal, smooth(t)),
            radius: between(phase.from.radius, phase.to.radius, smooth((2.0 * t).min(1.0))),
            motion: match &phase.amplitudes[..] {
                [] => between(phase.from.motion, phase.to.motion, ramp(t)),
                points => curve(points, t),
            },
        }
    }

    /// The row of a step of `dt` from `time`, preceded by a step of `before`; `stretch` gives the stretches of a cell along its
    /// fibre directions at a time, which are known only during the run.
    pub fn row(&self, time: f64, dt: f64, before: f64, stretch: impl Fn(f64) -> [f64; 2]) -> Row<f64> {
        let (now, last) = (self.load(time), self.load((time - before).max(0.0)));
        let next = self.load(time + dt);
        let f = gradient(now.angle, stretch(time));
        let old = gradient(last.angle, stretch((time - before).max(0.0)));
        let mut row = Row { dt, dt_mid: 0.5 * (dt + before), closing: 1.0, searched: 1.0, ..Row::default() };
        for i in 0..2 {
            for j in 0..2 {
                row.gradient[i][j] = f[i][j] - if i == j { 1.0 } else { 0.0 };
                row.rate[i][j] = (f[i][j] - old[i][j]) / before;
            }
        }
        row.thermal = now.thermal;
        row.thermal_increment = now.thermal - last.thermal;
        row.radius = now.radius;
        row.radius_increment = now.radius - last.radius;
        row.motion = (next.motion - now.motion) / dt;
        row.amplitude = now.motion;
        let [from, to] = [now, next].map(|load| libm::sincos(0.5 * load.angle));
        (row.sine, row.cosine) = ((to.0 - from.0) / dt, (to.1 - from.1) / dt);
        if let Some(phase) = self.phases.get(self.phase_at(time)) {
            [row.damping_solid, row.damping_thread] = phase.damping;
        }
        row
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::effects::Damping;

    #[test]
    fn every_load_step_has_its_damping() {
        let damping = Damping { rate_per_s: 3.0, thread_settle_rate_per_s: 5.0, move_rate_per_s: Some(2.0) };
        let effects = Effects { damping: Some(damping), ..Effects::default() };
        let steps = [
            Step::Pretension { time_s: 1.0 },
            Step::Hold { time_s: 1.0 },
            Step::Move { to: 1.0, through: vec![], time_s: 1.0 },
        ];
        let schedule = Schedule::new(&steps, &effects, false);
        let rates = |time: f64| {
            let row = schedule.row(time, 1e-3, 1e-3, |_| [1.0; 2]);
            [row.damping_solid, row.damping_thread]
        };
        assert_eq!([0.5, 1.5, 2.5].map(rates), [[3.0, 5.0], [3.0, 3.0], [2.0, 2.0]]);
    }

    #[test]
    fn amplitudes_are_smooth_and_reach_their_ends() {
        let steps = [
            Step::Pretension { time_s: 2.0 },
            Step::Hold { time_s: 1.0 },
            Step::Shear { angle_deg: 50.0, time_s: 4.0 },
        ];
        let schedule = Schedule::new(&steps, &Effects::default(), true);
        assert_eq!(schedule.load(2.0).thermal, 1.0);
        assert_eq!(schedule.load(3.0).angle, 0.0);
        assert!((schedule.load(7.0).angle.to_degrees() - 50.0).abs() < 1e-12);
        let speed = |t: f64| (schedule.load(t + 1e-6).angle - schedule.load(t - 1e-6).angle) / 2e-6;
        assert!(speed(3.0).abs() < 1e-4 && speed(7.0).abs() < 1e-4 && speed(5.0) > 0.2);
        for t in [0.5, 3.1, 3.4, 5.0, 6.7] {
            assert!((speed(t + 1e-4) - speed(t)).abs() < 1e-3, "a kink at {t}");
        }
    }

    #[test]
    fn every_move_goes_on_from_where_the_last_one_ended() {
        let to = |to: f64| Step::Move { to, through: vec![], time_s: 1.0 };
        let schedule = Schedule::new(&[to(0.5), to(-0.25), to(1.0)], &Effects::default(), false);
        assert_eq!([0.0, 1.0, 2.0, 3.0].map(|t| schedule.load(t).motion), [0.0, 0.5, -0.25, 1.0]);
        assert_eq!(schedule.load(1.5).motion, 0.125);
    }

    #[test]
    fn a_move_passes_through_its_amplitudes_without_a_kink() {
        let through = vec![[0.25, 0.8], [0.5, 0.2], [0.75, 0.4]];
        let schedule = Schedule::new(&[Step::Move { to: 0.9, through, time_s: 4.0 }], &Effects::default(), false);
        let at = |t: f64| schedule.load(t).motion;
        for (t, value) in [(0.0, 0.0), (1.0, 0.8), (2.0, 0.2), (3.0, 0.4), (4.0, 0.9)] {
            assert!((at(t) - value).abs() < 1e-12, "{t}: {}", at(t));
        }
        let speed = |t: f64| (at(t + 1e-6) - at(t - 1e-6)) / 2e-6;
        // extremes and ends are turning points, and between points the curve is monotone
        assert!([1.0, 2.0].iter().all(|t| speed(*t).abs() < 1e-5) && speed(3.0) > 0.1);
        for i in 1..400 {
            let t = 0.01 * f64::from(i);
            assert!((speed(t + 1e-4) - speed(t - 1e-4)).abs() < 2e-3, "a kink at {t}");
            assert!((0.0..=0.9).contains(&at(t)));
        }
    }
}
