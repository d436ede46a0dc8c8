//! Fibre lines: selective mass scaling that lifts the time step limit set by the axial stiffness of fibres and threads.
//!
//! The mass matrix becomes A = M + β dt² Σ k_s b_s b_sᵀ over the segments s of a line, with b_s = (−d_s, +d_s) on the segment's
//! two nodes, d_s its current direction and k_s its axial stiffness. The forces are unchanged, so every static solution is the
//! same. Translations are in the null space of the added part, so momentum is conserved and rigid slip is not resisted. By the
//! Woodbury identity the accelerations a = M⁻¹f of a line are corrected by Σ p_s b_s/m, where p solves a symmetric positive
//! definite tridiagonal system, cyclic for a line that closes through the periodic cell:
//!
//! diagonal 1/(β dt² k_s) + 1/m_s + 1/m_{s+1}, off-diagonal −d_s·d_{s+1}/m_{s+1}, right side −d_s·(a_{s+1} − a_s).
//!
//! A node that is prescribed along some axes takes part with its free components only: 1/m is then a diagonal matrix with zeros for
//! the others, between the directions of the segments that it joins.
//!
//! A mass μ = β dt² k that only resisted the stretching of a segment would have the force −μ (d·(a_{s+1} − a_s) + u²/l) d, with u
//! the relative velocity of its nodes across it. The second term is left out: with u from half a step before, it feeds energy
//! into whipping threads. Without it, the added mass does work on fast zigzags of light nodes, and fine meshes need a margin
//! between the step and the limit of the elements, as in [`crate::case::accuracy`].
//!
//! The fibre laws are logarithmic: at a stretch λ < 1 their stiffness is (1 − ln λ)/λ² times the stiffness at rest. k_s grows
//! by λ⁻⁴, which is more.
//!
//! Segments are computed along each line, and the systems of up to sixteen consecutive lines are solved at once, one per lane.
//! The WGSL twin gives each line a workgroup and solves the same system, bordered by its last row, by parallel cyclic reduction.
//!
//! Every node belongs to one line, so that assembly, fibre lines and integration of a line need nothing from other lines. Nodes
//! without fibres form free lines, which are left alone.

use super::BLOCK;
use super::tridiagonal::{BORDER, COUPLING, DIAGONAL, RIGHT, Systems};
use crate::elements::LANES;
use crate::kernel::buffer::CacheLine;
use crate::kernel::buffer::Kind::{Int, Scalar, Uint};
use crate::kernel::interface::{Slot, constants, slot};
use crate::kernel::io::{Io, Scatter, View};
use crate::kernel::lane::{Lane, Real};
use crate::kernel::position::{self, QUANTUM};
use crate::kernel::scratch;
use crate::kernel::shader::{Shader, Share, when};
use crate::kernel::stage::Kernel;
use bytemuck::{Pod, Zeroable};
use std::ops::Range;

/// A line of consecutive nodes.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable)]
pub struct Line {
    /// First node.
    pub first: u32,
    /// Number of nodes; at least two unless it is free.
    pub stations: u32,
    /// [`OPEN`], [`CLOSED`] or [`FREE`].
    pub kind: u32,
    /// Image shift of the first node when it follows the last, in quanta along x and y.
    pub shift: [i32; 2],
}

/// The ends are free, the first node follows the last, or no fibres connect the nodes.
pub const OPEN: u32 = 0;
pub const CLOSED: u32 = 1;
pub const FREE: u32 = 2;

/// Integers per line in the table.
const LINE: usize = size_of::<Line>() / 4;

impl Line {
    /// Whether fibres run along it.
    pub fn has_fibres(&self) -> bool {
        self.kind != FREE
    }

    /// Nodes of the line.
    pub fn nodes(&self) -> Range<usize> {
        self.first as usize..(self.first + self.stations) as usize
    }
}

/// Constants of the stage.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Params {
    /// Strength β of the added mass.
    pub beta: f32,
}

