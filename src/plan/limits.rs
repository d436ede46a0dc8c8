//! The limit of the time step: row sums of the stiffness matrix at nodes, and their weighed means.

use super::Tables;
use super::beams::{Beams, Bends};
use super::builder::{Builder, NODE_GRAIN};
use super::dynamics::{Assembled, Held};
use super::hexes::Hexes;
use super::nodes::Nodes;
use crate::dynamics::time_step::{ElementLimit, HeldLimit, Params, WeighedLimit};
use crate::kernel::buffer::Buffer;
use crate::kernel::stage::{Code, Stage, flagged, wires};
use crate::mesh::Mesh;

/// Adds the stages of the limit; returns the buffer of the weighed limit of each node.
pub(super) fn add(
    b: &mut Builder,
    t: &Tables,
    nodes: &Nodes,
    (hexes, beams, bends): (&mut Hexes, &Beams, Option<&Bends>),
    assembled: &Assembled,
    held: Option<&Held>,
) -> Buffer {
    let constant = constant_stiffness(&t.mesh, &t.line_stiffness(), &covered(t, nodes));
    let constant = b.table("constant stiffness of nodes", constant);
    let solid_bounds = b.indices("corner bounds of solid nodes", t.solids.bounds.clone());
    let bend_rows = bends.map(|_| b.table("bend rows", t.threads.bend_rows.clone()));
    let rows = wires![
        solid_bounds,
        hex_bound: hexes.bound,
        constant,
        thread_slots: assembled.thread_slots,
        beam_force: beams.force,
        beams: beams.table,
        bend_slots: bends.map(|bends| bends.slots),
        bends: bends.map(|bends| bends.table),
        bend_energy: bends.map(|bends| bends.energy),
        bend_force: bends.map(|bends| bends.force),
        bend_rows,
        limit: hexes.limit,
    ];
    let params = Params {
        first_thread: nodes.first_thread as u32,
        mass_per_stiffness: assembled.mass_per_stiffness,
        axial: f32::from(u8::from(!t.lines_on_threads())),
    };
    let work = (nodes.count, NODE_GRAIN);
    let wires = [&rows[..], &wires![mass: nodes.mass, added_mass: assembled.added_mass]].concat();
    let kernel = flagged!(ElementLimit; t.active.bending, t.active.contact_mass);
    b.plan.diagnose.push(Stage::new("element limit", kernel, work, &wires, params));
    if let Some(held) = held {
        let wires = wires![conditions: held.nodes, limit: hexes.limit];
        let kernel = Code::of::<HeldLimit>();
        b.plan.diagnose.push(Stage::new("held limit", kernel, (held.count, NODE_GRAIN), &wires, [0u32; 0]));
    }
    b.plan.diagnose.append(&mut hexes.weighed_bounds);
    let weighed = b.scratch("weighed limit of nodes", nodes.count);
    let pairs = bends.map(|bends| bends.pairs);
    let wires = [&rows[..], &wires![ends: beams.ends, pairs, out: weighed]].concat();
    let kernel = flagged!(WeighedLimit; t.active.bending);
    b.plan.diagnose.push(Stage::new("weighed limit", kernel, work, &wires, params));
    weighed
}

/// Nodes whose axial stiffness is already counted by fibre lines, hexahedra or beams.
fn covered(t: &Tables, nodes: &Nodes) -> Vec<bool> {
    let mut covered = vec![false; nodes.count];
    if t.active.fibre_lines {
        for line in t.lines.iter().filter(|line| line.has_fibres()) {
            covered[line.nodes()].fill(true);
        }
    } else {
        // in the bounds of hexahedra
        covered[..nodes.first_thread].fill(true);
    }
    if !t.lines_on_threads() {
        // in the rows of beams
        covered[nodes.first_thread..].fill(true);
    }
    covered
}

/// Row sums of the axial stiffness that is not counted elsewhere.
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
