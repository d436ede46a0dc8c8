//! Where a beam is in contact with other beams: its chord, moved out by the mean height of the arc that it stands for.
//!
//! A chain of chords that touches a thread inside its bend with the middle of each is a polygon around it: one of angle θ a
//! chord is θ²/12 longer than the arc. The arc of a chord of length l lies κl²/12 outside of it in the mean, with κ its
//! curvature, and with chords moved by that much the chain is as long as the arc when it touches. κ comes from the directions
//! of both neighbours and the lengths between their middles and the beam's. A line has the direction and length of its chord,
//! so closest points are those of straight segments, and forces on the four nodes are the exact gradient of the energy.

use crate::elements::beam2;
use crate::kernel::lane::Real;
use crate::kernel::node::Displacements;
use crate::kernel::vector::{Vector, add, scale, sub};

/// Integers of a beam in the table: the beams before and behind it on its thread, itself where there is none.
pub const NEIGHBOURS: usize = 2;
/// Numbers of a beam in the table: shares of the vectors of these beams in its bow, zero where one is missing.
pub const SHARES: usize = 2;

/// Tables of the beams before and behind.
pub struct Bows<'a, R> {
    pub neighbours: &'a [u32],
    pub shares: &'a [R],
}

/// Shares of its neighbours' vectors in the bow of a beam, from the lengths of the three, mm.
pub fn shares(before: f64, length: f64, behind: f64) -> [f64; SHARES] {
    let rise = length * length / 12.0 / (0.5 * before + length + 0.5 * behind);
    [rise / before, rise / behind]
}

impl<R: Real> Bows<'_, R> {
    #[inline(always)]
    fn beside(&self, beam: usize) -> ([usize; 2], [R; 2]) {
        let (n, s) = (&self.neighbours[NEIGHBOURS * beam..][..NEIGHBOURS], &self.shares[SHARES * beam..][..SHARES]);
        ([n[0] as usize, n[1] as usize], [s[0], s[1]])
    }

    /// From a beam's chord to its line, in the reference and now, mm.
    #[inline(always)]
    pub fn bow<const PERIODIC: bool>(
        &self,
        beams: &[R],
        ends: &[u32],
        beam: usize,
        w: &Displacements<R>,
        gradient: &[[R; 3]; 3],
    ) -> (Vector<R>, Vector<R>) {
        let (beside, shares) = self.beside(beam);
        let before = beam2::vector::<_, PERIODIC>(beams, ends, beside[0], w, gradient);
        let behind = beam2::vector::<_, PERIODIC>(beams, ends, beside[1], w, gradient);
        let part = |before, behind| sub(scale(before, shares[0]), scale(behind, shares[1]));
        let rest = part(before.0, behind.0);
        (rest, add(rest, part(before.1, behind.1)))
    }

    /// Nodes of a point at `s` (0 to 1) on a beam's line, with its weights.
    #[inline(always)]
    pub fn line_nodes(&self, ends: &[u32], beam: usize, s: R) -> [(usize, R); 4] {
        let ([before, behind], [p, q]) = self.beside(beam);
        [
            (ends[2 * before] as usize, -p),
            (ends[2 * beam] as usize, R::from_f64(1.0) - s + p),
            (ends[2 * beam + 1] as usize, s + q),
            (ends[2 * behind + 1] as usize, -q),
        ]
    }

    /// The sum of the sizes of these weights.
    #[inline(always)]
    pub fn line_weights(&self, beam: usize) -> R {
        let [p, q] = self.beside(beam).1;
        R::from_f64(1.0) + (p + q) + (p + q)
    }
}
