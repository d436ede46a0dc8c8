//! Stages of contact: the grid (broad phase), then candidates and forces for every kind of pair that can touch; ties.

use super::beams::Beams;
use super::builder::Builder;
use super::nodes::Nodes;
use super::surfaces::{Carried, Surfaces};
use super::tools::Tools;
use super::{Active, Capacity, ContactPoint, Tables};
use crate::contact::skin::Shares;
use crate::contact::{
    EMPTY, Params, candidates, grid, memory, pairs, penalty, slot_state, sums, surface, threads, tie,
};
use crate::elements::beam2;
use crate::error::Result;
use crate::kernel::buffer::{Buffer, Initial, Kind};
use crate::kernel::position::quanta;
use crate::kernel::stage::{Code, Stage, Wire, flagged, wires};
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
    /// Bodies touched by each point, and the [`memory::touch`] of each.
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
    /// Energies of ties, and the number of ties.
    pub ties: Option<(Buffer, usize)>,
    pub tools: Option<Tools>,
    pub points: [Vec<ContactPoint>; 2],
}

/// The parts of the scene that contact needs.
pub(super) struct ContactScene<'a> {
    pub chosen: &'a Contact,
    pub tables: &'a Tables<'a>,
    pub capacity: Capacity,
    pub nodes: &'a Nodes,
    pub beams: &'a Beams,
    /// Displacements at the last full search, in quanta, in a scene that searches.
    pub before: Option<Buffer>,
}

/// Names of the buffers and stages of one kind of contact with faces.
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

const NAMES: [&Names; 2] = [&OF_THREADS, &OF_YARNS];

/// Contact points of threads or of yarns: see [`surface::CARRIED`] and [`surface::POINT`], and their number.
#[derive(Clone, Copy)]
pub(super) struct Points {
    pub nodes: Buffer,
    pub points: Buffer,
    pub count: usize,
}

impl Points {
    /// Adds the tables of the points, if there are any.
    fn add(b: &mut Builder, carried: &Carried, names: &Names) -> Option<Self> {
        let count = carried.contact_points.len();
        (count > 0).then(|| Self {
            nodes: b.indices(names.nodes, carried.nodes.clone()),
            points: b.table(names.points, carried.points.clone()),
            count,
        })
    }
}

/// The grid of the broad phase, where nearby bodies are found.
struct Search {
    counts: Buffer,
    lists: Buffer,
    boxes: Buffer,
}

impl Search {
    fn wires(&self) -> [(&'static str, Wire); 3] {
        let &Self { counts, lists, boxes } = self;
        wires![counts, lists, boxes]
    }
}

/// Tables of faces and their slabs, and the boxes of faces.
#[derive(Clone, Copy)]
struct Faces {
    slabs: Buffer,
    faces: Buffer,
    face_boxes: Buffer,
}

impl Faces {
    fn wires(&self) -> [(&'static str, Wire); 3] {
        let &Self { slabs, faces, face_boxes } = self;
        wires![slabs, faces, face_boxes]
    }
}

/// Sums of contact forces and stiffness.
#[derive(Clone, Copy)]
pub(super) struct Added {
    pub force: Buffer,
    pub stiffness: Buffer,
}

/// Tables of the previous and next beams, see [`crate::contact::arc_offset`].
#[derive(Clone, Copy)]
struct Offsets {
    neighbours: Buffer,
    shares: Buffer,
}

impl ContactScene<'_> {
    /// Adds the stages of the pairs that can touch, and of ties.
    pub fn add(&self, b: &mut Builder) -> Result<ContactParts> {
        let Tables { mesh, threads, active, .. } = self.tables;
        let surfaces = Surfaces::new(mesh, threads, self.chosen, *active)?;
        let slabs = surfaces.slabs.len() / grid::SLAB;
        let params = self.params(&surfaces, slabs);
        let sums = Added {
            force: b.add("contact force", Kind::Int, 3 * self.nodes.count, false, Initial::Zero),
            stiffness: b.add("contact stiffness", Kind::Int, self.nodes.count, false, Initial::Zero),
        };
        let points = [0, 1].map(|kind| Points::add(b, &surfaces.carried[kind], NAMES[kind]));
        let (mut faces, mut pairs) = ([None; 2], None);
        if active.searches() {
            let paired = if active.thread_thread { self.beams.count } else { 0 };
            let search = self.grid(b, slabs + paired, params);
            let tables = (slabs > 0).then(|| self.slabs(b, &search, &surfaces, params));
            let offsets = (paired > 0).then(|| Offsets {
                neighbours: b.indices("neighbours of beams", threads.neighbours.clone()),
                shares: b.table("shares in offsets", threads.shares.clone()),
            });
            if let Some(offsets) = offsets {
                self.beams_to_grid(b, &search, slabs, offsets, params);
            }
            let mut waits = true;
            let meets = [active.thread_yarn, active.yarn_yarn];
            for (kind, carried) in surfaces.carried.iter().enumerate().filter(|(kind, _)| meets[*kind]) {
                let Some(points) = points[kind] else { continue };
                faces[kind] = tables
                    .map(|tables| self.faces(b, &search, tables, (kind == 0, carried, points), sums, (params, waits)));
                waits = false;
            }
            pairs = offsets.map(|offsets| self.pairs(b, &search, offsets, sums, params));
        }
        let ties = active.ties.then(|| self.tied(b, sums, params));
        let tools = if active.tools { Some(self.tools(b, points, sums, params)?) } else { None };
        let points = surfaces.carried.map(|carried| carried.contact_points);
        let Added { force, stiffness } = sums;
        Ok(ContactParts { params, force, stiffness, faces, pairs, ties, tools, points })
    }

