//! A scene in time: drives a backend through the schedule, keeps the energy ledger, and stops what goes wrong. It writes no files.
//!
//! Steps run in bursts. After each burst the distance travelled decides on a contact search; after each window of bursts
//! the sums that kernels keep per item are added up in f64, energies and the limit of the time step are taken, and guards look.

use crate::backend::Backend;
use crate::backend::cpu::Cpu;
use crate::case::Case;
use crate::case::steps::Precision;
use crate::contact::{EMPTY, penalty, status};
use crate::dynamics::integrate::{WORK_DAMPING, WORK_GRAVITY, WORK_INERTIA};
use crate::dynamics::time_step;
use crate::elements::hex8::LANES;
use crate::error::{Error, Guard, Result};
use crate::kernel::buffer::Buffer;
use crate::kernel::lane::Isa;
use crate::kernel::position::{QUANTUM, quanta};
use crate::mesh::Mesh;
use crate::mesh::frame::{Field, Frame};
use crate::plan::{self, Capacity, Model};
use crate::schedule::{Load, Schedule};
use std::hash::Hasher;

/// Steps between two looks at the distance travelled.
const BURST: u64 = 8;
/// Bursts between two looks at energies and limits.
const WINDOW: u64 = 8;
/// Share of the contact skin that nodes may travel before a search.
const SKIN_USED: f64 = 0.35;
/// Length over which the affine motion between two searches is counted, mm.
const AFFINE_REACH: f64 = 2.0;
/// Step that a run starts with, as a share of the limit: legs that start crushed need it while they relax.
const FIRST_SHARE: f64 = 0.4;
/// Time over which the first share grows to one, s.
const FIRST_TIME: f64 = 2e-4;

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

/// What guards and reports want to know besides energies.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Health {
    /// Smallest det F of all Gauss points, and the hexahedron (in the order of the mesh) that has it.
    pub min_jacobian: f64,
    pub worst_hex: usize,
    /// Largest penetration of threads into yarns, of yarns, of threads, mm, since the last window.
    pub penetration: [f64; 3],
    /// Slave nodes and beams in contact: threads on yarns, yarns, threads.
    pub touching: [u32; 3],
    /// Relative error of the energy balance.
    pub balance: f64,
    /// Estimated limit of the time step without factors, s, and its node.
    pub dt_limit: f64,
    pub limiting_node: usize,
    /// Mass added now by contact, as a share of the true mass of solids and of threads.
    pub added_mass: [f64; 2],
}

/// A scene on a backend, at a moment.
pub struct Simulation {
    pub mesh: Mesh,
    pub model: Model,
    pub schedule: Schedule,
    backend: Box<dyn Backend>,
    case: Case,
    friction: f64,
    make: Make,
    capacity: Capacity,
    /// Time of the current positions, s.
    time: f64,
    /// Steps done.
    step: u64,
    dt: f64,
    dt_before: f64,
    searches: u64,
    gradient_at_search: Load,
    energies: Energies,
    start_energy: f64,
    largest_flow: f64,
    health: Health,
    stress: StressMean,
    slip: Vec<f64>,
    ready: bool,
}

/// How to make a backend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Make {
    pub precision: Precision,
    /// 0 for all cores.
    pub threads: usize,
    pub isa: Isa,
}

impl Default for Make {
    fn default() -> Self {
        Self { precision: Precision::F32, threads: 0, isa: Isa::best() }
    }
}

impl Make {
    fn backend(&self, model: &Model) -> Box<dyn Backend> {
        match self.precision {
            Precision::F32 => Box::new(Cpu::<f32>::new(&model.plan.buffers, self.threads, self.isa)),
            Precision::F64 => Box::new(Cpu::<f64>::new(&model.plan.buffers, self.threads, self.isa)),
        }
    }
}

/// Mean of V P̄ over the steps since it was last taken, N·mm.
#[derive(Debug, Clone, Copy, Default)]
struct StressMean {
    sum: [[f64; 3]; 3],
    steps: u64,
}

