//! Contact state of a point against faces between steps: gaps to listed faces, touched bodies, and the touch of each.

use super::EMPTY;
use crate::kernel::io::Own;
use crate::kernel::lane::Real;

/// Numbers before the gaps of a point, mm: the least gap at the last evaluation of faces; the largest possible closure since
/// then; the penetration, or an upper bound of it. Then the gap of every face of the list.
pub const LEAST: usize = 0;
pub const CLOSED: usize = 1;
pub const INNER: usize = 2;
pub const GAPS: usize = 3;
/// Numbers per touch: normal force and its damping part, N; with friction also the elastic tangential displacement, mm (3).
pub const NORMAL: usize = 0;
pub const DAMPED: usize = 1;
pub const ELASTIC: usize = 2;
pub const fn touch(friction: bool) -> usize {
    if friction { ELASTIC + 3 } else { ELASTIC }
}

/// State of a point that persists between steps, and its sums.
pub(super) struct Kept<'a, R> {
    pub gaps: &'a mut [R],
    pub keys: &'a mut [u32],
    pub touches: &'a mut [R],
    pub sums: &'a mut [R],
}

impl<R: Real> Kept<'_, R> {
    /// A new list resets all gaps, so that all faces are evaluated. The penetration is kept; before the first list it may be
    /// anything up to `depth` (mm).
    #[inline(always)]
    pub fn renew(&mut self, made: u32, depth: R) {
        if self.keys[0] != made {
            let inner = if self.keys[0] == EMPTY { depth } else { self.gaps[INNER] };
            self.keys[0] = made;
            self.gaps.fill(R::from_f64(0.0));
            self.gaps[INNER] = inner;
        }
    }
}

/// The contact state of all points of a chunk.
pub(super) struct Memory<'a, R> {
    pub gaps: Own<'a, R>,
    pub keys: Own<'a, u32>,
    pub touches: Own<'a, R>,
    pub sums: Own<'a, R>,
}

impl<R: Real> Memory<'_, R> {
    /// The state of a point.
    #[inline(always)]
    pub fn of(&mut self, item: usize) -> Kept<'_, R> {
        Kept {
            gaps: self.gaps.item(0, item),
            keys: self.keys.item(0, item),
            touches: self.touches.item(0, item),
            sums: self.sums.item(0, item),
        }
    }
}
