//! Contact skin (Verlet skin): largest nodal speed, validity of positions and, with contact, the distance travelled since the
//! last candidate check.
//!
//! Two [`Shares`] of the skin decide on checks and searches. A check is due once a node has travelled by the share `used`. It
//! searches only where bodies have moved relative to each other: nodes store their displacements at the last full search, and
//! candidates from that search stay valid as long as nothing within reach has moved by more than the share `apart` relative to
//! its carrier. Bodies that move with their surroundings, as in the clamp of a specimen, are not searched. A carrier searched
//! since then is searched at every check, until there are enough of them for a full search to pay.
//!
//! A pair in no list had a gap larger than the skin when the list was made. Since then the gap has closed by at most these
//! shares of the skin:
//!
//! | cause | free scene | periodic cell |
//! |---|---|---|
//! | relative motion until the last check, `apart` | 0.4 | 0.125 |
//! | affine motion of the cell until the last check, at most `apart`, or everything is searched | – | 0.125 |
//! | travel of both sides since the last check, 2 `used` | 0.4 | 0.5 |
//! | sum | 0.8 | 0.75 |
//!
//! The rest of the skin covers what nodes travel beyond `used` in a burst of steps, after which the check comes. A larger `apart`
//! saves searches, which cost more than checks. A cell pays for it twice, so its share is smaller.

use super::status;
use crate::kernel::buffer::Kind::{Int, Scalar, Uint};
use crate::kernel::interface::{Constant, Slot, slot};
use crate::kernel::io::{Io, raise};
use crate::kernel::lane::{Lane, Real};
use crate::kernel::node::Field;
use crate::kernel::position::{self, MOST_MM, difference, in_mm};
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::Kernel;
use crate::kernel::vector::dot;
use std::ops::Range;
use std::sync::atomic::Ordering;

/// Shares of the contact skin that motion may use up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shares {
    /// Share that nodes may travel before a check.
    pub used: f64,
    /// Share that bodies may have moved relative to each other since candidates were searched.
    pub apart: f64,
}

impl Shares {
    /// The shares of a periodic cell or of a free scene.
    pub const fn new(periodic: bool) -> Self {
        if periodic { Self { used: 0.25, apart: 0.125 } } else { Self { used: 0.2, apart: 0.4 } }
    }
}

/// Constants shared with the twin.
const CONSTANTS: &[&[Constant]] = &[&position::CONSTANTS, &status::CONSTANTS];

/// Stores displacements at a check.
pub struct Remember;
/// Updates the largest speed; with `CONTACT` also the largest distance travelled since the last check.
pub struct Travel<const CONTACT: bool>;

impl Kernel for Remember {
    const SHADER: Shader = Shader { constants: CONSTANTS, ..Shader::new("contact/skin", "remember") };
    const SLOTS: &'static [Slot] = &[
        Slot::read("quanta", Int),
        Slot::read("remainder", Scalar),
        Slot::planes("search_quanta", Int, 3),
        Slot::planes("search_remainder", Scalar, 3),
    ];
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let (quanta, remainder) = (io.ints(slot!(Self::SLOTS, "quanta")), io.scalars(slot!(Self::SLOTS, "remainder")));
        let mut search_quanta = io.own::<i32>(slot!(Self::SLOTS, "search_quanta"));
        let mut search_remainder = io.own::<L::Scalar>(slot!(Self::SLOTS, "search_remainder"));
        let plane = remainder.len() / 3;
        for node in items {
            for k in 0..3 {
                *search_quanta.at(k, node) = quanta[node + k * plane];
                *search_remainder.at(k, node) = remainder[node + k * plane];
            }
        }
    }
}

impl<const CONTACT: bool> Kernel for Travel<CONTACT> {
    const SHADER: Shader =
        Shader { defines: &[when(CONTACT, "CONTACT")], constants: CONSTANTS, ..Shader::new("contact/skin", "travel") };
    const SLOTS: &'static [Slot] = &[
        Slot::read("quanta", Int),
        Slot::read("remainder", Scalar),
        Slot::read("velocity", Scalar),
        // displacements at the last check
        Slot::read("search_quanta", Int).when(CONTACT),
        Slot::read("search_remainder", Scalar).when(CONTACT),
        Slot::atomic("status", Uint),
    ];
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let (quanta, remainder) = (io.ints(slot!(Self::SLOTS, "quanta")), io.scalars(slot!(Self::SLOTS, "remainder")));
        let searched = CONTACT.then(|| {
            let quanta = io.ints(slot!(Self::SLOTS, "search_quanta", CONTACT));
            (quanta, io.scalars(slot!(Self::SLOTS, "search_remainder", CONTACT)))
        });
        let status = io.atomic_uints(slot!(Self::SLOTS, "status"));
        let plane = remainder.len() / 3;
        let velocity = Field::new(io, slot!(Self::SLOTS, "velocity"));
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
