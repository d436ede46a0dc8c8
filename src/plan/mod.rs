//! From a scene to buffers and stages. Reading this file is reading the algorithm.
//!
//! A step: forces of hexahedra, beams, bends and contact, side by side; assembly to accelerations; prescribed motion;
//! fibre lines; integration. When the contact skin is used up: grid, then candidates. For energies and limits: the
//! diagnose stages, then the collect stages, which add up what the host reads. An effect that the scene does not have
//! ([`Active`]) adds no buffer, no stage, and no text or branch to the stages that others share.

mod conditions;
mod contact;
mod effects;
mod hexes;
mod perturbation;
mod shapes;
mod solids;
mod surfaces;
mod threads;
mod totals;

use crate::conditions::prescribed::{self, Prescribed};
use crate::contact::{penalty, skin, slot_state, status};
use crate::dynamics::assemble::{self, Assemble};
use crate::dynamics::fibre_lines::{self, FibreLines};
use crate::dynamics::integrate::{self, Integrate};
use crate::dynamics::time_step::{self, ElementLimit, WeighedLimit};
use crate::elements::beam2::Beam2;
use crate::elements::{LANES, bend, block};
use crate::error::Result;
use crate::kernel::buffer::{Buffer, Description, Initial, Kind};
use crate::kernel::position::quanta;
use crate::kernel::stage::{Access, Code, Kernel, Plan, Stage, flagged};
use crate::mesh::Mesh;
use crate::mesh::centre::centred;
use crate::scene::Scene;
use bytemuck::Pod;
use conditions::Conditions;
use contact::ContactScene;
pub use contact::FaceBuffers;
pub use effects::Active;
use hexes::HexBuffers;
use solids::Solids;
use threads::Threads;
pub use totals::{Largest, Sums, Totals};

/// A plan, and what the host must know to drive it and to understand what it computes.
pub struct Model {
    pub plan: Plan,
    pub active: Active,
    /// Stages of a step up to accelerations; the others move nodes.
    pub forces: usize,
    /// Those of the collect stages that see what motion has changed.
    pub collect_motion: Vec<Stage>,
    pub buffers: Buffers,
    pub totals: Totals,
    /// True mass of every node, tonne, and mass with the floor.
    pub true_mass: Vec<f64>,
    pub mass: Vec<f64>,
    /// Of all solids and of all threads: true mass, and what the floor adds to it, tonne.
    pub whole_mass: [[f64; 2]; 2],
    pub first_thread: usize,
    /// Block and lane of each hexahedron, in the order of the mesh.
    pub hex_place: Vec<(usize, usize)>,
    /// Hexahedron in each lane of each block.
    pub hex_at: Vec<usize>,
    /// Reference volume of each hexahedron, mm³.
    pub hex_volume: Vec<f64>,
    /// Contact points of threads and of yarn surfaces on yarns.
    pub points: [Vec<ContactPoint>; 2],
    /// Numbers of a touch of a point, and of a slot of a beam.
    pub touch: usize,
    pub slot_state: usize,
    /// Largest share of the smallest contact radius or yarn thickness, mm, for guards.
    pub limits: Limits,
    /// Number of load steps behind which each prescribed node is, in the order of their table.
    pub acts_after: Vec<usize>,
}

/// A contact point.
#[derive(Debug, Clone, Copy)]
pub struct ContactPoint {
    /// Nodes that it lies between, and its share in each.
    pub nodes: [usize; 2],
    pub shares: [f64; 2],
    /// mm² of a yarn surface, mm of a thread.
    pub measure: f64,
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
    /// What contact-aware mass adds, tonne.
    pub added_mass: Option<Buffer>,
    pub status: Buffer,
    /// Displacements when everything was last searched, in quanta.
    pub before: Option<Buffer>,
    pub hex_energy: Option<Buffer>,
    pub beam_tension: Option<Buffer>,
    pub bend_energy: Option<Buffer>,
    pub contact_force: Option<Buffer>,
    pub contact_stiffness: Option<Buffer>,
    /// Of threads and of yarns on yarns.
    pub faces: [Option<FaceBuffers>; 2],
    /// See [`crate::contact::found`]: of both, and of beams.
    pub found: [Option<Buffer>; 3],
    pub pair_sums: Option<Buffer>,
    pub pair_keys: Option<Buffer>,
    pub pair_state: Option<Buffer>,
    pub prescribed: Option<Buffer>,
    pub reaction: Option<Buffer>,
    /// Slip of each contact point of threads and of yarns since the start, mm.
    pub slip: [Option<Buffer>; 2],
}

