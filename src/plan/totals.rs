//! The stages that sum per-item results of kernels, and the places of the sums for the host.

use super::beams::Beams;
use super::builder::Builder;
use super::nodes::Nodes;
use super::{Active, Parts};
use crate::contact::{slip, sums};
use crate::dynamics::energy;
use crate::dynamics::integrate::Works;
use crate::dynamics::totals::{self, Params, Sum, WORST, Worst};
use crate::elements::LANES;
use crate::elements::block::{ENERGY, VIRIAL};
use crate::elements::hex8_reduced::HOURGLASS;
use crate::kernel::buffer::Buffer;
use crate::kernel::position::quanta;
use crate::kernel::stage::{Code, Stage, flagged, wires};
use crate::tools::motion;
use std::ops::Range;

/// Places of the column sums in the totals, part by part.
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

/// Places of the column maxima in the totals, part by part.
#[derive(Debug, Clone, Copy)]
pub struct Largest {
    into: usize,
    parts: usize,
    length: usize,
}

impl Largest {
    /// The largest number and its index in the column; the first of equal ones.
    pub fn of(&self, totals: &[f64]) -> (f64, usize) {
        let parts = totals[self.into..][..WORST * self.parts].chunks_exact(WORST).enumerate();
        let found = parts.map(|(number, part)| (part[0], number * self.length + part[1] as usize));
        found.fold((f64::NEG_INFINITY, 0), |best, part| if part.0 > best.0 { part } else { best })
    }
}

/// The contents of the totals; `None` for effects that the scene does not have.
#[derive(Debug, Clone)]
pub struct Totals {
    pub buffer: Buffer,
    /// Work on nodes, one column per kind, and the kinds that exist.
    pub work: Option<Sums>,
    pub works: Works,
    pub thermal: Option<Sums>,
    pub reaction: Option<Sums>,
    /// Works on tools and their kinetic energy: columns as in [`crate::tools::motion`].
    pub tools: Option<Sums>,
    /// Virial stress of hexahedra, beams and bends: nine components each.
    pub stress: Vec<Sums>,
    /// Sums of points and of pairs of beams: columns as in [`crate::contact::sums`].
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
    /// Kinetic energy including the affine motion; `None` without affine motion.
    pub kinetic_total: Option<Sums>,
    /// Mass added to solids and to threads.
    pub added: [Option<Sums>; 2],
    /// −det F by block and lane.
    pub jacobian: Option<Largest>,
    /// K/m of nodes.
    pub stiffness: Largest,
}

/// Items per chunk: about as many numbers as a chunk of nodes has.
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
    /// Consecutive planes.
    fn planes(count: usize, columns: usize) -> Self {
        Self { columns, ..Self::range(0..count) }
    }
    /// Rows of `columns` numbers.
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
    /// Reserves space for the results of every part of a column.
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

    /// Sums of columns, whose numbers are reset to zero.
    fn taken(&mut self, buffer: Buffer, columns: Columns, waits: bool) -> Sums {
        let (sums, length) = self.room(columns.count, columns.columns);
        let params = self.params(&columns, sums, length);
        let wires = wires![source: buffer, totals: self.totals];
        let work = (sums.parts * sums.columns, GRAIN);
        let stage = Stage::new("totals taken", Code::of::<Sum<true>>(), work, &wires, params);
        self.b.plan.collect.push(if waits { stage } else { stage.beside() });
        sums
    }

    /// Sums of columns, whose numbers are kept.
    fn kept(&mut self, buffer: Buffer, columns: Columns) -> Sums {
        let (sums, length) = self.room(columns.count, columns.columns);
        let params = self.params(&columns, sums, length);
        let wires = wires![source: buffer, totals: self.totals];
        let work = (sums.parts * sums.columns, GRAIN);
        self.b.plan.collect.push(Stage::new("totals", Code::of::<Sum<false>>(), work, &wires, params).beside());
        sums
    }

    /// The maximum of a column; with a mask of used lanes, the maximum of the negated numbers.
    fn largest(&mut self, buffer: Buffer, columns: Columns, lanes_used: Option<Buffer>) -> Largest {
        let (sums, length) = self.room(columns.count, WORST);
        let params = self.params(&columns, sums, length);
        let wires = wires![source: buffer, lanes_used, totals: self.totals];
        let kernel = flagged!(Worst; lanes_used.is_some());
        self.b.plan.collect.push(Stage::new("worst", kernel, (sums.parts, GRAIN), &wires, params).beside());
        Largest { into: sums.into, parts: sums.parts, length }
    }

    /// ½ Σ m v² of nodes; `total` includes the affine motion.
    fn kinetic(&mut self, p: &Parts, total: bool) -> Sums {
        let masses = &p.nodes.masses;
        let whole: f64 = masses.iter().sum();
        let centre = [0, 1, 2].map(|k| {
            let moment: f64 = p.tables.mesh.nodes.iter().zip(masses).map(|(x, m)| m * x[k]).sum();
            quanta(moment / whole)
        });
        let (sums, length) = self.room(masses.len(), 1);
        let params = energy::Params {
            count: masses.len() as u32,
            length: length as u32,
            into: sums.into as u32,
            centre: if total { centre } else { [0; 3] },
        };
        let &Nodes { velocity, mass, reference, .. } = &p.nodes;
        let wires = wires![velocity, mass, reference, totals: self.totals];
        let name = if total { "total kinetic energy" } else { "kinetic energy" };
        let kernel = flagged!(energy::Kinetic; total);
        self.b.plan.collect.push(Stage::new(name, kernel, (sums.parts, GRAIN), &wires, params).beside());
        sums
    }

    /// ½ Σ N² L₀/EA of beams.
    fn axial(&mut self, tension: Buffer, beams: &Beams) -> Sums {
        let count = beams.count;
        let (sums, length) = self.room(count, 1);
        let params =
            energy::Params { count: count as u32, length: length as u32, into: sums.into as u32, centre: [0; 3] };
        let wires = wires![tension, beams: beams.table, totals: self.totals];
        let kernel = Code::of::<energy::Axial>();
        self.b.plan.collect.push(Stage::new("axial energy", kernel, (sums.parts, GRAIN), &wires, params).beside());
        sums
    }
}

