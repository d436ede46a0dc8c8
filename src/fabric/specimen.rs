//! Pieces cut from the fabric: the specimen of a bias-extension test, a rectangle at an angle with its length along x, and the
//! cross-shaped sample of a picture frame, in whose arms only the yarns that run to the clamps are left.
//!
//! Yarns are cut with all their fibres in the planes of the cut. Inside, slices are perpendicular to the fibre. Towards an end,
//! each fibre line is stretched or shortened until its last node lies in the cut, so every element stays a hexahedron. At the
//! corners, fibre lines shorter than a slice are left out, as are yarns with fewer than three remaining columns. Threads are cut
//! where they leave the rectangle; pieces shorter than a loop bind nothing and are left out. Nodes in a clamp are held; all other
//! yarn ends are free. Where threads are cut, and where a loop has lost the next loop, the stitch would unravel;
//! [`crate::case::domain::ThreadEnds`] says whether it may.
//!
//! The origin of the fabric lies at the middle of a warp and of a gap between two wefts, where a course of the stitch runs.

use super::laps::Laps;
use super::section::Section;
use super::stitch::{self, Layout};
use super::{MOST_NODES, check, quantised, require};
use crate::case::Case;
use crate::case::domain::{Resolution, Specimen};
use crate::case::fabric::{Fabric, Yarn};
use crate::error::{Error, Result};
use crate::mesh::vector::Vector;
use crate::mesh::{Block, Mesh, Part, Ply, quality};

/// Fewest columns of a yarn that is cut along its length, and fewest slices.
const FEWEST_COLUMNS: usize = 3;
const FEWEST_SLICES: usize = 2;
/// Length over which fibre lines adapt to a cut, in widths of the yarn.
const BLEND: f64 = 2.0;

/// Builds a specimen.
pub fn build(case: &Case, fabric: &Fabric, specimen: &Specimen) -> Result<Mesh> {
    let cut = Cut::new(specimen.half(), specimen.warp_angle_deg);
    piece(case, fabric, "domain.specimen", [&cut; 3])
}

/// Builds the sample of a picture frame about the origin, its warps along y: a square of a side, mm, with arms of a length, mm.
///
/// # Errors
/// As of [`build`].
pub fn cross(case: &Case, fabric: &Fabric, side: f64, arm: f64) -> Result<Mesh> {
    let (half, whole) = (0.5 * side, 0.5 * side + arm);
    let cuts = [[half, whole], [whole, half], [half, half]].map(|half| Cut::new(half, 90.0));
    piece(case, fabric, "domain.picture_frame", cuts.each_ref())
}

/// Builds a piece with cuts of its warps, wefts and threads; `path` names it in messages.
fn piece(case: &Case, fabric: &Fabric, path: &str, [warps, wefts, threads]: [&Cut; 3]) -> Result<Mesh> {
    let resolution = &case.resolution.refined();
    check::fabric(fabric)?;
    check::resolution(resolution)?;
    let layout = Layout::new(fabric)?;
    let lines = |columns: usize, cut: &Cut, pitch: f64| {
        (columns + 1) as f64 * (resolution.layers + 1) as f64 * 4.0 * cut.half[0] * cut.half[1] / pitch
    };
    let nodes =
        lines(resolution.warp_columns, warps, layout.pitch[0]) + lines(resolution.weft_columns, wefts, layout.pitch[1]);
    let nodes = nodes / resolution.slice_mm;
    require(nodes <= MOST_NODES, "resolution", || {
        format!("asks for {nodes:.1e} nodes, more than {MOST_NODES:.0e}; coarsen it or choose a smaller specimen")
    })?;
    let mut mesh = Mesh { friction: fabric.friction, ..Mesh::default() };
    let [warp, weft] = [(Ply::Warp, &fabric.warp), (Ply::Weft, &fabric.weft)];
    for ((ply, yarn), cut) in [warp, weft].into_iter().zip([warps, wefts]) {
        if !add_ply(&mut mesh, cut, &layout, ply, yarn, resolution)? {
            let name = if ply == Ply::Warp { "warp" } else { "weft" };
            let message =
                format!("holds no {name} of {FEWEST_COLUMNS} columns and a slice; enlarge it or refine resolution");
            return Err(Error::geometry(path, message));
        }
    }
    add_threads(&mut mesh, threads, &layout, fabric, resolution)?;
    check::contact(case, fabric, &mesh)?;
    Ok(mesh)
}

