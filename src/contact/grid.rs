//! The grid of the broad phase: slabs of yarns (some neighbouring faces) and beams, each in every cell that its box touches.
//!
//! Cells lie in the pulled-back plane F̄⁻¹x, in which the periodic cell remains a rectangle; a distance ρ in space is there at
//! most ρ |row of F̄⁻¹| along an axis. A cell lists its items in any order, and the candidates chosen from them are independent
//! of it. Boxes store the motion of their items since the last full search (see [`super::skin`]). Faces have boxes of their own,
//! in space, from which candidates are chosen.

use super::arc_offset::{self, OffsetLines};
use super::surface::{self, FACE, Surface, of_coded};
use super::{Params, status};
use crate::elements::beam2;
use crate::kernel::buffer::Kind::{Int, Scalar, Uint};
use crate::kernel::interface::{Constant, Slot, constants, joined, slot};
use crate::kernel::io::{Io, Own, Scatter};
use crate::kernel::lane::{Lane, Real};
use crate::kernel::node::{Displacements, Lattice};
use crate::kernel::position::{self, QUANTUM};
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::Kernel;
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

/// Numbers per item box: centre in the pulled-back plane, mm (2), lowest and highest z, mm, half sizes in the plane, mm (2);
/// then, see [`MOTION`], least (3) and greatest motion (3) of its nodes since the last full search, quanta.
pub const BOX: usize = 12;
/// Index of the motion in a box.
pub const MOTION: usize = 6;
/// Largest motion that a box can store, quanta: 2 mm, a whole number in f32.
const MOST_MOTION: i32 = 1 << 24;
/// Integers per slab: its first face, and the number of consecutive faces.
pub const SLAB: usize = 2;
/// Largest number of faces per slab.
pub const SLAB_FACES: usize = 8;
/// Numbers per slab for the boxes of its faces: lowest (3) and highest coordinates (3) relative to the slab's first node, mm, each
/// for all faces side by side. A slab with fewer faces leaves the last places unused.
pub const FACE_BOXES: usize = 6 * SLAB_FACES;
/// Upper bound of the rounding error of a position, mm: an item must not be missing from a cell, nor a face from a list.
pub const ROUNDING: f64 = 1e-4;
/// Constants of the grid shared with the twins.
pub const CONSTANTS: [Constant; 7] =
    constants![uint: BOX, MOTION, SLAB, SLAB_FACES, FACE_BOXES; int: MOST_MOTION; scalar: ROUNDING];

/// Node positions, the first slots of the stages that fill the grid.
const PLACE: [Slot; 3] = [Slot::read("reference", Int), Slot::read("quanta", Int), Slot::read("remainder", Scalar)];

/// Slots written by the stages that fill the grid.
const GRID: [Slot; 4] = [
    Slot::atomic("counts", Uint),
    Slot::scatter("lists", Uint),
    Slot::row("boxes", Scalar, BOX),
    Slot::atomic("status", Uint),
];

/// Empties the cells.
pub struct Clear;
/// Constants shared with the twins of both stages that fill the grid.
const CONSTANTS_OF_FILLS: &[&[Constant]] = &[
    &position::CONSTANTS,
    &beam2::CONSTANTS,
    &status::CONSTANTS,
    &super::CONSTANTS,
    &surface::shared(false),
    &arc_offset::CONSTANTS,
    &CONSTANTS,
];

/// Puts slabs of yarns into cells.
pub struct FillSlabs<const PERIODIC: bool>;
/// Puts beams into cells.
pub struct FillBeams<const PERIODIC: bool>;

impl Kernel for Clear {
    const SHADER: Shader = Shader::new("contact/grid", "clear");
    const SLOTS: &'static [Slot] = &[Slot::row("counts", Uint, 1)];
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let mut counts = io.own::<u32>(slot!(Self::SLOTS, "counts"));
        for cell in items {
            *counts.at(0, cell) = 0;
        }
    }
}

