//! Totals: sums and maxima of columns, part by part, so that the host reads a few numbers instead of one per item.
//!
//! A part is a range of a column; its length depends only on the length of the column. A workgroup works on a part: each
//! invocation sums every 64th number, then the upper half is added to the lower until one sum is left. The CPU keeps the same
//! partial sums side by side. The host adds the parts in f64.

use crate::elements::{self, LANES};
use crate::kernel::buffer::Kind::{Scalar, Uint};
use crate::kernel::interface::{Slot, constants, slot};
use crate::kernel::io::Io;
use crate::kernel::lane::{Lane, Real};
use crate::kernel::shader::{Shader, Share, WORKGROUP, when};
use crate::kernel::stage::Kernel;
use bytemuck::{Pod, Zeroable};
use std::ops::Range;

/// Constants of the stage: the numbers that belong to a column.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Params {
    /// First number of the first column.
    pub start: u32,
    /// Numbers per column.
    pub count: u32,
    /// Number of them that are adjacent.
    pub lanes: u32,
    /// Stride from the first of these to the first of the next group.
    pub stride: u32,
    /// Number of columns; each starts after the lanes of the previous one.
    pub columns: u32,
    /// Numbers per part.
    pub length: u32,
    /// Start of the results of the stage.
    pub into: u32,
}

/// The shortest part for which a workgroup pays.
const SHORTEST: usize = 1024;
/// The largest number of parts of a column.
const MOST: usize = 256;

/// Length and number of the parts of a column of `count` numbers.
pub fn parts(count: usize) -> (usize, usize) {
    let length = count.div_ceil(MOST).max(SHORTEST).next_multiple_of(WORKGROUP);
    (length, count.div_ceil(length))
}

/// Range of numbers of a part.
#[inline(always)]
pub fn part(number: usize, length: u32, count: u32) -> Range<usize> {
    let first = number * length as usize;
    first..(first + length as usize).min(count as usize)
}

/// Adds up the terms of a part.
#[inline(always)]
pub fn add_up<R: Real>(part: Range<usize>, mut term: impl FnMut(usize) -> R) -> R {
    let mut sums = [R::from_f64(0.0); WORKGROUP];
    for number in part.clone() {
        let sum = &mut sums[(number - part.start) % WORKGROUP];
        *sum = *sum + term(number);
    }
    let mut half = WORKGROUP / 2;
    while half > 0 {
        for i in 0..half {
            sums[i] = sums[i] + sums[i + half];
        }
        half /= 2;
    }
    sums[0]
}

/// Below every value: the maximum of an empty set.
const LOWEST: f64 = -1e30;

/// The largest value of a part, and its index there; the first of equal ones.
#[inline(always)]
fn largest<R: Real>(part: Range<usize>, mut value: impl FnMut(usize) -> R) -> (R, usize) {
    let mut found = [(R::from_f64(LOWEST), 0); WORKGROUP];
    for number in part.clone() {
        let place = number - part.start;
        let value = value(number);
        let known = &mut found[place % WORKGROUP];
        if value > known.0 {
            *known = (value, place);
        }
    }
    let mut best = found[0];
    for &other in &found[1..] {
        if other.0 > best.0 || other.0 == best.0 && other.1 < best.1 {
            best = other;
        }
    }
    best
}

/// Indices of the numbers of a column, one after the other, without a division for each.
struct Places {
    place: usize,
    lane: usize,
    lanes: usize,
    /// From the end of adjacent numbers to the next of them.
    gap: usize,
}

impl Places {
    /// The indices from a number of a column on.
    #[inline(always)]
    fn new(params: &Params, number: usize, column: usize) -> Self {
        let (lanes, stride) = (params.lanes as usize, params.stride as usize);
        let lane = number % lanes;
        let place = params.start as usize + number / lanes * stride + column * lanes + lane;
        Self { place, lane, lanes, gap: stride - lanes }
    }

    #[inline(always)]
    fn next(&mut self) -> usize {
        let place = self.place;
        (self.place, self.lane) = (place + 1, self.lane + 1);
        if self.lane == self.lanes {
            (self.place, self.lane) = (self.place + self.gap, 0);
        }
        place
    }
}

/// Sums of columns, with the columns of a part side by side; with `TAKEN` the numbers are reset to zero.
pub struct Sum<const TAKEN: bool>;

impl<const TAKEN: bool> Kernel for Sum<TAKEN> {
    const SHADER: Shader = Shader {
        defines: &[when(TAKEN, "TAKEN")],
        share: Share::Workgroups(1),
        ..Shader::new("dynamics/totals", "sum")
    };
    const SLOTS: &'static [Slot] = &[
        if TAKEN { Slot::scatter("source", Scalar) } else { Slot::read("source", Scalar) },
        Slot::scatter("totals", Scalar),
    ];
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let params: Params = io.params();
        let columns = params.columns as usize;
        let mut totals = io.scatter::<L::Scalar>(slot!(Self::SLOTS, "totals"));
        for item in items {
            let (number, column) = (item / columns, item % columns);
            let part = part(number, params.length, params.count);
            let mut places = Places::new(&params, part.start, column);
            let sum = if TAKEN {
                let mut source = io.scatter::<L::Scalar>(slot!(Self::SLOTS, "source"));
                add_up(part, |_| {
                    let place = places.next();
                    let value = source.get(place);
                    source.set(place, L::Scalar::from_f64(0.0));
                    value
                })
            } else {
                let source = io.scalars(slot!(Self::SLOTS, "source"));
                add_up(part, |_| source[places.next()])
            };
            totals.set(params.into as usize + item, sum);
        }
    }
}

/// Numbers that [`Worst`] writes per part.
pub const WORST: usize = 2;

/// The largest number of a column, and its index in the part; with `JACOBIAN` the largest −det F in lanes in use.
pub struct Worst<const JACOBIAN: bool>;

impl<const JACOBIAN: bool> Kernel for Worst<JACOBIAN> {
    const SHADER: Shader = Shader {
        defines: &[when(JACOBIAN, "JACOBIAN")],
        share: Share::Workgroups(1),
        constants: &[&elements::CONSTANTS, &constants![uint: WORST; scalar: LOWEST]],
        ..Shader::new("dynamics/totals", "worst")
    };
    const SLOTS: &'static [Slot] = &[
        Slot::read("source", Scalar),
        // for each block of hexahedra
        Slot::read("lanes_used", Uint).when(JACOBIAN),
        Slot::scatter("totals", Scalar),
    ];
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let params: Params = io.params();
        let source = io.scalars(slot!(Self::SLOTS, "source"));
        let mut totals = io.scatter::<L::Scalar>(slot!(Self::SLOTS, "totals"));
        for item in items {
            let part = part(item, params.length, params.count);
            let mut places = Places::new(&params, part.start, 0);
            let (value, place) = if JACOBIAN {
                let used = io.uints(slot!(Self::SLOTS, "lanes_used", JACOBIAN));
                let lowest = L::Scalar::from_f64(LOWEST);
                largest(part, |number| {
                    let place = places.next();
                    if number % LANES < used[number / LANES] as usize { -source[place] } else { lowest }
                })
            } else {
                largest(part, |_| source[places.next()])
            };
            totals.set(params.into as usize + WORST * item, value);
            totals.set(params.into as usize + WORST * item + 1, L::Scalar::from_i32(place as i32));
        }
    }
}
