//! Control of a periodic cell along its fibre directions: held, brought to a stretch, or driven to a membrane force.
//!
//! Between two looks at energies, stretches are linear in time, and a device takes them from the row of each step. At a look, a
//! proportional–integral control sets the rate of a driven direction from the error e of its mean force since the previous look,
//!
//! ```text
//! ṡ ← ṡ − (PROPORTIONAL Δe + INTEGRAL e Δt/t₀)/(K t₀),   t₀ the time of a window of steps
//! ```
//!
//! which leaves no residual error where the force drifts steadily. K is the apparent stiffness of the cell: straight fibres are
//! as stiff as their material, wavy fibres a hundred times softer. It comes from the covariance of changes of force and stretch
//! from window to window. A working control hides part of this stiffness, since the force follows its target whatever the stretch
//! does. K then falls gradually until force and stretch oscillate together, which reveals it. Where the stretch hardly changes, K
//! is that of straight fibres, and the control is slow and safe.

use super::Simulation;
use crate::kernel::record::{Record, Recorded};
use crate::materials;
use crate::measure::shear;
use crate::mesh::{Mesh, quality};
use crate::schedule::ramp;
use crate::settings::steps::Along;

/// Gains: shares of a change of the force error and of the error itself that a window corrects.
const PROPORTIONAL: f64 = 0.4;
const INTEGRAL: f64 = 0.08;
/// Weight of the newest window in the stiffness estimate.
const NEWEST: f64 = 0.1;
/// Deviation of the change of stretch in a window from its mean that says nothing about stiffness.
const UNSEEN: f64 = 3e-7;
/// Least stiffness, as a share of that of straight fibres, and its smallest factor from one window to the next.
const SOFTEST: f64 = 2e-3;
const SOFTER: f64 = 0.95;
/// Largest stretch rate under force control, 1/s.
const FASTEST: f64 = 2.0;
/// Share of a window of steps below which a window is too short to say anything about stiffness.
const SHORT: f64 = 0.1;

/// Stretch of both directions, x and y, and its control.
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
    /// Rates before and after it, 1/s.
    rates: [f64; 2],
    /// Stretch and membrane force, N/mm, at the start of the load step.
    from: [f64; 2],
    /// Mean membrane force over the last window, mean stretch, and the time of its middle, s.
    force: f64,
    mean: f64,
    middle: f64,
    /// Error of the force over the last window, N/mm.
    error: f64,
    /// Stiffness of straight fibres and apparent stiffness of the cell, N/mm.
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
    /// Force less its target, N/mm; `None` without a target.
    pub error: Option<f64>,
    /// Stiffness that the control uses, N/mm.
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
    /// The control of a mesh in its reference position.
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

    /// Stretches at a time that is not before the last window.
    pub(super) fn at(&self, time: f64) -> [f64; 2] {
        let after = time - self.since;
        self.directions.map(|d| d.stretch + d.rates[usize::from(after > 0.0)] * after)
    }

    /// Records the mean V P̄ of a window, N·mm, with the time, s, and the shear angle at its middle; `usual` is the duration of a
    /// full window.
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
    /// Updates the stiffness estimate, N/mm, from the last window.
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

    /// Whether a fibre direction of a cell is driven to a membrane force now.
    pub(super) fn is_driven(&self) -> bool {
        let phase = self.schedule.phases().get(self.schedule.phase_at(self.time + 0.5 * self.dt));
        phase.is_some_and(|phase| phase.along.iter().any(Along::is_driven))
    }

    /// Both fibre directions of a cell, x and y.
    pub fn fibres(&self) -> [Fibres; 2] {
        let phase = self.stretch.phase.checked_sub(1).and_then(|at| self.schedule.phases().get(at));
        let now = self.stretch();
        [0, 1].map(|k| {
            let direction = &self.stretch.directions[k];
            let driven = phase.is_some_and(|phase| phase.along[k].is_driven());
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
        let (time, window) = (self.time, self.full_window() as f64 * self.dt);
        let number = self.schedule.phase_at(time + 0.5 * self.dt);
        let Some(phase) = self.schedule.phases().get(number) else { return };
        let now = self.stretch.at(time);
        let passed = time - self.stretch.since;
        let s = &mut self.stretch;
        let (corner, begins) = (shear::corner_force(s.normalised, s.angle), s.phase != number + 1);
        let done = |time: f64| ramp(((time - phase.start) / (phase.end - phase.start)).clamp(0.0, 1.0));
        // the target stretch is that at the end of the next window, or of the load step if earlier
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
