//! Central differences, with mass-proportional damping if the scene has any. In a periodic cell the unknown is the fluctuation w
//! of x = F̄X + w, and damping acts on its velocity only.
//!
//! v⁺ = ((1 − α dt/2) v⁻ + a dt)/(1 + α dt/2), then w⁺ = w + v⁺ dt. Work is taken with the mean velocity (v⁻ + v⁺)/2, for which
//! the change of kinetic energy is exactly the work of all forces. Only what a scene has is computed, and its work kept.

use crate::kernel::lane::{Lane, Real};
use crate::kernel::position::carry;
use crate::kernel::shader::{Shader, when};
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
/// Only if some work is kept; without it, what follows is one number earlier.
pub const MASS: usize = 1;
/// Only with `MASS_ADDED`; without it, what follows is one number earlier.
pub const INVERSE_MASS: usize = 2;
/// Only with `LINES`; without it, what follows is one number earlier.
pub const CORRECTION: usize = 3;
/// Only with `GRAVITY`; without it, what follows is one number earlier.
pub const TRUE_MASS: usize = 4;
/// The first write: velocity, mm/s (3 planes).
const VELOCITY: usize = 5;
const QUANTA: usize = 6;
const REMAINDER: usize = 7;
/// Works, mJ, a plane each, see [`Works`].
const WORK: usize = 8;

/// What changes the energy of nodes as they are integrated. Each has a plane in the work buffer, in this order.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Works {
    /// Loss by damping.
    pub damping: bool,
    /// Work of fibre lines and of added mass.
    pub inertia: bool,
    pub gravity: bool,
}

impl Works {
    /// Planes of the works that there are.
    pub const fn planes(self) -> [Option<usize>; 3] {
        const fn plane(is_there: bool, number: usize) -> Option<usize> {
            if is_there { Some(number) } else { None }
        }
        let (inertia, gravity) = (self.damping as usize, self.damping as usize + self.inertia as usize);
        [plane(self.damping, 0), plane(self.inertia, inertia), plane(self.gravity, gravity)]
    }

    /// How many there are.
    pub const fn count(self) -> usize {
        self.damping as usize + self.inertia as usize + self.gravity as usize
    }
}

/// Integration; with `LINES`, the correction of fibre lines is added first; with `GRAVITY` the work of weight is kept; with
/// `MASS_ADDED` the mass that acts may be more than that of the node.
pub struct Integrate<const LINES: bool, const GRAVITY: bool, const DAMPING: bool, const MASS_ADDED: bool>;

/// Factors on the old velocity and on the acceleration.
#[inline(always)]
pub fn factors<R: Real, const DAMPING: bool>(damping: R, dt: R) -> (R, R) {
    let one = R::from_f64(1.0);
    if !DAMPING {
        return (one, dt);
    }
    let half = damping * dt * R::from_f64(0.5);
    ((one - half) / (one + half), dt / (one + half))
}

impl<const LINES: bool, const GRAVITY: bool, const DAMPING: bool, const MASS_ADDED: bool> Kernel
    for Integrate<LINES, GRAVITY, DAMPING, MASS_ADDED>
{
    const SHADER: Shader = Shader {
        defines: &[
            when(LINES, "LINES"),
            when(GRAVITY, "GRAVITY"),
            when(DAMPING, "DAMPING"),
            when(MASS_ADDED, "MASS_ADDED"),
            when(LINES || MASS_ADDED, "INERTIA"),
            when(LINES || GRAVITY || DAMPING || MASS_ADDED, "WORKS"),
        ],
        ..Shader::new("dynamics/integrate", "integrate")
    };

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let works = const { Works { damping: DAMPING, inertia: LINES || MASS_ADDED, gravity: GRAVITY } };
        let [damped_plane, inertia_plane, fallen_plane] = works.planes();
        let params: Params = io.params();
        let acceleration = io.scalars(ACCELERATION);
        let plane = acceleration.len() / 3;
        let massless = usize::from(works.count() == 0);
        let masses = if works.count() > 0 { io.scalars(MASS) } else { &[] };
        let unchanged = massless + usize::from(!MASS_ADDED);
        let inverse = if MASS_ADDED { io.scalars(INVERSE_MASS - massless) } else { &[] };
        let correction = if LINES { io.scalars(CORRECTION - unchanged) } else { &[] };
        let straight = unchanged + usize::from(!LINES);
        let true_masses = if GRAVITY { io.scalars(TRUE_MASS - straight) } else { &[] };
        let missing = straight + usize::from(!GRAVITY);
        let mut velocity = io.own::<L::Scalar>(VELOCITY - missing);
        let mut quanta = io.own::<i32>(QUANTA - missing);
        let mut remainder = io.own::<L::Scalar>(REMAINDER - missing);
        let mut kept = (works.count() > 0).then(|| io.own::<L::Scalar>(WORK - missing));
        let row = io.row;
        let solid = factors::<_, DAMPING>(row.damping_solid, row.dt_mid);
        let thread = factors::<_, DAMPING>(row.damping_thread, row.dt_mid);
        let (zero, half) = (L::Scalar::from_f64(0.0), L::Scalar::from_f64(0.5));
        for node in items {
            let is_solid = node < params.first_thread as usize;
            let (keep, gain) = if is_solid { solid } else { thread };
            let damping = if is_solid { row.damping_solid } else { row.damping_thread };
            let mass = if works.count() > 0 { masses[node] } else { zero };
            // what acts beyond the mass of the node
            let added = MASS_ADDED && inverse[node] != zero;
            let extra = if added { L::Scalar::from_f64(1.0) / inverse[node] - mass } else { zero };
            let (mut damped, mut inertia, mut fallen) = (zero, zero, zero);
            for k in 0..3 {
                let mut a = acceleration[node + k * plane];
                let mut virtual_force = zero;
                if LINES {
                    let c = correction[node + k * plane];
                    a = a + c;
                    virtual_force = (mass + extra) * c;
                }
                if MASS_ADDED {
                    virtual_force = virtual_force - extra * a;
                }
                let v = velocity.at(k, node);
                let new = if DAMPING { *v * keep + a * gain } else { *v + a * gain };
                let mean = half * (*v + new);
                *v = new;
                if DAMPING {
                    damped = damped + mass * damping * mean * mean * row.dt_mid;
                }
                if LINES || MASS_ADDED {
                    inertia = inertia + virtual_force * mean * row.dt_mid;
                }
                if GRAVITY {
                    let gravity = L::Scalar::from_f64(f64::from(params.gravity[k]));
                    fallen = fallen + true_masses[node] * gravity * mean * row.dt_mid;
                }
                let (q, r) = (quanta.at(k, node), remainder.at(k, node));
                (*q, *r) = carry(*q, *r + new * row.dt);
            }
            if let Some(kept) = &mut kept {
                for (plane, done) in [(damped_plane, damped), (inertia_plane, inertia), (fallen_plane, fallen)] {
                    if let Some(plane) = plane {
                        let work = kept.at(plane, node);
                        *work = *work + done;
                    }
                }
            }
        }
    }
}