/// The in-plane inverse of F̄.
#[inline(always)]
pub fn inverse<R: Real, const PERIODIC: bool>(gradient: &[[R; 3]; 3]) -> [[R; 2]; 2] {
    let (zero, one) = (R::from_f64(0.0), R::from_f64(1.0));
    if !PERIODIC {
        return [[one, zero], [zero, one]];
    }
    let (a, b, c, d) = (one + gradient[0][0], gradient[0][1], gradient[1][0], one + gradient[1][1]);
    let scale = one / (a * d - b * c);
    [[d * scale, -(b * scale)], [-(c * scale), a * scale]]
}

/// Factor by which a distance in space can grow in the pulled-back plane, along its axes.
#[inline(always)]
pub fn stretch<R: Real>(inverse: &[[R; 2]; 2]) -> [R; 2] {
    let [first, second] = inverse;
    [(first[0] * first[0] + first[1] * first[1]).sqrt(), (second[0] * second[0] + second[1] * second[1]).sqrt()]
}

/// A vector in the pulled-back plane.
#[inline(always)]
pub fn pull_back<R: Real>(inverse: &[[R; 2]; 2], v: [R; 3]) -> [R; 2] {
    [inverse[0][0] * v[0] + inverse[0][1] * v[1], inverse[1][0] * v[0] + inverse[1][1] * v[1]]
}

/// Node position: pulled-back plane and height, mm. For the grid only; contact uses position differences.
#[inline(always)]
pub fn absolute<K: Kernel, R: Real>(io: &Io<R>, inverse: &[[R; 2]; 2], node: usize) -> ([R; 2], R) {
    let reference = io.ints(slot!(K::SLOTS, "reference"));
    let (quanta, remainder) = (io.ints(slot!(K::SLOTS, "quanta")), io.scalars(slot!(K::SLOTS, "remainder")));
    let plane = remainder.len() / 3;
    let quantum = R::from_f64(QUANTUM);
    let (mut x, mut w) = ([quantum; 3], [quantum; 3]);
    for k in 0..3 {
        let i = node + k * plane;
        (x[k], w[k]) = (R::from_i32(reference[i]) * quantum, R::from_i32(quanta[i]) * quantum + remainder[i]);
    }
    let back = pull_back(inverse, w);
    ([x[0] + back[0], x[1] + back[1]], x[2] + w[2])
}

/// First and last cell along one axis for an interval of the pulled-back plane; the last may exceed the first by whole periods.
#[inline(always)]
fn cells<R: Real, const PERIODIC: bool>(params: &Params, axis: usize, low: R, high: R) -> (i32, i32) {
    let (low, high, count) = (cell(params, axis, low), cell(params, axis, high), params.cells[axis] as i32);
    if PERIODIC && params.period[axis] != 0 {
        (low, high.min(low + count - 1))
    } else {
        (low.clamp(0, count - 1), high.clamp(0, count - 1))
    }
}

/// Cell of a coordinate along one axis, also beyond the grid.
#[inline(always)]
fn cell<R: Real>(params: &Params, axis: usize, x: R) -> i32 {
    let (origin, size) = (R::from_f64(f64::from(params.origin[axis])), R::from_f64(f64::from(params.cell[axis])));
    let x = ((x - origin) / size).max(R::from_f64(-1e6)).min(R::from_f64(1e6));
    let near = x.to_i32();
    near - i32::from(x < R::from_i32(near))
}

/// Index of a cell.
#[inline(always)]
fn cell_index(params: &Params, x: i32, y: i32) -> usize {
    let (nx, ny) = (params.cells[0] as i32, params.cells[1] as i32);
    (y.rem_euclid(ny) * nx + x.rem_euclid(nx)) as usize
}

/// Cells from the first to the last along x and y.
pub type Cells = [(i32, i32); 2];

/// The cells of a box of the pulled-back plane.
#[inline(always)]
pub fn cells_of<R: Real, const PERIODIC: bool>(params: &Params, low: [R; 2], high: [R; 2]) -> Cells {
    [cells::<_, PERIODIC>(params, 0, low[0], high[0]), cells::<_, PERIODIC>(params, 1, low[1], high[1])]
}