impl Simulation {
    /// A scene at rest at time zero.
    ///
    /// # Errors
    /// Geometry that cannot be run.
    pub fn new(case: &Case, friction: f64, mesh: Mesh, make: Make) -> Result<Self> {
        let capacity = Capacity::default();
        let model = plan::build(case, friction, &mesh, capacity)?;
        let backend = make.backend(&model);
        let slip = vec![0.0; model.slaves.len()];
        let schedule = Schedule::new(&case.steps, &case.effects);
        Ok(Self {
            gradient_at_search: schedule.load(0.0),
            schedule,
            backend,
            case: case.clone(),
            friction,
            make,
            capacity,
            time: 0.0,
            step: 0,
            dt: 0.0,
            dt_before: 0.0,
            searches: 0,
            energies: Energies::default(),
            start_energy: 0.0,
            largest_flow: 0.0,
            health: Health::default(),
            stress: StressMean::default(),
            slip,
            ready: false,
            mesh,
            model,
        })
    }

    pub fn time(&self) -> f64 {
        self.time
    }
    pub fn step(&self) -> u64 {
        self.step
    }
    /// The current time step, s.
    pub fn dt(&self) -> f64 {
        self.dt
    }
    /// Contact searches so far.
    pub fn searches(&self) -> u64 {
        self.searches
    }
    pub fn energies(&self) -> &Energies {
        &self.energies
    }
    pub fn health(&self) -> &Health {
        &self.health
    }
    /// What is prescribed now.
    pub fn load(&self) -> Load {
        self.schedule.load(self.time)
    }
    pub fn backend(&self) -> &dyn Backend {
        &*self.backend
    }
    /// Whether the schedule has come to its end.
    pub fn done(&self) -> bool {
        self.time >= self.schedule.end() * (1.0 - 1e-12)
    }

    /// Goes on until `until` (s), or until `stop` says so after a burst. The last step ends at or just behind `until`.
    ///
    /// # Errors
    /// A guard that was provoked.
    pub fn advance(&mut self, until: f64, mut stop: impl FnMut(&Self) -> bool) -> Result<()> {
        if !self.ready {
            self.begin()?;
        }
        while self.time < until * (1.0 - 1e-12) {
            let (from, steps) = (self.time - self.dt_before, self.step);
            for _ in 0..WINDOW {
                let remaining = ((until - self.time) / self.dt).ceil().max(1.0) as u64;
                self.burst(remaining.min(BURST))?;
                if self.time >= until * (1.0 - 1e-12) {
                    break;
                }
            }
            let work = self.collect_stress(self.step - steps, from, self.time - self.dt);
            self.energies.external += work;
            self.look()?;
            if stop(self) {
                break;
            }
        }
        Ok(())
    }

    /// First search, first energies, first time step.
    fn begin(&mut self) -> Result<()> {
        self.ready = true;
        self.dt = self.case.integration.dt_s.unwrap_or(self.case.integration.dt_max_s);
        self.dt_before = self.dt;
        self.search()?;
        self.diagnose();
        self.choose_dt();
        self.dt_before = self.dt;
        self.energies = self.state_energies();
        self.start_energy = self.energies.output();
        Ok(())
    }

    /// Some steps, then a search if the skin is used up.
    fn burst(&mut self, steps: u64) -> Result<()> {
        let mut rows = Vec::with_capacity(steps as usize);
        let mut time = self.time;
        for _ in 0..steps {
            rows.push(self.schedule.row(time, self.dt, self.dt_before));
            self.dt_before = self.dt;
            time += self.dt;
        }
        self.backend.run(&self.model.plan.step, &rows);
        self.time = time;
        self.step += steps;
        self.backend.run(&self.model.plan.watch, &rows[..1]);
        let status = self.backend.uints(self.model.buffers.status);
        self.check_flags(status[status::FLAGS])?;
        let travel = f64::from(f32::from_bits(status[status::TRAVEL]));
        let load = self.load();
        let affine = (load.angle - self.gradient_at_search.angle).abs() * AFFINE_REACH;
        let skin = self.case.effects.contact.as_ref().map_or(f64::INFINITY, |c| c.skin_mm);
        if travel + affine > SKIN_USED * skin || load.radius > self.gradient_at_search.radius {
            self.search()?;
        }
        Ok(())
    }

