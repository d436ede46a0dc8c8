//! Broad-phase candidates: for each carrier of contact points, the faces of other bodies whose box lies within reach of the box
//! of its points.
//!
//! A list is sorted by body and lateral image, then by face, so it is independent of the order of items in the grid, and the
//! faces of a body are consecutive. The list holds no state except the number of times it was made: contact state is stored per
//! body. Carriers keep their lists if nothing near them has moved relative to them (see [`super::skin`]).

use super::grid::{BOX, Moved, SLAB, absolute, cell_index, cells, has_moved, inverse, motion, pull_back, stretch};
use super::surface::{self, CARRIED, POINT, Surface, entry, of_coded};
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

const SLOTS: [Slot; 15] = [
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

    /// Whether the box of a face, with corners relative to the same node, is within `reach`, mm.
    #[inline(always)]
    fn is_near(&self, corners: &[Vector<R>; 4], reach: R) -> bool {
        let mut square = R::from_f64(0.0);
        for k in 0..3 {
            let [a, b, c, d] = [0, 1, 2, 3].map(|corner| corners[corner][k]);
            let (low, high) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
            let gap = (low - self.high[k]).max(self.low[k] - high).max(R::from_f64(0.0));
            square = square + gap * gap;
        }
        square <= reach * reach
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

    /// Adds an entry if it is not yet in the list.
    #[inline(always)]
    fn add(&mut self, entry: u32) {
        let body = self.body(entry);
        let order = |known: &u32| (self.body(*known), *known) < (body, entry);
        let place = self.entries[..self.count].partition_point(order);
        if self.entries[..self.count].get(place) == Some(&entry) {
            return;
        }
        if self.count == self.entries.len() {
            self.full = true;
            return;
        }
        self.entries.copy_within(place..self.count, place + 1);
        self.entries[place] = entry;
        self.count += 1;
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
    let boxes = io.scalars(slot!(&SLOTS, "boxes"));
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
        // slabs of other bodies within reach, and their images
        let seen = cells.flat_map(|cell| &lists[cell * params.capacity as usize..][..counts[cell] as usize]);
        let seen = seen.filter(|near| **near < params.slabs).filter_map(|near| {
            let slab = &slabs[SLAB * *near as usize..][..SLAB];
            let (first, faces) = (slab[0] as usize, slab[1] as usize);
            let is_own = surface.marks(first) >> 10 == own;
            let bounds = &boxes[BOX * *near as usize..][..BOX];
            let image = if is_own { None } else { place.image_within(bounds, reach, stretch, period) };
            image.map(|image| (first..first + faces, image, bounds))
        });
        let when = when.at(0, item);
        if *when == found::WITH_ALL {
            let (least, greatest) = moved::<K, _, N>(io, coded);
            if !seen.clone().any(|(_, _, bounds)| has_moved(bounds, least, greatest, apart)) {
                continue;
            }
        }
        let (made, entries) = near.item(0, item).split_at_mut(MADE);
        let mut list = List { entries, count: 0, full: false, surface: &surface };
        let zero = [R::from_f64(0.0); 3];
        for (faces, image, _) in seen {
            for face in faces {
                if place.is_near(&surface.corners(face, image, base, (zero, zero)).current, reach) {
                    list.add(entry(face, image));
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
