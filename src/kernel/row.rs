//! The schedule data of one time step. Everything else is in buffers.

use super::lane::Real;
use bytemuck::{Pod, Zeroable};

/// Prescribed values at one step. Units: mm, s.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Row<R> {
    /// F̄ − I, row by row.
    pub gradient: [[R; 3]; 3],
    /// Ḟ̄ over the last half step, 1/s.
    pub rate: [[R; 3]; 3],
    /// Time from this position to the next, s.
    pub dt: R,
    /// Mean of the previous and this step, s: the time step of the velocity.
    pub dt_mid: R,
    /// Active share of the thermal strain.
    pub thermal: R,
    /// Its increment since the previous step.
    pub thermal_increment: R,
    /// Contact radius over full radius.
    pub radius: R,
    /// Its increment since the previous step.
    pub radius_increment: R,
    /// Damping rate of solids, 1/s.
    pub damping_solid: R,
    /// Damping rate of threads, 1/s.
    pub damping_thread: R,
    /// Rate of the amplitude of prescribed motion, 1/s, and the amplitude.
    pub motion: R,
    pub amplitude: R,
    /// Rates of cos γ/2 and sin γ/2 of the shear angle γ, 1/s.
    pub cosine: R,
    pub sine: R,
    /// Upper bound of the speed at which the macroscopic deformation brings two near bodies together, mm/s.
    pub affine: R,
    /// Share of the motion that closes gaps: one, or zero while displacements are tried about a state.
    pub closing: R,
    /// Zero if contact has surely not been searched since the previous step, else one.
    pub searched: R,
    /// Number of the step modulo three, for the places of what one step leaves to the next.
    pub turn: R,
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
            amplitude: r(self.amplitude),
            cosine: r(self.cosine),
            sine: r(self.sine),
            affine: r(self.affine),
            closing: r(self.closing),
            searched: r(self.searched),
            turn: r(self.turn),
        }
    }
}

// SAFETY: `repr(C)`, one scalar type throughout, hence no padding.
unsafe impl<R: Zeroable> Zeroable for Row<R> {}
// SAFETY: as above, and every bit pattern of R is valid.
unsafe impl<R: Real> Pod for Row<R> {}
