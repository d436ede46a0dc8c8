//! Two registers side by side: a kernel whose operations wait for each other does twice the work in the same time.

use super::lane::Lane;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A pair of registers.
#[derive(Debug, Clone, Copy)]
pub struct Two<L>(pub L, pub L);

impl<L: Lane> Add for Two<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0, self.1 + other.1)
    }
}
impl<L: Lane> Sub for Two<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0, self.1 - other.1)
    }
}
impl<L: Lane> Mul for Two<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0 * other.0, self.1 * other.1)
    }
}
impl<L: Lane> Div for Two<L> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self(self.0 / other.0, self.1 / other.1)
    }
}
impl<L: Lane> Neg for Two<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl<L: Lane> Lane for Two<L> {
    type Scalar = L::Scalar;
    type Mask = (L::Mask, L::Mask);
    const WIDTH: usize = 2 * L::WIDTH;

    #[inline(always)]
    fn splat(x: L::Scalar) -> Self {
        Self(L::splat(x), L::splat(x))
    }
    #[inline(always)]
    fn load(from: &[L::Scalar]) -> Self {
        Self(L::load(from), L::load(&from[L::WIDTH..]))
    }
    #[inline(always)]
    fn store(self, to: &mut [L::Scalar]) {
        self.0.store(to);
        self.1.store(&mut to[L::WIDTH..]);
    }
    #[inline(always)]
    fn fma(self, a: Self, b: Self) -> Self {
        Self(self.0.fma(a.0, b.0), self.1.fma(a.1, b.1))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt(), self.1.sqrt())
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs(), self.1.abs())
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        (self.0.lt(other.0), self.1.lt(other.1))
    }
    #[inline(always)]
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self {
        Self(L::select(mask.0, a.0, b.0), L::select(mask.1, a.1, b.1))
    }
    #[inline(always)]
    fn any(mask: Self::Mask) -> bool {
        L::any(mask.0) || L::any(mask.1)
    }
    #[inline(always)]
    fn mantissa_exponent(self) -> (Self, Self) {
        let (a, b) = (self.0.mantissa_exponent(), self.1.mantissa_exponent());
        (Self(a.0, b.0), Self(a.1, b.1))
    }
    #[inline(always)]
    fn exp2_whole(self) -> Self {
        Self(self.0.exp2_whole(), self.1.exp2_whole())
    }
    #[inline(always)]
    fn round(self) -> Self {
        Self(self.0.round(), self.1.round())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::lane::{Isa, Real, Work};
    use crate::kernel::math;

    /// Compares pairs of registers with registers of an instruction set, and masks with the numbers that they compare.
    struct Check;

    /// A function of a register, and of a pair.
    type Same<L> = (fn(L) -> L, fn(Two<L>) -> Two<L>);

    fn values<L: Lane>(x: L) -> Vec<L::Scalar> {
        let mut values = vec![L::Scalar::default(); L::WIDTH];
        x.store(&mut values);
        values
    }

    impl<R: Real> Work<R> for Check {
        const WIDE: bool = true;
        fn run<L: Lane<Scalar = R>>(self) {
            let numbers: Vec<R> = (0..2 * L::WIDTH).map(|i| R::from_f64(0.003 + 0.17 * i as f64)).collect();
            let (first, second) = (L::load(&numbers), L::load(&numbers[L::WIDTH..]));
            let two = Two::<L>::load(&numbers);
            let functions: [Same<L>; 4] = [
                (math::log1p, math::log1p),
                (math::exp, math::exp),
                (math::asinh_ratio, math::asinh_ratio),
                (
                    |x| (x * x - L::new(0.5)).sqrt().abs().min(x) / x,
                    |x| (x * x - Two::new(0.5)).sqrt().abs().min(x) / x,
                ),
            ];
            for (of_one, of_two) in functions {
                let both: Vec<R> = [values(of_one(first)), values(of_one(second))].concat();
                let bits = |all: &[R]| all.iter().map(|x| x.to_f64().to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(&values(of_two(two))), bits(&both));
            }
            for limit in 0..=2 * L::WIDTH {
                let below = Two::splat(R::from_f64(0.17 * limit as f64));
                let mask = two.lt(below);
                assert_eq!((Two::<L>::any(mask), Two::<L>::all(mask)), (limit > 0, limit == 2 * L::WIDTH));
                let mask = first.lt(below.0);
                assert_eq!((L::any(mask), L::all(mask)), (limit > 0, limit >= L::WIDTH));
            }
        }
    }

    #[test]
    fn pairs_give_the_bits_of_their_registers_and_masks_tell_any_and_all() {
        for isa in Isa::available() {
            f32::dispatch(isa, Check);
            f64::dispatch(isa, Check);
        }
    }
}
