//! The energy balance: energy stored now, and work put in and lost since the start.

use super::{Simulation, StressMean};
use crate::contact::{status, sums};
use crate::error::Result;
use crate::kernel::stage::{Order, Stage};
use crate::measure::shear::trellis;
use crate::plan::Sums;
use crate::tools::motion;

/// Energies now, and work done since the start, in mJ (N·mm).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Energies {
    /// Strain energy of hexahedra by mode: elongation, compaction, distortion, longitudinal shear.
    pub elongation: f64,
    pub compaction: f64,
    pub distortion: f64,
    pub shear: f64,
    /// Hourglass energy of hexahedra with one Gauss point; `None` with eight points.
    pub hourglass: Option<f64>,
    /// Strain energy of threads.
    pub axial: f64,
    pub bending: f64,
    /// Elastic energy of contact, normal and tangential, and of ties.
    pub contact: f64,
    /// ½ Σ m v² of the solved velocity, in a periodic cell that of the fluctuation.
    pub kinetic: f64,
    /// ½ Σ m v² of the total velocity, relative to the centre of mass.
    pub kinetic_total: f64,
    /// Work lost to friction, to contact damping, and to damping.
    pub friction: f64,
    pub contact_damping: f64,
    pub damping: f64,
    /// Work put in: by the thermal strain −∫N L₀ dε_th, by growing contact radii, by the macroscopic deformation ∫ V P̄ : dF̄ in
    /// shear and in the stretch of the fibre directions, by prescribed motion, by gravity, and by the added inertia of fibre lines
    /// and contact-aware mass.
    pub thermal: f64,
    pub radius: f64,
    pub external: f64,
    pub stretch: f64,
    pub prescribed: f64,
    pub gravity: f64,
    pub inertia: f64,
}

impl Energies {
    /// Strain energy of yarns and threads.
    pub fn internal(&self) -> f64 {
        let solids = self.elongation + self.compaction + self.distortion + self.shear;
        solids + self.hourglass.unwrap_or(0.0) + self.axial + self.bending
    }

    /// All work put in.
    pub fn input(&self) -> f64 {
        self.thermal + self.radius + self.external + self.stretch + self.prescribed + self.gravity + self.inertia
    }

    /// All energy stored or lost.
    pub fn output(&self) -> f64 {
        self.internal() + self.contact + self.kinetic + self.friction + self.contact_damping + self.damping
    }

    /// Names and values, for a table.
    pub fn columns(&self) -> impl Iterator<Item = (&'static str, f64)> + use<> {
        let modes = [
            ("elongation_mj", self.elongation),
            ("compaction_mj", self.compaction),
            ("distortion_mj", self.distortion),
            ("shear_mj", self.shear),
        ];
        let others = [
            ("axial_mj", self.axial),
            ("bending_mj", self.bending),
            ("contact_mj", self.contact),
            ("kinetic_mj", self.kinetic),
            ("kinetic_total_mj", self.kinetic_total),
            ("friction_loss_mj", self.friction),
            ("contact_damping_loss_mj", self.contact_damping),
            ("damping_loss_mj", self.damping),
            ("thermal_work_mj", self.thermal),
            ("radius_work_mj", self.radius),
            ("external_work_mj", self.external),
            ("stretch_work_mj", self.stretch),
            ("prescribed_work_mj", self.prescribed),
            ("gravity_work_mj", self.gravity),
            ("added_inertia_work_mj", self.inertia),
        ];
        modes.into_iter().chain(self.hourglass.map(|energy| ("hourglass_mj", energy))).chain(others)
    }
}

impl Simulation {
    /// Elastic energy of bodies that overlap at the start: runs the contact stages once, over no time, without changing the
    /// state.
    pub(super) fn contact_at_rest(&mut self) -> Result<f64> {
        let b = self.model.buffers.clone();
        let (Some(force), Some(stiffness)) = (b.contact_force, b.contact_stiffness) else { return Ok(0.0) };
        let contact =
            |stage: &&Stage| stage.writes.iter().any(|(buffer, _)| *buffer == force) && stage.order == Order::Beside;
        let stages: Vec<Stage> = self.model.plan.step.iter().filter(contact).cloned().collect();
        let row = self.row(self.time, 1e-12, 1e-12);
        self.backend.run(&stages, &[row]);
        let taken = |stage: &&Stage| {
            let faces = b.faces.iter().flatten().map(|faces| faces.sums);
            let of_tools = b.tools.iter().flat_map(|tools| tools.sums).flatten().map(|(sums, _)| sums);
            let sums = |buffer| faces.clone().chain(of_tools.clone()).chain(b.pair_sums).any(|sums| sums == buffer);
            stage.writes.iter().any(|(buffer, _)| sums(*buffer))
        };
        let stages: Vec<Stage> = self.model.plan.collect.iter().filter(taken).cloned().collect();
        self.backend.run(&stages, &[row]);
        let totals = self.backend.scalars(self.model.totals.buffer);
        let found = self.backend.uints(b.status);
        self.alive()?;
        self.health.penetration = status::penetration(&found);
        for buffer in [force, stiffness, b.status] {
            self.backend.clear(buffer);
        }
        Ok(self.model.totals.contact.iter().map(|sums| sums.of(&totals, sums::SUM_ENERGY)).sum())
    }

    /// Runs the thread stages once before the first step, for the energy of threads that are not stress-free as generated or
    /// perturbed.
    pub(super) fn threads_at_rest(&mut self) {
        let b = &self.model.buffers;
        let results = [b.beam_tension, b.bend_energy];
        let threads = |stage: &&Stage| stage.writes.iter().any(|(buffer, _)| results.contains(&Some(*buffer)));
        let stages: Vec<Stage> = self.model.plan.step.iter().filter(threads).cloned().collect();
        let row = self.row(self.time, self.dt, self.dt_before);
        self.backend.run(&stages, &[row]);
    }

