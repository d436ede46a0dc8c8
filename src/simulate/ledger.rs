//! The energy ledger: what is stored now, and what has been put in and lost since the start.

use super::{Simulation, StressMean};
use crate::contact::penalty;
use crate::dynamics::integrate::{WORK_DAMPING, WORK_GRAVITY, WORK_INERTIA};
use crate::elements::hex8::LANES;
use crate::kernel::buffer::Buffer;
use crate::kernel::stage::Stage;

/// Energies now, and work done since the start, in mJ (N·mm).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Energies {
    /// Strain energy of hexahedra by mode: elongation, compaction, distortion, longitudinal shear.
    pub elongation: f64,
    pub compaction: f64,
    pub distortion: f64,
    pub shear: f64,
    /// Of threads.
    pub axial: f64,
    pub bending: f64,
    /// Elastic energy of contact, normal and tangential.
    pub contact: f64,
    /// ½ Σ m v² of the unknown: the fluctuation velocity in a periodic cell.
    pub kinetic: f64,
    /// ½ Σ m v² of the total velocity, seen from the centre of mass.
    pub kinetic_total: f64,
    /// Work lost to friction, to contact damping, and to damping.
    pub friction: f64,
    pub contact_damping: f64,
    pub damping: f64,
    /// Work put in: by the thermal strain −∫N L₀ dε_th, by growing contact radii, by the macroscopic deformation ∫ V P̄ : dF̄,
    /// by prescribed motion, by gravity, and by the added inertia of fibre lines and contact-aware mass.
    pub thermal: f64,
    pub radius: f64,
    pub external: f64,
    pub prescribed: f64,
    pub gravity: f64,
    pub inertia: f64,
}

impl Energies {
    /// Strain energy of yarns and threads.
    pub fn internal(&self) -> f64 {
        self.elongation + self.compaction + self.distortion + self.shear + self.axial + self.bending
    }

    /// All work put in.
    pub fn input(&self) -> f64 {
        self.thermal + self.radius + self.external + self.prescribed + self.gravity + self.inertia
    }

    /// All energy stored or lost.
    pub fn output(&self) -> f64 {
        self.internal() + self.contact + self.kinetic + self.friction + self.contact_damping + self.damping
    }

    /// Names and values, for a table.
    pub fn columns(&self) -> [(&'static str, f64); 18] {
        [
            ("elongation_mj", self.elongation),
            ("compaction_mj", self.compaction),
            ("distortion_mj", self.distortion),
            ("shear_mj", self.shear),
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
            ("prescribed_work_mj", self.prescribed),
            ("gravity_work_mj", self.gravity),
            ("added_inertia_work_mj", self.inertia),
        ]
    }
}

impl Simulation {
    /// Elastic energy of bodies that overlap at the start: the contact stages once, over no time, without effect.
    pub(super) fn contact_at_rest(&mut self) -> f64 {
        let b = self.model.buffers.clone();
        let (Some(force), Some(stiffness)) = (b.contact_force, b.contact_stiffness) else { return 0.0 };
        let contact = |stage: &&Stage| stage.writes.iter().any(|(buffer, _)| *buffer == force) && !stage.waits;
        let stages: Vec<Stage> = self.model.plan.step.iter().filter(contact).cloned().collect();
        let row = self.schedule.row(self.time, 1e-12, 1e-12);
        self.backend.run(&stages, &[row]);
        let mut energy = 0.0;
        for buffer in [b.contact_sums, b.pair_sums].into_iter().flatten() {
            energy += self.take(buffer).chunks_exact(penalty::SUMS).map(|s| s[penalty::SUM_ENERGY]).sum::<f64>();
        }
        for buffer in [force, stiffness, b.status] {
            self.backend.clear(buffer);
        }
        energy
    }

    /// Adds up what kernels summed per item since the last look, and sets it back.
    pub(super) fn collect_work(&mut self) {
        let nodes = self.mesh.nodes.len();
        let b = self.model.buffers.clone();
        let work = self.take(b.work);
        let plane = |k: usize| work[k * nodes..][..nodes].iter().sum::<f64>();
        self.energies.damping += plane(WORK_DAMPING);
        self.energies.inertia += plane(WORK_INERTIA);
        self.energies.gravity += plane(WORK_GRAVITY);
        if let Some(buffer) = b.beam_work {
            self.energies.thermal += self.take(buffer).iter().sum::<f64>();
        }
        if let Some(buffer) = b.reaction_work {
            self.energies.prescribed += self.take(buffer).iter().sum::<f64>();
        }
    }

