//! The state of nodes: positions, velocities, masses, and the results of a step.

use super::builder::{Builder, NODE_GRAIN};
use super::{Tables, perturbation};
use crate::contact::{skin, status};
use crate::kernel::buffer::{Buffer, Initial, Kind};
use crate::kernel::position::quanta;
use crate::kernel::stage::{Code, Stage, flagged, wires};
use crate::mesh::Mesh;

/// Buffers of nodes, and their masses.
pub(super) struct Nodes {
    pub count: usize,
    /// First node of a thread.
    pub first_thread: usize,
    pub reference: Buffer,
    pub quanta: Buffer,
    pub remainder: Buffer,
    pub velocity: Buffer,
    pub mass: Buffer,
    pub status: Buffer,
    pub acceleration: Buffer,
    /// Mass subject to gravity, in a scene with gravity.
    pub true_mass: Option<Buffer>,
    pub inverse_mass: Buffer,
    /// Work by kind, if any is recorded.
    pub work: Option<Buffer>,
    /// True nodal masses, and masses with the floor, tonne.
    pub true_masses: Vec<f64>,
    pub masses: Vec<f64>,
}

impl Nodes {
    pub fn add(b: &mut Builder, t: &Tables) -> Self {
        let count = t.mesh.nodes.len();
        let planes: [Vec<i32>; 3] = std::array::from_fn(|k| t.mesh.nodes.iter().map(|x| quanta(x[k])).collect());
        let start = perturbation::start(&t.mesh, t.scene.integration.perturbation_mm, &t.conditions);
        let velocities = Initial::Scalar(initial_velocity(&t.mesh));
        let true_masses = [&t.solids.mass[..], &t.threads.mass].concat();
        let masses = floor_mass(&t.mesh, &true_masses, t.scene.effects.mass_floor);
        let works = t.active.works().count();
        Self {
            count,
            first_thread: t.mesh.first_thread_node(),
            reference: b.add("reference position", Kind::Int, 3 * count, false, Initial::Int(planes.concat())),
            quanta: b.add("displacement quanta", Kind::Int, 3 * count, true, Initial::Int(start)),
            remainder: b.add("displacement remainder", Kind::Scalar, 3 * count, true, Initial::Zero),
            velocity: b.add("velocity", Kind::Scalar, 3 * count, true, velocities),
            mass: b.table("mass", masses.clone()),
            status: b.add("status", Kind::Uint, status::SIZE, false, Initial::Zero),
            acceleration: b.scratch("acceleration", 3 * count),
            true_mass: t.active.gravity.then(|| b.table("true mass", true_masses.clone())),
            inverse_mass: b.scratch("inverse mass", count),
            work: (works > 0).then(|| b.scratch("work on nodes", works * count)),
            true_masses,
            masses,
        }
    }

    /// True mass of all solids and of all threads, and the mass added to each by the floor, tonne.
    pub fn whole_mass(&self) -> [[f64; 2]; 2] {
        [0..self.first_thread, self.first_thread..self.count].map(|range| {
            let [mass, truly] = [&self.masses, &self.true_masses].map(|mass| mass[range.clone()].iter().sum::<f64>());
            [truly, mass - truly]
        })
    }
}

/// Node positions at the last candidate search.
pub(super) struct Searched {
    quanta: Buffer,
    remainder: Buffer,
    /// Displacements at the last full search, in quanta.
    pub everything: Buffer,
}

impl Searched {
    /// Adds the data of the last search and the stage that watches nodes, in a scene that searches.
    pub fn add(b: &mut Builder, t: &Tables, nodes: &Nodes) -> Option<Self> {
        let all = 3 * nodes.count;
        let searched = t.active.searches().then(|| Self {
            quanta: b.add("quanta at the last search", Kind::Int, all, true, Initial::Zero),
            remainder: b.add("remainder at the last search", Kind::Scalar, all, true, Initial::Zero),
            everything: b.add("displacements at the last search of everything", Kind::Int, all, true, Initial::Zero),
        });
        let &Nodes { quanta, remainder, velocity, status, .. } = nodes;
        let wires = wires![
            quanta,
            remainder,
            velocity,
            search_quanta: searched.as_ref().map(|s| s.quanta),
            search_remainder: searched.as_ref().map(|s| s.remainder),
            status,
        ];
        let kernel = flagged!(skin::Travel; t.active.searches());
        b.plan.watch.push(Stage::new("travel", kernel, (nodes.count, NODE_GRAIN), &wires, [0u32; 0]));
        searched
    }

    /// Adds the stage that ends a search.
    pub fn remember(&self, b: &mut Builder, nodes: &Nodes) {
        let &Nodes { quanta, remainder, .. } = nodes;
        let wires = wires![quanta, remainder, search_quanta: self.quanta, search_remainder: self.remainder];
        let kernel = Code::of::<skin::Remember>();
        b.plan.search.push(Stage::new("remember", kernel, (nodes.count, NODE_GRAIN), &wires, [0u32; 0]));
    }
}

/// Initial velocities, in planes.
fn initial_velocity(mesh: &Mesh) -> Vec<f64> {
    let nodes = mesh.nodes.len();
    let mut planes = vec![0.0; 3 * nodes];
    let blocks = mesh.blocks.iter().map(|b| (b.first, b.count(), b.velocity));
    let threads = mesh.threads.iter().map(|t| (t.first, t.count, t.velocity));
    for (first, count, velocity) in blocks.chain(threads) {
        for (k, v) in velocity.into_iter().enumerate() {
            planes[k * nodes + first..][..count].fill(v);
        }
    }
    planes
}

/// Nodal mass with a floor, given as a share of the mean nodal mass of the body.
fn floor_mass(mesh: &Mesh, mass: &[f64], floor: f64) -> Vec<f64> {
    let mut floored = mass.to_vec();
    let blocks = mesh.blocks.iter().map(|b| (b.first, b.count()));
    let threads = mesh.threads.iter().map(|t| (t.first, t.count));
    for (first, count) in blocks.chain(threads) {
        let body = &mut floored[first..first + count];
        let least = floor * body.iter().sum::<f64>() / count as f64;
        body.iter_mut().for_each(|m| *m = m.max(least));
    }
    floored
}
