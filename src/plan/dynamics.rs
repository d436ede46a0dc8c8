//! From forces to motion: assembly, prescribed motion, fibre lines, integration by central differences.

use super::Tables;
use super::beams::{Beams, Bends};
use super::builder::{Builder, NODE_GRAIN};
use super::contact::ContactParts;
use super::hexes::Hexes;
use super::lines::Units;
use super::nodes::Nodes;
use crate::conditions::prescribed::{self, Prescribed};
use crate::dynamics::assemble::{self, Assemble};
use crate::dynamics::fibre_lines::{self, FibreLines};
use crate::dynamics::integrate::{self, Integrate};
use crate::kernel::buffer::{Buffer, Initial, Kind};
use crate::kernel::stage::{Code, Stage, flagged, wires};

/// Results of assembly for later stages.
pub(super) struct Assembled {
    /// Slots of thread nodes.
    pub thread_slots: Buffer,
    /// Mass added by contact-aware mass scaling, tonne.
    pub added_mass: Option<Buffer>,
    /// Minimum nodal mass per element stiffness, s².
    pub mass_per_stiffness: f32,
}

/// Adds the stages from assembly to accelerations.
pub(super) fn assemble(
    b: &mut Builder,
    t: &Tables,
    nodes: &Nodes,
    (hexes, beams, bends): (&Hexes, &Beams, Option<&Bends>),
    contact: Option<&ContactParts>,
    units: &Units,
) -> Assembled {
    let solid_slots = b.indices("corner slots of solid nodes", t.solids.slots.clone());
    let thread_slots = b.indices("slots of thread nodes", t.threads.slots.clone());
    let contact_mass = t.scene.effects.contact_mass.as_ref().filter(|_| t.active.contact_mass);
    let added_mass = contact_mass.map(|_| b.add("added mass", Kind::Scalar, nodes.count, true, Initial::Zero));
    let params = assemble::Params {
        first_thread: nodes.first_thread as u32,
        gravity: t.gravity(),
        force_quantum: contact.map_or(1.0, |c| c.params.force_quantum),
        stiffness_quantum: contact.map_or(1.0, |c| c.params.stiffness_quantum),
        mass_factor: contact_mass.map_or(0.0, |c| c.factor as f32),
        mass_memory: contact_mass.map_or(0.0, |c| c.memory as f32),
        mass_per_stiffness: contact_mass.map_or(0.0, |c| (0.25 * c.least_limit_s * c.least_limit_s) as f32),
    };
    let &Nodes { mass, true_mass, acceleration, inverse_mass, status, .. } = nodes;
    let wires = wires![
        solid_slots,
        hex_force: hexes.force,
        thread_slots,
        beam_force: beams.force,
        mass,
        bend_slots: bends.map(|bends| bends.slots),
        bend_force: bends.map(|bends| bends.force),
        element_stiffness: hexes.limit,
        true_mass,
        acceleration,
        inverse_mass,
        contact_force: contact.map(|c| c.force),
        contact_stiffness: contact.map(|c| c.stiffness),
        added_mass,
        status,
    ];
    let active = t.active;
    let kernel = flagged!(Assemble; contact.is_some(), active.contact_mass, active.bending, active.gravity);
    let stage = Stage::new("assemble", kernel, (nodes.count, NODE_GRAIN), &wires, params);
    b.plan.step.push(stage.in_units(&units.nodes, true));
    Assembled { thread_slots, added_mass, mass_per_stiffness: params.mass_per_stiffness }
}

/// Buffers of prescribed nodes.
pub(super) struct Held {
    pub count: usize,
    pub nodes: Buffer,
    pub reaction: Buffer,
    /// Work of reactions.
    pub work: Buffer,
    /// Mask of the prescribed components of each node, if some nodes on fibre lines are prescribed along some axes only.
    pub partly: Option<Buffer>,
}

impl Held {
    /// Adds prescribed motion if the scene has any.
    pub fn add(b: &mut Builder, t: &Tables, nodes: &Nodes, units: &Units) -> Option<Self> {
        let count = t.conditions.count();
        if count == 0 {
            return None;
        }
        let at = b.indices("prescribed nodes", t.conditions.nodes.clone());
        let targets = b.table("prescribed displacements", t.conditions.targets.clone());
        let arcs = (!t.conditions.arcs.is_empty()).then(|| b.table("prescribed arcs", t.conditions.arcs.clone()));
        let (reaction, work) = (b.scratch("reactions", 3 * count), b.scratch("work of reactions", count));
        let &Nodes { velocity, mass, acceleration, inverse_mass, .. } = nodes;
        let wires =
            wires![nodes: at, targets, arcs, velocity, mass, acceleration, inverse_mass, work, reactions: reaction];
        let params = prescribed::Params { first_thread: nodes.first_thread as u32 };
        let kernel = flagged!(Prescribed; t.active.damping, arcs.is_some());
        let stage = Stage::new("prescribed", kernel, (count, NODE_GRAIN), &wires, params);
        b.plan.step.push(stage.in_units(&units.conditions, false));
        let partly = (t.active.fibre_lines && t.conditions.is_partial())
            .then(|| b.indices("prescribed components", t.conditions.masks(nodes.count)));
        Some(Self { count, nodes: at, reaction, work, partly })
    }
}

/// Adds fibre lines if the scene has any; returns their correction of the accelerations.
pub(super) fn fibre_lines(
    b: &mut Builder,
    t: &Tables,
    nodes: &Nodes,
    held: Option<&Held>,
    units: &Units,
) -> Option<Buffer> {
    let chosen = t.fibre_lines()?;
    let correction = b.scratch("line correction", 3 * nodes.count);
    let lines = b.indices("fibre lines", bytemuck::cast_slice(&t.lines).to_vec());
    let stiffness = b.table("line stiffness", t.line_stiffness());
    let &Nodes { reference, quanta, remainder, acceleration, inverse_mass, .. } = nodes;
    let held = held.and_then(|held| held.partly);
    let wires = wires![lines, stiffness, reference, quanta, remainder, acceleration, inverse_mass, held, correction];
    let params = fibre_lines::Params { beta: chosen.beta as f32 };
    let longest = t.lines.iter().filter(|line| line.has_fibres()).map(|line| line.nodes().len()).max().unwrap_or(1);
    let kernel = flagged!(FibreLines; t.active.periodic, held.is_some());
    let stage = Stage::new("fibre lines", kernel, (t.lines.len(), 1), &wires, params).in_units(&units.lines, false);
    b.plan.step.push(Stage { constants: vec![("STATIONS", longest)], ..stage });
    Some(correction)
}

/// Adds integration.
pub(super) fn integrate(
    b: &mut Builder,
    t: &Tables,
    nodes: &Nodes,
    added_mass: Option<Buffer>,
    correction: Option<Buffer>,
    units: &Units,
) {
    let params = integrate::Params { first_thread: nodes.first_thread as u32, gravity: t.gravity() };
    let &Nodes { acceleration, mass, true_mass, velocity, quanta, remainder, work, status, .. } = nodes;
    let inverse_mass = added_mass.map(|_| nodes.inverse_mass);
    let wires =
        wires![acceleration, mass, inverse_mass, correction, true_mass, velocity, quanta, remainder, work, status];
    let active = t.active;
    let kernel = flagged!(Integrate; active.fibre_lines, active.gravity, active.damping, active.contact_mass);
    let stage = Stage::new("integrate", kernel, (nodes.count, NODE_GRAIN), &wires, params);
    b.plan.step.push(stage.in_units(&units.nodes, false));
}
