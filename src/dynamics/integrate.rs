//! Time integration by central differences, with mass-proportional damping if the scene has any. In a periodic cell the unknown
//! is the fluctuation w of x = F̄X + w, and damping acts on its velocity only.
//!
//! v⁺ = ((1 − α dt/2) v⁻ + a dt)/(1 + α dt/2), then w⁺ = w + v⁺ dt. Work is computed with the mean velocity (v⁻ + v⁺)/2, so the
//! change of kinetic energy is exactly the work of all forces. Only active effects are computed and their work recorded.

use super::BLOCK;
use crate::contact::status;
use crate::kernel::buffer::Kind::{Int, Scalar, Uint};
use crate::kernel::interface::{Slot, constants, slot};
use crate::kernel::io::{Io, raise};
use crate::kernel::lane::{Lane, Real};
use crate::kernel::position::{self, carry};
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::Kernel;
use bytemuck::{Pod, Zeroable};
use std::ops::Range;
use std::sync::atomic::Ordering;

/// Constants of the stage.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Params {
    /// First node of a thread.
    pub first_thread: u32,
    /// Gravity, mm/s².
    pub gravity: [f32; 3],
}

/// Kinds of work on nodes during integration. Each has a plane in the work buffer, in this order.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Works {
    /// Energy lost to damping.
    pub damping: bool,
    /// Work of fibre lines and of added mass.
    pub inertia: bool,
    pub gravity: bool,
}

impl Works {
    /// Planes of the active kinds.
    pub const fn planes(self) -> [Option<usize>; 3] {
        const fn plane(is_there: bool, number: usize) -> Option<usize> {
            if is_there { Some(number) } else { None }
        }
        let (inertia, gravity) = (self.before_inertia(), self.before_gravity());
        [plane(self.damping, 0), plane(self.inertia, inertia), plane(self.gravity, gravity)]
    }

    /// Number of planes before the inertia plane.
    const fn before_inertia(self) -> usize {
        self.damping as usize
    }

    /// Number of planes before the gravity plane.
    const fn before_gravity(self) -> usize {
        self.damping as usize + self.inertia as usize
    }

    /// Number of active kinds.
    pub const fn count(self) -> usize {
        self.damping as usize + self.inertia as usize + self.gravity as usize
    }
}

/// Integration; with `LINES`, the correction of fibre lines is added first; with `GRAVITY`, the work of the weight is recorded;
/// with `MASS_ADDED`, the effective mass may exceed the nodal mass.
pub struct Integrate<const LINES: bool, const GRAVITY: bool, const DAMPING: bool, const MASS_ADDED: bool>;

