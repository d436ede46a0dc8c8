//! How fast nodes are, whether they are still numbers in range, and with contact how far they have moved since candidates
//! around them were searched.
//!
//! A search is due as soon as a node has travelled by [`SKIN_USED`] of the contact skin. It is one for all that has travelled by
//! [`SKIN_MOVED`]: cells of the grid within reach of such a node are searched again, and it is noted where the node is. A pair
//! that is in no list was farther apart than reach and skin when there was last a search near it. Either side was then within
//! `SKIN_MOVED` of the place that is noted of it, and is now within `SKIN_USED`: together they have come closer by at most 2 × (0.125 +
//! 0.25) of the skin. The rest of it is for what they travel between two looks.

use super::status;
use crate::kernel::lane::{Lane, Real};
use crate::kernel::node::Field;
use crate::kernel::position::{MOST_MM, difference, in_mm};
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::{Io, Kernel, raise};
use crate::kernel::vector::dot;
use bytemuck::{Pod, Zeroable};
use std::ops::Range;
use std::sync::atomic::Ordering;

pub const QUANTA: usize = 0;
pub const REMAINDER: usize = 1;
/// Displacements when candidates around a node were last searched; [`Travel`] reads the velocity first, and these only with contact.
pub const SEARCH_QUANTA: usize = 2;
pub const SEARCH_REMAINDER: usize = 3;
/// Of [`Remember`]: 1 for nodes that have moved.
const MOVED: usize = 2;

/// Share of the contact skin that nodes may travel before a search.
pub const SKIN_USED: f64 = 0.25;
/// And the one from which on a search is made around them.
pub const SKIN_MOVED: f64 = 0.5 * SKIN_USED;

/// Constants of [`Travel`].
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Params {
    /// Distance from which on a node has moved, mm.
    pub moved: f32,
}

/// Notes displacements of nodes that have moved, at a search.
pub struct Remember;
/// Raises the largest speed; with `CONTACT` also the largest distance travelled since the last search.
pub struct Travel<const CONTACT: bool>;

impl Kernel for Remember {
    const SHADER: Shader = Shader::new("contact/travel", "remember");

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let (quanta, remainder) = (io.ints(QUANTA), io.scalars(REMAINDER));
        let moved = io.uints(MOVED);
        let mut search_quanta = io.own::<i32>(SEARCH_QUANTA + 1);
        let mut search_remainder = io.own::<L::Scalar>(SEARCH_REMAINDER + 1);
        let plane = remainder.len() / 3;
        for node in items.filter(|node| moved[*node] == 1) {
            for k in 0..3 {
                *search_quanta.at(k, node) = quanta[node + k * plane];
                *search_remainder.at(k, node) = remainder[node + k * plane];
            }
        }
    }
}

impl<const CONTACT: bool> Kernel for Travel<CONTACT> {
    const SHADER: Shader = Shader { defines: &[when(CONTACT, "CONTACT")], ..Shader::new("contact/travel", "travel") };

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        const VELOCITY: usize = 2;
        let (quanta, remainder) = (io.ints(QUANTA), io.scalars(REMAINDER));
        let searched = CONTACT.then(|| (io.ints(SEARCH_QUANTA + 1), io.scalars(SEARCH_REMAINDER + 1)));
        let mut moved =
            CONTACT.then(|| (io.own::<u32>(5), L::Scalar::from_f64(f64::from(io.params::<Params>().moved))));
        let status = io.atomic_uints(if CONTACT { 6 } else { 3 });
        let plane = remainder.len() / 3;
        let velocity = Field::new(io, VELOCITY);
        let (mut largest, mut fastest) = (L::Scalar::from_f64(0.0), L::Scalar::from_f64(0.0));
        for node in items {
            let (mut square, mut furthest) = (L::Scalar::from_f64(0.0), L::Scalar::from_f64(0.0));
            let mut far = L::Scalar::from_f64(0.0);
            for k in 0..3 {
                let i = node + k * plane;
                if let Some((search_quanta, search_remainder)) = searched {
                    let d = difference(quanta[i], remainder[i], search_quanta[i], search_remainder[i]);
                    square = square + d * d;
                }
                let moved = in_mm(quanta[i], remainder[i]);
                far = far + moved * moved;
                furthest = furthest.max(moved.abs());
            }
            if !far.is_finite() {
                status[status::FLAGS].fetch_or(status::NOT_FINITE, Ordering::Relaxed);
            } else if furthest > L::Scalar::from_f64(MOST_MM) {
                status[status::FLAGS].fetch_or(status::OUT_OF_RANGE, Ordering::Relaxed);
            }
            if let Some((moved, far)) = &mut moved {
                *moved.at(0, node) = u32::from(square > *far * *far);
            }
            largest = largest.max(square);
            let v = velocity.at(node);
            fastest = fastest.max(dot(v, v));
        }
        if CONTACT {
            raise(&status[status::TRAVEL], largest.sqrt());
        }
        raise(&status[status::SPEED], fastest.sqrt());
    }
}
