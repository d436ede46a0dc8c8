//! Control of a periodic cell along its fibre directions: held, brought to a stretch, or driven to a membrane force.
//!
//! Stretches are linear in time between two looks at energies, so that nothing changes on a device: the row of each step has them.
//! Behind a look the rate of a direction that is driven follows the error e of its mean force since the look before,
//!
//! ```text
//! ṡ ← ṡ − (PROPORTIONAL Δe + INTEGRAL e Δt/t₀)/(K t₀),   t₀ the time of a window of steps
//! ```
//!
//! which leaves no error behind where the force drifts steadily. K is the stiffness that the cell shows: fibres that are straight
//! are as stiff as their material, and wavy ones a hundred times less. It comes from the covariance of changes of force and of
//! stretch from window to window. A control that works takes part of it away, since it makes the force follow its aim whatever the
//! stretch does; K then falls, little by little, until force and stretch swing together, by which it shows. Where the stretch hardly
//! changes, K is that of straight fibres, with which the control is slow and sure.

use super::{Simulation, WINDOW};
use crate::kernel::record::{Record, Recorded};
use crate::materials;
use crate::measure::shear;
use crate::mesh::{Mesh, quality};
use crate::schedule::ramp;
use crate::settings::steps::Along;

/// Shares of a change of force and of its error that a window takes away.
const PROPORTIONAL: f64 = 0.4;
const INTEGRAL: f64 = 0.08;
/// Weight of the newest window in what is known of the stiffness.
const NEWEST: f64 = 0.1;
/// Change of stretch in a window, beyond the usual one, that says nothing about stiffness.
const UNSEEN: f64 = 3e-7;
/// Least stiffness, as a share of that of straight fibres, and the most that it falls by in a window.
const SOFTEST: f64 = 2e-3;
const SOFTER: f64 = 0.95;
/// Fastest stretch that follows a force, 1/s.
const FASTEST: f64 = 2.0;
/// Share of a window of steps below which a window is too short to say anything about stiffness.
const SHORT: f64 = 0.1;

/// Stretch of both directions, x and y, and what drives it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stretch {
    directions: [Direction; 2],
    /// Time of the last change of rates, s.
    since: f64,
    /// Load step of the last change, from 1.
    phase: usize,
    /// F_nor over the last window, N/mm, and the shear angle in its middle.
    normalised: f64,
    angle: f64,
    /// Whether forces are known.
    seen: bool,
}

#[derive(Debug, Clone, Copy, Default)]
struct Direction {
    /// At the last change of rates.
    stretch: f64,
    /// Before and behind it, 1/s.
    rates: [f64; 2],
    /// Stretch and membrane force, N/mm, as the load step began.
    from: [f64; 2],
    /// Mean membrane force over the last window, mean stretch, and the time of its middle, s.
    force: f64,
    mean: f64,
    middle: f64,
    /// Error of the force over the last window, N/mm.
    error: f64,
    /// Stiffness of straight fibres, N/mm, and what the cell shows.
    straight: f64,
    stiffness: f64,
    /// Changes of stretch and force in a window: their means, then variance and covariance.
    changes: [f64; 4],
}

/// A fibre direction of a cell as it is now.
#[derive(Debug, Clone, Copy)]
pub struct Fibres {
    /// Length over that at the start.
    pub stretch: f64,
    /// Mean membrane force over the last window, N/mm.
    pub force: f64,
    /// By how much it missed its aim, N/mm; `None` where it has none.
    pub error: Option<f64>,
    /// Stiffness that the control counts with, N/mm.
    pub stiffness: f64,
}

impl Recorded for Stretch {
    fn record(&mut self, record: &mut Record) {
        let Self { directions, since, phase, normalised, angle, seen } = self;
        directions.record(record);
        [since, normalised, angle].into_iter().for_each(|x| x.record(record));
        phase.record(record);
        seen.record(record);
    }
}

impl Recorded for Direction {
    fn record(&mut self, record: &mut Record) {
        let Self { stretch, rates, from, force, mean, middle, error, straight, stiffness, changes } = self;
        [stretch, force, mean, middle, error, straight, stiffness].into_iter().for_each(|x| x.record(record));
        [rates, from].into_iter().for_each(|x| x.record(record));
        changes.record(record);
    }
}

impl Stretch {
    /// A mesh as it is given.
    pub(super) fn of(mesh: &Mesh) -> Self {
        let area = mesh.period.map_or(1.0, |[x, y]| x * y);
        let straight = |axis: usize| -> f64 {
            let along = mesh.blocks.iter().map(|block| {
                let (_, _, young) = materials::choose(&block.material);
                quality::volume(mesh, block) * young * block.fibre[axis].powi(4)
            });
            along.sum::<f64>() / area
        };
        let direction = |axis: usize| {
            let straight = straight(axis);
            Direction { stretch: 1.0, mean: 1.0, straight, stiffness: straight, ..Direction::default() }
        };
        Self { directions: [0, 1].map(direction), since: 0.0, phase: 0, normalised: 0.0, angle: 0.0, seen: false }
    }