    /// Runs the contact search, with larger tables if they overflow.
    fn search(&mut self) -> Result<()> {
        if self.model.plan.search.is_empty() {
            return Ok(());
        }
        for _ in 0..6 {
            let row = self.schedule.row(self.time, self.dt, self.dt_before);
            self.backend.run(&self.model.plan.search, &[row]);
            let status = self.backend.uints(self.model.buffers.status);
            let full = status[status::FLAGS] & (status::CELL_FULL | status::SLOTS_FULL);
            self.clear_travel(&status);
            if full == 0 {
                self.check_flags(status[status::FLAGS])?;
                self.searches += 1;
                self.gradient_at_search = self.load();
                return Ok(());
            }
            let mut capacity = self.capacity;
            if full & status::CELL_FULL != 0 {
                capacity.cell *= 2;
            }
            if full & status::SLOTS_FULL != 0 {
                capacity.slots = (capacity.slots * 2).min(16);
                capacity.beam_slots *= 2;
            }
            self.grow(capacity)?;
        }
        Err(self.guard(
            "contact overflow",
            format!("more candidates than {:?}", self.capacity),
            "bodies have collapsed onto each other: lower the load or its speed",
        ))
    }

    /// Moves the state into a plan with larger contact tables.
    fn grow(&mut self, capacity: Capacity) -> Result<()> {
        let model = plan::build(&self.case, self.friction, &self.mesh, capacity)?;
        let mut backend = self.make.backend(&model);
        for (old, description) in self.model.plan.buffers.iter().enumerate() {
            let new = model.plan.buffers.iter().position(|d| d.name == description.name);
            let Some(new) = new.filter(|_| !matches!(description.name, "items of cells" | "cells" | "status")) else {
                continue;
            };
            let bytes = self.backend.bytes(Buffer(old));
            let bytes = if model.plan.buffers[new].len == description.len {
                bytes
            } else {
                widen(&bytes, description.len, &backend.bytes(Buffer(new)), &model, description.name)
            };
            backend.set_bytes(Buffer(new), &bytes);
        }
        self.model = model;
        self.backend = backend;
        self.capacity = capacity;
        Ok(())
    }

    fn clear_travel(&mut self, status: &[u32]) {
        let mut bytes = bytemuck::cast_slice::<u32, u8>(status).to_vec();
        for place in [status::FLAGS, status::TRAVEL] {
            bytes[4 * place..][..4].fill(0);
        }
        // flags that stop the run stay
        let stay = status[status::FLAGS] & !(status::CELL_FULL | status::SLOTS_FULL);
        bytes[4 * status::FLAGS..][..4].copy_from_slice(&stay.to_ne_bytes());
        self.backend.set_bytes(self.model.buffers.status, &bytes);
    }

    /// Energies, limits and guards after a window of steps.
    fn look(&mut self) -> Result<()> {
        self.collect_work();
        self.diagnose();
        let state = self.state_energies();
        self.energies = Energies {
            contact: self.energies.contact,
            friction: self.energies.friction,
            contact_damping: self.energies.contact_damping,
            damping: self.energies.damping,
            thermal: self.energies.thermal,
            radius: self.energies.radius,
            external: self.energies.external,
            prescribed: self.energies.prescribed,
            gravity: self.energies.gravity,
            inertia: self.energies.inertia,
            ..state
        };
        let e = &self.energies;
        let flow = [e.thermal, e.radius, e.external, e.prescribed, e.gravity].iter().map(|w| w.abs()).sum::<f64>();
        self.largest_flow = self.largest_flow.max(flow + self.start_energy.abs()).max(e.output());
        let error = e.output() - self.start_energy - e.input();
        self.health.balance = if self.largest_flow > 0.0 { error / self.largest_flow } else { 0.0 };
        self.guards()?;
        self.choose_dt();
        Ok(())
    }

