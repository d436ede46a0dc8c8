//! The buffers and stages of hexahedra, for the element type and the material laws of the scene.

use super::Tables;
use super::builder::Builder;
use super::nodes::Nodes;
use crate::dynamics::time_step;
use crate::elements::block::{BOUND, ENERGY, Params, SLOTS, VIRIAL};
use crate::elements::{hex8, hex8_reduced};
use crate::kernel::buffer::Buffer;
use crate::kernel::stage::{Code, Kernel, Stage, Wire, wires};
use crate::materials::charmetant::Charmetant;
use crate::materials::neo_hookean::NeoHookean;
use crate::materials::{Law, Material};
use std::ops::Range;

/// Buffers of hexahedra. An optional buffer exists only in a scene that has solids and a stage that writes it.
pub(super) struct Hexes {
    pub force: Buffer,
    pub bound: Buffer,
    pub energy: Option<Buffer>,
    /// Hourglass energy, for reduced integration.
    pub hourglass: Option<Buffer>,
    /// Virial stress sums of periodic scenes.
    pub virial: Option<Buffer>,
    /// Row sums of the element stiffness at nodes, and R/m, the weights of the bounds.
    pub limit: Buffer,
    /// Stages that weigh the bounds.
    pub weighed_bounds: Vec<Stage>,
}

/// Bindings and parameters common to the stages of all laws.
struct Common {
    wires: Vec<(&'static str, Wire)>,
    params: Params,
}

impl Hexes {
    /// Adds tables, results and stages, except the stages of the weighed bounds.
    pub fn add(b: &mut Builder, t: &Tables, nodes: &Nodes) -> Self {
        let limit = b.scratch("element stiffness of nodes", 2 * nodes.count);
        let hexes = t.solids.headers.len();
        let materials = b.table("materials", t.solids.materials.clone());
        let frames = b.table("fibre frames", t.solids.frames.clone());
        let shapes = b.table("shapes", t.solids.shapes.clone());
        let headers = b.indices("hex blocks", bytemuck::cast_slice(&t.solids.headers).to_vec());
        let corners = b.indices("hex corners", t.solids.corners.clone());
        let reduced = t.scene.integration.hourglass_control().is_some();
        let mut all = Self {
            force: b.scratch("hex corner forces", SLOTS * hexes),
            bound: b.scratch("hex stiffness bounds", BOUND * hexes),
            energy: (hexes > 0).then(|| b.scratch("hex energies", ENERGY * hexes)),
            hourglass: (hexes > 0 && reduced).then(|| b.scratch("hourglass energies", hex8_reduced::HOURGLASS * hexes)),
            virial: (hexes > 0 && t.active.periodic).then(|| b.scratch("hex stress sums", VIRIAL * hexes)),
            limit,
            weighed_bounds: Vec::new(),
        };
        let left = match t.fibre_lines() {
            Some(lines) => time_step::left(lines.beta) as f32,
            None => 0.0,
        };
        let &Nodes { quanta, remainder, .. } = nodes;
        let common = Common {
            wires: wires![headers, corners, quanta, remainder, shapes, frames, materials].to_vec(),
            params: Params { nodes: nodes.count as u32, left },
        };
        for (law, blocks) in &t.solids.laws {
            match (law, t.active.periodic) {
                (Law::Charmetant, true) => all.stages::<Charmetant, true>(b, &common, blocks),
                (Law::Charmetant, false) => all.stages::<Charmetant, false>(b, &common, blocks),
                (Law::NeoHookean, true) => all.stages::<NeoHookean, true>(b, &common, blocks),
                (Law::NeoHookean, false) => all.stages::<NeoHookean, false>(b, &common, blocks),
            }
        }
        all
    }

    /// Adds the stages for the blocks of one law.
    fn stages<M: Material, const PERIODIC: bool>(&mut self, b: &mut Builder, common: &Common, blocks: &Range<usize>) {
        let forces = wires![out: self.force, out_virial: self.virial];
        let energies = wires![out: self.energy, out_hourglass: self.hourglass];
        let bounds = wires![weights: self.limit, out: self.bound];
        let [step, energy, bound, weighed] = if self.hourglass.is_some() {
            [
                common.stage::<hex8_reduced::Force<M, PERIODIC>>("hex8 reduced", blocks, &forces),
                common.stage::<hex8_reduced::Energy<M, PERIODIC>>("hex8 reduced energy", blocks, &energies),
                common.stage::<hex8_reduced::Bound<M, PERIODIC, false>>("hex8 reduced bound", blocks, &bounds),
                common.stage::<hex8_reduced::Bound<M, PERIODIC, true>>("hex8 reduced weighed bound", blocks, &bounds),
            ]
        } else {
            [
                common.stage::<hex8::Force<M, PERIODIC>>("hex8", blocks, &forces),
                common.stage::<hex8::Energy<M, PERIODIC>>("hex8 energy", blocks, &energies),
                common.stage::<hex8::Bound<M, PERIODIC, false>>("hex8 bound", blocks, &bounds),
                common.stage::<hex8::Bound<M, PERIODIC, true>>("hex8 weighed bound", blocks, &bounds),
            ]
        };
        b.plan.step.push(step.beside());
        b.plan.diagnose.extend([energy.beside(), bound.beside()]);
        self.weighed_bounds.push(weighed);
    }
}

impl Common {
    fn stage<K: Kernel>(&self, name: &'static str, blocks: &Range<usize>, wires: &[(&'static str, Wire)]) -> Stage {
        /// Blocks per chunk.
        const GRAIN: usize = 4;
        let wires = [&self.wires[..], wires].concat();
        let stage = Stage::new(name, Code::of::<K>(), (blocks.len(), GRAIN), &wires, self.params);
        Stage { first: blocks.start, ..stage }
    }
}