/// The filled grid.
pub struct Filled<'a> {
    pub params: Params,
    pub counts: &'a [u32],
    pub lists: &'a [u32],
}

impl<'a> Filled<'a> {
    /// The items of a cell; `None` if there were more than it holds.
    #[inline(always)]
    pub fn items(&self, x: i32, y: i32) -> Option<&'a [u32]> {
        let cell = cell_index(&self.params, x, y);
        let (count, capacity) = (self.counts[cell], self.params.capacity);
        if count > capacity {
            return None;
        }
        Some(&self.lists[cell * capacity as usize..][..count as usize])
    }
}

/// Displacements of nodes, and those at the last full search.
pub struct Motion<'a, R> {
    now: Displacements<'a, R>,
    before: Lattice<'a>,
}

impl<'a, R: Real> Motion<'a, R> {
    /// From the bindings of a kernel, which binds the displacements at the last full search as `before`.
    #[inline(always)]
    pub fn new<K: Kernel>(io: &'a Io<R>) -> Self {
        Self {
            now: Displacements::new(io, slot!(K::SLOTS, "quanta"), slot!(K::SLOTS, "remainder")),
            before: Lattice::new(io, slot!(K::SLOTS, "before")),
        }
    }

    /// Displacement of a node since the last full search, quanta.
    #[inline(always)]
    fn of(&self, node: usize) -> [i32; 3] {
        let ((quanta, remainder), before) = (self.now.at(node), self.before.at(node));
        let mut motion = [0; 3];
        for k in 0..3 {
            let now = quanta[k].wrapping_add((remainder[k] * R::from_f64(1.0 / QUANTUM)).to_i32());
            motion[k] = now.wrapping_sub(before[k]).clamp(-MOST_MOTION, MOST_MOTION);
        }
        motion
    }
}

/// Whether an item, by its box, has moved by more than `apart` relative to an item with motion between `low` and `high`, or
/// whether either motion exceeds the range of a box.
#[inline(always)]
pub fn has_moved<R: Real>(bounds: &[R], low: [R; 3], high: [R; 3], apart: R) -> bool {
    let most = R::from_i32(MOST_MOTION);
    let mut moved = false;
    for k in 0..3 {
        let (least, greatest) = (bounds[MOTION + k].min(low[k]), bounds[MOTION + 3 + k].max(high[k]));
        moved |= (bounds[MOTION + 3 + k] - low[k]).max(high[k] - bounds[MOTION + k]) > apart
            || least <= -most
            || greatest >= most;
    }
    moved
}

/// Bounds of the motion of some nodes, quanta.
pub struct Moved {
    least: [i32; 3],
    greatest: [i32; 3],
}

impl Moved {
    /// No node.
    #[inline(always)]
    pub fn none() -> Self {
        Self { least: [MOST_MOTION; 3], greatest: [-MOST_MOTION; 3] }
    }

    /// Includes a node.
    #[inline(always)]
    pub fn add<R: Real>(&mut self, motion: &Motion<R>, node: usize) {
        let motion = motion.of(node);
        for k in 0..3 {
            self.least[k] = self.least[k].min(motion[k]);
            self.greatest[k] = self.greatest[k].max(motion[k]);
        }
    }

    /// The bounds as numbers of a box.
    #[inline(always)]
    pub fn bounds<R: Real>(&self) -> ([R; 3], [R; 3]) {
        let (mut least, mut greatest) = ([R::from_f64(0.0); 3], [R::from_f64(0.0); 3]);
        for k in 0..3 {
            (least[k], greatest[k]) = (R::from_i32(self.least[k]), R::from_i32(self.greatest[k]));
        }
        (least, greatest)
    }
}

/// The box of an item in the pulled-back plane and in height, relative to its first node, mm, and the motion of its nodes.
struct Bounds<R> {
    low: [R; 3],
    high: [R; 3],
    moved: Moved,
}

