//! The true limit of the time step: 2/ω of the fastest oscillation of the whole scene about its present state, by power
//! iteration. Stiffness comes from differences of all forces, with every contact held by friction. The mass matrix includes
//! selective mass scaling (fibre lines) and contact-aware mass. Both grow with the step, so the limit is a fixed point: the step
//! that equals its own limit. A contact that is just beginning adds mass on one side of the present state only. Forces there are
//! not zero, so unequal masses would give different accelerations without any stiffness. Both sides therefore have the mass of
//! both.

use super::Simulation;
use crate::error::{Error, Result};
use crate::kernel::position::QUANTUM;
use crate::kernel::row::Row;
use crate::kernel::stage::{Plan, Stage};
use crate::plan;
use crate::settings::integration::Precision;

/// Friction coefficient at which every contact of a scene with friction sticks.
const STICK: f64 = 1e6;
/// Largest displacement of a node to either side, mm.
const REACH: f64 = 1e-6;
/// Time over which the displacement is made, s: too long for contact damping to matter.
const SLOWLY: f64 = 1.0;
/// Rounds without growth of ω that end the power iteration, and the most rounds in all.
const PATIENCE: usize = 20;
const MOST_ROUNDS: usize = 1500;
/// Relative growth of ω² that counts as none.
const SETTLED: f64 = 1e-3;
/// Relative difference between a stable and an unstable step at which the search ends.
const SAME: f64 = 0.01;
/// Least factor between two trial steps until the limit is bracketed.
const STRIDE: f64 = 1.05;
/// Multiple of the estimate at which the search is given up if every step is stable with its own mass.
const FAR: f64 = 100.0;

/// A measured limit of the time step.
#[derive(Debug, Clone, Copy)]
pub struct Limit {
    /// Largest stable step, s; far too large where the scene buckles faster than it oscillates.
    pub dt: f64,
    /// Node that moves most in the fastest oscillation.
    pub node: usize,
    /// Direction of this motion.
    pub direction: [f64; 3],
}

/// The scene about its present state.
struct Oscillation<'a> {
    scene: &'a mut Simulation,
    /// Stages of a step up to accelerations.
    stages: Vec<Stage>,
    row: Row<f64>,
    /// Displacements of the present state, mm, in planes.
    rest: Vec<f64>,
    /// Components that may move.
    free: Vec<bool>,
    motion: Vec<f64>,
    /// Mass matrix A times the motion.
    inertia: Vec<f64>,
    /// Mass that contact has added on either side so far, tonne; none without contact-aware mass.
    added: Vec<f64>,
    seed: u64,
}

impl Simulation {
    /// Largest stable step at the present state. Call it after [`advance`](Self::advance) has returned; the state stays as it is.
    ///
    /// # Errors
    /// A run in f32, whose forces are too coarse for differences.
    pub fn measured_limit(&mut self) -> Result<Limit> {
        if self.config.precision != Precision::F64 {
            return Err(Error::Unsupported(
                "the limit of the time step is measured in f64: set integration.precision".into(),
            ));
        }
        // without friction there are no buffers for it
        let mut scene = self.scene.clone();
        scene.mesh.friction = scene.mesh.friction.with(STICK);
        if let Some(contact_mass) = &mut scene.effects.contact_mass {
            contact_mass.memory = 1.0;
        }
        let stuck = plan::build(&scene, self.capacity)?.plan;
        let names = |plan: &Plan| plan.buffers.iter().map(|b| (b.name, b.len)).collect::<Vec<_>>();
        assert_eq!(names(&stuck), names(&self.model.plan), "its stages run on the buffers of this scene");
        let mut stages = stuck.step;
        let moved = self.model.buffers.remainder;
        stages.retain(|stage| stage.writes.iter().all(|(buffer, _)| *buffer != moved));
        let b = &self.model.buffers;
        let (quanta, remainder) = (self.backend.ints(b.quanta), self.backend.scalars(b.remainder));
        let rest: Vec<f64> = quanta.iter().zip(remainder).map(|(q, r)| f64::from(*q) * QUANTUM + r).collect();
        let nodes = self.scene.mesh.nodes.len();
        let mut free = vec![true; 3 * nodes];
        if let Some(prescribed) = b.prescribed {
            for condition in self.backend.uints(prescribed).chunks_exact(2) {
                (0..3)
                    .filter(|k| condition[1] >> k & 1 == 1)
                    .for_each(|k| free[condition[0] as usize + k * nodes] = false);
            }
        }
        let row = self.row(self.time, self.dt, self.dt);
        let row = Row {
            rate: [[0.0; 3]; 3],
            thermal_increment: 0.0,
            radius_increment: 0.0,
            motion: 0.0,
            cosine: 0.0,
            sine: 0.0,
            closing: 0.0,
            ..row
        };
        let changing = self.changing();
        self.backend.save(&changing);
        let first = self.health.dt_limit;
        let mut oscillation = Oscillation {
            motion: vec![0.0; 3 * nodes],
            inertia: Vec::new(),
            added: Vec::new(),
            scene: self,
            stages,
            row,
            rest,
            free,
            seed: 1,
        };
        let (mut dt, mut lasts, mut fails) = (first, 0.0, f64::INFINITY);
        while fails > (1.0 + SAME) * lasts && dt < FAR * first {
            let room = oscillation.limit(dt) / dt;
            *if room >= 1.0 { &mut lasts } else { &mut fails } = dt;
            dt = if lasts > 0.0 && fails.is_finite() {
                (lasts * fails).sqrt()
            } else if lasts > 0.0 {
                dt * room.max(STRIDE)
            } else {
                dt * room.min(1.0 / STRIDE)
            };
        }
        let motion = std::mem::take(&mut oscillation.motion);
        self.backend.restore();
        let at = |node: usize| [0, 1, 2].map(|k| motion[node + k * nodes]);
        let size = |node: &usize| at(*node).iter().map(|x| x * x).sum::<f64>();
        let node = (0..nodes).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(0);
        Ok(Limit { dt, node, direction: at(node) })
    }
}