const fn slots(held: bool) -> [Slot; 9] {
    [
        Slot::read("lines", Uint),
        // axial stiffness at rest of the segment that starts at a node, N/mm; 0 for none
        Slot::read("stiffness", Scalar),
        Slot::read("reference", Int),
        Slot::read("quanta", Int),
        Slot::read("remainder", Scalar),
        Slot::read("acceleration", Scalar),
        Slot::read("inverse_mass", Scalar),
        // bit k: component k of the node is prescribed
        Slot::read("held", Uint).when(held),
        // change of acceleration, mm/s² (3 planes)
        Slot::scatter("correction", Scalar),
    ]
}

/// The correction of accelerations; with `PERIODIC`, lines deform with F̄ and may close through the cell; with `HELD`, some nodes are
/// prescribed along some axes only.
pub struct FibreLines<const PERIODIC: bool, const HELD: bool>;

impl<const PERIODIC: bool, const HELD: bool> Kernel for FibreLines<PERIODIC, HELD> {
    const SHADER: Shader = Shader {
        defines: &[when(PERIODIC, "PERIODIC"), when(HELD, "HELD")],
        // one workgroup per line
        share: Share::Workgroups(1),
        constants: &[&position::CONSTANTS, &constants![uint: LINE, CLOSED, FREE]],
        ..Shader::new("dynamics/fibre_lines", "fibre_lines")
    };
    const SLOTS: &'static [Slot] = &slots(HELD);

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let table: &[Line] = bytemuck::cast_slice(io.uints(slot!(Self::SLOTS, "lines")));
        let nodes = Nodes::new::<HELD>(io);
        let mut correction = io.scatter(slot!(Self::SLOTS, "correction"));
        let mut block = Block::new();
        // of the systems and the directions of lines
        let mut memory = scratch::take::<Vec<CacheLine>>();
        for first in items.clone().step_by(LANES) {
            let (mut lines, mut count) = ([Line::default(); LANES], 0);
            for line in &table[first..items.end.min(first + LANES)] {
                if line.has_fibres() {
                    lines[count] = *line;
                    count += 1;
                }
            }
            if count > 0 {
                solve::<L, PERIODIC, HELD>(&nodes, &lines[..count], &mut memory, &mut block, &mut correction);
            }
        }
        scratch::put_back(memory);
    }
}

/// What is known of the nodes, and constants of the step.
struct Nodes<'a, R> {
    reference: &'a [i32],
    quanta: View<'a, i32>,
    remainder: View<'a, R>,
    acceleration: View<'a, R>,
    inverse_mass: View<'a, R>,
    stiffness: &'a [R],
    /// Bit k of a node: its component k is prescribed.
    held: &'a [u32],
    /// F̄ − I.
    gradient: &'a [[R; 3]; 3],
    /// 1/(β dt²).
    compliance: R,
}

impl<'a, R: Real> Nodes<'a, R> {
    #[inline(always)]
    fn new<const HELD: bool>(io: &'a Io<R>) -> Self {
        let Params { beta } = io.params();
        let beta = R::from_f64(f64::from(beta));
        Self {
            reference: io.ints(slot!(&slots(HELD), "reference")),
            quanta: io.view(slot!(&slots(HELD), "quanta")),
            remainder: io.view(slot!(&slots(HELD), "remainder")),
            acceleration: io.view(slot!(&slots(HELD), "acceleration")),
            inverse_mass: io.view(slot!(&slots(HELD), "inverse_mass")),
            stiffness: io.scalars(slot!(&slots(HELD), "stiffness")),
            held: if HELD { io.uints(slot!(&slots(HELD), "held", HELD)) } else { &[] },
            gradient: &io.row.gradient,
            compliance: R::from_f64(1.0) / (beta * io.row.dt * io.row.dt),
        }
    }
}

impl<R: Real> Nodes<'_, R> {
    /// One if a component of a node is free, zero if it is prescribed.
    #[inline(always)]
    fn free<const HELD: bool>(&self, node: usize, k: usize) -> R {
        R::from_f64(if HELD && self.held[node] >> k & 1 == 1 { 0.0 } else { 1.0 })
    }
}

