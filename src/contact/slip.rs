//! How far slaves have slipped since the start, for pictures: taken from the sums of contact before these are set back.

use super::penalty::{SUM_SLIP, SUMS};
use crate::kernel::lane::Lane;
use crate::kernel::shader::Shader;
use crate::kernel::stage::{Io, Kernel};
use std::ops::Range;

pub const CONTACT_SUMS: usize = 0;
/// Slip of each slave, mm.
const SLIP: usize = 1;

/// Adds the slip of the last steps.
pub struct Slip;

impl Kernel for Slip {
    const SHADER: Shader = Shader::new("contact/slip", "slip");

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let sums = io.scalars(CONTACT_SUMS);
        let mut slip = io.own::<L::Scalar>(SLIP);
        for item in items {
            let slip = slip.at(0, item);
            *slip = *slip + sums[SUMS * item + SUM_SLIP];
        }
    }
}
