//! The contact line of a thread against other threads: a line through its nodes, offset to the mean of the arcs that its beams
//! represent.
//!
//! A chain of chords that touches the thread inside its bend with the middle of each chord is a polygon around it: with the
//! angle θ per chord it is θ²/12 longer than the arc. The arc of a chord of length l lies κl²/12 outside the chord in the mean,
//! with κ its curvature. A node between chords of lengths l₁ and l₂ is offset by κ (l₁² − l₁l₂ + l₂²)/12. Weighted with the
//! lengths, this has the same mean, so the line is as long as the arc to second order for any lengths. With κ from the
//! directions of both chords, the offset is a weighted second difference of positions (for equal lengths a twelfth of it). The
//! ends of a thread are not offset. Pieces of a line share their ends, so the line is continuous, and each piece depends on
//! four nodes with constant weights: the forces on these nodes are the exact gradient of the energy.

use crate::elements::beam2;
use crate::kernel::interface::{Constant, constants};
use crate::kernel::lane::Real;
use crate::kernel::node::Displacements;
use crate::kernel::vector::{Vector, add, scale, sub};

/// Integers per beam in the table: the previous and next beams on its thread, or itself if there is none; its thread; and the
/// image, in periods along x and y, in which the first beam of a closed thread follows the last.
pub const NEIGHBOURS: usize = 5;
/// Numbers per beam in the table: shares of the previous and next vectors in the offset of its first node, and in the offset of
/// its second node, zero at the end of a thread; arc length at its middle, mm; its length, mm; the length of a closed thread,
/// mm, else 0.
pub const SHARES: usize = 7;
/// Index of the arc length.
pub const ARC: usize = 4;
/// Constants shared with the twins.
pub const CONSTANTS: [Constant; 3] = constants![uint: NEIGHBOURS, SHARES, ARC];

/// Tables of the previous and next beams.
pub struct OffsetLines<'a, R> {
    pub neighbours: &'a [u32],
    pub shares: &'a [R],
}

/// A piece of the line: vectors from the first node of its beam to both its ends, in the reference and current states, mm.
pub struct Piece<R> {
    pub rest: [Vector<R>; 2],
    pub now: [Vector<R>; 2],
}

/// Shares of the previous and next vectors in the offset of a node, from their lengths, mm.
pub fn shares(before: f64, behind: f64) -> [f64; 2] {
    let rise = (before * before - before * behind + behind * behind) / (6.0 * (before + behind));
    [rise / before, rise / behind]
}

/// Both ends of a piece from the first node of its beam: from the vectors of the previous beam, its own and the next, and from
/// their shares.
#[inline(always)]
fn offset<R: Real>(before: Vector<R>, own: Vector<R>, behind: Vector<R>, shares: [R; 4]) -> [Vector<R>; 2] {
    let first = sub(scale(before, shares[0]), scale(own, shares[1]));
    let second = sub(scale(own, shares[2]), scale(behind, shares[3]));
    [first, add(own, second)]
}

impl<R: Real> OffsetLines<'_, R> {
    /// The previous and next beams, and the four shares.
    #[inline(always)]
    fn beside(&self, beam: usize) -> ([usize; 2], [R; 4]) {
        let (n, s) = (&self.neighbours[NEIGHBOURS * beam..][..NEIGHBOURS], &self.shares[SHARES * beam..][..SHARES]);
        ([n[0] as usize, n[1] as usize], [s[0], s[1], s[2], s[3]])
    }

    /// The piece of a beam.
    #[inline(always)]
    pub fn piece<const PERIODIC: bool>(
        &self,
        beams: &[R],
        ends: &[u32],
        beam: usize,
        w: &Displacements<R>,
        gradient: &[[R; 3]; 3],
    ) -> Piece<R> {
        let (beside, shares) = self.beside(beam);
        let before = beam2::vector::<_, PERIODIC>(beams, ends, beside[0], w, gradient);
        let own = beam2::vector::<_, PERIODIC>(beams, ends, beam, w, gradient);
        let behind = beam2::vector::<_, PERIODIC>(beams, ends, beside[1], w, gradient);
        let rest = offset(before.0, own.0, behind.0, shares);
        let change = offset(before.1, own.1, behind.1, shares);
        Piece { rest, now: [add(rest[0], change[0]), add(rest[1], change[1])] }
    }

    /// The four nodes that carry a piece.
    #[inline(always)]
    pub fn nodes(&self, ends: &[u32], beam: usize) -> [usize; 4] {
        let [before, behind] = self.beside(beam).0;
        let (first, second) = (ends[2 * beam] as usize, ends[2 * beam + 1] as usize);
        [ends[2 * before] as usize, first, second, ends[2 * behind + 1] as usize]
    }

    /// Weights of these nodes at both ends of the piece.
    #[inline(always)]
    pub fn weights(&self, beam: usize) -> [[R; 4]; 2] {
        let [before, first, second, behind] = self.beside(beam).1;
        let (zero, one) = (R::from_f64(0.0), R::from_f64(1.0));
        [[-before, one + before + first, -first, zero], [zero, -second, one + second + behind, -behind]]
    }

    /// The largest sum of the absolute values of these weights.
    #[inline(always)]
    pub fn most_weights(&self, beam: usize) -> R {
        let [before, first, second, behind] = self.beside(beam).1;
        let largest = (before + first).max(second + behind);
        R::from_f64(1.0) + largest + largest
    }

    /// Whether two beams, the second in an image, belong to the same thread here, with a distance along it below `arc` (mm)
    /// from end to end.
    #[inline(always)]
    pub fn are_near(&self, a: usize, b: usize, image: [i32; 2], arc: R) -> bool {
        let chain = &self.neighbours[NEIGHBOURS * a..][..NEIGHBOURS];
        if chain[2] != self.neighbours[NEIGHBOURS * b + 2] {
            return false;
        }
        let (p, q) = (&self.shares[SHARES * a + ARC..][..3], &self.shares[SHARES * b + ARC..][..3]);
        let reach = arc + R::from_f64(0.5) * (p[1] + q[1]);
        for turns in -1..2 {
            let there = [turns * chain[3] as i32, turns * chain[4] as i32];
            if there == image && (q[0] - p[0] + R::from_i32(turns) * p[2]).abs() < reach {
                return true;
            }
        }
        false
    }

    /// The beam before another beam in an image, and its image; `None` at the start of a thread.
    #[inline(always)]
    pub fn before(&self, beam: usize, image: [i32; 2]) -> Option<(usize, [i32; 2])> {
        let chain = &self.neighbours[NEIGHBOURS * beam..][..NEIGHBOURS];
        let before = chain[0] as usize;
        if before < beam {
            Some((before, image))
        } else if before > beam {
            // the first beam of a closed thread follows the last
            Some((before, [image[0] - chain[3] as i32, image[1] - chain[4] as i32]))
        } else {
            None
        }
    }
}