    /// At a time that is not before the last window.
    pub(super) fn at(&self, time: f64) -> [f64; 2] {
        let after = time - self.since;
        self.directions.map(|d| d.stretch + d.rates[usize::from(after > 0.0)] * after)
    }

    /// Takes note of the mean V P̄, N·mm, of a window, whose middle was at a time, s, and a shear angle; `usual` is the time of a window
    /// of steps.
    pub(super) fn see(&mut self, stress: [[f64; 2]; 2], [time, angle]: [f64; 2], usual: f64, area: f64) {
        let stretch = self.at(time);
        let forces = shear::membrane_forces(stress, angle, area);
        self.normalised = shear::normalised_force(stress, angle, stretch, area);
        self.angle = angle;
        for (k, d) in self.directions.iter_mut().enumerate() {
            if self.seen {
                d.learn(forces[k], stretch[k], time, usual);
            }
            (d.force, d.mean, d.middle) = (forces[k], stretch[k], time);
        }
        self.seen = true;
    }
}

impl Direction {
    /// What the last window shows of the stiffness, N/mm.
    fn learn(&mut self, force: f64, mean: f64, middle: f64, usual: f64) {
        let passed = middle - self.middle;
        if passed < SHORT * usual {
            return;
        }
        let [x, y, variance, covariance] = &mut self.changes;
        let [dx, dy] = [(mean - self.mean) * usual / passed - *x, (force - self.force) * usual / passed - *y];
        *x += NEWEST * dx;
        *y += NEWEST * dy;
        *variance = (1.0 - NEWEST) * (*variance + NEWEST * dx * dx);
        *covariance = (1.0 - NEWEST) * (*covariance + NEWEST * dx * dy);
        let unseen = UNSEEN * UNSEEN;
        let shown = (*covariance + unseen * self.straight) / (*variance + unseen);
        let least = (SOFTER * self.stiffness).max(SOFTEST * self.straight);
        self.stiffness = shown.clamp(least, self.straight);
    }
}

impl Simulation {
    /// Reference area of a cell, mm².
    pub(super) fn area(&self) -> f64 {
        self.scene.mesh.period.map_or(1.0, |[x, y]| x * y)
    }

    /// Both fibre directions of a cell, x and y.
    pub fn fibres(&self) -> [Fibres; 2] {
        let phase = self.stretch.phase.checked_sub(1).and_then(|at| self.schedule.phases().get(at));
        let now = self.stretch();
        [0, 1].map(|k| {
            let direction = &self.stretch.directions[k];
            let driven = phase.is_some_and(|p| matches!(p.along[k], Along::CornerDriven | Along::ForceNPerMm(_)));
            Fibres {
                stretch: now[k],
                force: direction.force,
                error: driven.then_some(direction.error),
                stiffness: direction.stiffness,
            }
        })
    }

    /// Sets the rates of stretch for the next window.
    pub(super) fn steer(&mut self) {
        let (time, window) = (self.time, WINDOW as f64 * self.dt);
        let number = self.schedule.phase_at(time + 0.5 * self.dt);
        let Some(phase) = self.schedule.phases().get(number) else { return };
        let now = self.stretch.at(time);
        let passed = time - self.stretch.since;
        let s = &mut self.stretch;
        let (corner, begins) = (shear::corner_force(s.normalised, s.angle), s.phase != number + 1);
        let done = |time: f64| ramp(((time - phase.start) / (phase.end - phase.start)).clamp(0.0, 1.0));
        // a stretch is aimed at where the next window ends, at most where its load step does
        let ahead = if phase.stretches { window.min(phase.end - time).max(0.5 * self.dt) } else { window };
        let [share, share_ahead] = [time, time + ahead].map(|time| if phase.stretches { done(time) } else { 1.0 });
        for (k, d) in s.directions.iter_mut().enumerate() {
            if begins && phase.stretches {
                d.from = [now[k], d.force];
            }
            let drive = |goal: f64, d: &mut Direction| {
                let error = d.force - (d.from[1] + (goal - d.from[1]) * share);
                let change = if begins { 0.0 } else { error - d.error };
                d.error = error;
                let step = PROPORTIONAL * change + INTEGRAL * error * passed.min(window) / window;
                (d.rates[1] - step / (d.stiffness * window)).clamp(-FASTEST, FASTEST)
            };
            let rate = match phase.along[k] {
                Along::Held => 0.0,
                Along::To(goal) => (d.from[0] + (goal - d.from[0]) * share_ahead - now[k]) / ahead,
                Along::ForceNPerMm(goal) => drive(goal, d),
                Along::CornerDriven => drive(corner, d),
            };
            d.rates = [d.rates[1], rate];
            d.stretch = now[k];
        }
        (s.since, s.phase) = (time, number + 1);
    }
}
