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
//! The fibre laws are logarithmic: at a stretch λ < 1 their stiffness is (1 − ln λ)/λ² times the stiffness at rest. k_s grows
//! by λ⁻⁴, which is more.
//!
//! The sweep solves a group of up to sixteen lines at once, one line per lane. The WGSL twin gives each line a workgroup and
//! solves the same system, bordered by its last row, by parallel cyclic reduction.

use crate::elements::{self, LANES};
use crate::kernel::buffer::Kind::{Int, Scalar, Uint};
use crate::kernel::interface::{Slot, constants, slot};
use crate::kernel::lane::{Lane, Real};
use crate::kernel::position::{self, QUANTUM};
use crate::kernel::shader::{Shader, Share, when};
use crate::kernel::stage::{Io, Kernel};
use bytemuck::{Pod, Zeroable};
use std::cell::RefCell;
use std::ops::Range;

/// A group of lines of equal length with consecutive nodes.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct Group {
    /// First node of the first line.
    pub first: u32,
    /// Number of lines, at most sixteen.
    pub lines: u32,
    /// Nodes per line.
    pub stations: u32,
    /// 1 if the first node follows the last, else 0.
    pub closed: u32,
    /// Image shift of the first node when it follows the last, in quanta along x and y.
    pub shift: [i32; 2],
}

/// Integers per group in the table.
const GROUP: usize = size_of::<Group>() / 4;

/// Constants of the stage.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Params {
    /// Strength β of the added mass.
    pub beta: f32,
}

const SLOTS: [Slot; 8] = [
    Slot::read("groups", Uint),
    // axial stiffness at rest of the segment that starts at a node, N/mm; 0 for none
    Slot::read("stiffness", Scalar),
    Slot::read("reference", Int),
    Slot::read("quanta", Int),
    Slot::read("remainder", Scalar),
    Slot::read("acceleration", Scalar),
    Slot::read("inverse_mass", Scalar),
    // change of acceleration, mm/s² (3 planes)
    Slot::scatter("correction", Scalar),
];

/// The correction of accelerations; with `PERIODIC`, lines deform with F̄ and may close through the cell.
pub struct FibreLines<const PERIODIC: bool>;

thread_local! {
    /// Work space of a sweep; f64 for its alignment and size.
    static SCRATCH: RefCell<Vec<f64>> = const { RefCell::new(Vec::new()) };
}

/// Rows of work space per station.
const DIRECTION: usize = 0;
const RESPONSE: usize = 3;
const INVERSE: usize = 6;
const DIAGONAL: usize = 7;
const COUPLING: usize = 8;
const CORNER: usize = 9;
const RIGHT: usize = 10;
const ROWS: usize = 11;

impl<const PERIODIC: bool> Kernel for FibreLines<PERIODIC> {
    const SHADER: Shader = Shader {
        defines: &[when(PERIODIC, "PERIODIC")],
        // one workgroup per line
        share: Share::Workgroups(LANES),
        constants: &[&elements::CONSTANTS, &position::CONSTANTS, &constants![uint: GROUP]],
        ..Shader::new("dynamics/fibre_lines", "fibre_lines")
    };
    const SLOTS: &'static [Slot] = &SLOTS;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let groups: &[Group] = bytemuck::cast_slice(io.uints(slot!(&SLOTS, "groups")));
        // taken, not borrowed in a closure, because the closure would not be compiled for the instruction set
        let mut memory = SCRATCH.take();
        for group in items {
            let group = groups[group];
            memory.resize(memory.len().max(ROWS * LANES * (group.stations as usize + 1)), 0.0);
            let scratch: &mut [L::Scalar] = bytemuck::cast_slice_mut(&mut memory);
            gather::<L, PERIODIC>(io, &group, scratch);
            for lane in (0..group.lines as usize).step_by(L::WIDTH) {
                solve::<L>(io, &group, &mut Sweep { scratch, lane });
            }
            scatter(io, &group, scratch);
        }
        SCRATCH.set(memory);
    }
}

/// Index of a row of a station in the work space.
#[inline(always)]
fn place(station: usize, row: usize) -> usize {
    (station * ROWS + row) * LANES
}

