//! The buffers and stages of hexahedra, of the element and of the laws that the scene has.

use super::solids::Solids;
use super::{Builder, beside, own, waiting};
use crate::elements::block::{BOUND, ENERGY, Params, SLOTS, VIRIAL};
use crate::elements::{hex8, hex8_reduced};
use crate::kernel::buffer::Buffer;
use crate::kernel::stage::{Access, Kernel, Stage};
use crate::materials::charmetant::Charmetant;
use crate::materials::neo_hookean::NeoHookean;
use crate::materials::{Law, Material};
use std::ops::Range;

/// What hexahedra write.
pub(super) struct HexBuffers {
    pub force: Buffer,
    pub bound: Buffer,
    pub energy: Option<Buffer>,
    /// Energy of hourglass modes, of reduced integration.
    pub hourglass: Option<Buffer>,
    /// Stress sums of periodic scenes.
    pub virial: Option<Buffer>,
    /// Bounds again, weighed.
    pub weighed_bounds: Vec<Stage>,
}

/// Blocks of one law, and what their stages read.
struct Blocks<'a> {
    range: Range<usize>,
    reads: &'a [Buffer],
    limits: Buffer,
    params: Params,
}

impl HexBuffers {
    /// Adds tables, results and stages, but for those of weighed bounds; `position` are quanta and remainder of
    /// displacements, `limits` the row sums and R/m of nodes.
    pub(super) fn add(
        b: &mut Builder,
        solids: &Solids,
        position: [Buffer; 2],
        limits: Buffer,
        periodic: bool,
        reduced: bool,
        params: Params,
    ) -> Self {
        let hexes = solids.headers.len();
        let materials = b.table("materials", solids.materials.clone());
        let frames = b.table("fibre frames", solids.frames.clone());
        let shapes = b.table("shapes", solids.shapes.clone());
        let headers = b.indices("hex blocks", bytemuck::cast_slice(&solids.headers).to_vec());
        let corners = b.indices("hex corners", solids.corners.clone());
        let mut buffers = Self {
            force: b.scratch("hex corner forces", SLOTS * hexes),
            bound: b.scratch("hex stiffness bounds", BOUND * hexes),
            energy: (hexes > 0).then(|| b.scratch("hex energies", ENERGY * hexes)),
            hourglass: (hexes > 0 && reduced).then(|| b.scratch("hourglass energies", hex8_reduced::HOURGLASS * hexes)),
            virial: (hexes > 0 && periodic).then(|| b.scratch("hex stress sums", VIRIAL * hexes)),
            weighed_bounds: Vec::new(),
        };
        let [quanta, remainder] = position;
        let reads = &[headers, corners, quanta, remainder, shapes, frames, materials];
        for (law, range) in &solids.laws {
            let blocks = Blocks { range: range.clone(), reads, limits, params };
            match law {
                Law::Charmetant => buffers.law::<Charmetant>(b, &blocks),
                Law::NeoHookean => buffers.law::<NeoHookean>(b, &blocks),
            }
        }
        buffers
    }

    fn law<M: Material>(&mut self, b: &mut Builder, blocks: &Blocks) {
        match self.virial {
            Some(_) => self.stages::<M, true>(b, blocks),
            None => self.stages::<M, false>(b, blocks),
        }
    }

    fn stages<M: Material, const PERIODIC: bool>(&mut self, b: &mut Builder, blocks: &Blocks) {
        let force = (self.force, own(1, SLOTS));
        let forces: Vec<_> = [force].into_iter().chain(self.virial.map(|v| (v, own(1, VIRIAL)))).collect();
        let energies: Vec<_> = self.energy.map(|e| (e, own(1, ENERGY))).into_iter().collect();
        let bounds = [(self.bound, own(1, BOUND))];
        let reads = [blocks.reads, &[blocks.limits]].concat();
        let weighed = Blocks { range: blocks.range.clone(), reads: &reads, ..*blocks };
        let [step, energy, bound, weighed] = match self.hourglass {
            Some(hourglass) => {
                let energies = [&energies[..], &[(hourglass, own(1, hex8_reduced::HOURGLASS))]].concat();
                [
                    blocks.stage::<hex8_reduced::Force<M, PERIODIC>>("hex8 reduced", &forces),
                    blocks.stage::<hex8_reduced::Energy<M, PERIODIC>>("hex8 reduced energy", &energies),
                    blocks.stage::<hex8_reduced::Bound<M, PERIODIC, false>>("hex8 reduced bound", &bounds),
                    weighed.stage::<hex8_reduced::Bound<M, PERIODIC, true>>("hex8 reduced weighed bound", &bounds),
                ]
            }
            None => [
                blocks.stage::<hex8::Force<M, PERIODIC>>("hex8", &forces),
                blocks.stage::<hex8::Energy<M, PERIODIC>>("hex8 energy", &energies),
                blocks.stage::<hex8::Bound<M, PERIODIC, false>>("hex8 bound", &bounds),
                weighed.stage::<hex8::Bound<M, PERIODIC, true>>("hex8 weighed bound", &bounds),
            ],
        };
        b.plan.step.push(step);
        b.plan.diagnose.extend([energy, bound]);
        self.weighed_bounds.push(waiting(weighed));
    }
}

impl Blocks<'_> {
    fn stage<K: Kernel>(&self, name: &'static str, writes: &[(Buffer, Access)]) -> Stage {
        /// Blocks in a chunk.
        const GRAIN: usize = 4;
        let stage = beside::<K>(name, self.range.len(), GRAIN, self.reads, writes, self.params);
        Stage { first: self.range.start, ..stage }
    }
}
