//! From a scene to buffers and stages. Reading this file is reading the algorithm.
//!
//! A step: forces of hexahedra, beams, bends and contact, side by side; assembly to accelerations; prescribed motion;
//! fibre lines; integration. When the contact skin is used up: grid, then candidates. For energies and limits: the
//! diagnose stages, then the collect stages, which add up what the host reads. An effect that the scene does not have adds no buffer and no stage.

mod conditions;
mod solids;
mod surfaces;
mod threads;
mod ties;
mod totals;

use crate::case::Case;
use crate::conditions::prescribed;
use crate::contact::{
    self, Params as ContactParams, candidates, grid, penalty, status, threads as thread_contact, tie, travel,
};
use crate::dynamics::{assemble, fibre_lines, integrate, time_step};
use crate::elements::{beam2, bend, hex8};
use crate::error::Result;
use crate::kernel::buffer::{Buffer, Description, Initial, Kind};
use crate::kernel::position::quanta;
use crate::kernel::stage::{Access, Code, Kernel, Plan, Stage};
use crate::materials::charmetant::Charmetant;
use crate::materials::neo_hookean::NeoHookean;
use crate::materials::{Law, Material};
use crate::mesh::Mesh;
use bytemuck::Pod;
use conditions::Conditions;
use solids::Solids;
use surfaces::Surfaces;
use threads::Threads;
use ties::Ties;
pub use totals::{Largest, Sums, Totals};

/// A plan, and what the host must know to drive it and to understand what it computes.
pub struct Model {
    pub plan: Plan,
    /// Stages of a step up to accelerations; the others move nodes.
    pub forces: usize,
    /// Those of the collect stages that see what motion has changed.
    pub collect_motion: Vec<Stage>,
    pub buffers: Buffers,
    pub totals: Totals,
    /// True mass of every node, tonne, and mass with the floor.
    pub true_mass: Vec<f64>,
    pub mass: Vec<f64>,
    pub first_thread: usize,
    /// Block and lane of each hexahedron, in the order of the mesh.
    pub hex_place: Vec<(usize, usize)>,
    /// Hexahedron in each lane of each block.
    pub hex_at: Vec<usize>,
    /// Reference volume of each hexahedron, mm³.
    pub hex_volume: Vec<f64>,
    /// Node, area or length, and whether it is a thread's, of each contact slave.
    pub slaves: Vec<Slave>,
    /// Largest share of the smallest contact radius or yarn thickness, mm, for guards.
    pub limits: Limits,
}

/// A contact slave node.
#[derive(Debug, Clone, Copy)]
pub struct Slave {
    pub node: usize,
    /// mm² of a yarn surface, mm of a thread.
    pub measure: f64,
    pub is_thread: bool,
}

/// Sizes that guards compare penetrations with, mm.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    pub thread_radius: f64,
    pub yarn_thickness: f64,
}

/// Buffers that the host reads or writes.
#[derive(Debug, Clone)]
pub struct Buffers {
    pub reference: Buffer,
    pub quanta: Buffer,
    pub remainder: Buffer,
    pub velocity: Buffer,
    /// Of the last step, mm/s² and 1/tonne, and what fibre lines add to the first.
    pub acceleration: Buffer,
    pub inverse_mass: Buffer,
    pub correction: Option<Buffer>,
    pub status: Buffer,
    pub hex_energy: Option<Buffer>,
    pub beam_tension: Option<Buffer>,
    pub contact_force: Option<Buffer>,
    pub contact_stiffness: Option<Buffer>,
    pub contact_sums: Option<Buffer>,
    pub contact_keys: Option<Buffer>,
    pub contact_state: Option<Buffer>,
    pub pair_sums: Option<Buffer>,
    pub pair_keys: Option<Buffer>,
    pub pair_state: Option<Buffer>,
    pub prescribed: Option<Buffer>,
    pub reaction: Option<Buffer>,
    /// Slip of each contact slave since the start, mm.
    pub slip: Option<Buffer>,
}

/// Sizes of contact's tables, which grow when they overflow: slots up to 16, those of beams up to [`thread_contact::MOST_PAIRS`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Capacity {
    pub cell: usize,
    pub slots: usize,
    pub beam_slots: usize,
}

impl Default for Capacity {
    fn default() -> Self {
        Self { cell: 192, slots: 12, beam_slots: 16 }
    }
}

/// Items of a chunk of light work on nodes.
const NODE_GRAIN: usize = 512;

/// Builds a plan piece by piece.
#[derive(Default)]
struct Builder {
    plan: Plan,
}