/// Adds the stages of totals; returns their places, and the slip of contact points.
pub(super) fn add(b: &mut Builder, p: &Parts) -> (Totals, [Option<Buffer>; 2]) {
    let Parts { tables, nodes, hexes, beams, bends, .. } = p;
    let buffer = b.scratch("totals", 0);
    let Active { friction, periodic, .. } = tables.active;
    let points = p.points();
    let face_sums = p.faces().map(|faces| faces.map(|faces| faces.sums));
    let mut slip = [None; 2];
    for (kind, name) in [(0, "slip of thread points"), (1, "slip of yarn points")] {
        slip[kind] = face_sums[kind].filter(|_| friction).map(|sums| {
            let slipped = b.scratch(name, points[kind]);
            let (wires, kernel) = (wires![sums, slipped], flagged!(slip::Slip; periodic));
            b.plan.collect.push(Stage::new("slip", kernel, (points[kind], 512), &wires, [0u32; 0]).beside());
            slipped
        });
    }
    let hex_blocks = tables.solids.headers.len();
    let jacobian = hexes.energy.map(|energy| {
        let mut used = vec![0; hex_blocks];
        tables.solids.place.iter().for_each(|(block, _)| used[*block] += 1);
        (energy, b.indices("lanes in use", used))
    });
    let c = &mut Collector { b, totals: buffer };
    let mut contact = Vec::new();
    for (sums, points) in face_sums.into_iter().zip(points) {
        let Some(sums) = sums else { continue };
        contact.push(c.taken(sums, Columns::rows(points, sums::sums(friction, periodic)), true));
    }
    if let Some(pairs) = p.pairs() {
        contact.push(c.taken(pairs.sums, Columns::rows(beams.count, sums::sums(friction, periodic)), false));
    }
    let tools = p.tools().map(|tools| tools.buffers);
    for (sums, count) in tools.iter().flat_map(|tools| tools.sums).flatten() {
        contact.push(c.taken(sums, Columns::rows(count, sums::sums(friction, periodic)), contact.is_empty()));
    }
    let mut stress = Vec::new();
    if let Some(virial) = hexes.virial {
        stress.push(c.taken(virial, Columns::blocks(hex_blocks, VIRIAL, 9), false));
    }
    let of_bends = bends.as_ref().and_then(|bends| Some((bends.virial?, bends.count)));
    for (virial, count) in beams.virial.map(|virial| (virial, beams.count)).into_iter().chain(of_bends) {
        stress.push(c.taken(virial, Columns::rows(count, 9), false));
    }
    let held = p.held.as_ref();
    let ties = p.contact.as_ref().and_then(|contact| contact.ties);
    let first = nodes.first_thread;
    let part = |c: &mut Collector, range: Range<usize>| {
        p.assembled.added_mass.filter(|_| !range.is_empty()).map(|added| c.kept(added, Columns::range(range)))
    };
    let works = tables.active.works();
    let totals = Totals {
        buffer,
        work: nodes.work.map(|work| c.taken(work, Columns::planes(nodes.count, works.count()), false)),
        works,
        thermal: beams.work.map(|work| c.taken(work, Columns::range(0..beams.count), false)),
        reaction: held.map(|held| c.taken(held.work, Columns::range(0..held.count), false)),
        tools: tools.map(|tools| c.taken(tools.works, Columns::rows(tables.mesh.tools.len(), motion::WORKS), false)),
        stress,
        contact,
        ties: ties.map(|(energy, count)| c.kept(energy, Columns::range(0..count))),
        modes: hexes.energy.map(|e| c.kept(e, Columns::blocks(hex_blocks, ENERGY, 4))),
        hourglass: hexes.hourglass.map(|e| c.kept(e, Columns::blocks(hex_blocks, HOURGLASS, 1))),
        axial: beams.tension.map(|tension| c.axial(tension, beams)),
        bending: bends.as_ref().map(|bends| c.kept(bends.energy, Columns::range(0..bends.count))),
        kinetic: c.kinetic(p, false),
        kinetic_total: periodic.then(|| c.kinetic(p, true)),
        added: [part(c, 0..first), part(c, first..nodes.count)],
        jacobian: jacobian.map(|(energy, used)| {
            let jacobians = Columns { start: 4 * LANES, ..Columns::blocks(hex_blocks, ENERGY, 1) };
            c.largest(energy, jacobians, Some(used))
        }),
        stiffness: c.largest(p.weighed_limit, Columns::range(0..nodes.count), None),
    };
    (totals, slip)
}