/// Loads segment vectors, accelerations and inverse masses into the work space, one line per lane.
#[inline(always)]
fn gather<L: Lane, const PERIODIC: bool>(io: &Io<L::Scalar>, group: &Group, scratch: &mut [L::Scalar]) {
    let reference = io.ints(slot!(&SLOTS, "reference"));
    let (quanta, remainder) = (io.ints(slot!(&SLOTS, "quanta")), io.scalars(slot!(&SLOTS, "remainder")));
    let acceleration = io.scalars(slot!(&SLOTS, "acceleration"));
    let (inverse, stiffness) = (io.scalars(slot!(&SLOTS, "inverse_mass")), io.scalars(slot!(&SLOTS, "stiffness")));
    let plane = inverse.len();
    let n = group.stations as usize;
    let g = &io.row.gradient;
    let quantum = L::Scalar::from_f64(QUANTUM);
    for lane in 0..group.lines as usize {
        let first = group.first as usize + lane * n;
        for i in 0..n {
            let here = first + i;
            let (next, shift) = match (i + 1 < n, group.closed == 1) {
                (true, _) => (here + 1, [0, 0]),
                (false, true) => (first, group.shift),
                // an open line has no last segment: any other segment of nonzero length takes its place
                (false, false) => (here - 1, [0, 0]),
            };
            let shift = if PERIODIC { [shift[0], shift[1], 0] } else { [0; 3] };
            let rest: [L::Scalar; 3] = std::array::from_fn(|k| {
                let d = reference[next + k * plane].wrapping_sub(reference[here + k * plane]).wrapping_add(shift[k]);
                L::Scalar::from_i32(d) * quantum
            });
            let mut lengths = [L::Scalar::from_f64(0.0); 2];
            for k in 0..3 {
                let (a, b) = (next + k * plane, here + k * plane);
                let w =
                    L::Scalar::from_i32(quanta[a].wrapping_sub(quanta[b])) * quantum + (remainder[a] - remainder[b]);
                let mut now = rest[k];
                if PERIODIC {
                    now = now + (g[k][0] * rest[0] + g[k][1] * rest[1] + g[k][2] * rest[2]);
                }
                now = now + w;
                lengths = [lengths[0] + rest[k] * rest[k], lengths[1] + now * now];
                scratch[place(i, DIRECTION + k) + lane] = now;
                scratch[place(i, RESPONSE + k) + lane] = acceleration[b];
            }
            scratch[place(i, INVERSE) + lane] = inverse[here];
            let shortened = (lengths[0] / lengths[1]).max(L::Scalar::from_f64(1.0));
            scratch[place(i, DIAGONAL) + lane] = stiffness[here] * shortened * shortened;
        }
    }
}

/// One register of lines in the work space.
struct Sweep<'a, R> {
    scratch: &'a mut [R],
    lane: usize,
}

impl<R: Real> Sweep<'_, R> {
    #[inline(always)]
    fn get<L: Lane<Scalar = R>>(&self, station: usize, row: usize) -> L {
        L::load(&self.scratch[place(station, row) + self.lane..])
    }
    #[inline(always)]
    fn set<L: Lane<Scalar = R>>(&mut self, station: usize, row: usize, value: L) {
        value.store(&mut self.scratch[place(station, row) + self.lane..]);
    }
    #[inline(always)]
    fn vector<L: Lane<Scalar = R>>(&self, station: usize, row: usize) -> [L; 3] {
        [self.get(station, row), self.get(station, row + 1), self.get(station, row + 2)]
    }
}

#[inline(always)]
fn dot<L: Lane>(a: [L; 3], b: [L; 3]) -> L {
    a[2].fma(b[2], a[1].fma(b[1], a[0] * b[0]))
}