impl Builder {
    fn add(&mut self, name: &'static str, kind: Kind, len: usize, persistent: bool, initial: Initial) -> Buffer {
        self.plan.buffers.push(Description { name, kind, len, persistent, initial });
        Buffer(self.plan.buffers.len() - 1)
    }
    /// Scalars that start at zero and live for one step or one output.
    fn scratch(&mut self, name: &'static str, len: usize) -> Buffer {
        self.add(name, Kind::Scalar, len, false, Initial::Zero)
    }
    /// Scalars that do not change.
    fn table(&mut self, name: &'static str, values: Vec<f64>) -> Buffer {
        self.add(name, Kind::Scalar, values.len(), false, Initial::Scalar(values))
    }
    /// Unsigned integers that do not change.
    fn indices(&mut self, name: &'static str, values: Vec<u32>) -> Buffer {
        self.add(name, Kind::Uint, values.len(), false, Initial::Uint(values))
    }
}

/// A stage that runs beside those before it.
fn beside<K: Kernel>(
    name: &'static str,
    count: usize,
    grain: usize,
    reads: &[Buffer],
    writes: &[(Buffer, Access)],
    params: impl Pod,
) -> Stage {
    Stage {
        name,
        first: 0,
        count,
        grain,
        reads: reads.to_vec(),
        writes: writes.to_vec(),
        params: bytemuck::bytes_of(&params).to_vec(),
        constants: Vec::new(),
        kernel: Code::of::<K>(),
        waits: false,
    }
}

/// A stage that waits for those before it.
fn after<K: Kernel>(
    name: &'static str,
    count: usize,
    grain: usize,
    reads: &[Buffer],
    writes: &[(Buffer, Access)],
    params: impl Pod,
) -> Stage {
    Stage { waits: true, ..beside::<K>(name, count, grain, reads, writes, params) }
}

fn own(planes: usize, stride: usize) -> Access {
    Access::Own { planes, stride }
}

