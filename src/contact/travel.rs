//! How far nodes have moved since the last search, and whether they are still numbers.

use super::status;
use crate::kernel::lane::{Lane, Real};
use crate::kernel::position::difference;
use crate::kernel::stage::{Io, Kernel, raise};
use std::ops::Range;
use std::sync::atomic::Ordering;

pub const QUANTA: usize = 0;
pub const REMAINDER: usize = 1;
/// Displacements at the last search.
pub const SEARCH_QUANTA: usize = 2;
pub const SEARCH_REMAINDER: usize = 3;

/// Notes displacements at a search.
pub struct Remember;
/// Raises the largest distance travelled since.
pub struct Travel;

impl Kernel for Remember {
    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let (quanta, remainder) = (io.ints(QUANTA), io.scalars(REMAINDER));
        let mut search_quanta = io.own::<i32>(SEARCH_QUANTA);
        let mut search_remainder = io.own::<L::Scalar>(SEARCH_REMAINDER);
        let plane = remainder.len() / 3;
        for node in items {
            for k in 0..3 {
                *search_quanta.at(k, node) = quanta[node + k * plane];
                *search_remainder.at(k, node) = remainder[node + k * plane];
            }
        }
    }
}

impl Kernel for Travel {
    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        const STATUS: usize = 4;
        let (quanta, remainder) = (io.ints(QUANTA), io.scalars(REMAINDER));
        let (search_quanta, search_remainder) = (io.ints(SEARCH_QUANTA), io.scalars(SEARCH_REMAINDER));
        let status = io.atomic_uints(STATUS);
        let plane = remainder.len() / 3;
        let mut largest = L::Scalar::from_f64(0.0);
        for node in items {
            let mut square = L::Scalar::from_f64(0.0);
            for k in 0..3 {
                let i = node + k * plane;
                let d = difference(quanta[i], remainder[i], search_quanta[i], search_remainder[i]);
                square = square + d * d;
            }
            if !square.is_finite() {
                status[status::FLAGS].fetch_or(status::NOT_FINITE, Ordering::Relaxed);
            }
            largest = largest.max(square);
        }
        raise(&status[status::TRAVEL], largest.sqrt());
    }
}
