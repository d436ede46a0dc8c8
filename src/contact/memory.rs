//! What contact with faces remembers of a point from step to step: gaps to listed faces, touched bodies, and the touch of each.

use super::EMPTY;
use crate::kernel::lane::Real;

/// Numbers before the gaps of a point, mm: the least gap when faces were last looked at; what bodies can have closed of it
/// since; how deep the point was inside a body, or may have been. Then the gap of every face of the list.
pub const LEAST: usize = 0;
pub const CLOSED: usize = 1;
pub const INNER: usize = 2;
pub const GAPS: usize = 3;
/// Numbers of a touch: normal force and its part from damping, N; with friction then the elastic tangential displacement, mm (3).
pub const NORMAL: usize = 0;
pub const DAMPED: usize = 1;
pub const ELASTIC: usize = 2;
pub const fn touch(friction: bool) -> usize {
    if friction { ELASTIC + 3 } else { ELASTIC }
}

/// What stays of a point from step to step, and its sums.
pub(super) struct Kept<'a, R> {
    pub gaps: &'a mut [R],
    pub keys: &'a mut [u32],
    pub touches: &'a mut [R],
    pub sums: &'a mut [R],
}

impl<R: Real> Kept<'_, R> {
    /// With a new list all faces are looked at. How deep the point was inside stays known; before the first one it may be anywhere up
    /// to `depth` (mm).
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