/// The plan of a case on its mesh.
///
/// # Errors
/// Geometry that cannot be run: inverted elements, conditions without nodes.
pub fn build(case: &Case, friction: f64, mesh: &Mesh, capacity: Capacity) -> Result<Model> {
    let effects = &case.effects;
    let periodic = mesh.period.is_some();
    let nodes = mesh.nodes.len();
    let first = mesh.first_thread_node();
    let solids = Solids::new(mesh)?;
    let threads = Threads::new(mesh, effects.bending);
    let (hexes, beams, bends) = (solids.headers.len(), threads.thread.len(), threads.pairs.len() / 2);
    let conditions = Conditions::new(case, mesh)?;
    let first_thread = first as u32;

    let mut b = Builder::default();
    // state of nodes
    let planes: [Vec<i32>; 3] = std::array::from_fn(|k| mesh.nodes.iter().map(|x| quanta(x[k])).collect());
    let reference = b.add("reference position", Kind::Int, 3 * nodes, false, Initial::Int(planes.concat()));
    let mut start = vec![0; 3 * nodes];
    start[2 * nodes + nodes / 2] = case.integration.perturbation_quanta;
    let quanta_ = b.add("displacement quanta", Kind::Int, 3 * nodes, true, Initial::Int(start));
    let remainder = b.add("displacement remainder", Kind::Scalar, 3 * nodes, true, Initial::Zero);
    let velocity = b.add("velocity", Kind::Scalar, 3 * nodes, true, Initial::Scalar(initial_velocity(mesh)));
    let true_mass = [&solids.mass[..], &threads.mass].concat();
    let floored = floor_mass(mesh, &true_mass, effects.mass_floor);
    let mass = b.table("mass", floored.clone());
    let status_ = b.add("status", Kind::Uint, status::SIZE, false, Initial::Zero);
    let acceleration = b.scratch("acceleration", 3 * nodes);
    let inverse_mass = b.scratch("inverse mass", nodes);
    let work = b.scratch("work on nodes", integrate::WORKS * nodes);

    // forces of elements
    let materials = b.table("materials", solids.materials.clone());
    let frames = b.table("fibre frames", solids.frames.clone());
    let shapes = b.table("shapes", solids.shapes.clone());
    let headers = b.indices("hex blocks", bytemuck::cast_slice(&solids.headers).to_vec());
    let corners = b.indices("hex corners", solids.corners.clone());
    let hex_force = b.scratch("hex corner forces", hex8::SLOTS * hexes);
    let hex_bound = b.scratch("hex stiffness bounds", hex8::BOUND * hexes);
    let hex_energy = (hexes > 0).then(|| b.scratch("hex energies", hex8::ENERGY * hexes));
    let hex_virial = (hexes > 0 && periodic).then(|| b.scratch("hex stress sums", hex8::VIRIAL * hexes));
    let left = effects.fibre_lines.as_ref().map_or(0.0, |lines| time_step::left(lines.beta) as f32);
    let hex_reads = [headers, corners, quanta_, remainder, shapes, frames, materials];
    for (law, range) in &solids.laws {
        let stages = HexStages {
            params: hex8::Params { nodes: nodes as u32, left },
            blocks: range.clone(),
            reads: &hex_reads,
            force: hex_force,
            virial: hex_virial,
            energy: hex_energy,
            bound: hex_bound,
        };
        match law {
            Law::Charmetant => stages.add::<Charmetant>(&mut b),
            Law::NeoHookean => stages.add::<NeoHookean>(&mut b),
        }
    }
    let ends = b.indices("beam ends", threads.ends.clone());
    let beam_table = b.table("beams", threads.beams.clone());
    let beam_force = b.scratch("beam forces", 3 * beams);
    let bend_force = b.scratch("bend forces", 6 * bends);
    let beam_tension = (beams > 0).then(|| b.scratch("beam tension", beams));
    let beam_work = (beams > 0).then(|| b.scratch("thermal work of beams", beams));
    let beam_virial = (beams > 0 && periodic).then(|| b.scratch("beam stress sums", 9 * beams));
    if let (Some(tension), Some(thermal)) = (beam_tension, beam_work) {
        let reads = [ends, beam_table, quanta_, remainder];
        let writes = [(beam_force, own(1, 3)), (tension, own(1, 1)), (thermal, own(1, 1))];
        b.plan.step.push(match beam_virial {
            Some(virial) => {
                let writes = [&writes[..], &[(virial, own(1, 9))]].concat();
                beside::<beam2::Beam2<true>>("beam2", beams, 64, &reads, &writes, [0u32; 0])
            }
            None => beside::<beam2::Beam2<false>>("beam2", beams, 64, &reads, &writes, [0u32; 0]),
        });
    }
    let bend_energy = (bends > 0).then(|| b.scratch("bend energies", bends));
    let bend_table = b.table("bends", threads.bends.clone());
    let bend_virial = (bends > 0 && periodic).then(|| b.scratch("bend stress sums", 9 * bends));
    if let Some(energy) = bend_energy {
        let pairs = b.indices("bend beams", threads.pairs.clone());
        let reads = [pairs, bend_table, ends, beam_table, quanta_, remainder];
        let writes = [(bend_force, own(1, 6)), (energy, own(1, 1))];
        b.plan.step.push(match bend_virial {
            Some(virial) => {
                let writes = [&writes[..], &[(virial, own(1, 9))]].concat();
                beside::<bend::Bend<true>>("bend", bends, 64, &reads, &writes, [0u32; 0])
            }
            None => beside::<bend::Bend<false>>("bend", bends, 64, &reads, &writes, [0u32; 0]),
        });
    }

    let element_limit = b.scratch("element stiffness of nodes", 2 * nodes);
    let search_quanta = b.add("quanta at the last search", Kind::Int, 3 * nodes, true, Initial::Zero);
    let search_remainder = b.add("remainder at the last search", Kind::Scalar, 3 * nodes, true, Initial::Zero);
    let reads = [quanta_, remainder, search_quanta, search_remainder, velocity];
    let writes = [(status_, Access::Atomic)];
    b.plan.watch.push(after::<travel::Travel>("travel", nodes, NODE_GRAIN, &reads, &writes, [0u32; 0]));

    // contact
    let contact = match &effects.contact {
        Some(chosen) => {
            let scene = ContactScene {
                chosen,
                friction,
                mesh,
                threads: &threads,
                conditions: &conditions,
                ties: Ties::new(case, mesh, chosen.thread_thread_penalty_n_mm),
                capacity,
                reference,
                quanta: quanta_,
                remainder,
                velocity,
                mass,
                status: status_,
                ends,
                beams: beam_table,
            };
            scene.add(&mut b)
        }
        None => None,
    };

    let writes = [(search_quanta, own(3, 1)), (search_remainder, own(3, 1))];
    let reads = [quanta_, remainder];
    b.plan.search.push(after::<travel::Remember>("remember", nodes, NODE_GRAIN, &reads, &writes, [0u32; 0]));

    // accelerations
    let solid_slots = b.indices("corner slots of solid nodes", solids.slots.clone());
    let thread_slots = b.indices("slots of thread nodes", threads.slots.clone());
    let contact_mass = effects.contact_mass.as_ref().filter(|_| contact.is_some());
    let assemble_params = assemble::Params {
        first_thread,
        force_quantum: contact.as_ref().map_or(1.0, |c| c.params.force_quantum),
        stiffness_quantum: contact.as_ref().map_or(1.0, |c| c.params.stiffness_quantum),
        mass_factor: contact_mass.map_or(0.0, |c| c.factor as f32),
        mass_memory: contact_mass.map_or(0.0, |c| c.memory as f32),
    };
    let mut reads = vec![solid_slots, hex_force, thread_slots, beam_force, bend_force, mass];
    reads.extend(contact_mass.map(|_| element_limit));
    let mut writes = vec![(acceleration, own(3, 1)), (inverse_mass, own(1, 1))];
    let mut added_mass = None;
    let assembly = match &contact {
        None => {
            after::<assemble::Assemble<false, false>>("assemble", nodes, NODE_GRAIN, &reads, &writes, assemble_params)
        }
        Some(contact) => {
            writes.extend([(contact.force, own(3, 1)), (contact.stiffness, own(1, 1))]);
            if contact_mass.is_some() {
                let added = b.add("added mass", Kind::Scalar, nodes, true, Initial::Zero);
                added_mass = Some(added);
                writes.push((added, own(1, 1)));
                after::<assemble::Assemble<true, true>>("assemble", nodes, NODE_GRAIN, &reads, &writes, assemble_params)
            } else {
                writes.push((status_, Access::Atomic));
                after::<assemble::Assemble<true, false>>(
                    "assemble",
                    nodes,
                    NODE_GRAIN,
                    &reads,
                    &writes,
                    assemble_params,
                )
            }
        }
    };
    b.plan.step.push(assembly);
    let forces = b.plan.step.len();

    // conditions
    let gravity = effects.gravity_mm_s2.unwrap_or_default().map(|g| g as f32);
    let (mut reaction, mut reaction_work, mut condition_nodes) = (None, None, None);
    if conditions.count() > 0 {
        let count = conditions.count();
        let at = b.indices("prescribed nodes", conditions.nodes);
        let targets = b.table("prescribed displacements", conditions.targets);
        let (force, done) = (b.scratch("reactions", 3 * count), b.scratch("work of reactions", count));
        (reaction, reaction_work, condition_nodes) = (Some(force), Some(done), Some((at, count)));
        let reads = [at, targets, velocity, mass];
        let writes =
            [(acceleration, Access::Scatter), (inverse_mass, Access::Scatter), (done, own(1, 1)), (force, own(1, 3))];
        let params = prescribed::Params { first_thread, gravity };
        b.plan.step.push(after::<prescribed::Prescribed>("prescribed", count, NODE_GRAIN, &reads, &writes, params));
    }

    // fibre lines
    let line_stiffness = [&solids.line_stiffness[..], &threads.line_stiffness].concat();
    let mut covered = vec![false; nodes];
    let mut correction = None;
    if let Some(lines) = &effects.fibre_lines {
        let groups = line_groups(mesh, lines.threads);
        for g in &groups {
            covered[g.first as usize..][..(g.lines * g.stations) as usize].fill(true);
        }
        let response = b.scratch("line correction", 3 * nodes);
        correction = Some(response);
        let table = b.indices("fibre lines", bytemuck::cast_slice(&groups).to_vec());
        let stiffness = b.table("line stiffness", line_stiffness.clone());
        let reads = [table, stiffness, reference, quanta_, remainder, acceleration, inverse_mass];
        let params = fibre_lines::Params { beta: lines.beta as f32 };
        let writes = [(response, Access::Scatter)];
        let longest = groups.iter().map(|g| g.stations as usize).max().unwrap_or(1);
        b.plan.step.push(Stage {
            constants: vec![("STATIONS", longest)],
            ..after::<fibre_lines::FibreLines>("fibre lines", groups.len(), 1, &reads, &writes, params)
        });
        if let Some((at, count)) = condition_nodes {
            b.plan.step.push(after::<prescribed::Hold>("hold", count, NODE_GRAIN, &[at], &writes, [0u32; 0]));
        }
    }

    // motion
    let params = integrate::Params { first_thread, gravity };
    let reads: Vec<Buffer> = [acceleration, mass, inverse_mass].into_iter().chain(correction).collect();
    let writes = [(velocity, own(3, 1)), (quanta_, own(3, 1)), (remainder, own(3, 1)), (work, own(3, 1))];
    let lines = effects.fibre_lines.is_some();
    b.plan.step.push(match (lines, effects.gravity_mm_s2.is_some()) {
        (true, true) => {
            after::<integrate::Integrate<true, true>>("integrate", nodes, NODE_GRAIN, &reads, &writes, params)
        }
        (true, false) => {
            after::<integrate::Integrate<true, false>>("integrate", nodes, NODE_GRAIN, &reads, &writes, params)
        }
        (false, true) => {
            after::<integrate::Integrate<false, true>>("integrate", nodes, NODE_GRAIN, &reads, &writes, params)
        }
        (false, false) => {
            after::<integrate::Integrate<false, false>>("integrate", nodes, NODE_GRAIN, &reads, &writes, params)
        }
    });

    // limit of the time step
    if effects.fibre_lines.is_none() {
        // in the bounds of hexahedra
        covered[..first].fill(true);
    }
    let constant = constant_stiffness(mesh, &line_stiffness, &covered);
    let constant = b.table("constant stiffness of nodes", constant);
    let solid_bounds = b.indices("corner bounds of solid nodes", solids.bounds.clone());
    let bend_rows = b.table("bend rows", threads.bend_rows.clone());
    // without bends none of their numbers is read
    let bend_reads = [bend_table, bend_energy.unwrap_or(bend_force), bend_force, bend_rows];
    let reads =
        [&[solid_bounds, hex_bound, constant, mass, thread_slots, beam_force, beam_table][..], &bend_reads].concat();
    let params = time_step::Params { first_thread };
    let writes = [(element_limit, own(2, 1))];
    b.plan.diagnose.push(after::<time_step::ElementLimit>("element limit", nodes, NODE_GRAIN, &reads, &writes, params));
    if let Some((at, count)) = condition_nodes {
        let writes = [(element_limit, Access::Scatter)];
        let held = after::<time_step::HeldLimit>("held limit", count, NODE_GRAIN, &[at], &writes, [0u32; 0]);
        b.plan.diagnose.push(held);
    }

    let (faces, pairs) = contact.as_ref().map_or((None, None), |c| (c.faces, c.pairs));
    let sources = totals::Sources {
        mesh,
        masses: &floored,
        hex_place: &solids.place,
        hex_blocks: hexes,
        bends,
        slaves: contact.as_ref().map_or(0, |c| c.slaves.len()),
        conditions: condition_nodes.map_or(0, |(_, count)| count),
        mass,
        velocity,
        reference,
        work,
        element_limit,
        beam_table,
        hex_energy,
        hex_virial,
        beam_tension,
        beam_work,
        beam_virial,
        bend_energy,
        bend_virial,
        contact_sums: faces.map(|f| f.sums),
        pair_sums: pairs.map(|p| p.sums),
        ties: contact.as_ref().and_then(|c| c.ties),
        reaction_work,
        added_mass,
    };
    let (totals, slip) = totals::add(&mut b, &sources);
    let moved = |stage: &&Stage| {
        let taken = |buffer| buffer == work || Some(buffer) == reaction_work;
        stage.reads.contains(&velocity) || stage.writes.iter().any(|(buffer, _)| taken(*buffer))
    };
    let collect_motion = b.plan.collect.iter().filter(moved).cloned().collect();
    let mut hex_at = vec![0; hexes * hex8::LANES];
    for (hex, (block, lane)) in solids.place.iter().enumerate() {
        hex_at[block * hex8::LANES + lane] = hex;
    }

    let thickness = mesh.blocks.iter().map(|block| thickness(mesh, block)).fold(f64::INFINITY, f64::min);
    let radius = threads.radius.iter().copied().fold(f64::INFINITY, f64::min);
    Ok(Model {
        buffers: Buffers {
            reference,
            quanta: quanta_,
            remainder,
            velocity,
            acceleration,
            inverse_mass,
            correction,
            status: status_,
            hex_energy,
            beam_tension,
            contact_force: contact.as_ref().map(|c| c.force),
            contact_stiffness: contact.as_ref().map(|c| c.stiffness),
            contact_sums: faces.map(|f| f.sums),
            contact_keys: faces.map(|f| f.keys),
            contact_state: faces.map(|f| f.state),
            pair_sums: pairs.map(|p| p.sums),
            pair_keys: pairs.map(|p| p.keys),
            pair_state: pairs.map(|p| p.state),
            prescribed: condition_nodes.map(|(at, _)| at),
            reaction,
            slip,
        },
        totals,
        plan: b.plan,
        forces,
        collect_motion,
        true_mass,
        mass: floored,
        first_thread: first,
        hex_at,
        hex_place: solids.place,
        hex_volume: solids.volume,
        slaves: contact.map_or_else(Vec::new, |c| c.slaves),
        limits: Limits { thread_radius: radius, yarn_thickness: thickness },
    })
}

