//! Pairs of nearby beams: found by the grid, each with the line pieces of its beams.
//!
//! In a pair of beams, the beam with the lower number integrates over the other. The pairs of a beam with consecutive beams of
//! one thread form a chain: each subtracts the joint with the previous beam if that beam is in the chain too.
//!
//! Two points of a thread bent to a circle of radius ρ are 2ρ sin(a/2ρ) apart, with a the arc between them. No bend is tighter
//! than ρ = r, where the inside folds, so points within an arc of π r, half a turn of the tightest loop, never touch. Beams of
//! one thread whose nearer ends are closer than this along the thread form no pair.

use super::arc_offset::{self, OffsetLines, Piece};
use super::grid::{self, BOX, Cells, Filled, MOTION, absolute, cells_of, has_moved, inverse, pull_back};
use super::segments::{self, Segments};
use super::{EMPTY, Params, found, key, of_key, shift, status};
use crate::elements::beam2;
use crate::kernel::buffer::Kind::{Int, Scalar, Uint};
use crate::kernel::interface::{Slot, joined, slot};
use crate::kernel::io::Io;
use crate::kernel::lane::{Lane, Real};
use crate::kernel::node::{Displacements, Lattice};
use crate::kernel::position::{self, QUANTUM};
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::Kernel;
use crate::kernel::vector::{Vector, add, apply, sub};
use std::ops::Range;
use std::sync::atomic::Ordering;

/// Beam slots that both the search and the forces read first.
pub const READS: [Slot; 7] = [
    Slot::read("ends", Uint),
    Slot::read("beams", Scalar),
    Slot::read("reference", Int),
    Slot::read("quanta", Int),
    Slot::read("remainder", Scalar),
    // see [`super::arc_offset`]
    Slot::read("neighbours", Uint),
    Slot::read("shares", Scalar),
];

/// The slots of [`Pairs`].
const PAIRS: [Slot; 14] = joined(
    &READS,
    &[
        Slot::read("counts", Uint),
        Slot::read("lists", Uint),
        Slot::read("boxes", Scalar),
        Slot::row_of_plan("keys", Uint),
        Slot::row_of_plan("states", Scalar),
        Slot::row("found_when", Uint, 1),
        Slot::atomic("status", Uint),
    ],
);

/// Finds pairs of beams.
pub struct Pairs<const PERIODIC: bool>;

/// Beam data that the search and the forces read.
pub struct Scene<'a, R, const PERIODIC: bool> {
    pub ends: &'a [u32],
    pub beams: &'a [R],
    pub offsets: OffsetLines<'a, R>,
    pub reference: Lattice<'a>,
    pub displacement: Displacements<'a, R>,
    pub gradient: &'a [[R; 3]; 3],
    pub period: [i32; 2],
    pub self_arc: R,
}

impl<'a, R: Real, const PERIODIC: bool> Scene<'a, R, PERIODIC> {
    #[inline(always)]
    pub fn new(io: &'a Io<R>, params: &Params) -> Self {
        Self {
            ends: io.uints(slot!(&READS, "ends")),
            beams: io.scalars(slot!(&READS, "beams")),
            offsets: OffsetLines {
                neighbours: io.uints(slot!(&READS, "neighbours")),
                shares: io.scalars(slot!(&READS, "shares")),
            },
            reference: Lattice::new(io, slot!(&READS, "reference")),
            displacement: Displacements::new(io, slot!(&READS, "quanta"), slot!(&READS, "remainder")),
            gradient: &io.row.gradient,
            period: params.period,
            self_arc: R::from_f64(f64::from(params.self_arc)),
        }
    }

    /// The piece of the line of a beam.
    #[inline(always)]
    pub fn piece(&self, beam: usize) -> Piece<R> {
        self.offsets.piece::<PERIODIC>(self.beams, self.ends, beam, &self.displacement, self.gradient)
    }

    /// The pieces of the known beam `a` and of `b` in an image, in the reference and current states.
    #[inline(always)]
    pub fn segments(&self, a: usize, own: &Piece<R>, b: usize, image: [i32; 2]) -> [Segments<R>; 2] {
        let other = self.piece(b);
        let (a, b) = (self.ends[2 * a] as usize, self.ends[2 * b] as usize);
        let rest: Vector<R> = self.reference.between(b, a, shift::<PERIODIC>(self.period, image));
        let affine = if PERIODIC { add(rest, apply(self.gradient, rest)) } else { rest };
        let now = add(affine, self.displacement.between(b, a));
        [between(own.rest, rest, other.rest), between(own.now, now, other.now)]
    }

