//! How far contact points have slipped since the start, for pictures: taken from the sums of contact before these are set back.

use super::sums::{SUM_SLIP, sums};
use crate::kernel::lane::Lane;
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::{Io, Kernel};
use std::ops::Range;

pub const CONTACT_SUMS: usize = 0;
/// Slip of each point, mm.
const SLIP: usize = 1;

/// Adds the slip of the last steps.
pub struct Slip<const PERIODIC: bool>;

impl<const PERIODIC: bool> Kernel for Slip<PERIODIC> {
    const SHADER: Shader = Shader { defines: &[when(PERIODIC, "PERIODIC")], ..Shader::new("contact/slip", "slip") };

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let (size, sums) = (const { sums(true, PERIODIC) }, io.scalars(CONTACT_SUMS));
        let mut slip = io.own::<L::Scalar>(SLIP);
        for item in items {
            let slip = slip.at(0, item);
            *slip = *slip + sums[size * item + SUM_SLIP];
        }
    }
}
