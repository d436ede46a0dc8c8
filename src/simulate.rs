//! A scene in time: drives a backend through the schedule, keeps the energy ledger, and stops what goes wrong. It writes no files.
//!
//! Steps run in bursts, which grow as long as speeds do not and the contact skin is sure to last. After each burst the distance
//! travelled decides on a contact search. At the end of each window of bursts the sums that kernels keep per item are added up on
//! the backend, only totals come to the host, and guards look at energies and limits. They are those of one moment, where the last
//! step starts: it is looked at between its forces and its motion, and velocities are the mean of those before and after.

mod guards;
mod ledger;
mod limit;
mod retry;
mod snapshot;
mod state;
mod stretch;

pub use ledger::Energies;
pub use limit::Limit;
pub use retry::Retries;
pub use stretch::Fibres;

use crate::backend::Backend;
use crate::backend::cpu::Cpu;
use crate::backend::gpu::{Device, Gpu};
use crate::contact::found;
use crate::contact::penalty::GAPS;
use crate::contact::skin::{SKIN_APART, SKIN_USED};
use crate::contact::status;
use crate::contact::threads::MOST_PAIRS;
use crate::dynamics::time_step;
use crate::error::{Error, Result};
use crate::kernel::buffer::{Buffer, Initial};
use crate::kernel::lane::Isa;
use crate::kernel::position::QUANTUM;
use crate::kernel::row::Row;
use crate::mesh::Mesh;
use crate::plan::{self, Capacity, Model};
use crate::scene::Scene;
use crate::schedule::{Load, Schedule};
use crate::settings::integration::Precision;
use std::sync::Arc;
use stretch::Stretch;

/// Fewest steps between two looks at the distance travelled.
const BURST: u64 = 8;
/// Steps between two looks at energies and limits; the longest burst.
const WINDOW: u64 = 64;
/// Growth of the largest speed over a burst after which bursts start short again.
const CALM: f64 = 1.4;
/// Change of the speed of shear over a window, as a share of it, from which windows are as short as a burst: external work
/// is the mean stress of a window times its strain, so both must not change together.
const STEADY: f64 = 0.1;
/// Energy below which rounding decides its balance, mJ.
const NOISE: f64 = 1e-6;
/// Length over which the affine motion between two searches is counted, mm.
const AFFINE_REACH: f64 = 2.0;
/// Speeds may grow by this factor during a burst.
const SPEED_MARGIN: f64 = 2.0;
/// Farthest that nodes may travel in a burst, mm, so that the range of positions is left by less than what wraps around.
const FARTHEST: f64 = 3.0;
/// Step that a run starts with, as a share of the limit: legs that start crushed need it while they relax.
const FIRST_SHARE: f64 = 0.15;
/// Time over which the first share grows to one, s.
const FIRST_TIME: f64 = 2e-4;

/// What guards and reports want to know besides energies.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Health {
    /// Smallest det F of all Gauss points, and the hexahedron (in the order of the mesh) that has it.
    pub min_jacobian: f64,
    pub worst_hex: usize,
    /// Largest penetration of threads into yarns, of yarns, of threads, mm, since the last window.
    pub penetration: [f64; 3],
    /// Slave nodes and beams in contact, mean over the last window: threads on yarns, yarns, threads.
    pub touching: [u32; 3],
    /// Error of the energy balance over the largest energy so far, or over 1 nJ.
    pub balance: f64,
    /// Estimated limit of the time step without factors, s, and its node.
    pub dt_limit: f64,
    pub limiting_node: usize,
    /// Mass added now by the floor and by contact, as a share of the true mass of solids and of threads.
    pub added_mass: [f64; 2],
}

