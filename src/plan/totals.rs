//! The stages that add up what kernels keep per item, and where the host finds the sums.

use super::{Active, Builder, beside, coded};
use crate::contact::{slip, sums};
use crate::dynamics::energy;
use crate::dynamics::integrate::Works;
use crate::dynamics::totals::{self, Params, Sum, WORST, Worst};
use crate::elements::LANES;
use crate::elements::block::{ENERGY, VIRIAL};
use crate::elements::hex8_reduced::HOURGLASS;
use crate::kernel::buffer::Buffer;
use crate::kernel::position::quanta;
use crate::kernel::stage::{Access, Code, Stage, flagged};
use crate::mesh::Mesh;
use std::ops::Range;

/// Where sums of columns are in the totals, part by part.
#[derive(Debug, Clone, Copy)]
pub struct Sums {
    into: usize,
    parts: usize,
    columns: usize,
}

impl Sums {
    /// The sum of a column.
    pub fn of(&self, totals: &[f64], column: usize) -> f64 {
        let parts = totals[self.into..][..self.parts * self.columns].chunks_exact(self.columns);
        parts.map(|part| part[column]).sum()
    }
}

/// Where the largest numbers of a column are in the totals, part by part.
#[derive(Debug, Clone, Copy)]
pub struct Largest {
    into: usize,
    parts: usize,
    length: usize,
}

impl Largest {
    /// The largest number and its place in the column; of equal ones the first.
    pub fn of(&self, totals: &[f64]) -> (f64, usize) {
        let parts = totals[self.into..][..WORST * self.parts].chunks_exact(WORST).enumerate();
        let found = parts.map(|(number, part)| (part[0], number * self.length + part[1] as usize));
        found.fold((f64::NEG_INFINITY, 0), |best, part| if part.0 > best.0 { part } else { best })
    }
}

/// What the host finds in the totals; `None` for what the scene does not have.
#[derive(Debug, Clone)]
pub struct Totals {
    pub buffer: Buffer,
    /// Work on nodes, one column a kind, and which kinds there are.
    pub work: Option<Sums>,
    pub works: Works,
    pub thermal: Option<Sums>,
    pub reaction: Option<Sums>,
    /// Of hexahedra, beams and bends: nine components each.
    pub stress: Vec<Sums>,
    /// Of points and pairs of beams: columns as in [`penalty`].
    pub contact: Vec<Sums>,
    /// Elastic energy of ties.
    pub ties: Option<Sums>,
    /// Strain energy of hexahedra by mode.
    pub modes: Option<Sums>,
    /// Energy of the hourglass modes of hexahedra.
    pub hourglass: Option<Sums>,
    pub axial: Option<Sums>,
    pub bending: Option<Sums>,
    pub kinetic: Sums,
    /// With the affine motion; `None` if there is none.
    pub kinetic_total: Option<Sums>,
    /// Mass added to solids and to threads.
    pub added: [Option<Sums>; 2],
    /// −det F by block and lane.
    pub jacobian: Option<Largest>,
    /// K/m of nodes.
    pub stiffness: Largest,
}

/// Buffers that are added up.
pub(super) struct Sources<'a> {
    pub mesh: &'a Mesh,
    /// Mass that acts, tonne.
    pub masses: &'a [f64],
    /// Block and lane of each hexahedron.
    pub hex_place: &'a [(usize, usize)],
    pub hex_blocks: usize,
    pub bends: usize,
    /// Contact points of threads and of yarns.
    pub points: [usize; 2],
    pub active: Active,
    pub conditions: usize,
    pub mass: Buffer,
    pub velocity: Buffer,
    pub reference: Buffer,
    pub work: Option<Buffer>,
    pub weighed_limit: Buffer,
    pub beam_table: Buffer,
    pub hex_energy: Option<Buffer>,
    pub hex_hourglass: Option<Buffer>,
    pub hex_virial: Option<Buffer>,
    pub beam_tension: Option<Buffer>,
    pub beam_work: Option<Buffer>,
    pub beam_virial: Option<Buffer>,
    pub bend_energy: Option<Buffer>,
    pub bend_virial: Option<Buffer>,
    pub face_sums: [Option<Buffer>; 2],
    pub pair_sums: Option<Buffer>,
    /// Energies of ties, and their number.
    pub ties: Option<(Buffer, usize)>,
    pub reaction_work: Option<Buffer>,
    pub added_mass: Option<Buffer>,
}

/// Items of a chunk: about as many numbers as a chunk of nodes has.
const GRAIN: usize = 4;

