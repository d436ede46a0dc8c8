//! Broad-phase candidates: for each carrier of contact points, the faces of other bodies whose box lies within reach of the box
//! of its points.
//!
//! The grid gives the slabs near a carrier, and the boxes of their faces relative to the first node of the slab. The position of
//! this node relative to the carrier, in the image of the slab, therefore places all faces of the slab at once.
//!
//! A list is sorted by body and lateral image, then by face, so it is independent of the order of items in the grid, and the
//! faces of a body are consecutive. The list holds no state except the number of times it was made: contact state is stored per
//! body. Carriers keep their lists if nothing near them has moved relative to them (see [`super::skin`]).

use super::grid::{
    BOX, FACE_BOXES, Moved, ROUNDING, SLAB, SLAB_FACES, absolute, cell_index, cells, has_moved, inverse, motion,
    pull_back, stretch,
};
use super::surface::{self, CARRIED, FACE, POINT, Surface, entry, of_coded};
use super::{EMPTY, Params, found, grid, of_key, status};
use crate::kernel::buffer::Kind::{Int, Scalar, Uint};
use crate::kernel::interface::{Constant, Slot, constants, slot};
use crate::kernel::lane::{Lane, Real};
use crate::kernel::node::{Displacements, Lattice};
use crate::kernel::position::{self, QUANTUM};
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::{Io, Kernel};
use crate::kernel::vector::Vector;
use std::ops::Range;
use std::sync::atomic::Ordering;

/// Integers per carrier: its first point, number of points, and its own body, or [`EMPTY`] for a thread.
pub const CARRIER: usize = 3;
/// Integers before the entries of a list, and before the keys of the bodies that a point touches: how often the list was made,
/// and how often it had been made when the point last read it.
pub const MADE: usize = 1;
/// Constants of lists and carriers shared with the twins.
pub const CONSTANTS: [Constant; 2] = constants![uint: CARRIER, MADE];

const SLOTS: [Slot; 16] = [
    Slot::read("carriers", Uint),
    Slot::read("nodes", Uint),
    Slot::read("points", Scalar),
    Slot::read("slabs", Uint),
    Slot::read("faces", Uint),
    Slot::read("reference", Int),
    Slot::read("quanta", Int),
    Slot::read("remainder", Scalar),
    Slot::read("counts", Uint),
    Slot::read("lists", Uint),
    Slot::read("boxes", Scalar),
    Slot::read("face_boxes", Scalar),
    // displacements at the last full search, in quanta
    Slot::read("before", Int),
    Slot::row_of_plan("near", Uint),
    // see [`found`]
    Slot::row("found_when", Uint, 1),
    Slot::atomic("status", Uint),
];

/// The search, for beams of threads (`THREAD`) or for nodes of yarn surfaces.
pub struct Candidates<const THREAD: bool, const PERIODIC: bool>;

/// Bounds of the motion of a carrier's nodes since the last full search, quanta.
#[inline(always)]
fn moved<K: Kernel, R: Real, const N: usize>(io: &Io<R>, coded: [u32; N]) -> ([R; 3], [R; 3]) {
    let mut moved = Moved::none();
    coded.iter().for_each(|node| moved.add(motion::<K, _>(io, of_coded(*node).0)));
    moved.bounds()
}

/// The extent of the points of a carrier.
struct Place<R> {
    /// Lowest and highest coordinates relative to the carrier's first node, mm.
    low: Vector<R>,
    high: Vector<R>,
    /// Centre and half sizes in the pulled-back plane, mm, and lowest and highest z, mm.
    middle: [R; 2],
    half: [R; 2],
    heights: [R; 2],
}

impl<R: Real> Place<R> {
    /// The box of points at `offsets` from a node at `base` in the pulled-back plane and at a height.
    #[inline(always)]
    fn new(offsets: impl Iterator<Item = Vector<R>>, (base, height): ([R; 2], R), inverse: &[[R; 2]; 2]) -> Self {
        let half = R::from_f64(0.5);
        let far = R::from_f64(1e9);
        let (mut low, mut high) = ([far; 3], [-far; 3]);
        let (mut from, mut to) = ([far; 2], [-far; 2]);
        for offset in offsets {
            for k in 0..3 {
                (low[k], high[k]) = (low[k].min(offset[k]), high[k].max(offset[k]));
            }
            let back = pull_back(inverse, offset);
            for k in 0..2 {
                (from[k], to[k]) = (from[k].min(back[k]), to[k].max(back[k]));
            }
        }
        Self {
            low,
            high,
            middle: [0, 1].map(|k| base[k] + half * (from[k] + to[k])),
            half: [0, 1].map(|k| half * (to[k] - from[k])),
            heights: [height + low[2], height + high[2]],
        }
    }