/// The rectangle and the orientation of the fabric in it.
struct Cut {
    half: [f64; 2],
    /// Directions of wefts and warps: the fabric's x and y.
    axes: [[f64; 2]; 2],
}

impl Cut {
    fn new(half: [f64; 2], warp_angle_deg: f64) -> Self {
        let (sin, cos) = libm::sincos(warp_angle_deg.to_radians());
        Self { half, axes: [[sin, -cos], [cos, sin]] }
    }

    /// Largest coordinate of the rectangle along an axis of the fabric.
    fn reach(&self, axis: usize) -> f64 {
        let [x, y] = self.axes[axis];
        x.abs() * self.half[0] + y.abs() * self.half[1]
    }

    /// Transforms a point of the fabric into the specimen.
    fn place(&self, [x, y, z]: Vector) -> Vector {
        let [weft, warp] = self.axes;
        [x * weft[0] + y * warp[0], x * weft[1] + y * warp[1], z]
    }

    fn holds(&self, p: Vector) -> bool {
        (0..2).all(|k| p[k].abs() <= self.half[k])
    }

    /// Where the line of points `offset + t direction` enters and leaves the rectangle.
    fn chord(&self, offset: [f64; 2], direction: [f64; 2]) -> Option<[f64; 2]> {
        let mut chord = [f64::NEG_INFINITY, f64::INFINITY];
        for k in 0..2 {
            if direction[k].abs() < 1e-12 {
                if offset[k].abs() > self.half[k] {
                    return None;
                }
                continue;
            }
            let at = |border: f64| (border - offset[k]) / direction[k];
            let [a, b] = [at(-self.half[k]), at(self.half[k])];
            chord = [chord[0].max(a.min(b)), chord[1].min(a.max(b))];
        }
        (chord[0] < chord[1]).then_some(chord)
    }
}

/// Adds the yarns of a ply; whether there are any.
fn add_ply(
    mesh: &mut Mesh,
    cut: &Cut,
    layout: &Layout,
    ply: Ply,
    yarn: &Yarn,
    resolution: &Resolution,
) -> Result<bool> {
    // columns run across the fibre such that slices, columns and layers are right-handed
    let [weft, warp] = cut.axes;
    let (name, section, columns, middle, along, across, axis, half_pitch): (_, &Section, _, _, _, _, _, f64) = match ply
    {
        Ply::Warp => ("warp", &layout.warp, resolution.warp_columns, layout.middle[0], warp, weft.map(|c| -c), 0, 0.0),
        _ => ("weft", &layout.weft, resolution.weft_columns, layout.middle[1], weft, warp, 1, 0.5),
    };
    let pitch = layout.pitch[axis];
    let side = if axis == 0 { -1.0 } else { 1.0 };
    let count = (cut.reach(axis) / pitch).ceil() as i64 + 1;
    let grid = section.grid(columns, resolution.layers);
    let density = yarn.areal_mass_g_m2 * quality::TONNES_PER_MM2 * pitch / section.meshed_area(columns);
    let before = mesh.blocks.len();
    for index in -count..=count {
        let place = side * (index as f64 + half_pitch) * pitch;
        let offset = |u: f64| across.map(|c| (place + u) * c);
        let chords: Vec<Option<[f64; 2]>> = grid[0].iter().map(|[u, _]| cut.chord(offset(*u), along)).collect();
        let Some(outline) = Outline::new(&chords, section.width, resolution.slice_mm) else { continue };
        let first = mesh.nodes.len();
        let lattice = |p: [f64; 2]| p.map(quantised);
        let scaled = |v: [f64; 2], by: f64| v.map(|c| by * c);
        let [from, step] = [outline.start, outline.step()];
        let centre = offset(0.0);
        let origin = lattice([0, 1].map(|k| centre[k] + from * along[k]));
        // the same step of whole quanta everywhere: hexahedra inside all yarns share shapes
        let step = lattice(scaled(along, step));
        for row in &grid {
            for (line, [u, v]) in row.iter().enumerate().skip(outline.first).take(outline.lines()) {
                let (aside, z) = (lattice(scaled(across, *u)), quantised(middle + v));
                mesh.nodes.extend((0..=outline.slices).map(|slice| {
                    let shift = lattice(scaled(along, outline.shift(line, slice)));
                    let [x, y] = [0, 1].map(|k| origin[k] + slice as f64 * step[k] + aside[k] + shift[k]);
                    [x, y, z]
                }));
            }
        }
        let block = Block {
            name: format!("{name} {}", mesh.blocks.len() - before + 1),
            ply,
            first,
            slices: outline.slices,
            columns: outline.lines() - 1,
            layers: resolution.layers,
            wrap: None,
            fibre: [along[0], along[1], 0.0],
            density,
            material: yarn.material.clone(),
            velocity: [0.0; 3],
        };
        check::shape(mesh, &block, name)?;
        mesh.blocks.push(block);
    }
    Ok(mesh.blocks.len() > before)
}