/// The stages of hexahedra of one law.
struct HexStages<'a> {
    params: hex8::Params,
    blocks: std::ops::Range<usize>,
    reads: &'a [Buffer],
    force: Buffer,
    virial: Option<Buffer>,
    energy: Option<Buffer>,
    bound: Buffer,
}

impl HexStages<'_> {
    fn add<M: Material>(&self, b: &mut Builder) {
        /// Blocks in a chunk.
        const GRAIN: usize = 4;
        let &Self { params, reads, force, .. } = self;
        let count = self.blocks.len();
        let here = |stage: Stage| Stage { first: self.blocks.start, ..stage };
        let force = (force, own(1, hex8::SLOTS));
        let force_stage = match self.virial {
            Some(virial) => {
                let writes = [force, (virial, own(1, hex8::VIRIAL))];
                beside::<hex8::Force<M, true>>("hex8", count, GRAIN, reads, &writes, params)
            }
            None => beside::<hex8::Force<M, false>>("hex8", count, GRAIN, reads, &[force], params),
        };
        b.plan.step.push(here(force_stage));
        if let Some(energy) = self.energy {
            let writes = [(energy, own(1, hex8::ENERGY))];
            b.plan.diagnose.push(here(beside::<hex8::Energy<M>>("hex8 energy", count, GRAIN, reads, &writes, params)));
        }
        let writes = [(self.bound, own(1, hex8::BOUND))];
        b.plan.diagnose.push(here(beside::<hex8::Bound<M>>("hex8 bound", count, GRAIN, reads, &writes, params)));
    }
}

