//! The row of schedule data that one time step needs. Everything else is in buffers.

use super::lane::Real;
use bytemuck::{Pod, Zeroable};

/// What the schedule prescribes at one step. Units: mm, s.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Row<R> {
    /// F̄ − I, rows first.
    pub gradient: [[R; 3]; 3],
    /// Ḟ̄ over the last half step, 1/s.
    pub rate: [[R; 3]; 3],
    /// Step from this position to the next, s.
    pub dt: R,
    /// Mean of the last and this step, s: the step of the velocity.
    pub dt_mid: R,
    /// Share of the thermal strain that acts.
    pub thermal: R,
    /// Its increment since the step before.
    pub thermal_increment: R,
    /// Contact radius over full radius.
    pub radius: R,
    /// Its increment since the step before.
    pub radius_increment: R,
    /// Damping rate of solids, 1/s.
    pub damping_solid: R,
    /// Damping rate of threads, 1/s.
    pub damping_thread: R,
    /// Acceleration of the amplitude of prescribed motion, 1/s².
    pub motion: R,
    /// Bound on how fast two near bodies can approach each other, mm/s.
    pub approach: R,
}

impl Row<f64> {
    /// The row in the precision of a run.
    pub fn cast<R: Real>(&self) -> Row<R> {
        let r = R::from_f64;
        Row {
            gradient: self.gradient.map(|row| row.map(r)),
            rate: self.rate.map(|row| row.map(r)),
            dt: r(self.dt),
            dt_mid: r(self.dt_mid),
            thermal: r(self.thermal),
            thermal_increment: r(self.thermal_increment),
            radius: r(self.radius),
            radius_increment: r(self.radius_increment),
            damping_solid: r(self.damping_solid),
            damping_thread: r(self.damping_thread),
            motion: r(self.motion),
            approach: r(self.approach),
        }
    }
}

// SAFETY: `repr(C)`, one scalar type throughout, hence no padding.
unsafe impl<R: Zeroable> Zeroable for Row<R> {}
// SAFETY: as above, and every bit pattern of R is valid.
unsafe impl<R: Real> Pod for Row<R> {}
