//! Contact: points of threads and nodes of yarn surfaces against the surfaces of yarns, and beams against beams.
//!
//! A scene has only the kinds of pairs that it requires, each with its own stages, and friction only if it is on, the
//! coefficient is positive and bodies can touch.
//!
//! Yarns have a closed `surface` of `face`s. Broad phase: `grid` sorts slabs of faces and beams into cells, and `candidates`
//! lists the faces near each beam and each yarn node. Narrow phase: every step `penalty` applies the forces of the listed
//! faces, the gradient of a `potential`, to the contact points, which `arc` places along beams. Points `look` at faces in
//! registers, a face in each lane, with their results in a `table`; `rub` adds damping and friction, and `press` adds the forces
//! to nodes, in sums of a `joint`. For beams on beams, `pairs` finds nearby beams, and `threads` applies the forces: `arc_offset` constructs the lines
//! of threads, and `segments` integrates along them. Forces and contact stiffness are summed as integers, so the sum is
//! independent of the order, and the forces of a pair cancel exactly.

pub mod arc;
pub mod arc_offset;
pub mod candidates;
pub mod face;
pub mod friction;
pub mod grid;
pub(crate) mod joint;
pub mod look;
pub mod memory;
pub mod pairs;
pub mod penalty;
pub mod potential;
pub mod press;
pub mod rub;
pub mod segments;
pub mod skin;
pub mod slip;
pub mod sums;
pub mod surface;
pub mod table;
pub mod threads;
pub mod tie;

use crate::kernel::interface::{Constant, constants};
use crate::kernel::lane::Real;
use bytemuck::{Pod, Zeroable};
use std::sync::atomic::{AtomicI32, AtomicU32, Ordering};

/// Constants that all contact stages share.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Params {
    /// Periods along x and y in quanta; 0 for a free scene.
    pub period: [i32; 2],
    /// Cells of the grid along x and y.
    pub cells: [u32; 2],
    /// Items that a cell can hold.
    pub capacity: u32,
    /// Capacity of a carrier's list of faces, and number of bodies that a point can touch.
    pub faces: u32,
    pub slots: u32,
    /// Slots per beam.
    pub beam_slots: u32,
    /// Number of yarn slabs among the grid's items; beams follow them.
    pub slabs: u32,
    /// Numbers stored per slot of a beam, see [`slot_state`].
    pub state: u32,
    /// Lower corner of the grid and size of its cells, mm.
    pub origin: [f32; 2],
    pub cell: [f32; 2],
    /// Contact skin (Verlet skin): distance beyond touching at which pairs become candidates, mm.
    pub skin: f32,
    /// Friction coefficient.
    pub friction: f32,
    /// Ratio of tangential to normal penalty.
    pub tangential: f32,
    /// Damping ratio: share of critical damping.
    pub damping: f32,
    /// Quantum of force, N, and of stiffness, N/mm.
    pub force_quantum: f32,
    pub stiffness_quantum: f32,
    /// Radius of threads, mm.
    pub thread_radius: f32,
    /// Penalty of threads on threads per length, N/mm².
    pub thread_thread: f32,
    /// Arc length within which beams of one thread ignore each other, mm.
    pub self_arc: f32,
    /// Largest penetration of a surface node that is still pushed out, mm.
    pub depth: f32,
    /// Relative motion of bodies along an axis that triggers a new candidate search, quanta.
    pub apart: u32,
}

/// Numbers per slot of a beam: normal force, N, or minus the guaranteed remaining gap, mm; with friction also the elastic
/// tangential displacement, mm (3).
pub const fn slot_state(friction: bool) -> usize {
    if friction { 4 } else { 1 }
}

/// State of the candidates of a carrier or beam: never searched, from the last full search, or from a later partial search.
pub mod found {
    pub const NEVER: u32 = 0;
    pub const WITH_ALL: u32 = 1;
    pub const SINCE: u32 = 2;
}

/// Constants of candidates and sums shared with the twins.
pub const CONSTANTS: [Constant; 5] = constants![uint: WITH_ALL = found::WITH_ALL, SINCE = found::SINCE, NEVER = found::NEVER, EMPTY; scalar: MOST_QUANTA];

/// No candidate in a slot.
pub const EMPTY: u32 = u32::MAX;

/// Places in the status buffer.
pub mod status {
    use crate::kernel::interface::{Constant, constants};
    use std::ops::Range;

    /// Flags below.
    pub const FLAGS: usize = 0;
    /// Largest displacement since the last search, bits of an f32, mm.
    pub const TRAVEL: usize = 1;
    /// Largest speed of a node, bits of an f32, mm/s.
    pub const SPEED: usize = 2;
    /// Number of carriers and beams whose candidates were searched.
    pub const SEARCHED: usize = 3;
    /// Largest penetration of a thread into a yarn, of yarns, of threads; bits of an f32, mm.
    pub const PENETRATION: [usize; 3] = [4, 5, 6];
    /// These penetrations, mm.
    pub fn penetration(status: &[u32]) -> [f64; 3] {
        PENETRATION.map(|place| f64::from(f32::from_bits(status[place])))
    }
    /// Largest contact stiffness over mass, bits of an f32, 1/s².
    pub const CONTACT_RATE: usize = 7;
    /// Nodes and beams in contact.
    pub const TOUCHING: [usize; 3] = [8, 9, 10];
    /// A node whose contact force overflowed its integer.
    pub const CULPRIT: usize = 11;
    /// Largest speed of a node of a yarn, and behind it of a thread, in a step; bits of an f32, mm/s. Steps take turns at three
    /// places: a step reads that of the step before, raises its own, and clears that of the next.
    pub const FASTEST: [usize; 3] = [12, 14, 16];
    pub const NOW: usize = 0;
    pub const NEXT: usize = 1;
    pub const BEFORE: usize = 2;
    /// The places of a step, of the next, or of the step before.
    #[inline(always)]
    pub fn turn(turn: i32, from: usize) -> usize {
        FASTEST[(turn as usize + from) % FASTEST.len()]
    }
    /// What counts from one search to the next, and from one look at energies to the next.
    pub const SINCE_SEARCH: Range<usize> = FLAGS..PENETRATION[0];
    pub const SINCE_LOOK: Range<usize> = PENETRATION[0]..CULPRIT;
    /// Size of the buffer.
    pub const SIZE: usize = 18;