    /// Whether beam `a` subtracts the joint at the first end of `b`: it does if it also forms a pair with the beam before `b`.
    #[inline(always)]
    pub fn owns(&self, a: usize, b: usize, image: [i32; 2]) -> bool {
        let Some((before, image)) = self.offsets.before(b, image) else { return false };
        before > a && !self.offsets.are_near(a, before, image, self.self_arc)
    }
}

/// The pieces `own` and `other`, with the vector from the first node of one beam to that of the other.
#[inline(always)]
fn between<R: Real>(own: [Vector<R>; 2], apart: Vector<R>, other: [Vector<R>; 2]) -> Segments<R> {
    Segments { along: sub(own[1], own[0]), start: add(apart, sub(other[0], own[0])), other: sub(other[1], other[0]) }
}

/// The search data for the neighbours of a beam.
struct Search<'a, R, const PERIODIC: bool> {
    scene: Scene<'a, R, PERIODIC>,
    grid: Filled<'a>,
    boxes: &'a [R],
    inverse: [[R; 2]; 2],
    reach: R,
}

impl<R: Real, const PERIODIC: bool> Search<'_, R, PERIODIC> {
    /// The cells of a beam's piece; `None` if its position is not finite.
    #[inline(always)]
    fn cells(&self, io: &Io<R>, beam: usize, piece: &Piece<R>) -> Option<Cells> {
        let (node, _) = absolute::<Pairs<PERIODIC>, _>(io, &self.inverse, self.scene.ends[2 * beam] as usize);
        if !(node[0].is_finite() && node[1].is_finite()) {
            return None;
        }
        let (first, second) = (pull_back(&self.inverse, piece.now[0]), pull_back(&self.inverse, piece.now[1]));
        let (a, b) = ([node[0] + first[0], node[1] + first[1]], [node[0] + second[0], node[1] + second[1]]);
        let (low, high) = ([a[0].min(b[0]), a[1].min(b[1])], [a[0].max(b[0]), a[1].max(b[1])]);
        Some(cells_of::<_, PERIODIC>(&self.grid.params, low, high))
    }

    /// Whether a beam of a higher number in these cells has moved relative to this one since the last full search; `None` if a
    /// cell is full.
    #[inline(always)]
    fn has_moved(&self, beam: usize, [xs, ys]: Cells) -> Option<bool> {
        let item = self.grid.params.slabs + beam as u32;
        let own = &self.boxes[BOX * item as usize..][..BOX];
        let least = [own[MOTION], own[MOTION + 1], own[MOTION + 2]];
        let greatest = [own[MOTION + 3], own[MOTION + 4], own[MOTION + 5]];
        let apart = R::from_i32(self.grid.params.apart as i32);
        let mut moved = false;
        for y in ys.0..=ys.1 {
            for x in xs.0..=xs.1 {
                for &near in self.grid.items(x, y)? {
                    if moved {
                        break;
                    }
                    let bounds = &self.boxes[BOX * near as usize..][..BOX];
                    moved = near > item && has_moved(bounds, least, greatest, apart);
                }
            }
        }
        Some(moved)
    }

    /// The image of an item nearest to a beam.
    #[inline(always)]
    fn image(&self, beam: usize, near: usize) -> [i32; 2] {
        let item = self.grid.params.slabs as usize + beam;
        let mut image = [0; 2];
        for k in 0..2 {
            if PERIODIC && self.grid.params.period[k] != 0 {
                let apart = self.boxes[BOX * item + k] - self.boxes[BOX * near + k];
                image[k] = (apart / (R::from_i32(self.grid.params.period[k]) * R::from_f64(QUANTUM))).to_i32();
            }
        }
        image
    }

    /// Whether a pair is within reach.
    #[inline(always)]
    fn is_near(&self, beam: usize, piece: &Piece<R>, other: usize, image: [i32; 2]) -> bool {
        let [_, now] = self.scene.segments(beam, piece, other, image);
        now.distance() < self.reach
    }

    /// Removes pairs out of reach from a beam's list; returns the number left.
    #[inline(always)]
    fn keep(&self, beam: usize, piece: &Piece<R>, keys: &mut [u32], states: &mut [R]) -> usize {
        let size = self.grid.params.state as usize;
        let mut count = 0;
        for slot in 0..keys.len() {
            let known = std::mem::replace(&mut keys[slot], EMPTY);
            if known == EMPTY {
                break;
            }
            let (other, image) = of_key(known);
            if self.is_near(beam, piece, other, image) {
                keys[count] = known;
                states.copy_within(size * slot..size * (slot + 1), size * count);
                count += 1;
            }
        }
        count
    }

    /// Inserts pairs within reach into a beam's list of `count`, in ascending order for any cell order; `false` if there is no
    /// room.
    #[inline(always)]
    fn fill(
        &self,
        beam: usize,
        piece: &Piece<R>,
        [xs, ys]: Cells,
        keys: &mut [u32],
        states: &mut [R],
        mut count: usize,
    ) -> bool {
        let size = self.grid.params.state as usize;
        for y in ys.0..=ys.1 {
            for x in xs.0..=xs.1 {
                for &near in self.grid.items(x, y).unwrap_or_default() {
                    if near <= self.grid.params.slabs + beam as u32 {
                        continue;
                    }
                    let other = (near - self.grid.params.slabs) as usize;
                    let image = self.image(beam, near as usize);
                    let key = key(other, image);
                    let mut place = 0;
                    while place < count && keys[place] < key {
                        place += 1;
                    }
                    let is_known = place < count && keys[place] == key;
                    if is_known
                        || self.scene.offsets.are_near(beam, other, image, self.scene.self_arc)
                        || !self.is_near(beam, piece, other, image)
                    {
                        continue;
                    }
                    if count == keys.len() {
                        return false;
                    }
                    keys.copy_within(place..count, place + 1);
                    states.copy_within(size * place..size * count, size * (place + 1));
                    keys[place] = key;
                    states[size * place..][..size].fill(R::from_f64(0.0));
                    count += 1;
                }
            }
        }
        true
    }
}