/// A scene on a backend, at a moment.
pub struct Simulation {
    pub scene: Scene,
    pub model: Model,
    pub schedule: Schedule,
    backend: Box<dyn Backend>,
    config: BackendConfig,
    capacity: Capacity,
    /// Time of the current positions, s.
    time: f64,
    /// Steps done.
    step: u64,
    dt: f64,
    dt_before: f64,
    /// Factor on the time step: below one in a run that has gone back.
    share: f64,
    searches: u64,
    /// Slaves and beams that were searched since the last search of everything.
    searched: u64,
    /// Seconds in stages of backends that larger tables have replaced.
    spent_before: Vec<(&'static str, f64)>,
    /// Largest speed of a node after the last burst, mm/s.
    speed: f64,
    /// Steps of the next burst.
    burst: u64,
    /// Step of the last look at energies and limits.
    diagnosed: u64,
    gradient_at_search: Load,
    /// And the stretch then.
    stretch_at_search: [f64; 2],
    stretch: Stretch,
    energies: Energies,
    start_energy: f64,
    largest_flow: f64,
    health: Health,
    /// Step since which the energy balance is off by more than half of its tolerance.
    half_off: Option<u64>,
    stress: StressMean,
    /// Half of the work of its motion, which the next look adds, mJ: see [`ledger`].
    owed: [f64; 4],
    /// Number of load steps behind which prescribed motion acts now; all of it in a new backend.
    acting: usize,
    ready: bool,
}

/// How to config a backend.
#[derive(Debug, Clone)]
pub struct BackendConfig {
    pub precision: Precision,
    /// Threads of the CPU; 0 for all cores.
    pub threads: usize,
    pub isa: Isa,
    /// The device that runs the scene; `None` for the CPU.
    pub device: Option<Arc<Device>>,
}

impl Default for BackendConfig {
    fn default() -> Self {
        Self { precision: Precision::F32, threads: 0, isa: Isa::best(), device: None }
    }
}

impl BackendConfig {
    /// # Errors
    /// A scene that the device cannot hold or compute.
    fn backend(&self, model: &Model) -> Result<Box<dyn Backend>> {
        let buffers = &model.plan.buffers;
        Ok(match (&self.device, self.precision) {
            (None, Precision::F32) => Box::new(Cpu::<f32>::new(buffers, self.threads, self.isa)),
            (None, Precision::F64) => Box::new(Cpu::<f64>::new(buffers, self.threads, self.isa)),
            (Some(device), Precision::F32) => Box::new(Gpu::new(Arc::clone(device), buffers)?),
            (Some(_), Precision::F64) => {
                let what = "a GPU computes in f32 only; set integration.precision to f32, or use --backend cpu";
                return Err(Error::Unsupported(what.into()));
            }
        })
    }
}

/// Totals in the middle of the last step of a window, between its forces and its motion, and after it.
struct Looked {
    middle: Vec<f64>,
    after: Vec<f64>,
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
    pub fn new(scene: Scene, config: BackendConfig) -> Result<Self> {
        Self::with_capacity(scene, config, Capacity::default())
    }

