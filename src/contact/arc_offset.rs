//! Where a thread is in contact with other threads: a line through its nodes, moved out to the mean of the arcs that its beams
//! stand for.
//!
//! A chain of chords that touches a thread inside its bend with the middle of each is a polygon around it: one of angle θ a
//! chord is θ²/12 longer than the arc. The arc of a chord of length l lies κl²/12 outside of it in the mean, with κ its
//! curvature. A node between chords of lengths l₁ and l₂ is moved out by κ (l₁² − l₁l₂ + l₂²)/12: weighted with the lengths, that
//! is the same in the mean, so that the line is as long as the arc to second order, whatever the lengths. With κ from the
//! directions of both chords, the shift is a weighted second difference of positions, for equal lengths a twelfth of it. The ends of
//! a thread stay. Pieces of a line share their ends, so the line is joined, and each hangs on four nodes by weights that are
//! constant: forces on these nodes are the exact gradient of the energy.

use crate::elements::beam2;
use crate::kernel::interface::{Constant, constants};
use crate::kernel::lane::Real;
use crate::kernel::node::Displacements;
use crate::kernel::vector::{Vector, add, scale, sub};

/// Integers of a beam in the table: the beams before and behind it on its thread, itself where there is none; its thread; and the
/// image, in periods along x and y, in which the first beam of a closed thread follows the last.
pub const NEIGHBOURS: usize = 5;
/// Numbers of a beam in the table: shares of the vectors before and behind its first node in the shift of that node, and of those
/// before and behind its second node in the shift of that one, zero at the end of a thread; arc length of its middle, mm; its
/// length, mm; the length of a closed thread, mm, else 0.
pub const SHARES: usize = 7;
/// Where the arc length is.
pub const ARC: usize = 4;
/// What twins know of both.
pub const CONSTANTS: [Constant; 3] = constants![uint: NEIGHBOURS, SHARES, ARC];

/// Tables of the beams before and behind.
pub struct OffsetLines<'a, R> {
    pub neighbours: &'a [u32],
    pub shares: &'a [R],
}

/// A piece of the line: from the first node of its beam to both its ends, in the reference and now, mm.
pub struct Piece<R> {
    pub rest: [Vector<R>; 2],
    pub now: [Vector<R>; 2],
}

/// Shares of the vectors before and behind a node in its shift, from their lengths, mm.
pub fn shares(before: f64, behind: f64) -> [f64; 2] {
    let rise = (before * before - before * behind + behind * behind) / (6.0 * (before + behind));
    [rise / before, rise / behind]
}

impl<R: Real> OffsetLines<'_, R> {
    /// The beams before and behind, and the four shares.
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
        let vector = |beam: usize| beam2::vector::<_, PERIODIC>(beams, ends, beam, w, gradient);
        let (before, own, behind) = (vector(beside[0]), vector(beam), vector(beside[1]));
        let ends = |before, own, behind| {
            let first = sub(scale(before, shares[0]), scale(own, shares[1]));
            let second = sub(scale(own, shares[2]), scale(behind, shares[3]));
            [first, add(own, second)]
        };
        let (rest, change) = (ends(before.0, own.0, behind.0), ends(before.1, own.1, behind.1));
        Piece { rest, now: [add(rest[0], change[0]), add(rest[1], change[1])] }
    }

    /// The four nodes on which a piece hangs.
    #[inline(always)]
    pub fn nodes(&self, ends: &[u32], beam: usize) -> [usize; 4] {
        let [before, behind] = self.beside(beam).0;
        [ends[2 * before], ends[2 * beam], ends[2 * beam + 1], ends[2 * behind + 1]].map(|node| node as usize)
    }

    /// Weights of these nodes at both ends of the piece.
    #[inline(always)]
    pub fn weights(&self, beam: usize) -> [[R; 4]; 2] {
        let [before, first, second, behind] = self.beside(beam).1;
        let (zero, one) = (R::from_f64(0.0), R::from_f64(1.0));
        [[-before, one + before + first, -first, zero], [zero, -second, one + second + behind, -behind]]
    }

    /// The largest sum of the sizes of these weights.
    #[inline(always)]
    pub fn most_weights(&self, beam: usize) -> R {
        let [before, first, second, behind] = self.beside(beam).1;
        let largest = (before + first).max(second + behind);
        R::from_f64(1.0) + largest + largest
    }

    /// Whether two beams, the second in an image, are the same thread here, and closer along it than `arc` (mm) from end to end.
    #[inline(always)]
    pub fn are_near(&self, a: usize, b: usize, image: [i32; 2], arc: R) -> bool {
        let of = |beam: usize| &self.neighbours[NEIGHBOURS * beam..][..NEIGHBOURS];
        let place = |beam: usize| &self.shares[SHARES * beam + ARC..][..3];
        let (chain, p, q) = (of(a), place(a), place(b));
        let reach = arc + R::from_f64(0.5) * (p[1] + q[1]);
        let after = |turns: i32| {
            let there = [turns.wrapping_mul(chain[3] as i32), turns.wrapping_mul(chain[4] as i32)];
            there == image && (q[0] - p[0] + R::from_i32(turns) * p[2]).abs() < reach
        };
        chain[2] == of(b)[2] && (after(0) || after(1) || after(-1))
    }

    /// The beam before another one in an image, and its image; `None` at the start of a thread.
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
