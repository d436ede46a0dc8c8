//! Stages of contact: the grid, then candidates and forces of every kind of pair that can touch; ties.

use super::conditions::Conditions;
use super::effects::Active;
use super::surfaces::{Carried, Surfaces};
use super::threads::Threads;
use super::{Builder, Capacity, ContactPoint, after, beside, coded, own, thickness, waiting};
use crate::contact::found::NEVER;
use crate::contact::skin::SKIN_APART;
use crate::contact::{EMPTY, Params, candidates, grid, penalty, slot_state, sums, surface, threads, tie};
use crate::elements::beam2;
use crate::error::Result;
use crate::kernel::buffer::{Buffer, Initial, Kind};
use crate::kernel::position::quanta;
use crate::kernel::stage::{Access, Code, Stage, flagged};
use crate::mesh::Mesh;
use crate::scene::Tie;
use crate::settings::effects::Contact;

/// Buffers of contact with the faces of yarns.
#[derive(Debug, Clone, Copy)]
pub struct FaceBuffers {
    pub sums: Buffer,
    /// See [`candidates::CARRIER`].
    pub carriers: Buffer,
    /// List of near faces of each carrier, see [`crate::contact::surface::entry`], and gap counters of each point.
    pub near: Buffer,
    pub gaps: Buffer,
    /// Bodies that each point touches, and [`penalty::touch`] of each.
    pub keys: Buffer,
    pub touches: Buffer,
    /// See [`crate::contact::found`].
    pub found: Buffer,
}

/// Buffers of contact between beams.
#[derive(Clone, Copy)]
pub(super) struct PairBuffers {
    pub sums: Buffer,
    pub keys: Buffer,
    pub state: Buffer,
    /// See [`crate::contact::found`].
    pub found: Buffer,
}

/// What contact adds to a plan.
pub(super) struct ContactParts {
    pub params: Params,
    pub force: Buffer,
    pub stiffness: Buffer,
    /// Of threads and of yarns on yarns.
    pub faces: [Option<FaceBuffers>; 2],
    pub pairs: Option<PairBuffers>,
    /// Energies of ties, and how many there are.
    pub ties: Option<(Buffer, usize)>,
    pub points: [Vec<ContactPoint>; 2],
}

/// What contact needs to know of the scene.
pub(super) struct ContactScene<'a> {
    pub chosen: &'a Contact,
    pub active: Active,
    pub mesh: &'a Mesh,
    pub threads: &'a Threads,
    pub conditions: &'a Conditions,
    pub ties: &'a [Tie],
    pub capacity: Capacity,
    pub reference: Buffer,
    pub quanta: Buffer,
    pub remainder: Buffer,
    pub velocity: Buffer,
    pub mass: Buffer,
    pub status: Buffer,
    /// Displacements when everything was last searched, in quanta, in a scene that searches.
    pub before: Option<Buffer>,
    pub ends: Buffer,
    pub beams: Buffer,
}

/// Names of the buffers and stages of a kind of contact with faces.
struct Names {
    carriers: &'static str,
    nodes: &'static str,
    points: &'static str,
    near: &'static str,
    gaps: &'static str,
    keys: &'static str,
    touches: &'static str,
    found: &'static str,
    sums: &'static str,
    search: &'static str,
    step: &'static str,
}

const OF_THREADS: Names = Names {
    carriers: "carriers of thread points",
    nodes: "nodes of thread points",
    points: "thread points",
    near: "faces near threads",
    gaps: "gaps of thread points",
    keys: "bodies that thread points touch",
    touches: "touches of thread points",
    found: "when faces near threads were found",
    sums: "thread contact sums",
    search: "thread-yarn candidates",
    step: "thread-yarn contact",
};

const OF_YARNS: Names = Names {
    carriers: "carriers of yarn points",
    nodes: "nodes of yarn points",
    points: "yarn points",
    near: "faces near yarns",
    gaps: "gaps of yarn points",
    keys: "bodies that yarn points touch",
    touches: "touches of yarn points",
    found: "when faces near yarns were found",
    sums: "yarn contact sums",
    search: "yarn-yarn candidates",
    step: "yarn-yarn contact",
};

/// Where bodies near each other are found.
struct Search {
    counts: Buffer,
    lists: Buffer,
    boxes: Buffer,
}

/// Tables of faces.
#[derive(Clone, Copy)]
struct Faces {
    slabs: Buffer,
    faces: Buffer,
}

