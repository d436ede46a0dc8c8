//! Central differences with mass-proportional damping. In a periodic cell the unknown is the fluctuation w of
//! x = F̄X + w, and damping acts on its velocity only.
//!
//! v⁺ = ((1 − α dt/2) v⁻ + a dt)/(1 + α dt/2), then w⁺ = w + v⁺ dt. Work is taken with the mean velocity (v⁻ + v⁺)/2, for which
//! the change of kinetic energy is exactly the work of all forces.

use crate::kernel::lane::{Lane, Real};
use crate::kernel::position::carry;
use crate::kernel::shader::Shader;
use crate::kernel::stage::{Io, Kernel};
use bytemuck::{Pod, Zeroable};
use std::ops::Range;

/// Constants of the stage.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Params {
    /// First node of a thread.
    pub first_thread: u32,
    /// Gravity, mm/s².
    pub gravity: [f32; 3],
}

pub const ACCELERATION: usize = 0;
pub const MASS: usize = 1;
pub const INVERSE_MASS: usize = 2;
/// Only with `LINES`.
pub const CORRECTION: usize = 3;
/// The first write: velocity, mm/s (3 planes); without `LINES`, all writes are one number earlier.
const VELOCITY: usize = 4;
const QUANTA: usize = 5;
const REMAINDER: usize = 6;
/// Work lost to damping, work of fibre lines and added mass, and work of gravity, mJ (3 planes).
const WORK: usize = 7;

/// Places in the work buffer.
pub const WORK_DAMPING: usize = 0;
pub const WORK_INERTIA: usize = 1;
pub const WORK_GRAVITY: usize = 2;
pub const WORKS: usize = 3;

/// Integration; with `LINES`, the correction of fibre lines is added first, with `GRAVITY` gravity.
pub struct Integrate<const LINES: bool, const GRAVITY: bool>;

/// Factors on the old velocity and on the acceleration.
#[inline(always)]
pub fn factors<R: Real>(damping: R, dt: R) -> (R, R) {
    let half = damping * dt * R::from_f64(0.5);
    let one = R::from_f64(1.0);
    ((one - half) / (one + half), dt / (one + half))
}

impl<const LINES: bool, const GRAVITY: bool> Kernel for Integrate<LINES, GRAVITY> {
    const SHADER: Shader = Shader {
        defines: match (LINES, GRAVITY) {
            (true, true) => &["LINES", "GRAVITY"],
            (true, false) => &["LINES"],
            (false, true) => &["GRAVITY"],
            (false, false) => &[],
        },
        ..Shader::new("dynamics/integrate", "integrate")
    };

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let params: Params = io.params();
        let (acceleration, masses) = (io.scalars(ACCELERATION), io.scalars(MASS));
        let inverse = io.scalars(INVERSE_MASS);
        let correction = if LINES { io.scalars(CORRECTION) } else { &[] };
        let plane = masses.len();
        let missing = usize::from(!LINES);
        let mut velocity = io.own::<L::Scalar>(VELOCITY - missing);
        let mut quanta = io.own::<i32>(QUANTA - missing);
        let mut remainder = io.own::<L::Scalar>(REMAINDER - missing);
        let mut works = io.own::<L::Scalar>(WORK - missing);
        let row = io.row;
        let solid = factors(row.damping_solid, row.dt_mid);
        let thread = factors(row.damping_thread, row.dt_mid);
        let (zero, half) = (L::Scalar::from_f64(0.0), L::Scalar::from_f64(0.5));
        for node in items {
            let is_solid = node < params.first_thread as usize;
            let (keep, gain) = if is_solid { solid } else { thread };
            let damping = if is_solid { row.damping_solid } else { row.damping_thread };
            let mass = masses[node];
            // what acts beyond the true mass: added mass, and the inertia of fibre lines
            let extra = if inverse[node] == zero { zero } else { L::Scalar::from_f64(1.0) / inverse[node] - mass };
            let (mut damped, mut inertia, mut fallen) = (zero, zero, zero);
            for k in 0..3 {
                let mut a = acceleration[node + k * plane];
                let mut virtual_force = zero;
                if LINES {
                    let c = correction[node + k * plane];
                    a = a + c;
                    virtual_force = (mass + extra) * c;
                }
                if GRAVITY {
                    a = a + L::Scalar::from_f64(f64::from(params.gravity[k]));
                }
                virtual_force = virtual_force - extra * a;
                let v = velocity.at(k, node);
                let new = *v * keep + a * gain;
                let mean = half * (*v + new);
                *v = new;
                damped = damped + mass * damping * mean * mean * row.dt_mid;
                inertia = inertia + virtual_force * mean * row.dt_mid;
                if GRAVITY {
                    fallen =
                        fallen + (mass + extra) * L::Scalar::from_f64(f64::from(params.gravity[k])) * mean * row.dt_mid;
                }
                let (q, r) = (quanta.at(k, node), remainder.at(k, node));
                (*q, *r) = carry(*q, *r + new * row.dt);
            }
            let work = works.at(WORK_DAMPING, node);
            *work = *work + damped;
            let work = works.at(WORK_INERTIA, node);
            *work = *work + inertia;
            if GRAVITY {
                let work = works.at(WORK_GRAVITY, node);
                *work = *work + fallen;
            }
        }
    }
}