/// Buffers of one kind of contact that the host reads.
#[derive(Clone, Copy)]
struct ContactBuffers {
    sums: Buffer,
    keys: Buffer,
    state: Buffer,
}

/// What contact adds to a plan.
struct ContactParts {
    params: ContactParams,
    force: Buffer,
    stiffness: Buffer,
    faces: Option<ContactBuffers>,
    pairs: Option<ContactBuffers>,
    /// Energies of ties, and how many there are.
    ties: Option<(Buffer, usize)>,
    slaves: Vec<Slave>,
}

/// What contact needs to know of the scene.
struct ContactScene<'a> {
    chosen: &'a crate::case::effects::Contact,
    friction: f64,
    mesh: &'a Mesh,
    threads: &'a Threads,
    conditions: &'a Conditions,
    ties: Ties,
    capacity: Capacity,
    reference: Buffer,
    quanta: Buffer,
    remainder: Buffer,
    velocity: Buffer,
    mass: Buffer,
    status: Buffer,
    ends: Buffer,
    beams: Buffer,
}

impl ContactScene<'_> {
    /// Adds the stages of contact; nothing if no pair can touch.
    fn add(&self, b: &mut Builder) -> Option<ContactParts> {
        let surfaces = Surfaces::new(self.mesh, self.threads, self.chosen);
        let count = surfaces.count();
        let beams = self.threads.thread.len();
        let paired = if self.chosen.thread_thread { beams } else { 0 };
        if count == 0 && paired == 0 {
            return None;
        }
        let nodes = self.mesh.nodes.len();
        let slabs = surfaces.slabs.len() / grid::SLAB;
        let params = self.params(&surfaces, slabs);
        let cells = (params.cells[0] * params.cells[1]) as usize;
        let force = b.add("contact force", Kind::Int, 3 * nodes, false, Initial::Zero);
        let stiffness = b.add("contact stiffness", Kind::Int, nodes, false, Initial::Zero);
        let bodies = b.indices("bodies", bytemuck::cast_slice(&surfaces.bodies).to_vec());
        let rings = b.indices("ring lines", surfaces.ring_lines);
        let slab_table = b.indices("slabs", surfaces.slabs);
        let counts = b.add("items of cells", Kind::Uint, cells, false, Initial::Zero);
        let lists = b.add("cells", Kind::Uint, cells * self.capacity.cell, false, Initial::Zero);
        let boxes = b.scratch("boxes", grid::BOX * (slabs + paired));
        let place = [self.reference, self.quanta, self.remainder];
        let status = (self.status, Access::Atomic);
        b.plan.search.push(after::<grid::Clear>("clear grid", cells, 4096, &[], &[(counts, own(1, 1))], params));
        let reads = [&[slab_table, bodies, rings][..], &place, &[self.ends, self.beams]].concat();
        let writes = [(counts, Access::Atomic), (lists, Access::Scatter), (boxes, own(1, grid::BOX)), status];
        b.plan.search.push(after::<grid::Fill>("grid", slabs + paired, 32, &reads, &writes, params));

        let faces = (count > 0).then(|| {
            let slaves = b.indices("slaves", surfaces.slaves.clone());
            let values = b.table("slave values", surfaces.values.clone());
            let slots = self.capacity.slots;
            let keys_len = penalty::SLOT_KEYS * slots * count;
            let keys =
                b.add("contact candidates", Kind::Uint, keys_len, true, Initial::Uint(vec![contact::EMPTY; keys_len]));
            let state =
                b.add("contact friction", Kind::Scalar, penalty::SLOT_STATE * slots * count, true, Initial::Zero);
            let sums = b.scratch("contact sums", penalty::SUMS * count);
            let keys_own = (keys, own(1, penalty::SLOT_KEYS * slots));
            let state_own = (state, own(1, penalty::SLOT_STATE * slots));
            let reads = [&[slaves, values, slab_table, bodies, rings][..], &place, &[counts, lists, boxes]].concat();
            let writes = [keys_own, state_own, status];
            b.plan.search.push(after::<candidates::Candidates>("candidates", count, 64, &reads, &writes, params));
            let reads = [&[slaves, values, bodies, rings][..], &place, &[self.velocity, self.mass]].concat();
            let writes = [
                keys_own,
                state_own,
                (sums, own(1, penalty::SUMS)),
                (force, Access::Atomic),
                (stiffness, Access::Atomic),
                status,
            ];
            b.plan.step.push(beside::<penalty::Penalty>("contact", count, 64, &reads, &writes, params));
            ContactBuffers { sums, keys, state }
        });

        let pairs = (paired > 0).then(|| {
            let slots = self.capacity.beam_slots;
            let of = b.indices("threads of beams", self.threads.thread.clone());
            let arcs = b.table("arc lengths", self.threads.arcs.clone());
            let keys_len = slots * beams;
            let keys = b.add("beam pairs", Kind::Uint, keys_len, true, Initial::Uint(vec![contact::EMPTY; keys_len]));
            let state =
                b.add("beam pair friction", Kind::Scalar, thread_contact::STATE * slots * beams, true, Initial::Zero);
            let sums = b.scratch("beam pair sums", penalty::SUMS * beams);
            let common = [&[self.ends, self.beams][..], &place].concat();
            let reads = [&common[..], &[of, arcs, counts, lists, boxes]].concat();
            let keys_own = (keys, own(1, slots));
            let state_own = (state, own(1, thread_contact::STATE * slots));
            let writes = [keys_own, state_own, status];
            b.plan.search.push(after::<thread_contact::Pairs>("beam pairs", beams, 32, &reads, &writes, params));
            let reads = [&common[..], &[self.velocity, self.mass]].concat();
            let writes = [
                keys_own,
                state_own,
                (sums, own(1, penalty::SUMS)),
                (force, Access::Atomic),
                (stiffness, Access::Atomic),
                status,
            ];
            b.plan.step.push(beside::<thread_contact::Force>("beam contact", beams, 32, &reads, &writes, params));
            ContactBuffers { sums, keys, state }
        });
        let ties = (self.ties.count() > 0).then(|| {
            let count = self.ties.count();
            let nodes = b.indices("ties", self.ties.nodes.clone());
            let values = b.table("tie values", self.ties.values.clone());
            let energy = b.scratch("tie energies", count);
            let reads = [nodes, values, self.quanta, self.remainder];
            let writes = [(energy, own(1, 1)), (force, Access::Atomic), (stiffness, Access::Atomic), status];
            b.plan.step.push(beside::<tie::Tie>("ties", count, 64, &reads, &writes, params));
            (energy, count)
        });
        let slaves = surfaces
            .slaves
            .chunks_exact(penalty::SLAVE)
            .zip(&surfaces.measure)
            .map(|(s, measure)| Slave { node: s[0] as usize, measure: *measure, is_thread: s[1] == contact::EMPTY })
            .collect();
        Some(ContactParts { params, force, stiffness, faces, pairs, ties, slaves })
    }

    fn params(&self, surfaces: &Surfaces, slabs: usize) -> ContactParams {
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
        let stiffest = surfaces.values.chunks_exact(penalty::SLAVE_VALUES).map(|v| v[0]).fold(0.0, f64::max);
        let stiffest = stiffest.max(self.chosen.thread_thread_penalty_n_mm);
        let radius = self.threads.radius.iter().copied().fold(0.0, f64::max);
        let thickness = mesh.blocks.iter().map(|b| thickness(mesh, b)).fold(f64::INFINITY, f64::min);
        let depth = 0.5 * thickness.min(0.4);
        let power = |x: f64| libm::exp2(libm::ceil(libm::log2(x)));
        ContactParams {
            period: mesh.period.unwrap_or_default().map(quanta),
            cells,
            capacity: self.capacity.cell as u32,
            slots: self.capacity.slots as u32,
            beam_slots: self.capacity.beam_slots as u32,
            slabs: slabs as u32,
            origin: origin.map(|x| x as f32),
            cell: [0, 1].map(|k| (size[k] / f64::from(cells[k])) as f32),
            skin: self.chosen.skin_mm as f32,
            friction: if self.chosen.friction { self.friction as f32 } else { 0.0 },
            tangential: self.chosen.tangential_ratio as f32,
            damping: self.chosen.damping_ratio as f32,
            // a pair may reach 2²⁷ quanta, a node the sum of sixteen such pairs
            force_quantum: (power(stiffest * (depth + radius)) / f64::from(1 << 27)) as f32,
            stiffness_quantum: (power(64.0 * stiffest) / f64::from(1 << 28)) as f32,
            thread_radius: radius as f32,
            thread_thread: self.chosen.thread_thread_penalty_n_mm as f32,
            self_arc: self.chosen.self_contact_arc_mm as f32,
            depth: depth.min(f64::from(f32::MAX)) as f32,
        }
    }
}