/// Columns of a buffer.
struct Columns {
    start: usize,
    count: usize,
    lanes: usize,
    stride: usize,
    columns: usize,
}

impl Columns {
    /// A range of plain numbers.
    fn range(range: Range<usize>) -> Self {
        Self { start: range.start, count: range.len(), lanes: range.len(), stride: range.len(), columns: 1 }
    }
    /// Planes behind each other.
    fn planes(count: usize, columns: usize) -> Self {
        Self { columns, ..Self::range(0..count) }
    }
    /// Rows of so many numbers.
    fn rows(count: usize, columns: usize) -> Self {
        Self { start: 0, count, lanes: 1, stride: columns, columns }
    }
    /// Lanes of blocks of hexahedra.
    fn blocks(blocks: usize, stride: usize, columns: usize) -> Self {
        Self { start: 0, count: blocks * LANES, lanes: LANES, stride, columns }
    }
}

/// Adds the stages of totals to a plan.
struct Collector<'a> {
    b: &'a mut Builder,
    totals: Buffer,
}

impl Collector<'_> {
    /// Room for the results of every part of a column.
    fn room(&mut self, count: usize, columns: usize) -> (Sums, usize) {
        let (length, parts) = totals::parts(count);
        let len = &mut self.b.plan.buffers[self.totals.0].len;
        let sums = Sums { into: *len, parts, columns };
        *len += parts * columns;
        (sums, length)
    }

    fn params(&self, columns: &Columns, sums: Sums, length: usize) -> Params {
        Params {
            start: columns.start as u32,
            count: columns.count as u32,
            lanes: columns.lanes as u32,
            stride: columns.stride as u32,
            columns: columns.columns as u32,
            length: length as u32,
            into: sums.into as u32,
        }
    }

    /// Sums of columns, whose numbers are then set to zero.
    fn taken(&mut self, buffer: Buffer, columns: Columns, waits: bool) -> Sums {
        let (sums, length) = self.room(columns.count, columns.columns);
        let params = self.params(&columns, sums, length);
        let writes = [(buffer, Access::Scatter), (self.totals, Access::Scatter)];
        let stage = beside::<Sum<true>>("totals taken", sums.parts * sums.columns, GRAIN, &[], &writes, params);
        self.b.plan.collect.push(Stage { waits, ..stage });
        sums
    }

    /// Sums of columns.
    fn kept(&mut self, buffer: Buffer, columns: Columns) -> Sums {
        let (sums, length) = self.room(columns.count, columns.columns);
        let params = self.params(&columns, sums, length);
        let writes = [(self.totals, Access::Scatter)];
        let stage = beside::<Sum<false>>("totals", sums.parts * sums.columns, GRAIN, &[buffer], &writes, params);
        self.b.plan.collect.push(stage);
        sums
    }

    /// The largest of a column; with the lanes in use of blocks, the largest of the negative.
    fn largest(&mut self, buffer: Buffer, columns: Columns, lanes_used: Option<Buffer>) -> Largest {
        let (sums, length) = self.room(columns.count, WORST);
        let params = self.params(&columns, sums, length);
        let writes = [(self.totals, Access::Scatter)];
        self.b.plan.collect.push(match lanes_used {
            Some(used) => beside::<Worst<true>>("worst", sums.parts, GRAIN, &[buffer, used], &writes, params),
            None => beside::<Worst<false>>("worst", sums.parts, GRAIN, &[buffer], &writes, params),
        });
        Largest { into: sums.into, parts: sums.parts, length }
    }

    /// ½ Σ m v² of nodes; `total` with the affine motion.
    fn kinetic(&mut self, s: &Sources, total: bool) -> Sums {
        let mass: f64 = s.masses.iter().sum();
        let centre = [0, 1, 2].map(|k| {
            let moment: f64 = s.mesh.nodes.iter().zip(s.masses).map(|(x, m)| m * x[k]).sum();
            quanta(moment / mass)
        });
        let (sums, length) = self.room(s.masses.len(), 1);
        let params = energy::Params {
            count: s.masses.len() as u32,
            length: length as u32,
            into: sums.into as u32,
            centre: if total { centre } else { [0; 3] },
        };
        let (reads, writes) = ([s.velocity, s.mass, s.reference], [(self.totals, Access::Scatter)]);
        self.b.plan.collect.push(if total {
            beside::<energy::Kinetic<true>>("total kinetic energy", sums.parts, GRAIN, &reads, &writes, params)
        } else {
            beside::<energy::Kinetic<false>>("kinetic energy", sums.parts, GRAIN, &reads[..2], &writes, params)
        });
        sums
    }

    /// ½ Σ N² L₀/EA of beams.
    fn axial(&mut self, tension: Buffer, s: &Sources) -> Sums {
        let count = s.mesh.beams();
        let (sums, length) = self.room(count, 1);
        let params =
            energy::Params { count: count as u32, length: length as u32, into: sums.into as u32, centre: [0; 3] };
        let (reads, writes) = ([tension, s.beam_table], [(self.totals, Access::Scatter)]);
        self.b.plan.collect.push(beside::<energy::Axial>("axial energy", sums.parts, GRAIN, &reads, &writes, params));
        sums
    }
}

