//! Positions as whole quanta plus a remainder.
//!
//! An f32 displacement of 60 mm resolves 4e-6 mm, so explicit steps of 1e-8 mm would never change it. Reference positions are
//! therefore whole multiples of a quantum of 2⁻²³ mm (1.2e-7 mm), and displacements are an i32 number of quanta plus an f32
//! remainder, at most half a quantum after the carry. Differences of near nodes are exact integers before they become f32. The range
//! is ±256 mm. In f64 runs the integer part of displacements stays zero.

use super::interface::{Constant, constants};
use super::lane::Real;

/// Size of a quantum, mm: 2⁻²³.
pub const QUANTUM: f64 = 1.0 / 8_388_608.0;
/// Quanta per mm.
pub const QUANTA_PER_MM: f64 = 8_388_608.0;
/// Largest displacement along an axis, mm; far enough inside the range of quanta that no node leaves it between two checks.
pub const MOST_MM: f64 = 252.0;
/// Constants of positions shared with the twins.
pub const CONSTANTS: [Constant; 3] = constants![scalar: QUANTUM, QUANTA_PER_MM, MOST_MM];

/// Nearest whole number of quanta of a coordinate in mm.
pub fn quanta(mm: f64) -> i32 {
    libm::rint(mm * QUANTA_PER_MM) as i32
}

/// Moves whole quanta from the remainder into the integer part.
#[inline(always)]
pub fn carry<R: Real>(quanta: i32, remainder: R) -> (i32, R) {
    if !R::QUANTISED {
        return (quanta, remainder);
    }
    let whole = (remainder * R::from_f64(QUANTA_PER_MM)).to_i32();
    (quanta.wrapping_add(whole), remainder - R::from_i32(whole) * R::from_f64(QUANTUM))
}

/// A displacement, mm.
#[inline(always)]
pub fn in_mm<R: Real>(quanta: i32, remainder: R) -> R {
    R::from_i32(quanta) * R::from_f64(QUANTUM) + remainder
}

/// Difference of two positions, mm.
#[inline(always)]
pub fn difference<R: Real>(quanta: i32, remainder: R, from_quanta: i32, from_remainder: R) -> R {
    R::from_i32(quanta.wrapping_sub(from_quanta)) * R::from_f64(QUANTUM) + (remainder - from_remainder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_million_tiny_steps_do_not_get_lost() {
        let (mut q, mut r) = (quanta(60.0), 0.0f32);
        for _ in 0..1_000_000 {
            (q, r) = carry(q, r + 1e-8);
        }
        let moved = difference(q, r, quanta(60.0), 0.0f32);
        assert!((moved - 0.01).abs() < 2e-6, "{moved}");
    }
}