/// Consecutive segments of a line. Differences are from the node where a segment starts to the node where it ends.
struct Block<R> {
    /// Differences of reference positions.
    rest: [[R; BLOCK]; 3],
    /// Differences of displacements.
    moved: [[R; BLOCK]; 3],
    /// Differences of accelerations.
    jump: [[R; BLOCK]; 3],
    /// Inverse masses of both nodes, and which of their components are free.
    inverse_mass: [[R; BLOCK]; 2],
    free: [[[R; BLOCK]; 3]; 2],
    /// Stiffness at rest.
    stiffness: [R; BLOCK],
    /// Current directions, after that of the segment before.
    direction: [[R; BLOCK + 1]; 3],
    /// Columns of the system; the coupling is that of the segment before to a segment.
    diagonal: [R; BLOCK],
    right: [R; BLOCK],
    coupling: [R; BLOCK],
}

impl<R: Real> Block<R> {
    #[inline(always)]
    fn new() -> Self {
        let row = [R::from_f64(0.0); BLOCK];
        Self {
            rest: [row; 3],
            moved: [row; 3],
            jump: [row; 3],
            inverse_mass: [row; 2],
            free: [[row; 3]; 2],
            stiffness: row,
            direction: [[R::from_f64(0.0); BLOCK + 1]; 3],
            diagonal: row,
            right: row,
            coupling: row,
        }
    }

    /// Loads segments from nodes `start ..` to nodes `end ..` whose image is shifted, into places `at ..`.
    #[inline(always)]
    fn load<const HELD: bool>(
        &mut self,
        nodes: &Nodes<R>,
        [start, end]: [usize; 2],
        shift: [i32; 3],
        at: usize,
        count: usize,
    ) {
        let plane = nodes.inverse_mass.len();
        let quantum = R::from_f64(QUANTUM);
        for k in 0..3 {
            let (a, b) = (start + k * plane, end + k * plane);
            let (from, to) = (&nodes.reference[a..][..count], &nodes.reference[b..][..count]);
            let rest = &mut self.rest[k][at..][..count];
            for i in 0..count {
                rest[i] = R::from_i32(to[i].wrapping_sub(from[i]).wrapping_add(shift[k])) * quantum;
            }
            let (from, to) = (nodes.quanta.slice(a, count), nodes.quanta.slice(b, count));
            let (from_rest, to_rest) = (nodes.remainder.slice(a, count), nodes.remainder.slice(b, count));
            let moved = &mut self.moved[k][at..][..count];
            for i in 0..count {
                moved[i] = position::difference(to[i], to_rest[i], from[i], from_rest[i]);
            }
            let (from, to) = (nodes.acceleration.slice(a, count), nodes.acceleration.slice(b, count));
            let jump = &mut self.jump[k][at..][..count];
            for i in 0..count {
                jump[i] = to[i] - from[i];
            }
        }
        self.inverse_mass[0][at..][..count].copy_from_slice(nodes.inverse_mass.slice(start, count));
        self.inverse_mass[1][at..][..count].copy_from_slice(nodes.inverse_mass.slice(end, count));
        if HELD {
            for (k, i) in (0..3).flat_map(|k| (0..count).map(move |i| (k, i))) {
                self.free[0][k][at + i] = nodes.free::<HELD>(start + i, k);
                self.free[1][k][at + i] = nodes.free::<HELD>(end + i, k);
            }
        }
        self.stiffness[at..][..count].copy_from_slice(&nodes.stiffness[start..][..count]);
    }