    /// Current and reference positions of nodes.
    fn place(&self) -> [(&'static str, Wire); 4] {
        let &Nodes { reference, quanta, remainder, .. } = self.nodes;
        wires![reference, quanta, remainder, before: self.before]
    }

    /// The grid for a number of items.
    fn grid(&self, b: &mut Builder, items: usize, params: Params) -> Search {
        let cells = (params.cells[0] * params.cells[1]) as usize;
        let counts = b.add("items of cells", Kind::Uint, cells, false, Initial::Zero);
        let lists = b.add("cells", Kind::Uint, cells * self.capacity.cell, false, Initial::Zero);
        let boxes = b.scratch("boxes", grid::BOX * items);
        let clear = Stage::new("clear grid", Code::of::<grid::Clear>(), (cells, 4096), &wires![counts], params);
        b.plan.search.push(clear);
        Search { counts, lists, boxes }
    }

    /// Puts yarns into the grid.
    fn slabs(&self, b: &mut Builder, search: &Search, surfaces: &Surfaces, params: Params) -> Faces {
        let faces = b.indices("faces", surfaces.faces.clone());
        let slabs = b.indices("slabs", surfaces.slabs.clone());
        let count = surfaces.slabs.len() / grid::SLAB;
        let tables = Faces { slabs, faces, face_boxes: b.scratch("face boxes", grid::FACE_BOXES * count) };
        let status = self.nodes.status;
        let wires = [&self.place()[..], &search.wires(), &tables.wires(), &wires![status]].concat();
        let kernel = flagged!(grid::FillSlabs; self.tables.active.periodic);
        b.plan.search.push(Stage::new("yarns to grid", kernel, (count, 32), &wires, params));
        tables
    }

    /// Puts threads into the grid, after the slabs of yarns. The stages that fill the grid may run concurrently.
    fn beams_to_grid(&self, b: &mut Builder, search: &Search, slabs: usize, offsets: Offsets, params: Params) {
        let status = self.nodes.status;
        let wires = [&self.place()[..], &search.wires(), &self.lines(offsets), &wires![status]].concat();
        let kernel = flagged!(grid::FillBeams; self.tables.active.periodic);
        let stage = Stage::new("threads to grid", kernel, (self.beams.count, 32), &wires, params);
        let stage = Stage { first: slabs, ..stage };
        b.plan.search.push(if slabs == 0 { stage } else { stage.beside() });
    }

    /// Inputs of the lines of beams.
    fn lines(&self, offsets: Offsets) -> [(&'static str, Wire); 4] {
        let Offsets { neighbours, shares } = offsets;
        wires![ends: self.beams.ends, beams: self.beams.table, neighbours, shares]
    }

    /// Points of threads, or nodes of yarn surfaces, against yarns. The kind that is searched first waits for the grid.
    fn faces(
        &self,
        b: &mut Builder,
        search: &Search,
        tables: Faces,
        (thread, carried, points): (bool, &Carried, Points),
        total: Added,
        (params, waits): (Params, bool),
    ) -> FaceBuffers {
        let Active { friction, periodic, .. } = self.tables.active;
        let Capacity { faces, slots, .. } = self.capacity;
        let Points { nodes, points, count } = points;
        let lists = carried.carriers.len() / candidates::CARRIER;
        let names = NAMES[usize::from(!thread)];
        let carriers = b.indices(names.carriers, carried.carriers.clone());
        let (list, row) = (candidates::MADE + faces, memory::GAPS + faces);
        let (places, size) = (candidates::MADE + slots, memory::touch(friction));
        let each = sums::sums(friction, periodic);
        let empty = |len: usize| Initial::Uint(vec![EMPTY; len]);
        let near = b.add(names.near, Kind::Uint, list * lists, true, empty(list * lists));
        let gaps = b.add(names.gaps, Kind::Scalar, row * count, true, Initial::Zero);
        let keys = b.add(names.keys, Kind::Uint, places * count, true, empty(places * count));
        let touches = b.add(names.touches, Kind::Scalar, size * slots * count, true, Initial::Zero);
        let found = b.add(names.found, Kind::Uint, lists, true, Initial::Zero);
        let sums = b.scratch(names.sums, each * count);

        let &Nodes { reference, quanta, remainder, velocity, mass, status, .. } = self.nodes;
        let searched = wires![carriers, nodes, points, near: (near, list), found_when: found, status];
        let wires = [&searched[..], &self.place(), &search.wires(), &tables.wires()].concat();
        let kernel = flagged!(candidates::Candidates; thread, periodic);
        let stage = Stage::new(names.search, kernel, (lists, 64), &wires, params);
        b.plan.search.push(if waits { stage } else { stage.beside() });

        let wires = wires![
            nodes,
            points,
            faces: tables.faces,
            near,
            reference,
            quanta,
            remainder,
            velocity,
            mass,
            gaps: (gaps, row),
            keys: (keys, places),
            touches: (touches, size * slots),
            sums: (sums, each),
            forces: total.force,
            stiffness: total.stiffness,
            status,
        ];
        let kernel = flagged!(penalty::Penalty; thread, friction, periodic);
        let coefficients = self.tables.mesh.friction.pairs();
        let coefficient = if thread { coefficients.thread_yarn } else { coefficients.yarn_yarn };
        let params = Params { friction: coefficient as f32, ..params };
        b.plan.step.push(Stage::new(names.step, kernel, (count, 128), &wires, params).beside());
        FaceBuffers { sums, carriers, near, gaps, keys, touches, found }
    }

    /// Beams against beams.
    fn pairs(&self, b: &mut Builder, search: &Search, offsets: Offsets, total: Added, params: Params) -> PairBuffers {
        let (beams, slots, size) = (self.beams.count, self.capacity.beam_slots, params.state as usize);
        let Active { friction, periodic, .. } = self.tables.active;
        let each = sums::sums(friction, periodic);
        let keys = b.add("beam pairs", Kind::Uint, slots * beams, true, Initial::Uint(vec![EMPTY; slots * beams]));
        let state = b.add("beam pair state", Kind::Scalar, size * slots * beams, true, Initial::Zero);
        let sums = b.scratch("beam pair sums", each * beams);
        let found = b.add("when pairs were found", Kind::Uint, beams, true, Initial::Zero);
        let &Nodes { reference, quanta, remainder, velocity, mass, status, .. } = self.nodes;
        let both = wires![reference, quanta, remainder, keys: (keys, slots), states: (state, size * slots), status];
        let both = [&both[..], &self.lines(offsets)].concat();
        let wires = [&both[..], &search.wires(), &wires![found_when: found]].concat();
        let kernel = flagged!(pairs::Pairs; periodic);
        b.plan.search.push(Stage::new("thread-thread candidates", kernel, (beams, 32), &wires, params));
        let Added { force, stiffness } = total;
        let forces = wires![velocity, mass, sums: (sums, each), forces: force, stiffness];
        let wires = [&both[..], &forces].concat();
        let kernel = flagged!(threads::Force; friction, periodic);
        let params = Params { friction: self.tables.mesh.friction.pairs().thread_thread as f32, ..params };
        b.plan.step.push(Stage::new("thread-thread contact", kernel, (beams, 32), &wires, params).beside());
        PairBuffers { sums, keys, state, found }
    }

    /// Nodes of cut threads that are tied; energies and number of ties.
    fn tied(&self, b: &mut Builder, total: Added, params: Params) -> (Buffer, usize) {
        let held = &self.tables.scene.ties;
        let at = |tie: &Tie| std::iter::once(tie.node).chain(tie.corners).map(|node| node as u32).collect::<Vec<_>>();
        let ties = b.indices("ties", held.iter().flat_map(at).collect());
        let stiffness_of = |tie: &Tie| tie.weights.into_iter().chain([self.chosen.tie_n_mm]).collect::<Vec<_>>();
        let values = b.table("tie values", held.iter().flat_map(stiffness_of).collect());
        let energies = b.scratch("tie energies", held.len());
        let &Nodes { quanta, remainder, status, .. } = self.nodes;
        let Added { force, stiffness } = total;
        let wires = wires![ties, values, quanta, remainder, energies, forces: force, stiffness, status];
        b.plan.step.push(Stage::new("ties", Code::of::<tie::Tie>(), (held.len(), 64), &wires, params).beside());
        (energies, held.len())
    }

    fn params(&self, surfaces: &Surfaces, slabs: usize) -> Params {
        /// Target cell size, mm.
        const CELL: f64 = 0.5;
        let Tables { mesh, threads, conditions, active, .. } = self.tables;
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for x in mesh.nodes.iter().copied().chain(conditions.ends(mesh)) {
            for k in 0..2 {
                (low[k], high[k]) = (low[k].min(x[k]), high[k].max(x[k]));
            }
        }
        let (origin, size) = match mesh.period {
            Some(period) => ([0.0; 2], period),
            // bodies outside the box share its outermost cells
            None => ([low[0] - CELL, low[1] - CELL], [high[0] - low[0] + 2.0 * CELL, high[1] - low[1] + 2.0 * CELL]),
        };
        let cells = size.map(|s| (libm::floor(s / CELL) as u32).clamp(1, 1024));
        let points = surfaces.carried.iter().flat_map(|carried| carried.points.chunks_exact(surface::POINT));
        let stiffest = points.map(|point| point[4]).fold(0.0, f64::max);
        let longest = threads.beams.chunks_exact(beam2::TABLE).map(|beam| beam[3]).fold(0.0, f64::max);
        let stiffest = if active.ties { stiffest.max(self.chosen.tie_n_mm) } else { stiffest };
        let along = if active.thread_thread { self.chosen.thread_thread_penalty_n_mm2 * longest } else { 0.0 };
        let radius = threads.radius.iter().copied().fold(0.0, f64::max);
        let depth = 0.5 * self.tables.thinnest().min(0.4);
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
            // set for the forces of each kind of pair
            friction: 0.0,
            tangential: self.chosen.tangential_ratio as f32,
            damping: self.chosen.damping_ratio as f32,
            // a pair may reach 2²⁷ quanta, a node the sum of sixteen such pairs; line pieces push with at most 0.39 k L r
            force_quantum: (power((stiffest * (depth + radius)).max(along * radius)) / f64::from(1 << 27)) as f32,
            stiffness_quantum: (power(64.0 * stiffest.max(along)) / f64::from(1 << 28)) as f32,
            thread_radius: radius as f32,
            thread_thread: self.chosen.thread_thread_penalty_n_mm2 as f32,
            self_arc: mesh.self_arc() as f32,
            depth: depth.min(f64::from(f32::MAX)) as f32,
            state: slot_state(active.friction) as u32,
            // per axis, so that the same distance results in space
            apart: quanta(Shares::new(active.periodic).apart * self.chosen.skin_mm / libm::sqrt(3.0)) as u32,
        }
    }
}
