//! Arithmetic that a device must get right to the last bit: whole quanta with remainders over many small steps, and
//! order-independent integer sums. Compilers that re-associate floating-point sums would lose the steps.

use super::buffer::Kind::{Int, Scalar};
use super::interface::{Slot, constants, slot};
use super::lane::{Lane, Real};
use super::position::{self, QUANTUM, carry, quanta};
use super::shader::Shader;
use super::stage::{Io, Kernel};
use std::ops::Range;
use std::sync::atomic::Ordering;

/// Steps per item.
pub const STEPS: usize = 2048;

/// Marches every item by many small steps.
pub struct Exact;

/// Start of item `i`, quanta, and its increment per step, mm: from a thousandth of a quantum to a hundred quanta.
pub fn start(item: usize) -> (i32, f64) {
    let sign = if item.is_multiple_of(2) { 1.0 } else { -1.0 };
    (quanta(item as f64 * 0.37 - 150.0), sign * QUANTUM * libm::pow(10.0, (item % 97) as f64 * 5.0 / 96.0 - 3.0))
}

impl Kernel for Exact {
    const SHADER: Shader =
        Shader { constants: &[&position::CONSTANTS, &constants![uint: STEPS]], ..Shader::new("kernel/exact", "exact") };
    const SLOTS: &'static [Slot] = &[
        Slot::read("increments", Scalar),
        Slot::row("quanta", Int, 1),
        Slot::row("remainders", Scalar, 1),
        // sum of all quanta, wrapping
        Slot::atomic("sum", Int),
    ];
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let increments = io.scalars(slot!(Self::SLOTS, "increments"));
        let mut quanta = io.own::<i32>(slot!(Self::SLOTS, "quanta"));
        let mut remainders = io.own::<L::Scalar>(slot!(Self::SLOTS, "remainders"));
        let sum = io.atomics(slot!(Self::SLOTS, "sum"));
        for item in items {
            let (mut q, mut r) = (*quanta.at(0, item), *remainders.at(0, item));
            for step in 0..STEPS {
                let share = L::Scalar::from_i32((step % 7) as i32 + 1);
                (q, r) = carry(q, r + increments[item] * share);
            }
            (*quanta.at(0, item), *remainders.at(0, item)) = (q, r);
            sum[0].fetch_add(q, Ordering::Relaxed);
        }
    }
}
