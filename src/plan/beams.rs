//! The buffers and stages of threads: beams, and bending between beams.

use super::Tables;
use super::builder::Builder;
use super::nodes::Nodes;
use crate::elements::beam2::Beam2;
use crate::elements::bend::Bend;
use crate::kernel::buffer::Buffer;
use crate::kernel::stage::{Code, Stage, flagged, wires};

/// Items per chunk.
const GRAIN: usize = 64;

/// Buffers of beams. An optional buffer exists only in a scene that has threads and a stage that writes it.
pub(super) struct Beams {
    pub count: usize,
    pub ends: Buffer,
    pub table: Buffer,
    pub force: Buffer,
    pub tension: Option<Buffer>,
    pub virial: Option<Buffer>,
    /// Thermal work.
    pub work: Option<Buffer>,
}

impl Beams {
    pub fn add(b: &mut Builder, t: &Tables, nodes: &Nodes) -> Self {
        let count = t.threads.beams();
        let ends = b.indices("beam ends", t.threads.ends.clone());
        let table = b.table("beams", t.threads.beams.clone());
        let force = b.scratch("beam forces", 3 * count);
        let tension = (count > 0).then(|| b.scratch("beam tension", count));
        let virial = (count > 0 && t.active.periodic).then(|| b.scratch("beam stress sums", 9 * count));
        let strain = t.active.thermal.then(|| b.table("thermal strain of beams", t.threads.thermal.clone()));
        let work = t.active.thermal.then(|| b.scratch("thermal work of beams", count));
        if tension.is_some() {
            let &Nodes { quanta, remainder, .. } = nodes;
            let wires = wires![
                ends,
                beams: table,
                quanta,
                remainder,
                thermal_strain: strain,
                forces: force,
                tensions: tension,
                virial,
                work,
            ];
            let kernel = flagged!(Beam2; t.active.periodic, t.active.thermal);
            b.plan.step.push(Stage::new("beam2", kernel, (count, GRAIN), &wires, [0u32; 0]).beside());
        }
        Self { count, ends, table, force, tension, virial, work }
    }
}

/// Buffers of bends.
pub(super) struct Bends {
    pub count: usize,
    pub table: Buffer,
    /// Bends at each thread node.
    pub slots: Buffer,
    pub pairs: Buffer,
    pub force: Buffer,
    pub energy: Buffer,
    pub virial: Option<Buffer>,
}

impl Bends {
    /// Adds bends, in a scene with bending.
    pub fn add(b: &mut Builder, t: &Tables, nodes: &Nodes, beams: &Beams) -> Option<Self> {
        if !t.active.bending {
            return None;
        }
        let count = t.threads.pairs.len() / 2;
        let table = b.table("bends", t.threads.bends.clone());
        let slots = b.indices("bend slots of thread nodes", t.threads.bend_slots.clone());
        let pairs = b.indices("bend beams", t.threads.pairs.clone());
        let force = b.scratch("bend forces", 6 * count);
        let energy = b.scratch("bend energies", count);
        let virial = t.active.periodic.then(|| b.scratch("bend stress sums", 9 * count));
        let &Nodes { quanta, remainder, .. } = nodes;
        let wires = wires![
            pairs,
            bends: table,
            ends: beams.ends,
            beams: beams.table,
            quanta,
            remainder,
            forces: force,
            energies: energy,
            virial,
        ];
        let kernel = flagged!(Bend; t.active.periodic);
        b.plan.step.push(Stage::new("bend", kernel, (count, GRAIN), &wires, [0u32; 0]).beside());
        Some(Self { count, table, slots, pairs, force, energy, virial })
    }
}