impl Oscillation<'_> {
    /// 2/ω of the fastest oscillation with the mass that a step of `dt` requires; infinite if a scene buckles faster than it
    /// oscillates.
    fn limit(&mut self, dt: f64) -> f64 {
        (self.row.dt, self.row.dt_mid) = (dt, 0.5 * (dt + SLOWLY));
        self.scene.backend.restore();
        self.added = self.scene.model.buffers.added_mass.map_or(Vec::new(), |b| self.scene.backend.scalars(b));
        self.stir();
        let (mut best, mut since) = (0.0, 0);
        for round in 0..MOST_ROUNDS {
            let (force, response) = self.respond();
            // the Rayleigh quotient, since A times the motion is known from the previous round
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let square = dot(&self.motion, &force) / dot(&self.motion, &self.inertia);
            if round > 0 && square > best * (1.0 + SETTLED) {
                (best, since) = (square, round);
            }
            let most = response.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            if round > since + PATIENCE || most == 0.0 {
                best = best.max(square);
                break;
            }
            self.motion = response.iter().map(|x| x / most).collect();
            self.inertia = force.iter().map(|f| f / most).collect();
        }
        2.0 / best.sqrt()
    }

    /// Adds a random part to every free component, so that no mode is missed.
    fn stir(&mut self) {
        for (motion, free) in self.motion.iter_mut().zip(&self.free) {
            self.seed = self.seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            if *free {
                *motion += (self.seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
            }
        }
        self.inertia = vec![0.0; self.motion.len()];
    }

    /// K times the motion, and A⁻¹K times the motion.
    fn respond(&mut self) -> (Vec<f64>, Vec<f64>) {
        let sides = loop {
            let before = self.added.clone();
            let sides = [1.0, -1.0].map(|side| self.forces(side * REACH));
            if self.added == before {
                break sides;
            }
        };
        let slope = |i: usize, of: fn(&[Vec<f64>; 2]) -> &Vec<f64>| {
            (of(&sides[1])[i] - of(&sides[0])[i]) / (2.0 * REACH) * f64::from(u8::from(self.free[i]))
        };
        let all = 0..self.motion.len();
        (all.clone().map(|i| slope(i, |s| &s[0])).collect(), all.map(|i| slope(i, |s| &s[1])).collect())
    }

    /// Forces and accelerations with the motion times `reach` added to the present state, in planes.
    fn forces(&mut self, reach: f64) -> [Vec<f64>; 2] {
        let (b, backend) = (&self.scene.model.buffers, &mut self.scene.backend);
        backend.restore();
        let velocity: Vec<f64> = self.motion.iter().map(|u| u * reach / SLOWLY).collect();
        let moved: Vec<f64> = self.rest.iter().zip(&self.motion).map(|(x, u)| x + u * reach).collect();
        backend.clear(b.quanta);
        backend.set_scalars(b.remainder, &moved);
        backend.set_scalars(b.velocity, &velocity);
        if let Some(added) = b.added_mass {
            backend.set_scalars(added, &self.added);
        }
        backend.run(&self.stages, &[self.row]);
        if let Some(added) = b.added_mass {
            self.added = backend.scalars(added);
        }
        let mut acceleration = backend.scalars(b.acceleration);
        let inverse = backend.scalars(b.inverse_mass);
        let force = acceleration.iter().zip(inverse.iter().cycle()).map(|(a, m)| if *m > 0.0 { a / m } else { 0.0 });
        let force = force.collect();
        if let Some(correction) = b.correction {
            acceleration.iter_mut().zip(backend.scalars(correction)).for_each(|(a, c)| *a += c);
        }
        [force, acceleration]
    }
}
