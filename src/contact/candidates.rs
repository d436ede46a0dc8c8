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
    BOX, Cells, FACE_BOXES, Filled, Motion, Moved, ROUNDING, SLAB, SLAB_FACES, absolute, cells_of, has_moved, inverse,
    pull_back, stretch,
};
use super::surface::{self, CARRIED, FACE, POINT, Surface, entry, of_coded};
use super::{EMPTY, Params, found, grid, of_key, status};
use crate::kernel::buffer::Kind::{Int, Scalar, Uint};
use crate::kernel::interface::{Constant, Slot, constants, slot};
use crate::kernel::io::Io;
use crate::kernel::lane::{Lane, Real};
use crate::kernel::node::{Displacements, Lattice};
use crate::kernel::position::{self, QUANTUM};
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::Kernel;
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
fn moved<R: Real, const N: usize>(motion: &Motion<R>, coded: &[u32; N]) -> ([R; 3], [R; 3]) {
    let mut moved = Moved::none();
    for node in coded {
        moved.add(motion, of_coded(*node).0);
    }
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
    /// The box of points carried by coded nodes, given by their rows of [`POINT`] numbers; the first node is at `base` in the
    /// pulled-back plane and at a height.
    #[inline(always)]
    fn new<const N: usize, const PERIODIC: bool>(
        surface: &Surface<R, PERIODIC>,
        coded: [u32; N],
        points: &[R],
        (base, height): ([R; 2], R),
        inverse: &[[R; 2]; 2],
    ) -> Self {
        let half = R::from_f64(0.5);
        let far = R::from_f64(1e9);
        let (mut low, mut high) = ([far; 3], [-far; 3]);
        let (mut from, mut to) = ([far; 2], [-far; 2]);
        for point in 0..points.len() / POINT {
            let mut weights = [half; N];
            weights.copy_from_slice(&points[POINT * point..][..N]);
            let offset = surface.point(coded, weights).1;
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
            middle: [base[0] + half * (from[0] + to[0]), base[1] + half * (from[1] + to[1])],
            half: [half * (to[0] - from[0]), half * (to[1] - from[1])],
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
        let mut are_near = [false; SLAB_FACES];
        for face in 0..SLAB_FACES {
            are_near[face] = squares[face] <= most * most;
        }
        are_near
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

/// What the carriers of a chunk read.
struct Search<'a, R, const PERIODIC: bool> {
    surface: Surface<'a, R, PERIODIC>,
    slabs: &'a [u32],
    grid: Filled<'a>,
    boxes: &'a [R],
    face_boxes: &'a [R],
    stretch: [R; 2],
    /// Periods, mm; 0 for a free scene.
    period: [R; 2],
}

/// A carrier: the extent of its points, its first node, the reach of its points, mm, and its own body.
struct Carrier<R> {
    place: Place<R>,
    base: usize,
    reach: R,
    own: u32,
}

impl<R: Real, const PERIODIC: bool> Search<'_, R, PERIODIC> {
    /// Whether a cell is full.
    #[inline(always)]
    fn overflows(&self, [xs, ys]: Cells) -> bool {
        for y in ys.0..=ys.1 {
            for x in xs.0..=xs.1 {
                if self.grid.items(x, y).is_none() {
                    return true;
                }
            }
        }
        false
    }

    /// The image of a slab of another body within reach of a carrier.
    #[inline(always)]
    fn image_of(&self, carrier: &Carrier<R>, slab: usize) -> Option<[i32; 2]> {
        let bounds = &self.boxes[BOX * slab..][..BOX];
        let image = carrier.place.image_within(bounds, carrier.reach, self.stretch, self.period)?;
        let is_own = self.surface.marks(self.slabs[SLAB * slab] as usize) >> 10 == carrier.own;
        if is_own { None } else { Some(image) }
    }

    /// Whether a slab within reach has moved relative to a carrier whose nodes have moved from `least` to `greatest`.
    #[inline(always)]
    fn has_moved(&self, carrier: &Carrier<R>, [xs, ys]: Cells, (least, greatest): ([R; 3], [R; 3])) -> bool {
        let apart = R::from_i32(self.grid.params.apart as i32);
        for y in ys.0..=ys.1 {
            for x in xs.0..=xs.1 {
                for &item in self.grid.items(x, y).unwrap_or_default() {
                    let slab = item as usize;
                    if item < self.grid.params.slabs
                        && has_moved(&self.boxes[BOX * slab..][..BOX], least, greatest, apart)
                        && self.image_of(carrier, slab).is_some()
                    {
                        return true;
                    }
                }
            }
        }
        false
    }

    /// Adds the near faces of a slab to the list of a carrier.
    #[inline(always)]
    fn add(&self, carrier: &Carrier<R>, slab: usize, list: &mut List<R, PERIODIC>) {
        let Some(image) = self.image_of(carrier, slab) else { return };
        let (first, count) = (self.slabs[SLAB * slab] as usize, self.slabs[SLAB * slab + 1] as usize);
        let origin = of_coded(self.surface.faces[FACE * first]).0;
        let offset = self.surface.from_node(origin, image, carrier.base).1;
        let boxes = &self.face_boxes[FACE_BOXES * slab..][..FACE_BOXES];
        let are_near = carrier.place.are_near(boxes, offset, carrier.reach);
        let body = self.surface.body(first, image);
        for face in 0..count {
            // a slab with a known face was in an earlier cell, too
            if are_near[face] && !list.add(body, entry(first + face, image)) {
                break;
            }
        }
    }
}

/// Makes the lists of carriers with `N` nodes.
#[inline(always)]
fn run<K: Kernel, R: Real, const N: usize, const PERIODIC: bool>(io: &Io<R>, items: Range<usize>) {
    let params: Params = io.params();
    let inverse = inverse::<_, PERIODIC>(&io.row.gradient);
    let mut period = [R::from_f64(0.0); 2];
    if PERIODIC {
        for k in 0..2 {
            period[k] = R::from_i32(params.period[k]) * R::from_f64(QUANTUM);
        }
    }
    let search = Search {
        surface: Surface::<_, PERIODIC> {
            faces: io.uints(slot!(&SLOTS, "faces")),
            reference: Lattice::new(io, slot!(&SLOTS, "reference")),
            displacement: Displacements::new(io, slot!(&SLOTS, "quanta"), slot!(&SLOTS, "remainder")),
            gradient: &io.row.gradient,
            period: params.period,
        },
        slabs: io.uints(slot!(&SLOTS, "slabs")),
        grid: Filled { params, counts: io.uints(slot!(&SLOTS, "counts")), lists: io.uints(slot!(&SLOTS, "lists")) },
        boxes: io.scalars(slot!(&SLOTS, "boxes")),
        face_boxes: io.scalars(slot!(&SLOTS, "face_boxes")),
        stretch: stretch(&inverse),
        period,
    };
    let carriers = io.uints(slot!(&SLOTS, "carriers"));
    let (nodes, points) = (io.uints(slot!(&SLOTS, "nodes")), io.scalars(slot!(&SLOTS, "points")));
    let motion = Motion::new::<K>(io);
    let mut near = io.own::<u32>(slot!(&SLOTS, "near"));
    let mut when = io.own::<u32>(slot!(&SLOTS, "found_when"));
    let flags = io.atomic_uints(slot!(&SLOTS, "status"));
    for item in items {
        let row = &carriers[CARRIER * item..][..CARRIER];
        let (first, count, own) = (row[0] as usize, row[1] as usize, row[2]);
        let mut coded = [0; N];
        coded.copy_from_slice(&nodes[CARRIED * first..][..N]);
        let base = of_coded(coded[0]).0;
        let points = &points[POINT * first..][..POINT * count];
        let reach = points[5] + R::from_f64(f64::from(params.skin));
        let place = Place::new(&search.surface, coded, points, absolute::<K, _>(io, &inverse, base), &inverse);
        if !(place.middle[0].is_finite() && place.middle[1].is_finite() && place.heights[0].is_finite()) {
            flags[status::FLAGS].fetch_or(status::NOT_FINITE, Ordering::Relaxed);
            continue;
        }
        let carrier = Carrier { place, base, reach, own };
        let (middle, half) = (carrier.place.middle, carrier.place.half);
        let (low, high) = ([middle[0] - half[0], middle[1] - half[1]], [middle[0] + half[0], middle[1] + half[1]]);
        let cells = cells_of::<_, PERIODIC>(&params, low, high);
        // an overflow triggers a new search with larger tables
        if search.overflows(cells) {
            continue;
        }
        let when = when.at(0, item);
        if *when == found::WITH_ALL && !search.has_moved(&carrier, cells, moved(&motion, &coded)) {
            continue;
        }
        let (made, entries) = near.item(0, item).split_at_mut(MADE);
        let mut list = List { entries, count: 0, full: false, surface: &search.surface };
        let [xs, ys] = cells;
        for y in ys.0..=ys.1 {
            for x in xs.0..=xs.1 {
                // a slab may be in several cells
                for &near in search.grid.items(x, y).unwrap_or_default() {
                    if near < params.slabs {
                        search.add(&carrier, near as usize, &mut list);
                    }
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