/// Sizes of contact's tables, which grow when they overflow: faces near a beam or a node up to [`Self::MOST_FACES`], slots for
/// bodies up to [`Self::MOST_SLOTS`], those of beams up to [`MOST_PAIRS`](crate::contact::threads::MOST_PAIRS).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Capacity {
    pub cell: usize,
    pub faces: usize,
    pub slots: usize,
    pub beam_slots: usize,
}

impl Capacity {
    pub const MOST_FACES: usize = 512;
    pub const MOST_SLOTS: usize = 64;
}

impl Default for Capacity {
    fn default() -> Self {
        Self { cell: 192, faces: 32, slots: 6, beam_slots: 16 }
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
fn coded(
    kernel: Code,
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
        kernel,
        waits: false,
    }
}

/// A stage of a kernel without flags that runs beside those before it.
fn beside<K: Kernel>(
    name: &'static str,
    count: usize,
    grain: usize,
    reads: &[Buffer],
    writes: &[(Buffer, Access)],
    params: impl Pod,
) -> Stage {
    coded(Code::of::<K>(), name, count, grain, reads, writes, params)
}

/// A stage of a kernel without flags that waits for those before it.
fn after<K: Kernel>(
    name: &'static str,
    count: usize,
    grain: usize,
    reads: &[Buffer],
    writes: &[(Buffer, Access)],
    params: impl Pod,
) -> Stage {
    waiting(beside::<K>(name, count, grain, reads, writes, params))
}

/// A stage that waits for those before it.
fn waiting(stage: Stage) -> Stage {
    Stage { waits: true, ..stage }
}

fn own(planes: usize, stride: usize) -> Access {
    Access::Own { planes, stride }
}

/// The plan of a scene.
///
/// # Errors
/// Geometry that cannot be run: inverted elements, motions that contradict each other.
pub fn build(scene: &Scene, capacity: Capacity) -> Result<Model> {
    let conditions = Conditions::new(scene)?;
    let mesh = &*centred(&scene.mesh);
    let effects = &scene.effects;
    let line_groups = effects.fibre_lines.as_ref().map_or_else(Vec::new, |lines| line_groups(mesh, lines.threads));
    let active = Active::new(scene, &line_groups);
    let periodic = active.periodic;
    let nodes = mesh.nodes.len();
    let first = mesh.first_thread_node();
    let hourglass = scene.integration.hourglass_control();
    let solids = Solids::new(mesh, hourglass)?;
    let threads = Threads::new(mesh, active.bending, &conditions.held);
    let (hexes, beams, bends) = (solids.headers.len(), threads.beams(), threads.pairs.len() / 2);
    let first_thread = first as u32;

    let mut b = Builder::default();
    // state of nodes
    let planes: [Vec<i32>; 3] = std::array::from_fn(|k| mesh.nodes.iter().map(|x| quanta(x[k])).collect());
    let reference = b.add("reference position", Kind::Int, 3 * nodes, false, Initial::Int(planes.concat()));
    let start = perturbation::start(mesh, scene.integration.perturbation_mm, &conditions);
    let quanta_ = b.add("displacement quanta", Kind::Int, 3 * nodes, true, Initial::Int(start));
    let remainder = b.add("displacement remainder", Kind::Scalar, 3 * nodes, true, Initial::Zero);
    let velocity = b.add("velocity", Kind::Scalar, 3 * nodes, true, Initial::Scalar(initial_velocity(mesh)));
    let true_mass = [&solids.mass[..], &threads.mass].concat();
    let floored = floor_mass(mesh, &true_mass, effects.mass_floor);
    let mass = b.table("mass", floored.clone());
    let status_ = b.add("status", Kind::Uint, status::SIZE, false, Initial::Zero);
    let acceleration = b.scratch("acceleration", 3 * nodes);
    let weighed = active.gravity.then(|| b.table("true mass", true_mass.clone()));
    let inverse_mass = b.scratch("inverse mass", nodes);
    let works = active.works();
    let work = (works.count() > 0).then(|| b.scratch("work on nodes", works.count() * nodes));

    // forces of elements
    let left = match &effects.fibre_lines {
        Some(lines) if active.fibre_lines => time_step::left(lines.beta) as f32,
        _ => 0.0,
    };
    let params = block::Params { nodes: nodes as u32, left };
    let element_limit = b.scratch("element stiffness of nodes", 2 * nodes);
    let position = [quanta_, remainder];
    let hex = HexBuffers::add(&mut b, &solids, position, element_limit, periodic, hourglass.is_some(), params);
    let ends = b.indices("beam ends", threads.ends.clone());
    let beam_table = b.table("beams", threads.beams.clone());
    let beam_force = b.scratch("beam forces", 3 * beams);
    let beam_tension = (beams > 0).then(|| b.scratch("beam tension", beams));
    let beam_virial = (beams > 0 && periodic).then(|| b.scratch("beam stress sums", 9 * beams));
    let beam_thermal = active.thermal.then(|| {
        let strain = b.table("thermal strain of beams", threads.thermal.clone());
        (strain, b.scratch("thermal work of beams", beams))
    });
    let beam_work = beam_thermal.map(|(_, work)| work);
    if let Some(tension) = beam_tension {
        let mut reads = vec![ends, beam_table, quanta_, remainder];
        reads.extend(beam_thermal.map(|(strain, _)| strain));
        let mut writes = vec![(beam_force, own(1, 3)), (tension, own(1, 1))];
        writes.extend(beam_virial.map(|virial| (virial, own(1, 9))));
        writes.extend(beam_work.map(|work| (work, own(1, 1))));
        let kernel = flagged!(Beam2; periodic, active.thermal);
        b.plan.step.push(coded(kernel, "beam2", beams, 64, &reads, &writes, [0u32; 0]));
    }
    let bent = active.bending.then(|| Bent {
        table: b.table("bends", threads.bends.clone()),
        slots: b.indices("bend slots of thread nodes", threads.bend_slots.clone()),
        pairs: b.indices("bend beams", threads.pairs.clone()),
        force: b.scratch("bend forces", 6 * bends),
        energy: b.scratch("bend energies", bends),
    });
    let bend_virial = (active.bending && periodic).then(|| b.scratch("bend stress sums", 9 * bends));
    if let Some(bent) = &bent {
        let reads = [bent.pairs, bent.table, ends, beam_table, quanta_, remainder];
        let mut writes = vec![(bent.force, own(1, 6)), (bent.energy, own(1, 1))];
        writes.extend(bend_virial.map(|virial| (virial, own(1, 9))));
        b.plan.step.push(coded(flagged!(bend::Bend; periodic), "bend", bends, 64, &reads, &writes, [0u32; 0]));
    }

    let searched = active.searches().then(|| {
        let quanta = b.add("quanta at the last search", Kind::Int, 3 * nodes, true, Initial::Zero);
        [quanta, b.add("remainder at the last search", Kind::Scalar, 3 * nodes, true, Initial::Zero)]
    });
    let name = "displacements at the last search of everything";
    let before = searched.map(|_| b.add(name, Kind::Int, 3 * nodes, true, Initial::Zero));
    let mut reads = vec![quanta_, remainder, velocity];
    reads.extend(searched.into_iter().flatten());
    let kernel = flagged!(skin::Travel; active.searches());
    let writes = [(status_, Access::Atomic)];
    b.plan.watch.push(waiting(coded(kernel, "travel", nodes, NODE_GRAIN, &reads, &writes, [0u32; 0])));

    // contact
    let contact = effects.contact.as_ref().filter(|_| active.searches() || active.ties).map(|chosen| {
        let contact = ContactScene {
            chosen,
            active,
            mesh,
            threads: &threads,
            conditions: &conditions,
            ties: &scene.ties,
            capacity,
            reference,
            quanta: quanta_,
            remainder,
            velocity,
            mass,
            status: status_,
            before,
            ends,
            beams: beam_table,
        };
        contact.add(&mut b)
    });
    let contact = contact.transpose()?;
    if let Some([search_quanta, search_remainder]) = searched {
        let writes = [(search_quanta, own(3, 1)), (search_remainder, own(3, 1))];
        let reads = [quanta_, remainder];
        b.plan.search.push(after::<skin::Remember>("remember", nodes, NODE_GRAIN, &reads, &writes, [0u32; 0]));
    }

    // accelerations
    let solid_slots = b.indices("corner slots of solid nodes", solids.slots.clone());
    let thread_slots = b.indices("slots of thread nodes", threads.slots.clone());
    let contact_mass = effects.contact_mass.as_ref().filter(|_| active.contact_mass);
    let gravity = effects.gravity_mm_s2.unwrap_or_default().map(|g| g as f32);
    let assemble_params = assemble::Params {
        first_thread,
        gravity,
        force_quantum: contact.as_ref().map_or(1.0, |c| c.params.force_quantum),
        stiffness_quantum: contact.as_ref().map_or(1.0, |c| c.params.stiffness_quantum),
        mass_factor: contact_mass.map_or(0.0, |c| c.factor as f32),
        mass_memory: contact_mass.map_or(0.0, |c| c.memory as f32),
        mass_per_stiffness: contact_mass.map_or(0.0, |c| (0.25 * c.least_limit_s * c.least_limit_s) as f32),
    };
    let mut reads = vec![solid_slots, hex.force, thread_slots, beam_force, mass];
    reads.extend(bent.iter().flat_map(|bent| [bent.slots, bent.force]));
    reads.extend(contact_mass.map(|_| element_limit));
    reads.extend(weighed);
    let mut writes = vec![(acceleration, own(3, 1)), (inverse_mass, own(1, 1))];
    let added_mass = contact_mass.map(|_| b.add("added mass", Kind::Scalar, nodes, true, Initial::Zero));
    if let Some(contact) = &contact {
        writes.extend([(contact.force, own(3, 1)), (contact.stiffness, own(1, 1))]);
        writes.push(added_mass.map_or((status_, Access::Atomic), |added| (added, own(1, 1))));
    }
    let kernel = flagged!(Assemble; contact.is_some(), active.contact_mass, active.bending, active.gravity);
    b.plan.step.push(waiting(coded(kernel, "assemble", nodes, NODE_GRAIN, &reads, &writes, assemble_params)));
    let forces = b.plan.step.len();

    // conditions
    let (mut reaction, mut reaction_work, mut condition_nodes) = (None, None, None);
    if conditions.count() > 0 {
        let count = conditions.count();
        let at = b.indices("prescribed nodes", conditions.nodes.clone());
        let targets = b.table("prescribed displacements", conditions.targets.clone());
        let (force, done) = (b.scratch("reactions", 3 * count), b.scratch("work of reactions", count));
        (reaction, reaction_work, condition_nodes) = (Some(force), Some(done), Some((at, count)));
        let reads = [at, targets, velocity, mass];
        let writes =
            [(acceleration, Access::Scatter), (inverse_mass, Access::Scatter), (done, own(1, 1)), (force, own(1, 3))];
        let params = prescribed::Params { first_thread };
        let kernel = flagged!(Prescribed; active.damping);
        b.plan.step.push(waiting(coded(kernel, "prescribed", count, NODE_GRAIN, &reads, &writes, params)));
    }

    // fibre lines
    let line_stiffness = [&solids.line_stiffness[..], &threads.line_stiffness].concat();
    let mut covered = vec![false; nodes];
    let mut correction = None;
    if let Some(lines) = effects.fibre_lines.as_ref().filter(|_| active.fibre_lines) {
        for g in &line_groups {
            covered[g.first as usize..][..(g.lines * g.stations) as usize].fill(true);
        }
        let response = b.scratch("line correction", 3 * nodes);
        correction = Some(response);
        let table = b.indices("fibre lines", bytemuck::cast_slice(&line_groups).to_vec());
        let stiffness = b.table("line stiffness", line_stiffness.clone());
        let reads = [table, stiffness, reference, quanta_, remainder, acceleration, inverse_mass];
        let params = fibre_lines::Params { beta: lines.beta as f32 };
        let writes = [(response, Access::Scatter)];
        let longest = line_groups.iter().map(|g| g.stations as usize).max().unwrap_or(1);
        let kernel = flagged!(FibreLines; periodic);
        let stage = coded(kernel, "fibre lines", line_groups.len(), 1, &reads, &writes, params);
        b.plan.step.push(waiting(Stage { constants: vec![("STATIONS", longest)], ..stage }));
        if let Some((at, count)) = condition_nodes {
            b.plan.step.push(after::<prescribed::Hold>("hold", count, NODE_GRAIN, &[at], &writes, [0u32; 0]));
        }
    }

    // motion
    let params = integrate::Params { first_thread, gravity };
    let mut reads = vec![acceleration];
    reads.extend(work.map(|_| mass));
    reads.extend(added_mass.map(|_| inverse_mass));
    reads.extend(correction);
    reads.extend(weighed);
    let mut writes = vec![(velocity, own(3, 1)), (quanta_, own(3, 1)), (remainder, own(3, 1))];
    writes.extend(work.map(|work| (work, own(works.count(), 1))));
    let kernel = flagged!(Integrate; active.fibre_lines, active.gravity, active.damping, active.contact_mass);
    b.plan.step.push(waiting(coded(kernel, "integrate", nodes, NODE_GRAIN, &reads, &writes, params)));

    // limit of the time step
    if !active.fibre_lines {
        // in the bounds of hexahedra
        covered[..first].fill(true);
    }
    let lines_on_threads = active.fibre_lines && effects.fibre_lines.as_ref().is_some_and(|lines| lines.threads);
    if !lines_on_threads {
        // in the rows of beams
        covered[first..].fill(true);
    }
    let constant = constant_stiffness(mesh, &line_stiffness, &covered);
    let constant = b.table("constant stiffness of nodes", constant);
    let solid_bounds = b.indices("corner bounds of solid nodes", solids.bounds.clone());
    let mut rows = vec![solid_bounds, hex.bound, constant, thread_slots, beam_force, beam_table];
    if let Some(bent) = &bent {
        let of_bends = b.table("bend rows", threads.bend_rows.clone());
        rows.extend([bent.slots, bent.table, bent.energy, bent.force, of_bends]);
    }
    let reads: Vec<Buffer> = rows.iter().copied().chain([mass]).chain(added_mass).collect();
    let params = time_step::Params {
        first_thread,
        mass_per_stiffness: assemble_params.mass_per_stiffness,
        axial: f32::from(u8::from(!lines_on_threads)),
    };
    let writes = [(element_limit, own(2, 1))];
    let kernel = flagged!(ElementLimit; active.bending, active.contact_mass);
    b.plan.diagnose.push(waiting(coded(kernel, "element limit", nodes, NODE_GRAIN, &reads, &writes, params)));
    if let Some((at, count)) = condition_nodes {
        let writes = [(element_limit, Access::Scatter)];
        let held = after::<time_step::HeldLimit>("held limit", count, NODE_GRAIN, &[at], &writes, [0u32; 0]);
        b.plan.diagnose.push(held);
    }
    b.plan.diagnose.extend(hex.weighed_bounds);
    let weighed_limit = b.scratch("weighed limit of nodes", nodes);
    let reads: Vec<Buffer> =
        rows.into_iter().chain([element_limit, ends]).chain(bent.as_ref().map(|bent| bent.pairs)).collect();
    let writes = [(weighed_limit, own(1, 1))];
    let kernel = flagged!(WeighedLimit; active.bending);
    b.plan.diagnose.push(waiting(coded(kernel, "weighed limit", nodes, NODE_GRAIN, &reads, &writes, params)));

    let (faces, pairs) = contact.as_ref().map_or(([None; 2], None), |c| (c.faces, c.pairs));
    let sources = totals::Sources {
        mesh,
        masses: &floored,
        hex_place: &solids.place,
        hex_blocks: hexes,
        bends,
        points: contact.as_ref().map_or([0; 2], |c| [0, 1].map(|kind| c.points[kind].len())),
        active,
        conditions: condition_nodes.map_or(0, |(_, count)| count),
        mass,
        velocity,
        reference,
        work,
        weighed_limit,
        beam_table,
        hex_energy: hex.energy,
        hex_hourglass: hex.hourglass,
        hex_virial: hex.virial,
        beam_tension,
        beam_work,
        beam_virial,
        bend_energy: bent.as_ref().map(|bent| bent.energy),
        bend_virial,
        face_sums: faces.map(|kind| kind.map(|f| f.sums)),
        pair_sums: pairs.map(|p| p.sums),
        ties: contact.as_ref().and_then(|c| c.ties),
        reaction_work,
        added_mass,
    };
    let (totals, slip) = totals::add(&mut b, &sources);
    let sees_motion = |stage: &&Stage| {
        let taken = |buffer| Some(buffer) == work || Some(buffer) == reaction_work;
        stage.reads.contains(&velocity) || stage.writes.iter().any(|(buffer, _)| taken(*buffer))
    };
    let collect_motion = b.plan.collect.iter().filter(sees_motion).cloned().collect();
    let mut hex_at = vec![0; hexes * LANES];
    for (hex, (block, lane)) in solids.place.iter().enumerate() {
        hex_at[block * LANES + lane] = hex;
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
            added_mass,
            status: status_,
            before,
            hex_energy: hex.energy,
            beam_tension,
            bend_energy: bent.as_ref().map(|bent| bent.energy),
            contact_force: contact.as_ref().map(|c| c.force),
            contact_stiffness: contact.as_ref().map(|c| c.stiffness),
            faces,
            found: [faces[0].map(|f| f.found), faces[1].map(|f| f.found), pairs.map(|p| p.found)],
            pair_sums: pairs.map(|p| p.sums),
            pair_keys: pairs.map(|p| p.keys),
            pair_state: pairs.map(|p| p.state),
            prescribed: condition_nodes.map(|(at, _)| at),
            reaction,
            slip,
        },
        totals,
        active,
        plan: b.plan,
        forces,
        collect_motion,
        whole_mass: [0..first, first..nodes].map(|range| {
            let [mass, truly] = [&floored, &true_mass].map(|mass| mass[range.clone()].iter().sum::<f64>());
            [truly, mass - truly]
        }),
        true_mass,
        mass: floored,
        first_thread: first,
        hex_at,
        hex_place: solids.place,
        hex_volume: solids.volume,
        points: contact.map_or_else(Default::default, |c| c.points),
        touch: penalty::touch(active.friction),
        slot_state: slot_state(active.friction),
        limits: Limits { thread_radius: radius, yarn_thickness: thickness },
        acts_after: conditions.after,
    })
}

/// Buffers of bends.
struct Bent {
    pairs: Buffer,
    table: Buffer,
    /// Bends at each thread node.
    slots: Buffer,
    force: Buffer,
    energy: Buffer,
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
        for start in (0..lines).step_by(LANES) {
            let count = (lines - start).min(LANES);
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
                        && last.lines < LANES as u32
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