impl<const LINES: bool, const GRAVITY: bool, const DAMPING: bool, const MASS_ADDED: bool>
    Integrate<LINES, GRAVITY, DAMPING, MASS_ADDED>
{
    const WORKS: Works = Works { damping: DAMPING, inertia: LINES || MASS_ADDED, gravity: GRAVITY };
}

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
            when(Self::WORKS.count() > 0, "WORKS"),
        ],
        constants: &[
            &position::CONSTANTS,
            &status::CONSTANTS,
            &constants![uint: INERTIA_PLANE = Self::WORKS.before_inertia(), GRAVITY_PLANE = Self::WORKS.before_gravity()],
        ],
        ..Shader::new("dynamics/integrate", "integrate")
    };
    const SLOTS: &'static [Slot] = &[
        Slot::read("acceleration", Scalar),
        Slot::read("mass", Scalar).when(Self::WORKS.count() > 0),
        Slot::read("inverse_mass", Scalar).when(MASS_ADDED),
        Slot::read("correction", Scalar).when(LINES),
        Slot::read("true_mass", Scalar).when(GRAVITY),
        // mm/s
        Slot::planes("velocity", Scalar, 3),
        Slot::planes("quanta", Int, 3),
        Slot::planes("remainder", Scalar, 3),
        // work, mJ, one plane per kind, see [`Works`]
        Slot::planes("work", Scalar, Self::WORKS.count()).when(Self::WORKS.count() > 0),
        Slot::atomic("status", Uint),
    ];

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let works = Self::WORKS;
        let [damped_plane, inertia_plane, fallen_plane] = works.planes();
        let params: Params = io.params();
        let acceleration = io.view::<L::Scalar>(slot!(Self::SLOTS, "acceleration"));
        let plane = acceleration.len() / 3;
        let masses =
            if works.count() > 0 { io.scalars(slot!(Self::SLOTS, "mass", Self::WORKS.count() > 0)) } else { &[] };
        let inverse = MASS_ADDED.then(|| io.view::<L::Scalar>(slot!(Self::SLOTS, "inverse_mass", MASS_ADDED)));
        let correction = LINES.then(|| io.view::<L::Scalar>(slot!(Self::SLOTS, "correction", LINES)));
        let true_masses = if GRAVITY { io.scalars(slot!(Self::SLOTS, "true_mass", GRAVITY)) } else { &[] };
        let mut velocity = io.own::<L::Scalar>(slot!(Self::SLOTS, "velocity"));
        let mut quanta = io.own::<i32>(slot!(Self::SLOTS, "quanta"));
        let mut remainder = io.own::<L::Scalar>(slot!(Self::SLOTS, "remainder"));
        let mut kept =
            (works.count() > 0).then(|| io.own::<L::Scalar>(slot!(Self::SLOTS, "work", Self::WORKS.count() > 0)));
        let row = io.row;
        let (zero, half) = (L::Scalar::from_f64(0.0), L::Scalar::from_f64(0.5));
        let border = params.first_thread as usize;
        let solids = items.start..items.end.min(border);
        let threads = items.start.max(border)..items.end;
        let status = io.atomic_uints(slot!(Self::SLOTS, "status"));
        let [own, next] = [status::NOW, status::NEXT].map(|from| status::turn(row.turn.to_i32(), from));
        if items.start == 0 {
            status[next].store(0, Ordering::Relaxed);
            status[next + 1].store(0, Ordering::Relaxed);
        }
        for kind in 0..2 {
            let (nodes, damping) =
                if kind == 0 { (&solids, row.damping_solid) } else { (&threads, row.damping_thread) };
            let (keep, gain) = factors::<_, DAMPING>(damping, row.dt_mid);
            let mut fastest = zero;
            for first in nodes.clone().step_by(BLOCK) {
                let count = BLOCK.min(nodes.end - first);
                let mass = if works.count() > 0 { &masses[first..][..count] } else { &[] };
                let heavy = if GRAVITY { &true_masses[first..][..count] } else { &[] };
                // effective mass beyond the nodal mass, and works summed over the axes
                let [mut extra, mut damped, mut inertia, mut fallen] = [[zero; BLOCK]; 4];
                let mut squares = [zero; BLOCK];
                if let Some(inverse) = &inverse {
                    for ((extra, inverse), mass) in extra.iter_mut().zip(inverse.slice(first, count)).zip(mass) {
                        *extra = if *inverse == zero { zero } else { L::Scalar::from_f64(1.0) / *inverse - *mass };
                    }
                }
                for k in 0..3 {
                    let a = acceleration.slice(first + k * plane, count);
                    let correction = match &correction {
                        Some(correction) => correction.slice(first + k * plane, count),
                        None => &[],
                    };
                    let gravity = L::Scalar::from_f64(f64::from(params.gravity[k]));
                    let (v, q) = (velocity.slice(k, first, count), quanta.slice(k, first, count));
                    let r = remainder.slice(k, first, count);
                    let mut new = [zero; BLOCK];
                    for i in 0..count {
                        let mut a = a[i];
                        let mut virtual_force = zero;
                        if LINES {
                            a = a + correction[i];
                            virtual_force = (mass[i] + extra[i]) * correction[i];
                        }
                        if MASS_ADDED {
                            virtual_force = virtual_force - extra[i] * a;
                        }
                        new[i] = if DAMPING { v[i] * keep + a * gain } else { v[i] + a * gain };
                        let mean = half * (v[i] + new[i]);
                        if DAMPING {
                            damped[i] = damped[i] + mass[i] * damping * mean * mean * row.dt_mid;
                        }
                        if LINES || MASS_ADDED {
                            inertia[i] = inertia[i] + virtual_force * mean * row.dt_mid;
                        }
                        if GRAVITY {
                            fallen[i] = fallen[i] + heavy[i] * gravity * mean * row.dt_mid;
                        }
                    }
                    v.copy_from_slice(&new[..count]);
                    for i in 0..count {
                        (q[i], r[i]) = carry(q[i], r[i] + new[i] * row.dt);
                    }
                    for i in 0..count {
                        squares[i] = squares[i] + new[i] * new[i];
                    }
                }
                for i in 0..BLOCK {
                    fastest = fastest.max(squares[i]);
                }
                let works = [(damped_plane, damped), (inertia_plane, inertia), (fallen_plane, fallen)];
                for (plane, done) in works {
                    if let (Some(kept), Some(plane)) = (&mut kept, plane) {
                        let kept = kept.slice(plane, first, count);
                        kept.iter_mut().zip(&done).for_each(|(kept, done)| *kept = *kept + *done);
                    }
                }
            }
            raise(&status[own + kind], fastest.sqrt());
        }
    }
}