impl ContactScene<'_> {
    /// Adds the stages of the pairs that can touch, and of ties.
    pub fn add(&self, b: &mut Builder) -> Result<ContactParts> {
        let surfaces = Surfaces::new(self.mesh, self.threads, self.chosen, self.active)?;
        let nodes = self.mesh.nodes.len();
        let slabs = surfaces.slabs.len() / grid::SLAB;
        let params = self.params(&surfaces, slabs);
        let force = b.add("contact force", Kind::Int, 3 * nodes, false, Initial::Zero);
        let stiffness = b.add("contact stiffness", Kind::Int, nodes, false, Initial::Zero);
        let sums = (force, stiffness);
        let (mut faces, mut pairs) = ([None; 2], None);
        if self.active.searches() {
            let paired = if self.active.thread_thread { self.threads.beams() } else { 0 };
            let cells = (params.cells[0] * params.cells[1]) as usize;
            let counts = b.add("items of cells", Kind::Uint, cells, false, Initial::Zero);
            let lists = b.add("cells", Kind::Uint, cells * self.capacity.cell, false, Initial::Zero);
            let boxes = b.scratch("boxes", grid::BOX * (slabs + paired));
            let search = Search { counts, lists, boxes };
            b.plan.search.push(after::<grid::Clear>("clear grid", cells, 4096, &[], &[(counts, own(1, 1))], params));
            let tables = (slabs > 0).then(|| self.slabs(b, &search, &surfaces, params));
            let offsets = (paired > 0).then(|| {
                let neighbours = b.indices("neighbours of beams", self.threads.neighbours.clone());
                [neighbours, b.table("shares in offsets", self.threads.shares.clone())]
            });
            if let Some(offsets) = offsets {
                self.beams_to_grid(b, &search, slabs, offsets, params);
            }
            let mut waits = true;
            for (kind, carried) in surfaces.carried.iter().enumerate().filter(|(_, carried)| !carried.points.is_empty())
            {
                faces[kind] =
                    tables.map(|tables| self.faces(b, &search, tables, (kind == 0, carried), sums, (params, waits)));
                waits = false;
            }
            pairs = offsets.map(|offsets| self.pairs(b, &search, offsets, sums, params));
        }
        let ties = self.active.ties.then(|| self.tied(b, sums, params));
        let points = surfaces.carried.map(|carried| carried.contact_points);
        Ok(ContactParts { params, force, stiffness, faces, pairs, ties, points })
    }

    /// Buffers of positions.
    fn place(&self) -> [Buffer; 3] {
        [self.reference, self.quanta, self.remainder]
    }

    fn status(&self) -> (Buffer, Access) {
        (self.status, Access::Atomic)
    }

    /// What puts items into the grid.
    fn to_grid(&self, search: &Search) -> [(Buffer, Access); 4] {
        let Search { counts, lists, boxes } = *search;
        [(counts, Access::Atomic), (lists, Access::Scatter), (boxes, own(1, grid::BOX)), self.status()]
    }

    /// Yarns in the grid.
    fn slabs(&self, b: &mut Builder, search: &Search, surfaces: &Surfaces, params: Params) -> Faces {
        let faces = b.indices("faces", surfaces.faces.clone());
        let slabs = b.indices("slabs", surfaces.slabs.clone());
        let mut reads = [&self.place()[..], &[slabs, faces]].concat();
        reads.extend(self.before);
        let kernel = flagged!(grid::FillSlabs; self.active.periodic);
        let count = surfaces.slabs.len() / grid::SLAB;
        let stage = coded(kernel, "yarns to grid", count, 32, &reads, &self.to_grid(search), params);
        b.plan.search.push(waiting(stage));
        Faces { slabs, faces }
    }

    /// Threads in the grid, behind the slabs of yarns.
    fn beams_to_grid(&self, b: &mut Builder, search: &Search, slabs: usize, offsets: [Buffer; 2], params: Params) {
        let beams = self.threads.beams();
        let mut reads = [&self.place()[..], &[self.ends, self.beams], &offsets].concat();
        reads.extend(self.before);
        let kernel = flagged!(grid::FillBeams; self.active.periodic);
        let stage = coded(kernel, "threads to grid", beams, 32, &reads, &self.to_grid(search), params);
        // what fills the grid may run side by side
        b.plan.search.push(Stage { first: slabs, waits: slabs == 0, ..stage });
    }

    /// Points of threads, or nodes of yarn surfaces, against yarns. What searches first waits for the grid.
    fn faces(
        &self,
        b: &mut Builder,
        search: &Search,
        tables: Faces,
        (thread, carried): (bool, &Carried),
        (force, stiffness): (Buffer, Buffer),
        (params, waits): (Params, bool),
    ) -> FaceBuffers {
        let Active { friction, periodic, .. } = self.active;
        let Capacity { faces, slots, .. } = self.capacity;
        let (count, lists) = (carried.contact_points.len(), carried.carriers.len() / candidates::CARRIER);
        let names = if thread { &OF_THREADS } else { &OF_YARNS };
        let carriers = b.indices(names.carriers, carried.carriers.clone());
        let nodes = b.indices(names.nodes, carried.nodes.clone());
        let points = b.table(names.points, carried.points.clone());
        let (list, row) = (candidates::MADE + faces, penalty::GAPS + faces);
        let (places, size) = (candidates::MADE + slots, penalty::touch(friction));
        let empty = |len: usize| Initial::Uint(vec![EMPTY; len]);
        let near = b.add(names.near, Kind::Uint, list * lists, true, empty(list * lists));
        let gaps = b.add(names.gaps, Kind::Scalar, row * count, true, Initial::Zero);
        let keys = b.add(names.keys, Kind::Uint, places * count, true, empty(places * count));
        let touches = b.add(names.touches, Kind::Scalar, size * slots * count, true, Initial::Zero);
        let found = b.add(names.found, Kind::Uint, lists, true, Initial::Uint(vec![NEVER; lists]));
        let sums = b.scratch(names.sums, sums::sums(friction, periodic) * count);

        let mut reads = [
            &[carriers, nodes, points, tables.slabs, tables.faces][..],
            &self.place(),
            &[search.counts, search.lists, search.boxes],
        ]
        .concat();
        reads.extend(self.before);
        let writes = [(near, own(1, list)), (found, own(1, 1)), self.status()];
        let kernel = flagged!(candidates::Candidates; thread, periodic);
        let stage = coded(kernel, names.search, lists, 64, &reads, &writes, params);
        b.plan.search.push(Stage { waits, ..stage });

        let reads = [&[nodes, points, tables.faces, near][..], &self.place(), &[self.velocity, self.mass]].concat();
        let writes = [
            (gaps, own(1, row)),
            (keys, own(1, places)),
            (touches, own(1, size * slots)),
            (sums, own(1, sums::sums(friction, periodic))),
            (force, Access::Atomic),
            (stiffness, Access::Atomic),
            self.status(),
        ];
        let kernel = flagged!(penalty::Penalty; thread, friction, periodic);
        b.plan.step.push(coded(kernel, names.step, count, 64, &reads, &writes, params));
        FaceBuffers { sums, carriers, near, gaps, keys, touches, found }
    }

    /// Beams against beams.
    fn pairs(
        &self,
        b: &mut Builder,
        search: &Search,
        offsets: [Buffer; 2],
        (force, stiffness): (Buffer, Buffer),
        params: Params,
    ) -> PairBuffers {
        let (beams, slots, size) = (self.threads.beams(), self.capacity.beam_slots, params.state as usize);
        let Active { friction, periodic, .. } = self.active;
        let keys = b.add("beam pairs", Kind::Uint, slots * beams, true, Initial::Uint(vec![EMPTY; slots * beams]));
        let state = b.add("beam pair state", Kind::Scalar, size * slots * beams, true, Initial::Zero);
        let sums = b.scratch("beam pair sums", sums::sums(friction, periodic) * beams);
        let common = [&[self.ends, self.beams][..], &self.place(), &offsets].concat();
        let reads = [&common[..], &[search.counts, search.lists, search.boxes]].concat();
        let found = b.add("when pairs were found", Kind::Uint, beams, true, Initial::Uint(vec![NEVER; beams]));
        let keys_own = (keys, own(1, slots));
        let state_own = (state, own(1, size * slots));
        let writes = [keys_own, state_own, (found, own(1, 1)), self.status()];
        let kernel = flagged!(threads::Pairs; periodic);
        let stage = coded(kernel, "thread-thread candidates", beams, 32, &reads, &writes, params);
        b.plan.search.push(waiting(stage));
        let reads = [&common[..], &[self.velocity, self.mass]].concat();
        let writes = [
            keys_own,
            state_own,
            (sums, own(1, sums::sums(friction, periodic))),
            (force, Access::Atomic),
            (stiffness, Access::Atomic),
            self.status(),
        ];
        let kernel = flagged!(threads::Force; friction, periodic);
        b.plan.step.push(coded(kernel, "thread-thread contact", beams, 32, &reads, &writes, params));
        PairBuffers { sums, keys, state, found }
    }

    /// Nodes of cut threads that are held; energies and number of ties.
    fn tied(&self, b: &mut Builder, (force, stiffness): (Buffer, Buffer), params: Params) -> (Buffer, usize) {
        let count = self.ties.len();
        let at = |tie: &Tie| std::iter::once(tie.node).chain(tie.corners).map(|node| node as u32).collect::<Vec<_>>();
        let nodes = b.indices("ties", self.ties.iter().flat_map(at).collect());
        let stiffness_of = |tie: &Tie| tie.weights.into_iter().chain([self.chosen.tie_n_mm]).collect::<Vec<_>>();
        let values = b.table("tie values", self.ties.iter().flat_map(stiffness_of).collect());
        let energy = b.scratch("tie energies", count);
        let reads = [nodes, values, self.quanta, self.remainder];
        let writes = [(energy, own(1, 1)), (force, Access::Atomic), (stiffness, Access::Atomic), self.status()];
        b.plan.step.push(beside::<tie::Tie>("ties", count, 64, &reads, &writes, params));
        (energy, count)
    }

    fn params(&self, surfaces: &Surfaces, slabs: usize) -> Params {
        /// Aimed size of a cell, mm.
        const CELL: f64 = 0.5;
        let mesh = self.mesh;
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for x in mesh.nodes.iter().copied().chain(self.conditions.ends(mesh)) {
            for k in 0..2 {
                (low[k], high[k]) = (low[k].min(x[k]), high[k].max(x[k]));
            }
        }
        let (origin, size) = match mesh.period {
            Some(period) => ([0.0; 2], period),
            // bodies that leave the box share its outermost cells
            None => ([low[0] - CELL, low[1] - CELL], [high[0] - low[0] + 2.0 * CELL, high[1] - low[1] + 2.0 * CELL]),
        };
        let cells = size.map(|s| (libm::floor(s / CELL) as u32).clamp(1, 1024));
        let points = surfaces.carried.iter().flat_map(|carried| carried.points.chunks_exact(surface::POINT));
        let stiffest = points.map(|point| point[4]).fold(0.0, f64::max);
        let longest = self.threads.beams.chunks_exact(beam2::TABLE).map(|beam| beam[3]).fold(0.0, f64::max);
        let stiffest = if self.active.ties { stiffest.max(self.chosen.tie_n_mm) } else { stiffest };
        let along = if self.active.thread_thread { self.chosen.thread_thread_penalty_n_mm2 * longest } else { 0.0 };
        let radius = self.threads.radius.iter().copied().fold(0.0, f64::max);
        let thickness = mesh.blocks.iter().map(|b| thickness(mesh, b)).fold(f64::INFINITY, f64::min);
        let depth = 0.5 * thickness.min(0.4);
        let power = |x: f64| libm::exp2(libm::ceil(libm::log2(x)));
        Params {
            period: mesh.period.unwrap_or_default().map(quanta),
            cells,
            capacity: self.capacity.cell as u32,
            faces: self.capacity.faces as u32,
            slots: self.capacity.slots as u32,
            beam_slots: self.capacity.beam_slots as u32,
            slabs: slabs as u32,
            origin: origin.map(|x| x as f32),
            cell: [0, 1].map(|k| (size[k] / f64::from(cells[k])) as f32),
            skin: self.chosen.skin_mm as f32,
            friction: if self.active.friction { self.mesh.friction as f32 } else { 0.0 },
            tangential: self.chosen.tangential_ratio as f32,
            damping: self.chosen.damping_ratio as f32,
            // a pair may reach 2²⁷ quanta, a node the sum of sixteen such pairs; pieces of threads push with 0.39 k L r at most
            force_quantum: (power((stiffest * (depth + radius)).max(along * radius)) / f64::from(1 << 27)) as f32,
            stiffness_quantum: (power(64.0 * stiffest.max(along)) / f64::from(1 << 28)) as f32,
            thread_radius: radius as f32,
            thread_thread: self.chosen.thread_thread_penalty_n_mm2 as f32,
            self_arc: mesh.self_arc() as f32,
            depth: depth.min(f64::from(f32::MAX)) as f32,
            state: slot_state(self.active.friction) as u32,
            // along each axis, so that it is as much in space
            apart: quanta(SKIN_APART * self.chosen.skin_mm / libm::sqrt(3.0)) as u32,
        }
    }
}