impl<R: Real> Bounds<R> {
    /// The box of the first node alone.
    #[inline(always)]
    fn new() -> Self {
        let zero = [R::from_f64(0.0); 3];
        Self { low: zero, high: zero, moved: Moved::none() }
    }

    /// Includes the end of a vector from the first node.
    #[inline(always)]
    fn grow(&mut self, inverse: &[[R; 2]; 2], v: [R; 3]) {
        let back = pull_back(inverse, v);
        let v = [back[0], back[1], v[2]];
        for k in 0..3 {
            self.low[k] = self.low[k].min(v[k]);
            self.high[k] = self.high[k].max(v[k]);
        }
    }
}

/// The grid during filling.
struct Grid<'a, R> {
    params: Params,
    inverse: [[R; 2]; 2],
    counts: &'a [AtomicU32],
    lists: Scatter<'a, u32>,
    boxes: Own<'a, R>,
    flags: &'a [AtomicU32],
}

impl<'a, R: Real> Grid<'a, R> {
    /// From the bindings of a kernel.
    #[inline(always)]
    fn new<K: Kernel, const PERIODIC: bool>(io: &'a Io<R>) -> Self {
        Self {
            params: io.params(),
            inverse: inverse::<R, PERIODIC>(&io.row.gradient),
            counts: io.atomic_uints(slot!(K::SLOTS, "counts")),
            lists: io.scatter(slot!(K::SLOTS, "lists")),
            boxes: io.own(slot!(K::SLOTS, "boxes")),
            flags: io.atomic_uints(slot!(K::SLOTS, "status")),
        }
    }

    /// Puts an item into every cell that its box touches, `reach` (mm) around.
    #[inline(always)]
    fn put<K: Kernel, const PERIODIC: bool>(
        &mut self,
        io: &Io<R>,
        item: usize,
        origin: usize,
        bounds: Bounds<R>,
        reach: R,
    ) {
        let Self { params, inverse, counts, lists, boxes, flags } = self;
        let Bounds { low, high, moved } = bounds;
        let (least, greatest): ([R; 3], [R; 3]) = moved.bounds();
        let (base, height) = absolute::<K, _>(io, inverse, origin);
        let (half, stretch) = (R::from_f64(0.5), stretch(inverse));
        boxes.item(0, item).copy_from_slice(&[
            base[0] + half * (low[0] + high[0]),
            base[1] + half * (low[1] + high[1]),
            height + low[2],
            height + high[2],
            half * (high[0] - low[0]),
            half * (high[1] - low[1]),
            least[0],
            least[1],
            least[2],
            greatest[0],
            greatest[1],
            greatest[2],
        ]);
        let mut ranges = [(0, 0); 2];
        for k in 0..2 {
            let room = reach * stretch[k] + R::from_f64(ROUNDING);
            ranges[k] = cells::<R, PERIODIC>(params, k, base[k] + low[k] - room, base[k] + high[k] + room);
        }
        let [xs, ys] = ranges;
        for y in ys.0..=ys.1 {
            for x in xs.0..=xs.1 {
                let cell = cell_index(params, x, y);
                let place = counts[cell].fetch_add(1, Ordering::Relaxed);
                if place < params.capacity {
                    lists.set(cell * params.capacity as usize + place as usize, item as u32);
                } else {
                    flags[status::FLAGS].fetch_or(status::CELL_FULL, Ordering::Relaxed);
                }
            }
        }
    }
}