/// One yarn seen along z: the extent of its fibre lines, and the slices between their median ends.
struct Outline {
    /// First kept line.
    first: usize,
    /// Ends of the kept lines less the ends of the slices, mm along the fibre.
    shifts: Vec<[f64; 2]>,
    /// Median of the starts of lines, mm.
    start: f64,
    length: f64,
    slices: usize,
    /// Length over which lines adapt, mm.
    blend: f64,
}

impl Outline {
    /// The yarn with these chords of its lines; `None` for a sliver.
    fn new(chords: &[Option<[f64; 2]>], width: f64, slice: f64) -> Option<Self> {
        let long = |chord: &Option<[f64; 2]>| chord.is_some_and(|[a, b]| b - a >= slice);
        // the cut is convex, so its long chords are neighbours
        let first = chords.iter().position(long)?;
        let kept: Vec<[f64; 2]> = chords[first..].iter().take_while(|c| long(c)).flatten().copied().collect();
        if kept.len() - 1 < FEWEST_COLUMNS.min(chords.len() - 1) {
            return None;
        }
        let [start, end] = [0, 1].map(|side| median(kept.iter().map(|c| c[side]).collect()));
        let length = end - start;
        let shifts: Vec<[f64; 2]> = kept.iter().map(|[a, b]| [a - start, b - end]).collect();
        let spread = shifts.iter().flatten().fold(0.0, |most: f64, s| most.max(s.abs()));
        let blend = (BLEND * width.max(spread)).min(0.5 * length);
        // between steep cuts, lines run straight from one end to the other
        let blend = if spread > 0.75 * blend { length } else { blend };
        let slices = ((length / slice).round() as usize).max(FEWEST_SLICES);
        Some(Self { first, shifts, start, length, slices, blend })
    }

    fn lines(&self) -> usize {
        self.shifts.len()
    }

    fn step(&self) -> f64 {
        self.length / self.slices as f64
    }

