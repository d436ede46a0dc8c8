//! A scene in time: drives a backend through the schedule, keeps the energy balance, and stops runs that go wrong. It writes no
//! files.
//!
//! Steps run in bursts, which grow as long as speeds do not and the contact skin (Verlet skin) is sure to last. After each burst
//! the distance travelled decides on a contact search. At the end of each window of bursts the backend adds up the sums that
//! kernels keep per item, only totals come to the host, and guards look at energies and limits. All totals belong to the moment
//! at which the last step starts: they are taken between its forces and its motion, and velocities are the mean of those before
//! and after.

mod backend_config;
mod burst;
mod guards;
mod ledger;
mod limit;
mod look;
mod retry;
mod search;
mod snapshot;
mod state;
mod stretch;
mod tools;

pub use backend_config::BackendConfig;
pub use ledger::Energies;
pub use limit::Limit;
pub use retry::Retries;
pub use stretch::Fibres;
pub use tools::ToolState;

use crate::backend::Backend;
use crate::error::{Error, Result};
use crate::kernel::buffer::Contents;
use crate::kernel::row::Row;
use crate::mesh::Mesh;
use crate::plan::{self, Capacity, Model};
use crate::scene::Scene;
use crate::schedule::{Load, Schedule};
use stretch::Stretch;

/// Fewest steps between two looks at the distance travelled.
const BURST: u64 = 8;
/// Steps between two looks at energies and limits; the longest burst.
const WINDOW: u64 = 64;
/// Longest time between two looks while a fibre direction is driven to a membrane force, s: they are when the control corrects.
const CONTROL: f64 = 32e-6;
/// Growth of the largest speed over a burst after which bursts start short again.
const CALM: f64 = 1.4;
/// Relative change of the shear rate over a window above which windows are as short as a burst. External work is the mean stress
/// of a window times its strain, so both must not change together.
const STEADY: f64 = 0.1;
/// Energy below which rounding decides its balance, mJ.
const NOISE: f64 = 1e-6;
/// Length over which the affine motion between two searches is counted, mm.
const AFFINE_REACH: f64 = 2.0;
/// Speeds may grow by this factor during a burst.
const SPEED_MARGIN: f64 = 2.0;
/// Largest travel of a node in a burst, mm: nodes that leave the range of positions must not wrap around.
const FARTHEST: f64 = 3.0;
/// Initial time step, as a share of the limit: legs that start crushed need it while they relax.
const FIRST_SHARE: f64 = 0.15;
/// Time over which this share grows to one, s.
const FIRST_TIME: f64 = 2e-4;