impl<const PERIODIC: bool> Kernel for FillSlabs<PERIODIC> {
    const SHADER: Shader = Shader {
        defines: &[when(PERIODIC, "PERIODIC")],
        constants: CONSTANTS_OF_FILLS,
        ..Shader::new("contact/grid", "fill_slabs")
    };
    const SLOTS: &'static [Slot] = &joined::<11>(
        &PLACE,
        &joined::<8>(
            &[
                Slot::read("slabs", Uint),
                Slot::read("faces", Uint),
                Slot::read("before", Int),
                Slot::row("face_boxes", Scalar, FACE_BOXES),
            ],
            &GRID,
        ),
    );
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let mut grid = Grid::new::<Self, PERIODIC>(io);
        let inverse = grid.inverse;
        let surface = Surface::<_, PERIODIC> {
            faces: io.uints(slot!(Self::SLOTS, "faces")),
            reference: Lattice::new(io, slot!(Self::SLOTS, "reference")),
            displacement: Displacements::new(io, slot!(Self::SLOTS, "quanta"), slot!(Self::SLOTS, "remainder")),
            gradient: &io.row.gradient,
            period: grid.params.period,
        };
        let motion = Motion::new::<Self>(io);
        let slabs = io.uints(slot!(Self::SLOTS, "slabs"));
        let mut face_boxes = io.own::<L::Scalar>(slot!(Self::SLOTS, "face_boxes"));
        let reach = L::Scalar::from_f64(f64::from(grid.params.thread_radius + grid.params.skin));
        let zero = [L::Scalar::from_f64(0.0); 3];
        for item in items {
            let (first, count) = (slabs[SLAB * item] as usize, slabs[SLAB * item + 1] as usize);
            let origin = of_coded(surface.faces[FACE * first]).0;
            let mut bounds = Bounds::new();
            let face_boxes = face_boxes.item(0, item);
            for place in 0..count {
                let corners = surface.corners(first + place, [0, 0], origin, (zero, zero));
                for a in 0..4 {
                    bounds.grow(&inverse, corners.current[a]);
                    bounds.moved.add(&motion, corners.nodes[a]);
                }
                for k in 0..3 {
                    let [a, b, c, d] = &corners.current;
                    let (a, b, c, d) = (a[k], b[k], c[k], d[k]);
                    face_boxes[SLAB_FACES * k + place] = a.min(b).min(c.min(d));
                    face_boxes[SLAB_FACES * (3 + k) + place] = a.max(b).max(c.max(d));
                }
            }
            grid.put::<Self, PERIODIC>(io, item, origin, bounds, reach);
        }
    }
}

impl<const PERIODIC: bool> Kernel for FillBeams<PERIODIC> {
    const SHADER: Shader = Shader {
        defines: &[when(PERIODIC, "PERIODIC")],
        constants: CONSTANTS_OF_FILLS,
        ..Shader::new("contact/grid", "fill_beams")
    };
    const SLOTS: &'static [Slot] = &joined::<12>(
        &PLACE,
        &joined::<9>(
            &[
                Slot::read("ends", Uint),
                Slot::read("beams", Scalar),
                Slot::read("neighbours", Uint),
                Slot::read("shares", Scalar),
                Slot::read("before", Int),
            ],
            &GRID,
        ),
    );
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let mut grid = Grid::new::<Self, PERIODIC>(io);
        let inverse = grid.inverse;
        let displacement = Displacements::new(io, slot!(Self::SLOTS, "quanta"), slot!(Self::SLOTS, "remainder"));
        let (ends, beams) = (io.uints(slot!(Self::SLOTS, "ends")), io.scalars(slot!(Self::SLOTS, "beams")));
        let offsets = OffsetLines {
            neighbours: io.uints(slot!(Self::SLOTS, "neighbours")),
            shares: io.scalars(slot!(Self::SLOTS, "shares")),
        };
        let motion = Motion::new::<Self>(io);
        let reach = L::Scalar::from_f64(f64::from(2.0 * grid.params.thread_radius + grid.params.skin));
        for item in items {
            let beam = item - grid.params.slabs as usize;
            let piece = offsets.piece::<PERIODIC>(beams, ends, beam, &displacement, &io.row.gradient);
            let mut bounds = Bounds::new();
            bounds.grow(&inverse, piece.now[0]);
            bounds.grow(&inverse, piece.now[1]);
            let (first, last) = (ends[2 * beam] as usize, ends[2 * beam + 1] as usize);
            bounds.moved.add(&motion, first);
            bounds.moved.add(&motion, last);
            grid.put::<Self, PERIODIC>(io, item, first, bounds, reach);
        }
    }
}