/// Adds the stages of totals; returns where they are, and the slip of contact points.
pub(super) fn add(b: &mut Builder, s: &Sources) -> (Totals, [Option<Buffer>; 2]) {
    let (nodes, beams, first) = (s.mesh.nodes.len(), s.mesh.beams(), s.mesh.first_thread_node());
    let buffer = b.scratch("totals", 0);
    let Active { friction, periodic, .. } = s.active;
    let mut slip = [None; 2];
    for (kind, name) in [(0, "slip of thread points"), (1, "slip of yarn points")] {
        slip[kind] = s.face_sums[kind].filter(|_| friction).map(|sums| {
            let slip = b.scratch(name, s.points[kind]);
            let own = Access::Own { planes: 1, stride: 1 };
            let kernel = flagged!(slip::Slip; periodic);
            b.plan.collect.push(coded(kernel, "slip", s.points[kind], 512, &[sums], &[(slip, own)], [0u32; 0]));
            slip
        });
    }
    let jacobian = s.hex_energy.map(|energy| {
        let mut used = vec![0; s.hex_blocks];
        s.hex_place.iter().for_each(|(block, _)| used[*block] += 1);
        (energy, b.indices("lanes in use", used))
    });
    let c = &mut Collector { b, totals: buffer };
    let mut contact = Vec::new();
    for (sums, points) in s.face_sums.into_iter().zip(s.points) {
        let Some(sums) = sums else { continue };
        contact.push(c.taken(sums, Columns::rows(points, sums::sums(friction, periodic)), true));
    }
    if let Some(sums) = s.pair_sums {
        contact.push(c.taken(sums, Columns::rows(beams, sums::sums(friction, periodic)), false));
    }
    let mut stress = Vec::new();
    if let Some(virial) = s.hex_virial {
        stress.push(c.taken(virial, Columns::blocks(s.hex_blocks, VIRIAL, 9), false));
    }
    for (virial, count) in [(s.beam_virial, beams), (s.bend_virial, s.bends)] {
        stress.extend(virial.map(|virial| c.taken(virial, Columns::rows(count, 9), false)));
    }
    let part = |c: &mut Collector, range: Range<usize>| {
        s.added_mass.filter(|_| !range.is_empty()).map(|added| c.kept(added, Columns::range(range)))
    };
    let totals = Totals {
        buffer,
        work: s.work.map(|work| c.taken(work, Columns::planes(nodes, s.active.works().count()), false)),
        works: s.active.works(),
        thermal: s.beam_work.map(|work| c.taken(work, Columns::range(0..beams), false)),
        reaction: s.reaction_work.map(|work| c.taken(work, Columns::range(0..s.conditions), false)),
        stress,
        contact,
        ties: s.ties.map(|(energy, count)| c.kept(energy, Columns::range(0..count))),
        modes: s.hex_energy.map(|e| c.kept(e, Columns::blocks(s.hex_blocks, ENERGY, 4))),
        hourglass: s.hex_hourglass.map(|e| c.kept(e, Columns::blocks(s.hex_blocks, HOURGLASS, 1))),
        axial: s.beam_tension.map(|tension| c.axial(tension, s)),
        bending: s.bend_energy.map(|e| c.kept(e, Columns::range(0..s.bends))),
        kinetic: c.kinetic(s, false),
        kinetic_total: s.mesh.period.map(|_| c.kinetic(s, true)),
        added: [part(c, 0..first), part(c, first..nodes)],
        jacobian: jacobian.map(|(energy, used)| {
            let jacobians = Columns { start: 4 * LANES, ..Columns::blocks(s.hex_blocks, ENERGY, 1) };
            c.largest(energy, jacobians, Some(used))
        }),
        stiffness: c.largest(s.weighed_limit, Columns::range(0..nodes), None),
    };
    (totals, slip)
}
