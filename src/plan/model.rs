//! The host's view of a plan: the buffers that it reads, and the places of scene entities in them.

use super::contact::FaceBuffers;
use super::totals::Totals;
use super::{Active, Parts, ToolBuffers};
use crate::contact::{memory, slot_state};
use crate::elements::LANES;
use crate::kernel::buffer::Buffer;
use crate::kernel::stage::{Plan, Stage};

/// A plan with everything the host needs to drive it and to interpret its results.
pub struct Model {
    pub plan: Plan,
    pub active: Active,
    /// Number of stages of a step up to accelerations; the remaining stages move nodes.
    pub forces: usize,
    /// The collect stages that depend on the motion of the step.
    pub collect_motion: Vec<Stage>,
    pub buffers: Buffers,
    pub totals: Totals,
    /// True mass of every node, and mass with the floor, tonne.
    pub true_mass: Vec<f64>,
    pub mass: Vec<f64>,
    /// True mass of all solids and of all threads, and the mass added to each by the floor, tonne.
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
    /// Numbers stored per touch of a point, and per slot of a beam.
    pub touch: usize,
    pub slot_state: usize,
    /// Lengths that guards compare penetrations with.
    pub limits: Limits,
    /// Number of load steps after which each prescribed node acts, in table order.
    pub acts_after: Vec<usize>,
}

/// A contact point.
#[derive(Debug, Clone, Copy)]
pub struct ContactPoint {
    /// Nodes that carry it, and its share in each.
    pub nodes: [usize; 2],
    pub shares: [f64; 2],
    /// mm² for a yarn surface, mm for a thread.
    pub measure: f64,
}

/// Sizes with which guards compare penetrations, mm.
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
    /// Acceleration and inverse mass of the last step, mm/s² and 1/tonne, and the correction by fibre lines.
    pub acceleration: Buffer,
    pub inverse_mass: Buffer,
    pub correction: Option<Buffer>,
    /// Mass added by contact-aware mass scaling, tonne.
    pub added_mass: Option<Buffer>,
    pub status: Buffer,
    /// Displacements at the last full search, in quanta.
    pub before: Option<Buffer>,
    pub hex_energy: Option<Buffer>,
    pub beam_tension: Option<Buffer>,
    pub bend_energy: Option<Buffer>,
    pub contact_force: Option<Buffer>,
    pub contact_stiffness: Option<Buffer>,
    /// Of threads and of yarns on yarns.
    pub faces: [Option<FaceBuffers>; 2],
    /// See [`crate::contact::found`]: for threads, yarns and beams.
    pub found: [Option<Buffer>; 3],
    pub pair_sums: Option<Buffer>,
    pub pair_keys: Option<Buffer>,
    pub pair_state: Option<Buffer>,
    pub prescribed: Option<Buffer>,
    /// Mask of the prescribed components of each node, if fibre lines need it.
    pub partly: Option<Buffer>,
    pub reaction: Option<Buffer>,
    pub tools: Option<ToolBuffers>,
    /// Slip of each contact point of threads and of yarns since the start, mm.
    pub slip: [Option<Buffer>; 2],
}

/// Sizes of the contact tables, which grow when they overflow: faces near a beam or node up to [`Self::MOST_FACES`], slots for
/// bodies up to [`Self::MOST_SLOTS`], slots of beams up to [`MOST_PAIRS`](crate::contact::threads::MOST_PAIRS).
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

impl Model {
    /// The model of a plan from its parts; `forces` is the number of stages up to accelerations.
    pub(super) fn new(plan: Plan, p: Parts, forces: usize, totals: Totals, slip: [Option<Buffer>; 2]) -> Self {
        let Parts { tables, nodes, .. } = &p;
        let sees_motion = |stage: &&Stage| {
            let works = [nodes.work, p.held.as_ref().map(|held| held.work), p.tools().map(|tools| tools.buffers.works)];
            let taken = |buffer| works.contains(&Some(buffer));
            let of_tools = |buffer: &Buffer| works[2] == Some(*buffer);
            stage.reads.iter().any(of_tools)
                || stage.reads.contains(&nodes.velocity)
                || stage.writes.iter().any(|(buffer, _)| taken(*buffer))
        };
        let collect_motion = plan.collect.iter().filter(sees_motion).cloned().collect();
        let mut hex_at = vec![0; tables.solids.headers.len() * LANES];
        for (hex, (block, lane)) in tables.solids.place.iter().enumerate() {
            hex_at[block * LANES + lane] = hex;
        }
        let limits = Limits {
            thread_radius: tables.threads.radius.iter().copied().fold(f64::INFINITY, f64::min),
            yarn_thickness: tables.thinnest(),
        };
        Self {
            plan,
            active: tables.active,
            forces,
            collect_motion,
            buffers: Buffers::new(&p, slip),
            totals,
            whole_mass: nodes.whole_mass(),
            first_thread: nodes.first_thread,
            hex_at,
            touch: memory::touch(tables.active.friction),
            slot_state: slot_state(tables.active.friction),
            limits,
            true_mass: p.nodes.true_masses,
            mass: p.nodes.masses,
            hex_place: p.tables.solids.place,
            hex_volume: p.tables.solids.volume,
            points: p.contact.map_or_else(Default::default, |contact| contact.points),
            acts_after: p.tables.conditions.after,
        }
    }
}

impl Buffers {
    fn new(p: &Parts, slip: [Option<Buffer>; 2]) -> Self {
        let Parts { nodes, contact, held, .. } = p;
        let (faces, pairs) = (p.faces(), p.pairs());
        Self {
            reference: nodes.reference,
            quanta: nodes.quanta,
            remainder: nodes.remainder,
            velocity: nodes.velocity,
            acceleration: nodes.acceleration,
            inverse_mass: nodes.inverse_mass,
            correction: p.correction,
            added_mass: p.assembled.added_mass,
            status: nodes.status,
            before: p.searched.as_ref().map(|searched| searched.everything),
            hex_energy: p.hexes.energy,
            beam_tension: p.beams.tension,
            bend_energy: p.bends.as_ref().map(|bends| bends.energy),
            contact_force: contact.as_ref().map(|c| c.force),
            contact_stiffness: contact.as_ref().map(|c| c.stiffness),
            faces,
            found: [faces[0].map(|f| f.found), faces[1].map(|f| f.found), pairs.map(|p| p.found)],
            pair_sums: pairs.map(|p| p.sums),
            pair_keys: pairs.map(|p| p.keys),
            pair_state: pairs.map(|p| p.state),
            prescribed: held.as_ref().map(|held| held.nodes),
            partly: held.as_ref().and_then(|held| held.partly),
            reaction: held.as_ref().map(|held| held.reaction),
            tools: p.tools().map(|tools| tools.buffers),
            slip,
        }
    }
}