    fn guards(&self) -> Result<()> {
        let h = &self.health;
        if !h.balance.is_finite() {
            return Err(self.guard("non-finite", "the energy is not a number".into(), "lower integration.safety"));
        }
        if h.min_jacobian <= 0.0 {
            let culprit = format!(
                "hexahedron {} of {} has det F = {:.3e}",
                h.worst_hex,
                self.hex_owner(h.worst_hex),
                h.min_jacobian
            );
            return Err(self.guard(
                "inversion",
                culprit,
                "load more slowly, lower integration.safety or refine the mesh",
            ));
        }
        let tolerance = self.case.integration.energy_tolerance;
        // below a nJ rounding decides
        if h.balance.abs() > tolerance && self.largest_flow > 1e-6 {
            let culprit = format!(
                "the energy balance is off by {:.1} % (tolerance {:.1} %)",
                100.0 * h.balance,
                100.0 * tolerance
            );
            return Err(self.guard("energy", culprit, "lower integration.safety or integration.dt_max_s"));
        }
        let allowed = self.case.integration.penetration_tolerance;
        let l = &self.model.limits;
        let kinds = [
            ("a thread into a yarn", l.thread_radius),
            ("a yarn into a yarn", l.yarn_thickness),
            ("a thread into a thread", l.thread_radius),
        ];
        for ((what, size), depth) in kinds.into_iter().zip(h.penetration) {
            if depth > allowed * size && self.schedule.load(self.time).radius >= 1.0 {
                let culprit = format!("{what} by {depth:.4} mm (tolerance {:.4} mm)", allowed * size);
                return Err(self.guard("penetration", culprit, "raise the contact penalties or load more slowly"));
            }
        }
        Ok(())
    }

    /// Name of the yarn that owns a hexahedron.
    fn hex_owner(&self, hex: usize) -> String {
        let mut first = 0;
        for block in &self.mesh.blocks {
            first += block.hexes();
            if hex < first {
                return block.name.clone();
            }
        }
        "?".into()
    }

    fn guard(&self, cause: &str, culprit: String, advice: &str) -> Error {
        Error::Guard(Guard { cause: cause.into(), step: self.step, time: self.time, culprit, advice: advice.into() })
    }

    fn check_flags(&self, flags: u32) -> Result<()> {
        if flags & status::NOT_FINITE != 0 {
            let culprit = match self.first_not_finite() {
                Some(node) => format!("the position of node {node} ({}) is not a number", self.node_owner(node)),
                None => "a position left the range of ±256 mm or is not a number".into(),
            };
            return Err(self.guard("non-finite", culprit, "lower integration.safety or integration.dt_max_s"));
        }
        if flags & status::FORCE_RANGE != 0 {
            let culprit = "a contact force outgrew its integer".into();
            return Err(self.guard("force range", culprit, "lower integration.safety, or load more slowly"));
        }
        Ok(())
    }

    fn first_not_finite(&self) -> Option<usize> {
        let nodes = self.mesh.nodes.len();
        self.backend.scalars(self.model.buffers.remainder).iter().position(|x| !x.is_finite()).map(|i| i % nodes)
    }

    /// Name of the body that owns a node.
    pub fn node_owner(&self, node: usize) -> String {
        let blocks = self.mesh.blocks.iter().map(|b| (b.first..b.first + b.count(), &b.name));
        let threads = self.mesh.threads.iter().map(|t| (t.first..t.first + t.count, &t.name));
        blocks
            .chain(threads)
            .find(|(range, _)| range.contains(&node))
            .map_or_else(|| "?".into(), |(_, name)| name.clone())
    }