    /// Computes the directions and the columns of the first `count` segments.
    #[inline(always)]
    fn compute<L: Lane<Scalar = R>, const PERIODIC: bool, const HELD: bool>(&mut self, nodes: &Nodes<R>, count: usize) {
        let one = L::new(1.0);
        let compliance = L::splat(nodes.compliance);
        for i in (0..count).step_by(L::WIDTH) {
            let rest: [L; 3] = vector(&self.rest, i);
            let moved: [L; 3] = vector(&self.moved, i);
            let mut now = rest;
            for k in 0..3 {
                if PERIODIC {
                    let g = &nodes.gradient[k];
                    now[k] = now[k] + (L::splat(g[0]) * rest[0] + L::splat(g[1]) * rest[1] + L::splat(g[2]) * rest[2]);
                }
                now[k] = now[k] + moved[k];
            }
            let shortened = (square(rest) / square(now)).max(one);
            let stiffness = L::load(&self.stiffness[i..]) * shortened * shortened;
            let inverse_length = one / dot(now, now).sqrt();
            let direction = [now[0] * inverse_length, now[1] * inverse_length, now[2] * inverse_length];
            let right = -dot(direction, vector(&self.jump, i));
            let [a, b] = &self.inverse_mass;
            let (mut a, mut b): (L, L) = (L::load(&a[i..]), L::load(&b[i..]));
            if HELD {
                a = a * free_part(direction, &self.free[0], i);
                b = b * free_part(direction, &self.free[1], i);
            }
            let diagonal = compliance / stiffness + a + b;
            for k in 0..3 {
                direction[k].store(&mut self.direction[k][i + 1..]);
            }
            diagonal.store(&mut self.diagonal[i..]);
            right.store(&mut self.right[i..]);
        }
        for i in (0..count).step_by(L::WIDTH) {
            let (before, mut after): ([L; 3], [L; 3]) = (vector(&self.direction, i), vector(&self.direction, i + 1));
            if HELD {
                let free: [L; 3] = vector(&self.free[0], i);
                after = [after[0] * free[0], after[1] * free[1], after[2] * free[2]];
            }
            let cosine = dot(before, after);
            let coupling = -(cosine * L::load(&self.inverse_mass[0][i..]));
            coupling.store(&mut self.coupling[i..]);
        }
    }
}

#[inline(always)]
fn vector<L: Lane, const N: usize>(rows: &[[L::Scalar; N]; 3], at: usize) -> [L; 3] {
    [L::load(&rows[0][at..]), L::load(&rows[1][at..]), L::load(&rows[2][at..])]
}

/// Share of the square of a direction in the free components of nodes.
#[inline(always)]
fn free_part<L: Lane>(direction: [L; 3], free: &[[L::Scalar; BLOCK]; 3], at: usize) -> L {
    let free: [L; 3] = vector(free, at);
    dot(direction, [direction[0] * free[0], direction[1] * free[1], direction[2] * free[2]])
}

#[inline(always)]
fn square<L: Lane>(a: [L; 3]) -> L {
    a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
}

#[inline(always)]
fn dot<L: Lane>(a: [L; 3], b: [L; 3]) -> L {
    a[2].fma(b[2], a[1].fma(b[1], a[0] * b[0]))
}

/// Solves the systems of up to sixteen lines and writes the corrections of their nodes.
#[inline(always)]
fn solve<L: Lane, const PERIODIC: bool, const HELD: bool>(
    nodes: &Nodes<L::Scalar>,
    lines: &[Line],
    memory: &mut Vec<CacheLine>,
    block: &mut Block<L::Scalar>,
    correction: &mut Scatter<L::Scalar>,
) {
    let (mut counts, mut longest) = ([0; LANES], 0);
    for (count, line) in counts.iter_mut().zip(lines) {
        *count = line.nodes().len();
        longest = longest.max(*count);
    }
    let space = Systems::space::<L>(lines.len(), longest);
    let numbers = space + longest + 3 * longest * lines.len();
    let needed = (numbers * size_of::<L::Scalar>()).div_ceil(size_of::<CacheLine>());
    memory.resize(needed.max(memory.len()), CacheLine::zeroed());
    let (systems, memory) = bytemuck::cast_slice_mut(memory).split_at_mut(space);
    let (unknowns, directions) = memory.split_at_mut(longest);
    let mut systems = Systems::new::<L>(systems, longest, &counts[..lines.len()]);
    for (lane, line) in lines.iter().enumerate() {
        let directions = &mut directions[3 * longest * lane..][..3 * longest];
        set_up::<L, PERIODIC, HELD>(nodes, line, block, directions, &mut systems, lane);
    }
    systems.solve::<L>();
    for (lane, line) in lines.iter().enumerate() {
        let unknowns = &mut unknowns[..line.nodes().len()];
        systems.solution(lane, unknowns);
        correct::<_, HELD>(nodes, line, &directions[3 * longest * lane..][..3 * longest], unknowns, correction);
    }
}