impl<const PERIODIC: bool> Kernel for Pairs<PERIODIC> {
    const SHADER: Shader = Shader {
        defines: &[when(PERIODIC, "PERIODIC")],
        constants: &[
            &position::CONSTANTS,
            &beam2::CONSTANTS,
            &status::CONSTANTS,
            &super::CONSTANTS,
            &grid::CONSTANTS,
            &arc_offset::CONSTANTS,
            &segments::CONSTANTS,
        ],
        ..Shader::new("contact/pairs", "pairs")
    };
    const SLOTS: &'static [Slot] = &PAIRS;
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let params: Params = io.params();
        let search = Search::<_, PERIODIC> {
            scene: Scene::new(io, &params),
            grid: Filled { params, counts: io.uints(slot!(&PAIRS, "counts")), lists: io.uints(slot!(&PAIRS, "lists")) },
            boxes: io.scalars(slot!(&PAIRS, "boxes")),
            inverse: inverse::<_, PERIODIC>(&io.row.gradient),
            reach: L::Scalar::from_f64(f64::from(2.0 * params.thread_radius + params.skin)),
        };
        let mut keys = io.own::<u32>(slot!(&PAIRS, "keys"));
        let mut states = io.own::<L::Scalar>(slot!(&PAIRS, "states"));
        let mut when = io.own::<u32>(slot!(&PAIRS, "found_when"));
        let flags = io.atomic_uints(slot!(&PAIRS, "status"));
        for beam in items {
            let piece = search.scene.piece(beam);
            let Some(cells) = search.cells(io, beam, &piece) else {
                flags[status::FLAGS].fetch_or(status::NOT_FINITE, Ordering::Relaxed);
                continue;
            };
            let when = when.at(0, beam);
            // an overflow keeps the known pairs and triggers a new search with larger tables
            let Some(moved) = search.has_moved(beam, cells) else { continue };
            if !moved && *when == found::WITH_ALL {
                continue;
            }
            let (keys, states) = (keys.item(0, beam), states.item(0, beam));
            let count = search.keep(beam, &piece, keys, states);
            if !search.fill(beam, &piece, cells, keys, states, count) {
                flags[status::FLAGS].fetch_or(status::SLOTS_FULL, Ordering::Relaxed);
                continue;
            }
            *when = if *when == found::NEVER { found::WITH_ALL } else { found::SINCE };
            flags[status::SEARCHED].fetch_add(1, Ordering::Relaxed);
        }
    }
}
