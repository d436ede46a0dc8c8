//! Tables and stages of rigid tools.

use super::Tables;
use super::builder::Builder;
use super::contact::{Added, ContactScene, Points};
use super::nodes::Nodes;
use crate::contact::{Params, memory, sums};
use crate::dynamics::totals::{self, Sum};
use crate::error::{Error, Result};
use crate::kernel::buffer::{Buffer, Initial, Kind};
use crate::kernel::position::quanta;
use crate::kernel::stage::{Code, Stage, flagged, wires};
use crate::mesh::solid::{Grid, axes};
use crate::settings::tool::{Shape, Tool};
use crate::tools::motion::{self, LOAD, Motion, WORKS};
use crate::tools::shape::{BOX, GRID, MOTION, PLANE, SEAT, TOOL};
use crate::tools::touch::{NOTES, Touch};

/// Buffers of tools.
#[derive(Debug, Clone, Copy)]
pub struct ToolBuffers {
    /// See [`SEAT`] and [`MOTION`].
    pub seats: Buffer,
    pub motions: Buffer,
    /// Sums of the notes of points, see [`NOTES`].
    pub results: Buffer,
    /// See [`WORKS`].
    pub works: Buffer,
    /// Contact sums of points of threads and of yarns, and the number of points.
    pub sums: [Option<(Buffer, usize)>; 2],
}

/// Tools of a plan.
pub(super) struct Tools {
    pub buffers: ToolBuffers,
    loads: Buffer,
    /// Notes of points, with their numbers.
    notes: [Option<(Buffer, usize)>; 2],
}

/// Names of the buffers and stages of tools on one kind of points.
struct Names {
    touches: &'static str,
    notes: &'static str,
    sums: &'static str,
    step: &'static str,
    add: &'static str,
}

const NAMES: [Names; 2] = [
    Names {
        touches: "touches of tools on threads",
        notes: "notes of thread points on tools",
        sums: "sums of tools on threads",
        step: "tools on threads",
        add: "forces of threads on tools",
    },
    Names {
        touches: "touches of tools on yarns",
        notes: "notes of yarn points on tools",
        sums: "sums of tools on yarns",
        step: "tools on yarns",
        add: "forces of yarns on tools",
    },
];

impl ContactScene<'_> {
    /// Adds tools and their forces on points.
    pub(super) fn tools(
        &self,
        b: &mut Builder,
        points: [Option<Points>; 2],
        total: Added,
        params: Params,
    ) -> Result<Tools> {
        let tools = &self.tables.mesh.tools;
        let count = tools.len();
        let (table, seats) = shapes(tools, self.tables.threads.radius.iter().copied().fold(0.0, f64::max))?;
        let table = b.table("shapes of tools", table);
        let seats = b.add("places of tools", Kind::Int, SEAT * count, true, Initial::Int(seats));
        let motions = b.add("motion of tools", Kind::Scalar, MOTION * count, true, Initial::Zero);
        let (mut sums, mut notes) = ([None; 2], [None; 2]);
        for (kind, names) in NAMES.iter().enumerate() {
            let Some(Points { nodes, points, count: each }) = points[kind] else { continue };
            let friction = self.tables.active.friction;
            let size = memory::touch(friction) * count;
            let touches = b.add(names.touches, Kind::Scalar, size * each, true, Initial::Zero);
            let noted = b.scratch(names.notes, NOTES * count * each);
            let row = sums::sums(friction, self.tables.active.periodic);
            let summed = b.scratch(names.sums, row * each);
            let &Nodes { reference, quanta, remainder, velocity, mass, status, .. } = self.nodes;
            let wires = wires![
                nodes,
                points,
                reference,
                quanta,
                remainder,
                velocity,
                mass,
                tools: table,
                seats,
                motions,
                touches: (touches, size),
                notes: (noted, NOTES * count),
                sums: (summed, row),
                forces: total.force,
                stiffness: total.stiffness,
                status,
            ];
            let kernel = flagged!(Touch; kind == 0, friction, self.tables.active.periodic);
            b.plan.step.push(Stage::new(names.step, kernel, (each, 256), &wires, params).beside());
            (sums[kind], notes[kind]) = (Some((summed, each)), Some((noted, each)));
        }
        let results = b.scratch("forces on tools", NOTES * count);
        let works = b.scratch("work on tools", WORKS * count);
        let loads = b.table("loads on tools", tools.iter().flat_map(load).collect());
        Ok(Tools { buffers: ToolBuffers { seats, motions, results, works, sums }, loads, notes })
    }
}