/// Largest top-to-bottom distance of a block's first section, mm.
fn thickness(mesh: &Mesh, block: &crate::mesh::Block) -> f64 {
    (0..=block.columns)
        .map(|c| {
            let (low, high) = (mesh.nodes[block.line(c, 0)], mesh.nodes[block.line(c, block.layers)]);
            let d = [0, 1, 2].map(|k| high[k] - low[k]);
            libm::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        })
        .fold(0.0, f64::max)
}

/// Velocities at the start, in planes.
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

/// Mass with a floor of a share of the body's mean nodal mass.
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

/// Groups of up to sixteen lines of equal length with consecutive nodes.
fn line_groups(mesh: &Mesh, with_threads: bool) -> Vec<fibre_lines::Group> {
    let shift = |wrap: Option<[i32; 2]>| {
        let period = mesh.period.unwrap_or_default().map(quanta);
        let wrap = wrap.unwrap_or_default();
        [wrap[0] * period[0], wrap[1] * period[1]]
    };
    let blocks = mesh.blocks.iter().map(|b| (b.first, b.lines(), b.stations(), b.wrap));
    let threads = mesh.threads.iter().filter(|_| with_threads).map(|t| (t.first, 1, t.count, t.wrap));
    let mut groups: Vec<fibre_lines::Group> = Vec::new();
    for (first, lines, stations, wrap) in threads.chain(blocks) {
        // a closed line of two nodes has two segments between the same nodes: its fibres stay explicit
        if stations < 2 + usize::from(wrap.is_some()) {
            continue;
        }
        for start in (0..lines).step_by(hex8::LANES) {
            let count = (lines - start).min(hex8::LANES);
            let group = fibre_lines::Group {
                first: (first + start * stations) as u32,
                lines: count as u32,
                stations: stations as u32,
                closed: u32::from(wrap.is_some()),
                shift: shift(wrap),
            };
            match groups.last_mut() {
                Some(last)
                    if lines == 1
                        && last.lines < hex8::LANES as u32
                        && (last.stations, last.closed, last.shift) == (group.stations, group.closed, group.shift)
                        && last.first + last.lines * last.stations == group.first =>
                {
                    last.lines += 1;
                }
                _ => groups.push(group),
            }
        }
    }
    groups
}

/// Row sums of axial stiffness that is not covered otherwise.
fn constant_stiffness(mesh: &Mesh, axial: &[f64], covered: &[bool]) -> Vec<f64> {
    let mut k = vec![0.0; mesh.nodes.len()];
    let blocks = mesh
        .blocks
        .iter()
        .flat_map(|b| (0..b.lines()).map(move |l| (b.first + l * b.stations(), b.stations(), b.wrap.is_some())));
    let chains = mesh.threads.iter().map(|t| (t.first, t.count, t.wrap.is_some()));
    for (first, count, closed) in blocks.chain(chains) {
        for i in 0..count {
            let next = if i + 1 < count { first + i + 1 } else { first };
            let here = first + i;
            if !covered[here] && (i + 1 < count || closed) {
                k[here] += 2.0 * axial[here];
                k[next] += 2.0 * axial[here];
            }
        }
    }
    k
}