    /// Adds up V P̄ over a window and the rest of contact's sums; returns the external work.
    pub(super) fn collect_stress(&mut self, steps: u64, from: f64, to: f64) -> f64 {
        let b = self.model.buffers.clone();
        let mut sum = [[0.0f64; 3]; 3];
        self.energies.contact = 0.0;
        if let Some(buffer) = b.hex_virial {
            for block in self.take(buffer).chunks_exact(9 * LANES) {
                for (k, lanes) in block.chunks_exact(LANES).enumerate() {
                    sum[k / 3][k % 3] += lanes.iter().sum::<f64>();
                }
            }
        }
        for buffer in [b.beam_virial, b.bend_virial].into_iter().flatten() {
            for item in self.take(buffer).chunks_exact(9) {
                for (k, value) in item.iter().enumerate() {
                    sum[k / 3][k % 3] += value;
                }
            }
        }
        for (buffer, is_face) in [(b.contact_sums, true), (b.pair_sums, false)] {
            let Some(buffer) = buffer else { continue };
            for (item, values) in self.take(buffer).chunks_exact(penalty::SUMS).enumerate() {
                self.energies.contact += values[penalty::SUM_ENERGY];
                self.energies.friction += values[penalty::SUM_FRICTION];
                self.energies.contact_damping += values[penalty::SUM_DAMPING];
                self.energies.radius += values[penalty::SUM_RADIUS];
                if is_face {
                    self.slip[item] += values[penalty::SUM_SLIP];
                }
                for (k, value) in values[penalty::SUM_VIRIAL..][..9].iter().enumerate() {
                    sum[k / 3][k % 3] += value;
                }
            }
        }
        if self.mesh.period.is_none() {
            return 0.0;
        }
        let old = self.schedule.row(from.max(0.0), 1.0, 1.0).gradient;
        let new = self.schedule.row(to, 1.0, 1.0).gradient;
        let mut work = 0.0;
        for i in 0..3 {
            for j in 0..3 {
                self.stress.sum[i][j] += sum[i][j];
                work += sum[i][j] / steps as f64 * (new[i][j] - old[i][j]);
            }
        }
        self.stress.steps += steps;
        work
    }

    /// The scalars of a buffer, which is then set to zero.
    pub(super) fn take(&mut self, buffer: Buffer) -> Vec<f64> {
        let values = self.backend.scalars(buffer);
        self.backend.clear(buffer);
        values
    }

    /// V P̄ averaged over the steps since the last call, N·mm; `None` if there was none.
    pub fn take_stress(&mut self) -> Option<[[f64; 3]; 3]> {
        let StressMean { sum, steps } = std::mem::take(&mut self.stress);
        (steps > 0).then(|| sum.map(|row| row.map(|x| x / steps as f64)))
    }

    /// Energies that belong to the present state.
    pub(super) fn state_energies(&self) -> Energies {
        let b = &self.model.buffers;
        let mut e = Energies::default();
        if let Some(buffer) = b.hex_energy {
            let values = self.backend.scalars(buffer);
            let mut modes = [0.0; 4];
            for (block, lane) in &self.model.hex_place {
                for (mode, sum) in modes.iter_mut().enumerate() {
                    *sum += values[(block * 5 + mode) * LANES + lane];
                }
            }
            [e.elongation, e.compaction, e.distortion, e.shear] = modes;
        }
        for (tension, [length, stiffness]) in self.tensions().iter().zip(&self.model.beams) {
            e.axial += 0.5 * tension * tension / stiffness * length;
        }
        if let Some(buffer) = b.bend_energy {
            e.bending = self.backend.scalars(buffer).iter().sum();
        }
        e.kinetic = self.kinetic(false);
        e.kinetic_total = self.kinetic(true);
        e
    }

    pub(super) fn kinetic(&self, total: bool) -> f64 {
        let nodes = self.mesh.nodes.len();
        let v = self.backend.scalars(self.model.buffers.velocity);
        let rate =
            if total { self.schedule.row(self.time, 1.0, self.dt_before.max(1e-12)).rate } else { [[0.0; 3]; 3] };
        let mass: f64 = self.model.mass.iter().sum();
        let centre = [0, 1, 2].map(|k| {
            let moments = self.mesh.nodes.iter().zip(&self.model.mass).map(|(x, m)| m * x[k]);
            if total { moments.sum::<f64>() / mass } else { 0.0 }
        });
        let mut sum = 0.0;
        for (node, x) in self.mesh.nodes.iter().enumerate() {
            let x = [0, 1, 2].map(|k| x[k] - centre[k]);
            for k in 0..3 {
                let affine = rate[k][0] * x[0] + rate[k][1] * x[1] + rate[k][2] * x[2];
                let v = v[node + k * nodes] + affine;
                sum += 0.5 * self.model.mass[node] * v * v;
            }
        }
        sum
    }
}