impl Tools {
    /// Adds the stages that sum the forces on tools and move them.
    pub fn march(&self, b: &mut Builder, t: &Tables) {
        let columns = NOTES * t.mesh.tools.len();
        let parts = b.scratch("parts of forces on tools", 0);
        let mut waits = true;
        for (kind, notes) in self.notes.iter().enumerate() {
            let Some((source, count)) = *notes else { continue };
            let (length, each) = totals::parts(count);
            let len = &mut b.plan.buffers[parts.number()].len;
            let into = *len;
            *len += each * columns;
            let params = totals::Params {
                start: 0,
                count: count as u32,
                lanes: 1,
                stride: columns as u32,
                columns: columns as u32,
                length: length as u32,
                into: into as u32,
            };
            let wires = wires![source, totals: parts];
            let stage = Stage::new(NAMES[kind].add, Code::of::<Sum<false>>(), (each * columns, 4), &wires, params);
            b.plan.step.push(if waits { stage } else { stage.beside() });
            waits = false;
        }
        let ToolBuffers { seats, motions, results, works, .. } = self.buffers;
        let contact_mass = t.scene.effects.contact_mass.as_ref().filter(|_| t.active.contact_mass);
        let params =
            motion::Params { gravity: t.gravity(), mass_factor: contact_mass.map_or(0.0, |mass| mass.factor as f32) };
        let wires = wires![loads: self.loads, parts, seats, motions, results, works];
        let count = t.mesh.tools.len();
        b.plan.step.push(Stage::new("motion of tools", Code::of::<Motion>(), (count, count), &wires, params));
    }
}

/// Tables of shapes, see [`TOOL`] and [`SEAT`], followed by the grids of distances; `radius` is the largest of a thread, mm.
fn shapes(tools: &[Tool], radius: f64) -> Result<(Vec<f64>, Vec<i32>)> {
    let (mut table, mut grids, mut seats) = (Vec::new(), Vec::new(), Vec::new());
    for tool in tools {
        let mut counts = [0; 3];
        let (mut half, mut edge, mut from, mut cell) = ([0.0; 3], 0.0, [0.0; 3], 0.0);
        let first = TOOL * tools.len() + grids.len();
        let kind = match &tool.shape {
            Shape::Plane => PLANE,
            Shape::Sphere { radius_mm } => {
                edge = *radius_mm;
                BOX
            }
            Shape::Cylinder { radius_mm, length_mm } => {
                (half[0], edge) = (0.5 * length_mm, *radius_mm);
                BOX
            }
            Shape::Box { size_mm, edge_radius_mm } => {
                edge = *edge_radius_mm;
                half = size_mm.map(|size| 0.5 * size - edge);
                BOX
            }
            Shape::Mesh { triangles_mm, cell_mm, .. } => {
                let grid = Grid::new(triangles_mm.as_deref().unwrap_or_default(), *cell_mm, radius)
                    .map_err(|message| Error::geometry(format!("tool {:?}", tool.name), message))?;
                (from, cell, counts) = (grid.from, grid.cell, grid.counts.map(|count| count as i32));
                grids.extend(grid.distances);
                GRID
            }
        };
        table.extend(axes(tool.turned_deg).as_flattened());
        table.extend(half);
        table.push(edge);
        let rubs = tool.friction.kinds();
        table.extend([rubs.thread, rubs.yarn]);
        table.extend(from);
        table.push(cell);
        seats.extend(tool.at_mm.map(quanta));
        seats.push(kind);
        seats.extend(counts);
        seats.push(first as i32);
        seats.extend([0; 3]);
    }
    table.extend(grids);
    Ok((table, seats))
}

/// See [`LOAD`].
fn load(tool: &Tool) -> [f64; LOAD] {
    let free = tool.is_free();
    let by_force = tool.free.as_ref();
    let force = by_force.map_or([0.0; 3], |free| free.force_n);
    let along = free.map(|free| f64::from(u8::from(free)));
    let by = [0, 1, 2].map(|k| if free[k] { 0.0 } else { tool.displacement_mm[k] });
    /// Of a tool that moves with the schedule along all axes, tonne; it has no effect.
    const ANY: f64 = 1.0;
    let mass = by_force.map_or(ANY, |free| free.mass_g * 1e-6);
    let mut all = [0.0; LOAD];
    for (place, number) in all.iter_mut().zip(by.into_iter().chain(force).chain(along).chain([mass])) {
        *place = number;
    }
    all
}