/// Computes the directions of a line's segments, in three planes, and its system.
#[inline(always)]
fn set_up<L: Lane, const PERIODIC: bool, const HELD: bool>(
    nodes: &Nodes<L::Scalar>,
    line: &Line,
    block: &mut Block<L::Scalar>,
    directions: &mut [L::Scalar],
    systems: &mut Systems<L::Scalar>,
    lane: usize,
) {
    let (first, stations, closed) = (line.first as usize, line.stations as usize, line.kind == CLOSED);
    let (last, plane) = (stations - 1, directions.len() / 3);
    // an open line has no last segment: any other segment of nonzero length takes its place
    let [x, y] = line.shift;
    let (follower, shift) = if closed { (first, [x, y, 0]) } else { (first + last - 1, [0; 3]) };
    for at in (0..stations).step_by(BLOCK) {
        let count = BLOCK.min(stations - at);
        let inner = count.min(last - at);
        block.load::<HELD>(nodes, [first + at, first + at + 1], [0; 3], 0, inner);
        if inner < count {
            block.load::<HELD>(nodes, [first + last, follower], shift, inner, 1);
        }
        block.compute::<L, PERIODIC, HELD>(nodes, count);
        for k in 0..3 {
            directions[k * plane + at..][..count].copy_from_slice(&block.direction[k][1..][..count]);
            block.direction[k][0] = block.direction[k][count];
        }
        systems.set(lane, DIAGONAL, at, &block.diagonal[..count]);
        systems.set(lane, RIGHT, at, &block.right[..count]);
        // no segment is before the first
        let before = usize::from(at == 0);
        systems.set(lane, COUPLING, at + before - 1, &block.coupling[before..count]);
    }
    let (zero, one) = (L::Scalar::from_f64(0.0), L::Scalar::from_f64(1.0));
    if closed {
        let [a, mut b] = [last, 0].map(|i| [directions[i], directions[plane + i], directions[2 * plane + i]]);
        if HELD {
            for (k, b) in b.iter_mut().enumerate() {
                *b = *b * nodes.free::<HELD>(first, k);
            }
        }
        systems.set(lane, BORDER, 0, &[-(dot(a, b) * nodes.inverse_mass.get(first))]);
    } else {
        systems.set(lane, BORDER, 0, &[zero]);
        systems.set(lane, DIAGONAL, last, &[one]);
        systems.set(lane, RIGHT, last, &[zero]);
        systems.set(lane, COUPLING, last - 1, &[zero]);
    }
}

/// Writes the corrections of a line's nodes.
#[inline(always)]
fn correct<R: Real, const HELD: bool>(
    nodes: &Nodes<R>,
    line: &Line,
    directions: &[R],
    unknowns: &[R],
    correction: &mut Scatter<R>,
) {
    let (first, n) = (line.first as usize, line.stations as usize);
    let (last, plane) = (n - 1, directions.len() / 3);
    let inverse_mass = nodes.inverse_mass.slice(first, n);
    let p = &unknowns[..n];
    for k in 0..3 {
        let d = &directions[k * plane..][..n];
        let to = correction.slice(first + k * nodes.inverse_mass.len(), n);
        to[0] = (p[last] * d[last] - p[0] * d[0]) * inverse_mass[0];
        for i in 1..n {
            to[i] = (p[i - 1] * d[i - 1] - p[i] * d[i]) * inverse_mass[i];
        }
        if HELD {
            for i in 0..n {
                to[i] = to[i] * nodes.free::<HELD>(first + i, k);
            }
        }
    }
}