    /// Adds the work that kernels summed since the last look: force work, and motion work up to the middle of the last step.
    pub(super) fn add_work(&mut self, totals: &[f64], after: &[f64]) {
        let places = self.model.totals.clone();
        let only = |sums: Option<Sums>, totals: &[f64]| sums.map_or(0.0, |sums| sums.of(totals, 0));
        let motion = |totals: &[f64]| {
            let done = |plane: Option<usize>| match (places.work, plane) {
                (Some(work), Some(plane)) => work.of(totals, plane),
                _ => 0.0,
            };
            let [damping, inertia, gravity] = places.works.planes().map(done);
            let of_tools = |column| places.tools.map_or(0.0, |sums| sums.of(totals, column));
            [
                damping + of_tools(motion::DAMPED),
                inertia + of_tools(motion::INERTIA),
                gravity + of_tools(motion::GRAVITY),
                only(places.reaction, totals) + of_tools(motion::LOADED),
            ]
        };
        let (before, last) = (motion(totals), motion(after));
        let e = &mut self.energies;
        let kinds = [&mut e.damping, &mut e.inertia, &mut e.gravity, &mut e.prescribed];
        for (k, energy) in kinds.into_iter().enumerate() {
            *energy += self.owed[k] + before[k] + 0.5 * last[k];
            self.owed[k] = 0.5 * last[k];
        }
        e.thermal += only(places.thermal, totals);
    }

    /// Adds the energy, losses and work of contact since the last look.
    pub(super) fn add_contact(&mut self, totals: &[f64]) {
        self.energies.contact = self.model.totals.ties.map_or(0.0, |ties| ties.of(totals, 0));
        for sums in &self.model.totals.contact {
            self.energies.contact += sums.of(totals, sums::SUM_ENERGY);
            if self.model.active.friction {
                self.energies.friction += sums.of(totals, sums::SUM_FRICTION);
            }
            self.energies.contact_damping += sums.of(totals, sums::SUM_DAMPING);
            self.energies.radius += sums.of(totals, sums::SUM_RADIUS);
        }
    }

    /// Adds V P̄ over a window of `steps` from time `from` to `to`, and the external work there.
    pub(super) fn add_stress(&mut self, totals: &[f64], steps: u64, from: f64, to: f64) {
        if self.scene.mesh.period.is_none() {
            return;
        }
        let (places, virial) = (&self.model.totals, sums::virial(self.model.active.friction));
        let total = |i: usize, j: usize| {
            let elements: f64 = places.stress.iter().map(|sums| sums.of(totals, 3 * i + j)).sum();
            let contact = places.contact.iter().map(|sums| sums.of(totals, virial + 3 * i + j));
            elements + contact.sum::<f64>()
        };
        let sum = [0, 1, 2].map(|i| [0, 1, 2].map(|j| total(i, j)));
        let mean = [0, 1].map(|i| [0, 1].map(|j| sum[i][j] / steps as f64));
        // the increment of stretch × direction splits into a rotation and a stretch
        let times = [from.max(0.0), to];
        let ([old, new], [was, is]) =
            (times.map(|t| trellis(self.schedule.load(t).angle)), times.map(|t| self.stretch.at(t)));
        for i in 0..2 {
            for j in 0..2 {
                self.energies.external += mean[i][j] * 0.5 * (was[j] + is[j]) * (new[i][j] - old[i][j]);
                self.energies.stretch += mean[i][j] * 0.5 * (new[i][j] + old[i][j]) * (is[j] - was[j]);
            }
        }
        for i in 0..3 {
            for j in 0..3 {
                self.stress.sum[i][j] += sum[i][j];
            }
        }
        self.stress.steps += steps;
        let middle = 0.5 * (from.max(0.0) + to);
        let usual = self.full_window() as f64 * self.dt;
        self.stretch.see(mean, [middle, self.schedule.load(middle).angle], usual, self.area());
    }

    /// V P̄ averaged over the steps since the last call, N·mm; `None` if there was none.
    pub fn take_stress(&mut self) -> Option<[[f64; 3]; 3]> {
        let StressMean { sum, steps } = std::mem::take(&mut self.stress);
        (steps > 0).then(|| sum.map(|row| row.map(|x| x / steps as f64)))
    }

    /// Replaces the energies of the present state; kinetic energy is the mean of its values before and after the last step's
    /// motion.
    pub(super) fn set_state(&mut self, totals: &[f64], after: &[f64]) {
        let places = &self.model.totals;
        let only = |sums: Option<Sums>| sums.map_or(0.0, |sums| sums.of(totals, 0));
        let modes = [0, 1, 2, 3].map(|mode| places.modes.map_or(0.0, |sums| sums.of(totals, mode)));
        let mean = |sums: Sums| 0.5 * (sums.of(totals, 0) + sums.of(after, 0));
        let of_tools = places.tools.map_or(0.0, |sums| sums.of(after, motion::KINETIC));
        let kinetic = mean(places.kinetic) + of_tools;
        self.energies = Energies {
            elongation: modes[0],
            compaction: modes[1],
            distortion: modes[2],
            shear: modes[3],
            hourglass: places.hourglass.map(|sums| sums.of(totals, 0)),
            axial: only(places.axial),
            bending: only(places.bending),
            kinetic,
            kinetic_total: places.kinetic_total.map_or(kinetic, mean),
            ..self.energies
        };
    }
}