/// Quantities for guards and reports besides energies.
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
    /// Mass added now by the mass floor and by contact, as a share of the true mass of solids and of threads.
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
    /// Factor on the time step: below one after a rollback.
    share: f64,
    searches: u64,
    /// Whether the lists of candidates may have been made anew since the last step.
    is_listed_anew: bool,
    /// Slave nodes and beams searched since the last full search.
    searched: u64,
    /// Seconds in stages of earlier backends, which were replaced when tables grew.
    spent_before: Vec<(String, f64)>,
    /// Largest speed of a node after the last burst, mm/s.
    speed: f64,
    /// Steps of the next burst.
    burst: u64,
    /// Step of the last look at energies and limits.
    diagnosed: u64,
    gradient_at_search: Load,
    /// Stretch at that search.
    stretch_at_search: [f64; 2],
    stretch: Stretch,
    energies: Energies,
    start_energy: f64,
    largest_flow: f64,
    health: Health,
    /// Step since which the energy balance is off by more than half of its tolerance.
    half_off: Option<u64>,
    stress: StressMean,
    /// Second half of the motion work of the last step, which the next look adds, mJ: see [`ledger`].
    owed: [f64; 4],
    /// Number of completed load steps whose prescribed motion acts now; in a new backend all of it acts.
    acting: usize,
    ready: bool,
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

    /// A scene at rest at time zero whose contact tables start at a given size and grow when they must.
    ///
    /// # Errors
    /// Geometry that cannot be run.
    pub fn with_capacity(scene: Scene, config: BackendConfig, capacity: Capacity) -> Result<Self> {
        let model = plan::build(&scene, capacity)?;
        let backend = config.backend(&model)?;
        let schedule = Schedule::new(&scene.steps, &scene.effects, scene.mesh.period.is_some());
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
            is_listed_anew: true,
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
    /// Factor on the time step: below one after a rollback.
    pub fn step_factor(&self) -> f64 {
        self.share
    }
    /// Contact searches so far.
    pub fn searches(&self) -> u64 {
        self.searches
    }
    /// Seconds spent in each stage so far, by name.
    pub fn timings(&self) -> Vec<(String, f64)> {
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
    /// Prescribed loads now.
    pub fn load(&self) -> Load {
        self.schedule.load(self.time)
    }
    /// Length of a cell along x and y now, over that at the start.
    pub fn stretch(&self) -> [f64; 2] {
        self.stretch.at(self.time)
    }
    /// The row of a step of `dt` from `time`, preceded by a step of `before`.
    fn row(&self, time: f64, dt: f64, before: f64) -> Row<f64> {
        let row = self.schedule.row(time, dt, before, |time| self.stretch.at(time));
        // only a cell deforms as a whole; in a free scene the shear angle is that of a frame
        if self.model.active.periodic { row } else { Row { gradient: [[0.0; 3]; 3], rate: [[0.0; 3]; 3], ..row } }
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
    /// Checks that the backend still computes.
    ///
    /// # Errors
    /// The failure: numbers read from the backend since then are void.
    pub fn alive(&self) -> Result<()> {
        let at = |fault| format!("{fault}; noticed at step {} (t = {:.6e} s)", self.step, self.time);
        self.backend.fault().map_or(Ok(()), |fault| Err(Error::Device(at(fault))))
    }
    /// What was asked for, from a backend that still computes.
    ///
    /// # Errors
    /// The failure of a device.
    fn receive<const N: usize>(&mut self) -> Result<[Contents; N]> {
        let received = self.backend.receive();
        self.alive()?;
        Ok(received.try_into().expect("as many as were asked for"))
    }

    /// Whether the schedule has come to its end.
    pub fn done(&self) -> bool {
        self.time >= self.schedule.end() * (1.0 - 1e-12)
    }

    /// Goes on until `until` (s), or until `stop` says so at the end of a window of steps. The last step ends at or just after `until`.
    ///
    /// # Errors
    /// A guard that tripped, or a device that failed.
    pub fn advance(&mut self, until: f64, mut stop: impl FnMut(&Self) -> bool) -> Result<()> {
        if !self.ready {
            self.begin()?;
        }
        while self.time < until * (1.0 - 1e-12) {
            self.steer();
            let (from, steps, window) = (self.time - self.dt_before, self.step, self.window());
            let looked = loop {
                // rounding may leave a tiny step; it is taken, since the last step of a window is looked at
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

    /// Steps of a full window.
    fn full_window(&self) -> u64 {
        if self.is_driven() { ((CONTROL / self.dt).round() as u64).clamp(BURST, WINDOW) } else { WINDOW }
    }

    /// Steps until the next look at energies.
    fn window(&self) -> u64 {
        let (rate, full) = (|time: f64| self.row(time, self.dt, self.dt).rate, self.full_window());
        let (now, then) = (rate(self.time), rate(self.time + full as f64 * self.dt));
        let change = largest([0, 1, 2].map(|i| [0, 1, 2].map(|j| then[i][j] - now[i][j])));
        if change > STEADY * largest(then).max(largest(now)) { BURST } else { full }
    }

    /// First search, first energies, first time step.
    fn begin(&mut self) -> Result<()> {
        self.ready = true;
        self.dt = self.share * self.scene.integration.dt_s.unwrap_or(self.scene.integration.dt_max_s);
        self.dt_before = self.dt;
        self.search_all()?;
        self.threads_at_rest();
        self.diagnose(self.row(self.time, self.dt, self.dt_before));
        self.backend.request(self.model.buffers.status);
        let [totals, status] = self.receive()?;
        let totals = totals.scalars();
        self.judge(&totals, &status.uints());
        self.guard_step()?;
        self.choose_dt();
        self.dt_before = self.dt;
        self.set_state(&totals, &totals);
        self.energies.contact = self.contact_at_rest()?;
        self.guard_overlap()?;
        self.start_energy = self.energies.output();
        Ok(())
    }
}

/// Largest component of a rate of deformation, 1/s.
fn largest(rate: [[f64; 3]; 3]) -> f64 {
    rate.as_flattened().iter().fold(0.0, |most: f64, r| most.max(r.abs()))
}