    /// A cell of the grid is full.
    pub const CELL_FULL: u32 = 1;
    /// The list of a carrier, or the slots of a point or beam, are full.
    pub const SLOTS_FULL: u32 = 2;
    /// A contact force overflowed its integer.
    pub const FORCE_RANGE: u32 = 4;
    /// A position is not a number.
    pub const NOT_FINITE: u32 = 8;
    /// A displacement left the range of its quanta.
    pub const OUT_OF_RANGE: u32 = 16;

    /// Status constants shared with the twins; places that exist per kind are given for the first kind.
    pub const CONSTANTS: [Constant; 17] = constants![
        uint: FLAGS, TRAVEL, PENETRATION = PENETRATION[0], CONTACT_RATE, TOUCHING = TOUCHING[0], SPEED, CULPRIT, SEARCHED,
            FASTEST = FASTEST[0], NOW, NEXT, BEFORE, CELL_FULL, SLOTS_FULL, FORCE_RANGE, NOT_FINITE, OUT_OF_RANGE
    ];
}

/// Key of a candidate: the touched body or beam and its lateral image, −8 to 7 periods along x and y.
#[inline(always)]
pub fn key(body: usize, image: [i32; 2]) -> u32 {
    (body as u32) << 8 | ((image[0] + 8) as u32 & 15) << 4 | ((image[1] + 8) as u32 & 15)
}

/// Body and image of a key.
#[inline(always)]
pub fn of_key(key: u32) -> (usize, [i32; 2]) {
    ((key >> 8) as usize, [(key >> 4 & 15) as i32 - 8, (key & 15) as i32 - 8])
}

/// Shift of an image, in quanta along x and y.
#[inline(always)]
pub fn shift<const PERIODIC: bool>(period: [i32; 2], image: [i32; 2]) -> [i32; 2] {
    if PERIODIC { [image[0].wrapping_mul(period[0]), image[1].wrapping_mul(period[1])] } else { [0; 2] }
}

/// Upper bound of a force component of a pair, quanta.
const MOST_QUANTA: f64 = (1 << 27) as f64;

/// Adds a force in quanta to a node.
#[inline(always)]
pub fn add_force(forces: &[AtomicI32], node: usize, quanta: [i32; 3]) {
    let plane = forces.len() / 3;
    for (k, quanta) in quanta.into_iter().enumerate() {
        forces[node + k * plane].fetch_add(quanta, Ordering::Relaxed);
    }
}

/// Whether a force component fits its integer; else records the node.
#[inline(always)]
pub(crate) fn is_in_range<R: Real>(status: &[AtomicU32], quanta: R, node: usize) -> bool {
    let fits = quanta.abs() < R::from_f64(MOST_QUANTA);
    if !fits {
        status[status::FLAGS].fetch_or(status::FORCE_RANGE, Ordering::Relaxed);
        status[status::CULPRIT].store(node as u32, Ordering::Relaxed);
    }
    fits
}

/// Adds a force to one node and, by weights, its opposite to others: as integers, so that the sum is exactly zero.
#[inline(always)]
pub fn add_pair<R: Real, const N: usize, const M: usize>(
    forces: &[AtomicI32],
    status: &[AtomicU32],
    force: [R; 3],
    quantum: R,
    to: [(usize, R); N],
    from: [(usize, R); M],
) {
    let plane = forces.len() / 3;
    for (k, force) in force.into_iter().enumerate() {
        let quanta = force / quantum;
        if !is_in_range(status, quanta, to[0].0) {
            return;
        }
        let mut rest = quanta.to_i32();
        let mut back = rest;
        for (i, (node, weight)) in to.into_iter().enumerate() {
            let part = if i + 1 == N { rest } else { (quanta * weight).to_i32() };
            rest -= part;
            forces[node + k * plane].fetch_add(part, Ordering::Relaxed);
        }
        for (i, (node, weight)) in from.into_iter().enumerate() {
            let part = if i + 1 == M { back } else { (quanta * weight).to_i32() };
            back -= part;
            forces[node + k * plane].fetch_sub(part, Ordering::Relaxed);
        }
    }
}

/// Adds stiffness to nodes by weights.
#[inline(always)]
pub fn add_stiffness<R: Real>(to: &[AtomicI32], stiffness: R, quantum: R, nodes: impl IntoIterator<Item = (usize, R)>) {
    let quanta = stiffness / quantum;
    for (node, weight) in nodes {
        to[node].fetch_add((quanta * weight.abs()).to_i32(), Ordering::Relaxed);
    }
}