/// Sets up and solves the systems of one register of lines; the corrections replace the accelerations in their rows.
#[inline(always)]
fn solve<L: Lane>(io: &Io<L::Scalar>, group: &Group, s: &mut Sweep<L::Scalar>) {
    let Params { beta } = io.params();
    let n = group.stations as usize;
    let (zero, one) = (L::new(0.0), L::new(1.0));
    let compliance =
        L::splat(L::Scalar::from_f64(1.0) / (L::Scalar::from_f64(f64::from(beta)) * io.row.dt * io.row.dt));
    for i in 0..n {
        let next = (i + 1) % n;
        let v: [L; 3] = s.vector(i, DIRECTION);
        let inverse_length = one / dot(v, v).sqrt();
        let d = [v[0] * inverse_length, v[1] * inverse_length, v[2] * inverse_length];
        let (a, b): ([L; 3], [L; 3]) = (s.vector(i, RESPONSE), s.vector(next, RESPONSE));
        let right = -dot(d, [b[0] - a[0], b[1] - a[1], b[2] - a[2]]);
        let stiffness: L = s.get(i, DIAGONAL);
        let diagonal = compliance / stiffness + s.get(i, INVERSE) + s.get(next, INVERSE);
        for (k, d) in d.into_iter().enumerate() {
            s.set(i, DIRECTION + k, d);
        }
        s.set(i, DIAGONAL, diagonal);
        s.set(i, RIGHT, right);
        s.set(i, CORNER, zero);
    }
    for i in 0..n {
        let next = (i + 1) % n;
        let (a, b): ([L; 3], [L; 3]) = (s.vector(i, DIRECTION), s.vector(next, DIRECTION));
        let inverse: L = s.get(next, INVERSE);
        s.set(i, COUPLING, -(dot(a, b) * inverse));
    }
    if group.closed == 0 {
        // no last segment
        s.set(n - 1, DIAGONAL, one);
        s.set(n - 1, RIGHT, zero);
        s.set(n - 1, COUPLING, zero);
        s.set(n.saturating_sub(2), COUPLING, zero);
    }
    eliminate::<L>(n, s);
    for i in 0..n {
        let previous = (i + n - 1) % n;
        let (a, b): ([L; 3], [L; 3]) = (s.vector(previous, DIRECTION), s.vector(i, DIRECTION));
        let (p, q): (L, L) = (s.get(previous, RIGHT), s.get(i, RIGHT));
        let inverse: L = s.get(i, INVERSE);
        for k in 0..3 {
            s.set(i, RESPONSE + k, (p * a[k] - q * b[k]) * inverse);
        }
    }
}

/// Cyclic LDLᵀ with a bordered last row; the solution replaces the right side.
#[inline(always)]
fn eliminate<L: Lane>(n: usize, s: &mut Sweep<L::Scalar>) {
    let last = n - 1;
    let corner: L = s.get(last, COUPLING);
    s.set(0, CORNER, corner);
    let mut last_diagonal: L = s.get(last, DIAGONAL);
    let mut last_right: L = s.get(last, RIGHT);
    for i in 0..last {
        let mut g: L = s.get(i, CORNER);
        if i + 1 == last {
            g = g + s.get(i, COUPLING);
            s.set(i, CORNER, g);
        }
        let inverse = L::new(1.0) / s.get(i, DIAGONAL);
        s.set(i, DIAGONAL, inverse);
        let right: L = s.get(i, RIGHT);
        let border = g * inverse;
        last_diagonal = last_diagonal - border * g;
        last_right = last_right - border * right;
        if i + 1 < last {
            let e: L = s.get(i, COUPLING);
            let l = e * inverse;
            let (d, r): (L, L) = (s.get(i + 1, DIAGONAL), s.get(i + 1, RIGHT));
            s.set(i + 1, DIAGONAL, d - l * e);
            s.set(i + 1, RIGHT, r - l * right);
            s.set(i + 1, CORNER, -(l * g));
        }
    }
    let end = last_right / last_diagonal;
    s.set(last, RIGHT, end);
    for i in (0..last).rev() {
        let mut r: L = s.get(i, RIGHT);
        if i + 1 < last {
            let e: L = s.get(i, COUPLING);
            r = r - e * s.get(i + 1, RIGHT);
        }
        let g: L = s.get(i, CORNER);
        r = r - g * end;
        let inverse: L = s.get(i, DIAGONAL);
        s.set(i, RIGHT, r * inverse);
    }
}

/// Writes the corrections of a group's nodes.
fn scatter<R: Real>(io: &Io<R>, group: &Group, scratch: &[R]) {
    let mut correction = io.scatter::<R>(slot!(&SLOTS, "correction"));
    let plane = io.scalars(slot!(&SLOTS, "inverse_mass")).len();
    let n = group.stations as usize;
    for lane in 0..group.lines as usize {
        for i in 0..n {
            for k in 0..3 {
                let node = group.first as usize + lane * n + i;
                correction.set(node + k * plane, scratch[place(i, RESPONSE + k) + lane]);
            }
        }
    }
}
