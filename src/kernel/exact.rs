//! What a device must get right: to the last bit whole quanta with remainders over many small steps, order-independent integer
//! sums (compilers that re-associate floating-point sums would lose the steps), and memory that a workgroup shares; closely,
//! divisions and square roots.

use super::buffer::Kind::{Int, Scalar, Uint};
use super::interface::{Slot, constants, slot};
use super::io::Io;
use super::lane::{Lane, Real};
use super::position::{self, QUANTUM, carry, quanta};
use super::shader::{Shader, Share, WORKGROUP};
use super::stage::Kernel;
use std::ops::Range;
use std::sync::atomic::Ordering;

/// Steps per item.
pub const STEPS: usize = 2048;

/// Marches every item by many small steps.
pub struct Exact;
/// Sums of numbers that the invocations of a workgroup share: the upper half is added to the lower until one sum is left.
pub struct Together;
/// The square roots of ratios.
pub struct Roots;

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

impl Kernel for Together {
    const SHADER: Shader = Shader {
        share: Share::Workgroups(1),
        constants: &[&position::CONSTANTS],
        ..Shader::new("kernel/exact", "together")
    };
    const SLOTS: &'static [Slot] = &[Slot::row("sums", Uint, 1)];
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let mut sums = io.own::<u32>(slot!(Self::SLOTS, "sums"));
        for item in items {
            *sums.at(0, item) = (0..WORKGROUP).map(|local| (item * local + local * local) as u32).sum();
        }
    }
}

impl Kernel for Roots {
    const SHADER: Shader = Shader { constants: &[&position::CONSTANTS], ..Shader::new("kernel/exact", "roots") };
    const SLOTS: &'static [Slot] =
        &[Slot::read("numerators", Scalar), Slot::read("denominators", Scalar), Slot::row("out", Scalar, 1)];
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let (numerators, denominators) =
            (io.scalars(slot!(Self::SLOTS, "numerators")), io.scalars(slot!(Self::SLOTS, "denominators")));
        let mut out = io.own::<L::Scalar>(slot!(Self::SLOTS, "out"));
        for item in items {
            *out.at(0, item) = (numerators[item] / denominators[item]).sqrt();
        }
    }
}