    /// The image of a slab whose box is within `reach` (mm), if any; `stretch` converts distances to the pulled-back plane.
    #[inline(always)]
    fn image_within(&self, bounds: &[R], reach: R, stretch: [R; 2], period: [R; 2]) -> Option<[i32; 2]> {
        if self.heights[1] < bounds[2] - reach || self.heights[0] > bounds[3] + reach {
            return None;
        }
        let mut image = [0; 2];
        for k in 0..2 {
            let from = self.middle[k] - bounds[k];
            let mut rest = from;
            if period[k] > R::from_f64(0.0) {
                image[k] = (from / period[k]).to_i32();
                rest = from - R::from_i32(image[k]) * period[k];
            }
            if rest.abs() > self.half[k] + bounds[4 + k] + reach * stretch[k] {
                return None;
            }
        }
        Some(image)
    }

    /// Whether the box of each face of a slab is within `reach`, mm: their [`FACE_BOXES`], and the slab's first node relative to
    /// the carrier's, mm.
    #[inline(always)]
    fn are_near(&self, boxes: &[R], offset: Vector<R>, reach: R) -> [bool; SLAB_FACES] {
        let mut squares = [R::from_f64(0.0); SLAB_FACES];
        for k in 0..3 {
            let (from, to) = (self.low[k] - offset[k], self.high[k] - offset[k]);
            let (low, high) = (&boxes[SLAB_FACES * k..][..SLAB_FACES], &boxes[SLAB_FACES * (3 + k)..][..SLAB_FACES]);
            for face in 0..SLAB_FACES {
                let gap = (low[face] - to).max(from - high[face]).max(R::from_f64(0.0));
                squares[face] = squares[face] + gap * gap;
            }
        }
        let most = reach + R::from_f64(ROUNDING);
        squares.map(|square| square <= most * most)
    }
}

/// The list of a carrier: entries ordered by body.
struct List<'a, R, const PERIODIC: bool> {
    entries: &'a mut [u32],
    count: usize,
    full: bool,
    surface: &'a Surface<'a, R, PERIODIC>,
}

impl<R: Real, const PERIODIC: bool> List<'_, R, PERIODIC> {
    /// The body of an entry, as a key.
    #[inline(always)]
    fn body(&self, entry: u32) -> u32 {
        let (face, image) = of_key(entry);
        self.surface.body(face, image)
    }

    /// Adds an entry of a body, given as a key; `false` if the list already has it or is full.
    #[inline(always)]
    fn add(&mut self, body: u32, entry: u32) -> bool {
        // faces are numbered body by body: without images, entries are in the order of bodies
        let is_before =
            |known: &u32| if PERIODIC { (self.body(*known), *known) < (body, entry) } else { *known < entry };
        let place = self.entries[..self.count].partition_point(is_before);
        if self.entries[..self.count].get(place) == Some(&entry) {
            return false;
        }
        if self.count == self.entries.len() {
            self.full = true;
            return false;
        }
        self.entries.copy_within(place..self.count, place + 1);
        self.entries[place] = entry;
        self.count += 1;
        true
    }

    /// Number of bodies in the list.
    #[inline(always)]
    fn bodies(&self) -> usize {
        let (mut bodies, mut last) = (0, EMPTY);
        for &entry in &self.entries[..self.count] {
            let body = self.body(entry);
            bodies += usize::from(body != last);
            last = body;
        }
        bodies
    }
}

impl<const THREAD: bool, const PERIODIC: bool> Kernel for Candidates<THREAD, PERIODIC> {
    const SHADER: Shader = Shader {
        defines: &[when(THREAD, "THREAD"), when(PERIODIC, "PERIODIC")],
        constants: &[
            &position::CONSTANTS,
            &status::CONSTANTS,
            &super::CONSTANTS,
            &surface::shared(THREAD),
            &grid::CONSTANTS,
            &CONSTANTS,
        ],
        ..Shader::new("contact/candidates", "candidates")
    };
    const SLOTS: &'static [Slot] = &SLOTS;
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        if THREAD { run::<Self, _, 4, PERIODIC>(io, items) } else { run::<Self, _, 1, PERIODIC>(io, items) }
    }
}