    /// Runs the stages for energies and limits, and reads them.
    fn diagnose(&mut self) {
        let row = self.schedule.row(self.time, self.dt, self.dt_before);
        self.backend.run(&self.model.plan.diagnose, &[row]);
        let nodes = self.mesh.nodes.len();
        let limits = self.backend.scalars(self.model.buffers.element_limit);
        let (node, worst) = limits[nodes..]
            .iter()
            .enumerate()
            .fold((0, 0.0), |best, (node, k)| if *k > best.1 { (node, *k) } else { best });
        let status = self.backend.uints(self.model.buffers.status);
        let contact = f64::from(f32::from_bits(status[status::CONTACT_RATE]));
        self.health.dt_limit = time_step::limit(worst + contact) * self.model.line_factor;
        self.health.limiting_node = node;
        (self.health.min_jacobian, self.health.worst_hex) = self.worst_jacobian();
        self.health.penetration = status::PENETRATION.map(|p| f64::from(f32::from_bits(status[p])));
        let steps = (WINDOW * BURST) as u32;
        self.health.touching = status::TOUCHING.map(|p| status[p] / steps);
        let mut cleared = status;
        for place in [status::CONTACT_RATE].into_iter().chain(status::PENETRATION).chain(status::TOUCHING) {
            cleared[place] = 0;
        }
        self.backend.set_bytes(self.model.buffers.status, bytemuck::cast_slice(&cleared));
        if let Some(added) = self.model.buffers.added_mass {
            let added = self.backend.scalars(added);
            let first = self.model.first_thread;
            let share = |range: std::ops::Range<usize>| {
                let mass: f64 = self.model.true_mass[range.clone()].iter().sum();
                if mass > 0.0 { added[range].iter().sum::<f64>() / mass } else { 0.0 }
            };
            self.health.added_mass = [share(0..first), share(first..nodes)];
        }
    }

    fn worst_jacobian(&self) -> (f64, usize) {
        let Some(energy) = self.model.buffers.hex_energy else { return (1.0, 0) };
        let values = self.backend.scalars(energy);
        self.model
            .hex_place
            .iter()
            .enumerate()
            .map(|(hex, (block, lane))| (values[(block * 5 + 4) * LANES + lane], hex))
            .fold((f64::INFINITY, 0), |a, b| if b.0 < a.0 { b } else { a })
    }

    fn choose_dt(&mut self) {
        let integration = &self.case.integration;
        if let Some(dt) = integration.dt_s {
            self.dt = dt;
            return;
        }
        let settled = FIRST_SHARE + (1.0 - FIRST_SHARE) * (self.time / FIRST_TIME).min(1.0);
        let aim = (integration.safety * self.health.dt_limit).min(integration.dt_max_s) * settled;
        // upwards by little, downwards at once
        self.dt = if self.step == 0 { aim } else { aim.min(1.05 * self.dt) };
    }

