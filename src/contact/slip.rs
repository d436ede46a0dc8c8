//! Accumulated slip of contact points since the start, for pictures: read from the contact sums before they are reset.

use super::sums::{SUM_SLIP, shared, sums};
use crate::kernel::buffer::Kind::Scalar;
use crate::kernel::interface::{Slot, slot};
use crate::kernel::io::Io;
use crate::kernel::lane::Lane;
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::Kernel;
use std::ops::Range;

/// Adds the slip of the last steps.
pub struct Slip<const PERIODIC: bool>;

impl<const PERIODIC: bool> Kernel for Slip<PERIODIC> {
    const SHADER: Shader = Shader {
        defines: &[when(PERIODIC, "PERIODIC")],
        constants: &[&shared(true, PERIODIC)],
        ..Shader::new("contact/slip", "slip")
    };
    // of each point, mm
    const SLOTS: &'static [Slot] = &[Slot::read("sums", Scalar), Slot::row("slipped", Scalar, 1)];
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let (size, sums) = (const { sums(true, PERIODIC) }, io.scalars(slot!(Self::SLOTS, "sums")));
        let mut slip = io.own::<L::Scalar>(slot!(Self::SLOTS, "slipped"));
        for item in items {
            let slip = slip.at(0, item);
            *slip = *slip + sums[size * item + SUM_SLIP];
        }
    }
}