/// Makes the lists of carriers with `N` nodes.
#[inline(always)]
fn run<K: Kernel, R: Real, const N: usize, const PERIODIC: bool>(io: &Io<R>, items: Range<usize>) {
    let params: Params = io.params();
    let surface = Surface::<_, PERIODIC> {
        faces: io.uints(slot!(&SLOTS, "faces")),
        reference: Lattice::new(io, slot!(&SLOTS, "reference")),
        displacement: Displacements::new(io, slot!(&SLOTS, "quanta"), slot!(&SLOTS, "remainder")),
        gradient: &io.row.gradient,
        period: params.period,
    };
    let inverse = inverse::<_, PERIODIC>(&io.row.gradient);
    let stretch = stretch(&inverse);
    let (carriers, slabs) = (io.uints(slot!(&SLOTS, "carriers")), io.uints(slot!(&SLOTS, "slabs")));
    let (nodes, points) = (io.uints(slot!(&SLOTS, "nodes")), io.scalars(slot!(&SLOTS, "points")));
    let (counts, lists) = (io.uints(slot!(&SLOTS, "counts")), io.uints(slot!(&SLOTS, "lists")));
    let (boxes, face_boxes) = (io.scalars(slot!(&SLOTS, "boxes")), io.scalars(slot!(&SLOTS, "face_boxes")));
    let mut near = io.own::<u32>(slot!(&SLOTS, "near"));
    let mut when = io.own::<u32>(slot!(&SLOTS, "found_when"));
    let flags = io.atomic_uints(slot!(&SLOTS, "status"));
    let period = params.period.map(|p| if PERIODIC { R::from_i32(p) * R::from_f64(QUANTUM) } else { R::from_f64(0.0) });
    let apart = R::from_i32(params.apart as i32);
    for item in items {
        let carrier = &carriers[CARRIER * item..][..CARRIER];
        let (first, count, own) = (carrier[0] as usize, carrier[1] as usize, carrier[2]);
        let coded: [u32; N] = std::array::from_fn(|a| nodes[CARRIED * first + a]);
        let base = of_coded(coded[0]).0;
        let reach = points[POINT * first + 5] + R::from_f64(f64::from(params.skin));
        let offsets = (first..first + count).map(|point| {
            let weights: [R; N] = std::array::from_fn(|a| points[POINT * point + a]);
            surface.point(coded, weights).1
        });
        let place = Place::new(offsets, absolute::<K, _>(io, &inverse, base), &inverse);
        if !(place.middle[0].is_finite() && place.middle[1].is_finite() && place.heights[0].is_finite()) {
            flags[status::FLAGS].fetch_or(status::NOT_FINITE, Ordering::Relaxed);
            continue;
        }
        let range = |k: usize| {
            cells::<_, PERIODIC>(&params, k, place.middle[k] - place.half[k], place.middle[k] + place.half[k])
        };
        let ((x0, x1), (y0, y1)) = (range(0), range(1));
        let cells = (y0..=y1).flat_map(|y| (x0..=x1).map(move |x| cell_index(&params, x, y)));
        // an overflow triggers a new search with larger tables
        if cells.clone().any(|cell| counts[cell] > params.capacity) {
            continue;
        }
        // slabs in the cells of the carrier; one may come several times
        let around = cells.flat_map(|cell| &lists[cell * params.capacity as usize..][..counts[cell] as usize]);
        let around = around.filter(|near| **near < params.slabs).map(|near| *near as usize);
        // the image of a slab of another body within reach
        let image_of = |slab: usize| {
            let image = place.image_within(&boxes[BOX * slab..][..BOX], reach, stretch, period);
            image.filter(|_| surface.marks(slabs[SLAB * slab] as usize) >> 10 != own)
        };
        let when = when.at(0, item);
        if *when == found::WITH_ALL {
            let (least, greatest) = moved::<K, _, N>(io, coded);
            let moving = |slab: &usize| has_moved(&boxes[BOX * *slab..][..BOX], least, greatest, apart);
            if !around.clone().filter(moving).any(|slab| image_of(slab).is_some()) {
                continue;
            }
        }
        let (made, entries) = near.item(0, item).split_at_mut(MADE);
        let mut list = List { entries, count: 0, full: false, surface: &surface };
        for slab in around {
            let Some(image) = image_of(slab) else { continue };
            let (first, count) = (slabs[SLAB * slab] as usize, slabs[SLAB * slab + 1] as usize);
            let origin = of_coded(surface.faces[FACE * first]).0;
            let offset = surface.from_node(origin, image, base).1;
            let are_near = place.are_near(&face_boxes[FACE_BOXES * slab..][..FACE_BOXES], offset, reach);
            let body = surface.body(first, image);
            for face in 0..count {
                // a slab with a known face was in an earlier cell, too
                if are_near[face] && !list.add(body, entry(first + face, image)) {
                    break;
                }
            }
        }
        if list.full || list.bodies() > params.slots as usize {
            *when = found::NEVER;
            flags[status::FLAGS].fetch_or(status::SLOTS_FULL, Ordering::Relaxed);
            continue;
        }
        let used = list.count;
        entries[used..].fill(EMPTY);
        made[0] = made[0].wrapping_add(1);
        *when = if *when == found::NEVER { found::WITH_ALL } else { found::SINCE };
        flags[status::SEARCHED].fetch_add(1, Ordering::Relaxed);
    }
}