    /// Adds up what kernels summed per item since the last look, and sets it back.
    fn collect_work(&mut self) {
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
    fn collect_stress(&mut self, steps: u64, from: f64, to: f64) -> f64 {
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
    fn take(&mut self, buffer: Buffer) -> Vec<f64> {
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
    fn state_energies(&self) -> Energies {
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

    fn kinetic(&self, total: bool) -> f64 {
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

    /// Axial force of each beam, N.
    pub fn tensions(&self) -> Vec<f64> {
        self.model.buffers.beam_tension.map_or_else(Vec::new, |b| self.backend.scalars(b))
    }

    /// Displacement of every node relative to F̄X, mm.
    pub fn fluctuations(&self) -> Vec<[f64; 3]> {
        let nodes = self.mesh.nodes.len();
        let quanta = self.backend.ints(self.model.buffers.quanta);
        let remainder = self.backend.scalars(self.model.buffers.remainder);
        (0..nodes)
            .map(|n| [0, 1, 2].map(|k| f64::from(quanta[n + k * nodes]) * QUANTUM + remainder[n + k * nodes]))
            .collect()
    }

    /// Velocity of every node (of the fluctuation in a periodic cell), mm/s.
    pub fn velocities(&self) -> Vec<[f64; 3]> {
        let nodes = self.mesh.nodes.len();
        let v = self.backend.scalars(self.model.buffers.velocity);
        (0..nodes).map(|n| [0, 1, 2].map(|k| v[n + k * nodes])).collect()
    }

    /// Replaces the velocity of every node, mm/s.
    pub fn set_velocities(&mut self, velocities: &[[f64; 3]]) {
        let planes: [Vec<f64>; 3] = [0, 1, 2].map(|k| velocities.iter().map(|v| v[k]).collect());
        self.backend.set_scalars(self.model.buffers.velocity, &planes.concat());
    }

    /// Replaces the displacement of every node relative to F̄X, mm. What contact remembers stays as it is.
    pub fn set_fluctuations(&mut self, displacements: &[[f64; 3]]) {
        let planes: [Vec<f64>; 3] = [0, 1, 2].map(|k| displacements.iter().map(|w| w[k]).collect());
        let planes = planes.concat();
        let whole: Vec<i32> = match self.make.precision {
            Precision::F32 => planes.iter().map(|w| quanta(*w)).collect(),
            Precision::F64 => vec![0; planes.len()],
        };
        let rest: Vec<f64> = planes.iter().zip(&whole).map(|(w, q)| w - f64::from(*q) * QUANTUM).collect();
        self.backend.set_bytes(self.model.buffers.quanta, bytemuck::cast_slice(&whole));
        self.backend.set_scalars(self.model.buffers.remainder, &rest);
    }

    /// Sum of the forces that the scene exerts on its prescribed components, N.
    pub fn reactions(&self) -> Vec<[f64; 3]> {
        self.model
            .buffers
            .reaction
            .map_or_else(Vec::new, |b| self.backend.scalars(b).chunks_exact(3).map(|f| [f[0], f[1], f[2]]).collect())
    }

    /// The deformed state, with the fields that pictures and ParaView show.
    pub fn frame(&self) -> Frame {
        let gradient = self.schedule.row(self.time, 1.0, 1.0).gradient;
        let f = [[1.0 + gradient[0][0], gradient[0][1]], [gradient[1][0], 1.0 + gradient[1][1]]];
        let positions = self
            .mesh
            .nodes
            .iter()
            .zip(self.fluctuations())
            .map(|(x, w)| [f[0][0] * x[0] + f[0][1] * x[1] + w[0], f[1][0] * x[0] + f[1][1] * x[1] + w[1], x[2] + w[2]])
            .collect();
        let mut frame = Frame {
            time: self.time,
            angle_deg: self.load().angle.to_degrees(),
            gradient: f,
            positions,
            ..Frame::default()
        };
        frame.hex_fields = self.hex_fields(&frame);
        frame.node_fields = self.contact_fields();
        let field = |name: &str, components, values| Field { name: name.into(), components, values };
        frame.node_fields.push(field("velocity_mm_s", 3, self.velocities().concat()));
        if !self.mesh.threads.is_empty() {
            frame.beam_fields = vec![field("tension_n", 1, self.tensions())];
        }
        frame
    }

    /// Energy density by mode, smallest det F, and fibre stretch of each hexahedron.
    fn hex_fields(&self, frame: &Frame) -> Vec<Field> {
        let Some(energy) = self.model.buffers.hex_energy else { return Vec::new() };
        let values = self.backend.scalars(energy);
        let names = [
            "elongation_energy_mpa",
            "compaction_energy_mpa",
            "distortion_energy_mpa",
            "shear_energy_mpa",
            "min_jacobian",
        ];
        let mut fields: Vec<Field> = names
            .iter()
            .enumerate()
            .map(|(mode, name)| {
                let density = self.model.hex_place.iter().zip(&self.model.hex_volume).map(|((block, lane), volume)| {
                    values[(block * 5 + mode) * LANES + lane] / if mode < 4 { *volume } else { 1.0 }
                });
                Field { name: (*name).into(), components: 1, values: density.collect() }
            })
            .collect();
        let mut stretches = Vec::with_capacity(self.mesh.hexes());
        let length = |a: [f64; 3], b: [f64; 3]| libm::sqrt((0..3).map(|k| (b[k] - a[k]) * (b[k] - a[k])).sum());
        for block in &self.mesh.blocks {
            for layer in 0..block.layers {
                for column in 0..block.columns {
                    for slice in 0..block.slices {
                        let c = block.corners(slice, column, layer);
                        let edges = [(0, 1), (3, 2), (4, 5), (7, 6)];
                        let stretch = edges.map(|(a, b)| {
                            let now = length(frame.position(&self.mesh, c[a]), frame.position(&self.mesh, c[b]));
                            now / length(self.mesh.position(c[a]), self.mesh.position(c[b]))
                        });
                        stretches.push(stretch.iter().sum::<f64>() / 4.0);
                    }
                }
            }
        }
        fields.push(Field { name: "fibre_stretch".into(), components: 1, values: stretches });
        fields
    }

    /// Normal force, pressure and slip of contact slaves, on nodes.
    fn contact_fields(&self) -> Vec<Field> {
        let b = &self.model.buffers;
        let (Some(keys), Some(state)) = (b.contact_keys, b.contact_state) else { return Vec::new() };
        let (keys, state) = (self.backend.uints(keys), self.backend.scalars(state));
        let nodes = self.mesh.nodes.len();
        let (mut force, mut pressure, mut slip) = (vec![0.0; nodes], vec![0.0; nodes], vec![0.0; nodes]);
        let slots = self.capacity.slots;
        for (item, slave) in self.model.slaves.iter().enumerate() {
            let normal: f64 = (0..slots)
                .map(|s| item * slots + s)
                .filter(|s| keys[s * penalty::SLOT_KEYS] != EMPTY)
                .map(|s| state[s * penalty::SLOT_STATE + 3])
                .sum();
            force[slave.node] = normal;
            slip[slave.node] = self.slip[item];
            if !slave.is_thread && slave.measure > 0.0 {
                pressure[slave.node] = normal / slave.measure;
            }
        }
        let field = |name: &str, values| Field { name: name.into(), components: 1, values };
        vec![field("contact_force_n", force), field("contact_pressure_mpa", pressure), field("slip_mm", slip)]
    }

    /// Hash of all persistent buffers and the step number: equal for equal states, bit by bit.
    pub fn state_hash(&self) -> u64 {
        let mut hasher = xxhash_rust::xxh3::Xxh3::new();
        for (i, description) in self.model.plan.buffers.iter().enumerate() {
            if description.persistent {
                hasher.update(description.name.as_bytes());
                hasher.update(&self.backend.bytes(Buffer(i)));
            }
        }
        hasher.write_u64(self.step);
        hasher.finish()
    }
}

/// Slots of an old table in the first places of wider rows of a new one.
fn widen(old: &[u8], old_len: usize, fresh: &[u8], model: &Model, name: &str) -> Vec<u8> {
    let mut new = fresh.to_vec();
    let new_len = model.plan.buffers.iter().find(|d| d.name == name).map_or(0, |d| d.len);
    let items = if name.starts_with("beam pair") { model.beams.len() } else { model.slaves.len() };
    if items == 0 || old_len % items != 0 || new_len % items != 0 {
        return new;
    }
    let (old_row, new_row) = (old.len() / items, new.len() / items);
    for item in 0..items {
        new[item * new_row..][..old_row].copy_from_slice(&old[item * old_row..][..old_row]);
    }
    new
}
