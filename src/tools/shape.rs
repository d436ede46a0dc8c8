//! Shapes of tools as signed distances, in the axes of the tool: positive outside.
//!
//! A rounded box is a core box, all of whose points within a radius belong to it. A sphere is one with a core of a point, a cylinder
//! one with a core of a line. The distance from any other shape is sampled on a grid of cubic cells and interpolated linearly along
//! each axis.

use crate::kernel::interface::{Constant, constants};
use crate::kernel::lane::Real;
use crate::kernel::vector::{Vector, apply, dot, fma, norm, scale};

/// Numbers per tool: its axes (3 × 3); half the sizes of the core (3) and the radius of a rounded box, mm; friction coefficients
/// against threads and yarns; the first point of a grid (3) and the size of its cells, mm.
pub const TOOL: usize = 19;
pub const HALF: usize = 9;
pub const RADIUS: usize = 12;
pub const RUBS: usize = 13;
pub const FROM: usize = 15;
pub const CELL: usize = 18;
/// Integers per tool: its origin at the start, quanta (3); kind of shape; points of a grid along x, y and z, and the place of the
/// first of them behind the tables of all tools, x fastest; its displacement, quanta (3).
pub const SEAT: usize = 11;
pub const KIND: usize = 3;
pub const COUNTS: usize = 4;
pub const FIRST: usize = 7;
pub const MOVED: usize = 8;
/// Numbers per tool that change: the rest of its displacement, mm, and its velocity, mm/s.
pub const MOTION: usize = 6;
/// Kinds of shapes: the half-space z < 0, a rounded box, a grid.
pub const PLANE: i32 = 0;
pub const BOX: i32 = 1;
pub const GRID: i32 = 2;
/// Constants of shapes shared with the twins.
pub const CONSTANTS: [Constant; 14] = constants![
    uint: TOOL, HALF, RADIUS, RUBS, FROM, CELL, SEAT, KIND, COUNTS, FIRST, MOVED, MOTION; int: PLANE, BOX
];

/// Tables of tools, followed by the distances at the points of grids, mm, and their integers.
#[derive(Clone, Copy)]
pub struct Shapes<'a, R> {
    pub tools: &'a [R],
    pub seats: &'a [i32],
}

/// The surface of a tool near a point.
#[derive(Debug, Clone, Copy)]
pub struct Near<R> {
    /// Signed distance of the point, mm.
    pub distance: R,
    /// Its gradient; of length one but for the interpolation of a grid.
    pub slope: Vector<R>,
}

impl<R: Real> Shapes<'_, R> {
    /// The surface of a tool near a point at `at` from its origin, mm; `None` far outside a grid.
    #[inline(always)]
    pub fn near(&self, tool: usize, at: Vector<R>) -> Option<Near<R>> {
        let table = &self.tools[TOOL * tool..][..TOOL];
        let axes = [[table[0], table[1], table[2]], [table[3], table[4], table[5]], [table[6], table[7], table[8]]];
        let local = apply(&axes, at);
        let (zero, one) = (R::from_f64(0.0), R::from_f64(1.0));
        let own = match self.seats[SEAT * tool + KIND] {
            PLANE => Near { distance: local[2], slope: [zero, zero, one] },
            BOX => rounded([table[HALF], table[HALF + 1], table[HALF + 2]], table[RADIUS], local),
            _ => self.sampled(tool, local)?,
        };
        let mut slope = [zero; 3];
        for k in 0..3 {
            slope = fma(axes[k], own.slope[k], slope);
        }
        Some(Near { slope, ..own })
    }

    /// The distance interpolated between the points of a grid.
    #[inline(always)]
    fn sampled(&self, tool: usize, at: Vector<R>) -> Option<Near<R>> {
        let (table, seat) = (&self.tools[TOOL * tool..][..TOOL], &self.seats[SEAT * tool..][..SEAT]);
        let (one, mut low, mut part) = (R::from_f64(1.0), [0; 3], [R::from_f64(0.0); 3]);
        for k in 0..3 {
            let cells = (at[k] - table[FROM + k]) / table[CELL];
            let last = seat[COUNTS + k] - 2;
            // at most half a cell from the nearest whole number, whatever lies outside
            if cells < R::from_f64(0.0) || cells > R::from_i32(last + 1) {
                return None;
            }
            let near = (cells - R::from_f64(0.5)).to_i32();
            low[k] = if near < 0 {
                0
            } else if near > last {
                last
            } else {
                near
            };
            part[k] = cells - R::from_i32(low[k]);
        }
        let (row, layer) = (seat[COUNTS], seat[COUNTS] * seat[COUNTS + 1]);
        let first = seat[FIRST] + low[0] + low[1] * row + low[2] * layer;
        let at = |x: i32, y: i32, z: i32| self.tools[(first + x + y * row + z * layer) as usize];
        // along x, then y, then z: value and slopes
        let mut edges = [[R::from_f64(0.0); 2]; 4];
        let mut corner = 0;
        for z in 0..2 {
            for y in 0..2 {
                let (a, b) = (at(0, y, z), at(1, y, z));
                edges[corner] = [a * (one - part[0]) + b * part[0], b - a];
                corner += 1;
            }
        }
        let mut sides = [[R::from_f64(0.0); 3]; 2];
        for z in 0..2 {
            let (a, b) = (edges[2 * z], edges[2 * z + 1]);
            let between = |k: usize| a[k] * (one - part[1]) + b[k] * part[1];
            sides[z] = [between(0), between(1), b[0] - a[0]];
        }
        let between = |k: usize| sides[0][k] * (one - part[2]) + sides[1][k] * part[2];
        let slope = [between(1), between(2), sides[1][0] - sides[0][0]];
        Some(Near { distance: between(0), slope: scale(slope, one / table[CELL]) })
    }
}

/// A rounded box: half the sizes of its core, and its radius.
#[inline(always)]
fn rounded<R: Real>(half: Vector<R>, radius: R, at: Vector<R>) -> Near<R> {
    let (zero, one) = (R::from_f64(0.0), R::from_f64(1.0));
    let (mut beyond, mut outside, mut side) = ([zero; 3], [zero; 3], [one; 3]);
    for k in 0..3 {
        beyond[k] = at[k].abs() - half[k];
        outside[k] = beyond[k].max(zero);
        side[k] = if at[k] < zero { -one } else { one };
    }
    let far = norm(outside);
    if far > zero {
        let slope = [side[0] * outside[0], side[1] * outside[1], side[2] * outside[2]];
        return Near { distance: far - radius, slope: scale(slope, one / far) };
    }
    // in the core: to its nearest face
    let nearest = if beyond[0] > beyond[1] { 0 } else { 1 };
    let nearest = if beyond[nearest] > beyond[2] { nearest } else { 2 };
    let mut slope = [zero; 3];
    slope[nearest] = side[nearest];
    Near { distance: beyond[nearest] - radius, slope }
}

/// Length of a slope, and its direction.
#[inline(always)]
pub fn steepness<R: Real>(slope: Vector<R>) -> (R, Vector<R>) {
    let length = dot(slope, slope).sqrt().max(R::from_f64(1e-6));
    (length, scale(slope, R::from_f64(1.0) / length))
}