    /// A scene at rest at time zero whose contact tables start at a given size; they grow when they must.
    ///
    /// # Errors
    /// Geometry that cannot be run.
    pub fn with_capacity(scene: Scene, config: BackendConfig, capacity: Capacity) -> Result<Self> {
        let model = plan::build(&scene, capacity)?;
        let backend = config.backend(&model)?;
        let schedule = Schedule::new(&scene.steps, &scene.effects);
        Ok(Self {
            gradient_at_search: schedule.load(0.0),
            stretch_at_search: [1.0; 2],
            stretch: Stretch::of(&scene.mesh),
            acting: usize::MAX,
            schedule,
            backend,
            config,
            capacity,
            time: 0.0,
            step: 0,
            dt: 0.0,
            dt_before: 0.0,
            share: 1.0,
            searches: 0,
            searched: 0,
            spent_before: Vec::new(),
            speed: 1e9,
            burst: BURST,
            diagnosed: 0,
            energies: Energies { hourglass: model.totals.hourglass.map(|_| 0.0), ..Energies::default() },
            start_energy: 0.0,
            largest_flow: 0.0,
            health: Health::default(),
            half_off: None,
            stress: StressMean::default(),
            owed: [0.0; 4],
            ready: false,
            scene,
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
    /// Factor on the time step: below one in a run that has gone back.
    pub fn step_factor(&self) -> f64 {
        self.share
    }
    /// Contact searches so far.
    pub fn searches(&self) -> u64 {
        self.searches
    }
    /// Seconds spent in each stage so far, by name.
    pub fn timings(&self) -> Vec<(&'static str, f64)> {
        let mut all = self.spent_before.clone();
        for (name, spent) in self.backend.timings() {
            match all.iter_mut().find(|(known, _)| *known == name) {
                Some((_, total)) => *total += spent,
                None => all.push((name, spent)),
            }
        }
        all
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
    /// Length of a cell along x and y now, over that at the start.
    pub fn stretch(&self) -> [f64; 2] {
        self.stretch.at(self.time)
    }
    /// The row of a step at `time` that goes on by `dt` and was reached by `before`.
    fn row(&self, time: f64, dt: f64, before: f64) -> Row<f64> {
        self.schedule.row(time, dt, before, |time| self.stretch.at(time))
    }
    /// Bodies in their reference position.
    pub fn mesh(&self) -> &Mesh {
        &self.scene.mesh
    }
    pub fn backend(&self) -> &dyn Backend {
        &*self.backend
    }
    /// Whether a device runs the scene rather than the CPU.
    pub fn on_device(&self) -> bool {
        self.config.device.is_some()
    }
    /// Whether the backend still computes.
    ///
    /// # Errors
    /// What made it fail: numbers read from it since then are void.
    pub fn alive(&self) -> Result<()> {
        let at = |fault| format!("{fault}; noticed at step {} (t = {:.6e} s)", self.step, self.time);
        self.backend.fault().map_or(Ok(()), |fault| Err(Error::Device(at(fault))))
    }
    /// Whether the schedule has come to its end.
    pub fn done(&self) -> bool {
        self.time >= self.schedule.end() * (1.0 - 1e-12)
    }

    /// Goes on until `until` (s), or until `stop` says so after a burst. The last step ends at or just behind `until`.
    ///
    /// # Errors
    /// A guard that was provoked, or a device that failed.
    pub fn advance(&mut self, until: f64, mut stop: impl FnMut(&Self) -> bool) -> Result<()> {
        if !self.ready {
            self.begin()?;
        }
        while self.time < until * (1.0 - 1e-12) {
            self.steer();
            let (from, steps, window) = (self.time - self.dt_before, self.step, self.window());
            let looked = loop {
                // rounding may leave a step that is hardly there: the last one of a window is looked at, so it is taken
                let remaining = ((until.min(self.phase_end()) - self.time) / self.dt).ceil().max(1.0) as u64;
                let left = remaining.min(steps + window - self.step);
                let burst = left.min(self.burst);
                if let Some(looked) = self.burst(burst, burst == left)? {
                    break looked;
                }
            };
            self.look(&looked, self.step - steps, from, self.time - self.dt)?;
            if stop(self) {
                break;
            }
        }
        Ok(())
    }

    /// End of the load step that the next time step belongs to, s: windows do not reach beyond it.
    fn phase_end(&self) -> f64 {
        let phases = self.schedule.phases();
        phases.get(self.schedule.phase_at(self.time + 0.5 * self.dt)).map_or(f64::INFINITY, |phase| phase.end)
    }

    /// Steps until the next look at energies.
    fn window(&self) -> u64 {
        let rate = |time: f64| self.row(time, self.dt, self.dt).rate;
        let (now, then) = (rate(self.time), rate(self.time + WINDOW as f64 * self.dt));
        let change = largest([0, 1, 2].map(|i| [0, 1, 2].map(|j| then[i][j] - now[i][j])));
        if change > STEADY * largest(then).max(largest(now)) { BURST } else { WINDOW }
    }

    /// First search, first energies, first time step.
    fn begin(&mut self) -> Result<()> {
        self.ready = true;
        self.dt = self.share * self.scene.integration.dt_s.unwrap_or(self.scene.integration.dt_max_s);
        self.dt_before = self.dt;
        self.search_all()?;
        self.threads_at_rest();
        let totals = self.diagnose(self.row(self.time, self.dt, self.dt_before))?;
        self.guard_step()?;
        self.choose_dt();
        self.dt_before = self.dt;
        self.set_state(&totals, &totals);
        self.energies.contact = self.contact_at_rest()?;
        self.guard_overlap()?;
        self.start_energy = self.energies.output();
        Ok(())
    }

    /// Some steps, then a search if the skin is used up. If the last step is looked at, returns its totals.
    fn burst(&mut self, steps: u64, looks: bool) -> Result<Option<Looked>> {
        self.hold();
        let mut rows = Vec::with_capacity(steps as usize);
        let mut time = self.time;
        let looked_at = self.diagnosed == self.step;
        for step in 0..steps {
            let row = self.row(time, self.dt, self.dt_before);
            // thermal work by the trapezoidal rule; across a look, the tension after it stands for both
            let (back, ahead) = (row.thermal_increment, self.schedule.load(time + self.dt).thermal - row.thermal);
            let first = if step == 0 && looked_at { back } else { 0.5 * back };
            let second = if step + 1 == steps && looks { 0.0 } else { 0.5 * ahead };
            let affine = largest(row.rate);
            let approach = 2.0 * SPEED_MARGIN * self.speed + 2.0 * affine * AFFINE_REACH;
            rows.push(Row { approach, thermal_increment: first + second, ..row });
            self.dt_before = self.dt;
            time += self.dt;
        }
        let last = rows.len() - usize::from(looks);
        self.backend.run(&self.model.plan.step, &rows[..last]);
        self.time = time;
        self.step += steps;
        let looked = if looks { Some(self.looked_at_step(rows[last])?) } else { None };
        self.backend.run(&self.model.plan.watch, &rows[..1]);
        let status = self.backend.uints(self.model.buffers.status);
        self.alive()?;
        self.check_flags(&status)?;
        let before = std::mem::replace(&mut self.speed, f64::from(f32::from_bits(status[status::SPEED])));
        let travel = f64::from(f32::from_bits(status[status::TRAVEL]));
        let load = self.load();
        let (stretch, then) = (self.stretch(), self.stretch_at_search);
        let strained = [0, 1].map(|k| (stretch[k] - then[k]).abs()).into_iter().fold(0.0, f64::max);
        let affine = ((load.angle - self.gradient_at_search.angle).abs() + strained) * AFFINE_REACH;
        let contact = self.scene.effects.contact.as_ref().filter(|_| self.model.active.searches());
        let skin = contact.map_or(f64::INFINITY, |c| c.skin_mm);
        let mut left = SKIN_USED * skin - travel - affine;
        let found = self.model.buffers.found.into_iter().flatten();
        let all: usize = found.map(|found| self.model.plan.buffers[found.0].len).sum();
        let pays = self.searched >= all as u64;
        if affine > SKIN_APART * skin || load.radius > self.gradient_at_search.radius || left < 0.0 && pays {
            self.search_all()?;
            left = SKIN_USED * skin;
        } else if left < 0.0 {
            self.search()?;
            left = SKIN_USED * skin - affine;
        }
        // a float that is too large for an integer becomes the largest one
        let sure = (left.min(FARTHEST) / (SPEED_MARGIN * self.speed * self.dt)) as u64;
        let longer = if self.speed > CALM * before { BURST } else { 2 * self.burst };
        self.burst = longer.min(sure).clamp(BURST, WINDOW);
        Ok(looked)
    }

    /// A step with its totals in the middle and after it.
    fn looked_at_step(&mut self, row: Row<f64>) -> Result<Looked> {
        self.backend.run(&self.model.plan.step[..self.model.forces], &[row]);
        let middle = self.diagnose(row)?;
        self.backend.run(&self.model.plan.step[self.model.forces..], &[row]);
        self.backend.run(&self.model.collect_motion, &[row]);
        let after = self.backend.scalars(self.model.totals.buffer);
        self.alive()?;
        Ok(Looked { middle, after })
    }

    /// Lets prescribed motion act from its time on, by the masks of its nodes.
    fn hold(&mut self) {
        let passed = self.schedule.phases().iter().take_while(|phase| self.time >= phase.end * (1.0 - 1e-12)).count();
        let acting = if self.model.acts_after.iter().any(|after| *after > passed) { passed } else { usize::MAX };
        if acting == self.acting {
            return;
        }
        self.acting = acting;
        let Some(buffer) = self.model.buffers.prescribed else { return };
        if let Initial::Uint(all) = &self.model.plan.buffers[buffer.0].initial {
            let mut masked = all.clone();
            for (condition, after) in masked.chunks_exact_mut(2).zip(&self.model.acts_after) {
                condition[1] = if *after <= passed { condition[1] } else { 0 };
            }
            self.backend.set_bytes(buffer, bytemuck::cast_slice(&masked));
        }
    }

    /// Searches contact everywhere, and notes where nodes are: until the next time, their motion is counted from here.
    fn search_all(&mut self) -> Result<()> {
        let b = &self.model.buffers;
        if let Some(before) = b.before {
            let now = self.backend.ints(b.quanta).into_iter().zip(self.backend.scalars(b.remainder));
            let now: Vec<i32> =
                now.map(|(quanta, rest)| quanta.wrapping_add((rest / QUANTUM).round() as i32)).collect();
            self.backend.set_bytes(before, bytemuck::cast_slice(&now));
        }
        for found in b.found.into_iter().flatten() {
            let count = self.model.plan.buffers[found.0].len;
            self.backend.set_bytes(found, bytemuck::cast_slice(&vec![found::NEVER; count]));
        }
        self.search()?;
        self.searched = 0;
        self.gradient_at_search = self.load();
        self.stretch_at_search = self.stretch();
        Ok(())
    }

    /// Runs the contact search where bodies have moved relative to each other, with larger tables if they overflow: what does not
    /// fit is left as it was, so that a search that overflows leaves nothing that the next one does not find again.
    fn search(&mut self) -> Result<()> {
        if self.model.plan.search.is_empty() {
            return Ok(());
        }
        let mut crowded = None;
        for _ in 0..8 {
            let row = self.row(self.time, self.dt, self.dt_before);
            self.backend.run(&self.model.plan.search, &[row]);
            let status = self.backend.uints(self.model.buffers.status);
            self.alive()?;
            let full = status[status::FLAGS] & (status::CELL_FULL | status::SLOTS_FULL);
            self.clear_travel(&status);
            if full == 0 {
                self.check_flags(&status)?;
                self.searches += 1;
                self.searched += u64::from(status[status::SEARCHED]);
                return Ok(());
            }
            crowded = self.most_crowded();
            let mut capacity = self.capacity;
            if full & status::CELL_FULL != 0 {
                capacity.cell *= 2;
            }
            if full & status::SLOTS_FULL != 0 {
                capacity.faces = (capacity.faces * 2).min(Capacity::MOST_FACES);
                capacity.slots = (capacity.slots * 2).min(Capacity::MOST_SLOTS);
                capacity.beam_slots = (capacity.beam_slots * 2).min(MOST_PAIRS);
            }
            self.grow(capacity)?;
        }
        Err(self.guard(
            "contact overflow",
            format!(
                "more candidates than {:?}{}",
                self.capacity,
                crowded.map_or_else(String::new, |place| format!("; most crowded: {place}"))
            ),
            "bodies have collapsed onto each other: lower the load or its speed",
        ))
    }

    /// Moves the state into a plan with larger contact tables.
    fn grow(&mut self, capacity: Capacity) -> Result<()> {
        let model = plan::build(&self.scene, capacity)?;
        let mut backend = self.config.backend(&model)?;
        // found again
        let b = &self.model.buffers;
        let lists: Vec<_> = b.faces.iter().flatten().map(|faces| Some(faces.near)).collect();
        for (old, description) in self.model.plan.buffers.iter().enumerate() {
            let new = model.plan.buffers.iter().position(|d| d.name == description.name);
            let is_listed = b.found.contains(&Some(Buffer(old))) || lists.contains(&Some(Buffer(old)));
            let Some(new) =
                new.filter(|_| !is_listed && !matches!(description.name, "items of cells" | "cells" | "status"))
            else {
                continue;
            };
            // of gaps, those of faces are found again
            let is_gaps = b.faces.iter().flatten().any(|faces| faces.gaps == Buffer(old));
            let bytes = self.backend.bytes(Buffer(old));
            let bytes = if is_gaps || model.plan.buffers[new].len != description.len {
                widen(
                    &bytes,
                    description.len,
                    &backend.bytes(Buffer(new)),
                    model.plan.buffers[new].len,
                    self.items_of(old),
                    if is_gaps { GAPS } else { usize::MAX },
                )
            } else {
                bytes
            };
            backend.set_bytes(Buffer(new), &bytes);
        }
        self.alive()?;
        self.spent_before = self.timings();
        self.model = model;
        self.backend = backend;
        self.capacity = capacity;
        Ok(())
    }

    /// Rows of a table that grows with its slots.
    fn items_of(&self, buffer: usize) -> usize {
        let b = &self.model.buffers;
        let kind =
            b.faces.iter().position(|f| f.is_some_and(|f| [f.keys, f.touches, f.gaps].contains(&Buffer(buffer))));
        kind.map_or(self.scene.mesh.beams(), |kind| self.model.points[kind].len())
    }

    fn clear_travel(&mut self, status: &[u32]) {
        let mut bytes = bytemuck::cast_slice::<u32, u8>(status).to_vec();
        for place in [status::FLAGS, status::TRAVEL, status::SPEED, status::SEARCHED] {
            bytes[4 * place..][..4].fill(0);
        }
        // flags that stop the run stay
        let stay = status[status::FLAGS] & !(status::CELL_FULL | status::SLOTS_FULL);
        bytes[4 * status::FLAGS..][..4].copy_from_slice(&stay.to_ne_bytes());
        self.backend.set_bytes(self.model.buffers.status, &bytes);
    }

    /// Energies, limits and guards after a window of `steps` from time `from` to `to`.
    fn look(&mut self, Looked { middle, after }: &Looked, steps: u64, from: f64, to: f64) -> Result<()> {
        self.add_work(middle, after);
        self.add_contact(middle);
        self.add_stress(middle, steps, from, to);
        self.set_state(middle, after);
        let e = &self.energies;
        let flow = [e.thermal, e.radius, e.external, e.prescribed, e.gravity].iter().map(|w| w.abs()).sum::<f64>();
        self.largest_flow = self.largest_flow.max(flow + self.start_energy.abs()).max(e.output());
        let error = e.output() - self.start_energy - e.input();
        self.health.balance = error / self.largest_flow.max(NOISE);
        let is_off = self.health.balance.abs() > 0.5 * self.scene.integration.energy_tolerance;
        self.half_off = is_off.then(|| self.half_off.unwrap_or(self.step));
        self.guards()?;
        self.choose_dt();
        Ok(())
    }

    /// Runs the stages for energies and limits; returns the totals.
    fn diagnose(&mut self, row: Row<f64>) -> Result<Vec<f64>> {
        self.backend.run(&self.model.plan.diagnose, &[row]);
        self.backend.run(&self.model.plan.collect, &[row]);
        let places = &self.model.totals;
        let totals = self.backend.scalars(places.buffer);
        let status = self.backend.uints(self.model.buffers.status);
        self.alive()?;
        let (worst, node) = places.stiffness.of(&totals);
        let contact = f64::from(f32::from_bits(status[status::CONTACT_RATE]));
        self.health.dt_limit = time_step::limit(worst + contact);
        self.health.limiting_node = node;
        (self.health.min_jacobian, self.health.worst_hex) = places.jacobian.map_or((1.0, 0), |largest| {
            let (negative, place) = largest.of(&totals);
            (-negative, self.model.hex_at[place])
        });
        self.health.penetration = status::penetration(&status);
        let steps = (self.step - self.diagnosed).max(1) as u32;
        self.diagnosed = self.step;
        self.health.touching = status::TOUCHING.map(|p| status[p] / steps);
        self.health.added_mass = std::array::from_fn(|kind| {
            let by_contact = places.added[kind].map_or(0.0, |added| added.of(&totals, 0));
            let [truly, floor] = self.model.whole_mass[kind];
            if truly > 0.0 { (floor + by_contact) / truly } else { 0.0 }
        });
        let mut cleared = status;
        for place in [status::CONTACT_RATE].into_iter().chain(status::PENETRATION).chain(status::TOUCHING) {
            cleared[place] = 0;
        }
        self.backend.set_bytes(self.model.buffers.status, bytemuck::cast_slice(&cleared));
        Ok(totals)
    }

    fn choose_dt(&mut self) {
        let integration = &self.scene.integration;
        if let Some(dt) = integration.dt_s {
            self.dt = self.share * dt;
            return;
        }
        let settled = FIRST_SHARE + (1.0 - FIRST_SHARE) * (self.time / FIRST_TIME).min(1.0);
        let aim = (integration.safety * self.health.dt_limit).min(integration.dt_max_s) * settled * self.share;
        // upwards by little, downwards at once
        self.dt = if self.step == 0 { aim } else { aim.min(1.05 * self.dt) };
    }
}

/// Slots of an old table in the first places of wider rows of a new one: lengths in numbers, how many rows, and the most numbers that
/// are taken from each.
fn widen(old: &[u8], old_len: usize, fresh: &[u8], new_len: usize, items: usize, most: usize) -> Vec<u8> {
    let mut new = fresh.to_vec();
    if items == 0 || !old_len.is_multiple_of(items) || !new_len.is_multiple_of(items) {
        return new;
    }
    let (old_row, new_row) = (old.len() / items, new.len() / items);
    let taken = old_row.min(most.saturating_mul(old.len() / old_len.max(1)));
    for item in 0..items {
        new[item * new_row..][..taken].copy_from_slice(&old[item * old_row..][..taken]);
    }
    new
}

/// Largest component of a rate of deformation, 1/s.
fn largest(rate: [[f64; 3]; 3]) -> f64 {
    rate.as_flattened().iter().fold(0.0, |most: f64, r| most.max(r.abs()))
}