    /// Shift of a node along its fibre, mm: full at the ends, zero inside.
    fn shift(&self, line: usize, slice: usize) -> f64 {
        let [start, end] = self.shifts[line - self.first];
        let share = |slices: usize| (1.0 - slices as f64 * self.step() / self.blend).max(0.0);
        start * share(slice) + end * share(self.slices - slice)
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let half = values.len() / 2;
    if values.len() % 2 == 1 { values[half] } else { 0.5 * (values[half - 1] + values[half]) }
}

/// Adds the pieces of thread in the rectangle. Laps differ in their beams only where both laps of a pair are whole. Every piece
/// then has as many beams as if all laps were alike, and pieces of equal length can be solved side by side.
fn add_threads(mesh: &mut Mesh, cut: &Cut, layout: &Layout, fabric: &Fabric, resolution: &Resolution) -> Result<()> {
    let path = layout.path()?;
    let laps = Laps::new(&path, resolution, fabric.stitch.radius_mm);
    let [px, py] = layout.pitch;
    let [threads, courses] = [(0, px), (1, py)].map(|(axis, pitch)| (cut.reach(axis) / pitch).ceil() as i64 + 1);
    let mut number = 0;
    for i in -threads..=threads {
        let place = |course: i64, [x, y, z]: Vector| {
            let side = if course % 2 == 0 { 1.0 } else { -1.0 };
            cut.place([i as f64 * px + side * x, course as f64 * py + y, z])
        };
        let at = |course: i64, arc: f64| place(course, path.line.at(arc));
        let is_whole = |course: i64| path.line.points().iter().all(|p| cut.holds(place(course, *p)));
        let lap = |course: i64| {
            let pair = 2 * course.div_euclid(2);
            if is_whole(pair) && is_whole(pair + 1) { laps.lap(i, course) } else { laps.mean() }
        };
        let beams = (-courses..=courses).flat_map(|j| lap(j).iter().map(move |&(arcs, part)| (j, arcs, part)));
        let mut pieces = pieces(cut, beams.map(|(j, arcs, part)| (move |arc| at(j, arc), arcs, part)));
        pieces.retain(|piece| piece.length() >= path.loop_length);
        number += usize::from(!pieces.is_empty());
        for (k, piece) in pieces.into_iter().enumerate() {
            let first = mesh.nodes.len();
            mesh.nodes.extend(piece.nodes.iter().map(|(p, _)| p.map(quantised)));
            let name = format!("thread {number}.{}", k + 1);
            mesh.threads.push(stitch::thread(&fabric.stitch, name, first, None, piece.beams()));
        }
    }
    Ok(())
}

/// A piece of thread: nodes with their arc lengths, and the part of the lap of each beam between two nodes.
#[derive(Default)]
struct Piece {
    nodes: Vec<(Vector, f64)>,
    parts: Vec<Part>,
}

impl Piece {
    /// Arc length from the first node to the last, mm.
    fn length(&self) -> f64 {
        self.nodes.last().map_or(0.0, |(_, end)| end - self.nodes[0].1)
    }

    /// Part and excess of each beam.
    fn beams(&self) -> Vec<(Part, f64)> {
        let excess = self.nodes.windows(2).map(|ends| stitch::excess(ends[1].1 - ends[0].1, ends[0].0, ends[1].0));
        self.parts.iter().copied().zip(excess).collect()
    }
}

/// Cuts a chain of beams, each with its curve and arc lengths on it, where it leaves the rectangle. A beam of which less than
/// half would remain is merged with its neighbour.
fn pieces<C: Fn(f64) -> Vector>(cut: &Cut, beams: impl Iterator<Item = (C, [f64; 2], Part)>) -> Vec<Piece> {
    let mut pieces = Vec::new();
    let mut piece = Piece::default();
    let mut before = 0.0;
    for (curve, [from, to], part) in beams {
        let node = |arc: f64| (curve(arc), before + arc - from);
        let inside = [from, to].map(|arc| cut.holds(curve(arc)));
        match (inside[0], piece.nodes.is_empty()) {
            (true, true) => piece.nodes.push(node(from)),
            // the end of the previous beam lay exactly on the border
            (false, false) => pieces.push(std::mem::take(&mut piece)),
            _ => {}
        }
        match inside {
            [true, true] => {
                piece.nodes.push(node(to));
                piece.parts.push(part);
            }
            [true, false] => {
                let border = leaves(cut, &curve, from, to);
                if border - from < 0.5 * (to - from) {
                    piece.nodes.pop();
                } else {
                    piece.parts.push(part);
                }
                piece.nodes.push(node(border));
                pieces.push(std::mem::take(&mut piece));
            }
            [false, true] => {
                let border = leaves(cut, &curve, to, from);
                piece.nodes.push(node(border));
                if to - border >= 0.5 * (to - from) {
                    piece.nodes.push(node(to));
                    piece.parts.push(part);
                }
            }
            [false, false] => {}
        }
        before += to - from;
    }
    pieces
}

/// Arc length at which a curve leaves the rectangle, between an inside and an outside arc length.
fn leaves(cut: &Cut, curve: impl Fn(f64) -> Vector, mut inside: f64, mut outside: f64) -> f64 {
    for _ in 0..50 {
        let middle = 0.5 * (inside + outside);
        if cut.holds(curve(middle)) { inside = middle } else { outside = middle }
    }
    inside
}
