//! Scalars and SIMD registers under one trait, so that a kernel is written once.
//!
//! Every operation is IEEE: add, subtract, multiply, divide, square root and *fused* multiply–add are correctly rounded
//! on every instruction set, comparisons select like `if`, and nothing is re-associated. A kernel therefore gives the
//! same bits on one lane as on sixteen.

use bytemuck::Pod;
use pulp::Simd;
use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// One number or a register of numbers.
pub trait Lane:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + 'static
{
    /// The number in one lane.
    type Scalar: Real;
    /// Result of a comparison, lane by lane.
    type Mask: Copy;
    /// Lanes per register.
    const WIDTH: usize;

    /// The same number in every lane.
    fn splat(x: Self::Scalar) -> Self;
    /// The first `WIDTH` numbers of a slice.
    fn load(from: &[Self::Scalar]) -> Self;
    /// Writes all lanes to the start of a slice.
    fn store(self, to: &mut [Self::Scalar]);
    /// `self * a + b`, rounded once.
    fn fma(self, a: Self, b: Self) -> Self;
    fn sqrt(self) -> Self;
    fn abs(self) -> Self;
    fn lt(self, other: Self) -> Self::Mask;
    /// `a` where the mask holds, else `b`.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
    /// Whether the mask holds in any lane.
    fn any(mask: Self::Mask) -> bool;
    /// Whether the mask holds in all lanes.
    #[inline(always)]
    fn all(mask: Self::Mask) -> bool {
        !Self::any(Self::new(0.5).lt(Self::select(mask, Self::new(0.0), Self::new(1.0))))
    }
    /// `(m, e)` with `self = m 2^e` and m in [√½, √2), for positive normal numbers.
    fn mantissa_exponent(self) -> (Self, Self);
    /// `2^self` for whole numbers in the range of the exponent.
    fn exp2_whole(self) -> Self;
    /// The nearest whole number, for magnitudes below 2²².
    fn round(self) -> Self;

    /// A constant.
    #[inline(always)]
    fn new(x: f64) -> Self {
        Self::splat(Self::Scalar::from_f64(x))
    }
    /// The minimum; `other` if either is NaN.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::select(self.lt(other), self, other)
    }
    /// The maximum; `other` if either is NaN.
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(other.lt(self), self, other)
    }
}

/// f32 or f64: the precision of a run.
pub trait Real: Lane<Scalar = Self> + Pod + Send + Sync + PartialOrd + Default {
    /// Whether positions are whole quanta plus a remainder (see [`super::position`]).
    const QUANTISED: bool;
    /// Number of terms of the series in [`super::math`].
    const LN_TERMS: usize;
    const EXP_TERMS: usize;
    const ASINH_TERMS: usize;

    fn from_f64(x: f64) -> Self;
    fn to_f64(self) -> f64;
    fn from_i32(x: i32) -> Self;
    /// Nearest whole number, within ± (2³¹ − 128), the largest one that both precisions and an i32 hold.
    fn to_i32(self) -> i32;
    fn is_finite(self) -> bool;
    /// Runs `work` on the registers of an instruction set.
    fn dispatch<W: Work<Self>>(isa: Isa, work: W);
}

/// Work for registers that are known only at run time.
pub trait Work<R: Real> {
    /// Whether it benefits from the widest available registers.
    const WIDE: bool;
    fn run<L: Lane<Scalar = R>>(self);
}

/// Instruction sets a kernel is compiled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Isa {
    /// One number at a time, baseline instructions.
    Scalar,
    /// 256-bit registers with fused multiply–add.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// 512-bit registers.
    #[cfg(target_arch = "x86_64")]
    Avx512,
    /// 128-bit registers.
    #[cfg(target_arch = "aarch64")]
    Neon,
}

#[cfg(target_arch = "x86_64")]
use pulp::x86::{V3, V4};

impl Isa {
    /// All instruction sets of this processor, best last.
    pub fn available() -> Vec<Isa> {
        let mut all = vec![Isa::Scalar];
        #[cfg(target_arch = "x86_64")]
        {
            all.extend(V3::try_new().map(|_| Isa::Avx2));
            all.extend(V4::try_new().map(|_| Isa::Avx512));
        }
        #[cfg(target_arch = "aarch64")]
        all.extend(pulp::aarch64::Neon::try_new().map(|_| Isa::Neon));
        all
    }

    /// The best instruction set of this processor.
    pub fn best() -> Isa {
        *Self::available().last().expect("scalar is always available")
    }
}

/// A register of f32 in instruction set `S`. Exists only inside [`Real::dispatch`], which has checked the processor.
#[derive(Clone, Copy, Debug)]
pub struct F32<S: Simd>(S::f32s);
/// A register of f64 in instruction set `S`. Exists only inside [`Real::dispatch`], which has checked the processor.
#[derive(Clone, Copy, Debug)]
pub struct F64<S: Simd>(S::f64s);

/// The token of the instruction set in use.
#[inline(always)]
fn token<S: Simd>() -> S {
    const { assert!(size_of::<S>() == 0) }
    // SAFETY: tokens are zero-sized proofs that the processor has the instructions, and registers of `S` are only
    // made in `Real::dispatch`, which holds such a proof.
    unsafe { std::mem::zeroed() }
}

macro_rules! register {
    ($name:ident, $scalar:ident, $register:ident, $mask:ident, $lanes:ident,
     $splat:ident, $add:ident, $sub:ident, $mul:ident, $div:ident, $neg:ident, $fma:ident, $sqrt:ident, $abs:ident,
     $lt:ident, $select:ident, $first_true:ident) => {
        impl<S: Simd> Add for $name<S> {
            type Output = Self;
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                Self(token::<S>().$add(self.0, other.0))
            }
        }
        impl<S: Simd> Sub for $name<S> {
            type Output = Self;
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                Self(token::<S>().$sub(self.0, other.0))
            }
        }
        impl<S: Simd> Mul for $name<S> {
            type Output = Self;
            #[inline(always)]
            fn mul(self, other: Self) -> Self {
                Self(token::<S>().$mul(self.0, other.0))
            }
        }
        impl<S: Simd> Div for $name<S> {
            type Output = Self;
            #[inline(always)]
            fn div(self, other: Self) -> Self {
                Self(token::<S>().$div(self.0, other.0))
            }
        }
        impl<S: Simd> Neg for $name<S> {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                Self(token::<S>().$neg(self.0))
            }
        }
        impl<S: Simd> Lane for $name<S> {
            type Scalar = $scalar;
            type Mask = S::$mask;
            const WIDTH: usize = S::$lanes;
            #[inline(always)]
            fn splat(x: $scalar) -> Self {
                Self(token::<S>().$splat(x))
            }
            #[inline(always)]
            fn load(from: &[$scalar]) -> Self {
                Self(bytemuck::pod_read_unaligned(bytemuck::cast_slice(&from[..Self::WIDTH])))
            }
            #[inline(always)]
            fn store(self, to: &mut [$scalar]) {
                to[..Self::WIDTH].copy_from_slice(bytemuck::cast_slice(&[self.0]));
            }
            #[inline(always)]
            fn fma(self, a: Self, b: Self) -> Self {
                Self(token::<S>().$fma(self.0, a.0, b.0))
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                Self(token::<S>().$sqrt(self.0))
            }
            #[inline(always)]
            fn abs(self) -> Self {
                Self(token::<S>().$abs(self.0))
            }
            #[inline(always)]
            fn lt(self, other: Self) -> Self::Mask {
                token::<S>().$lt(self.0, other.0)
            }
            #[inline(always)]
            fn select(mask: Self::Mask, a: Self, b: Self) -> Self {
                Self(token::<S>().$select(mask, a.0, b.0))
            }
            #[inline(always)]
            fn any(mask: Self::Mask) -> bool {
                token::<S>().$first_true(mask) < Self::WIDTH
            }
            register!(@whole $name);
        }
    };
    (@whole F32) => {
        #[inline(always)]
        fn mantissa_exponent(self) -> (Self, Self) {
            let s = token::<S>();
            let bias = s.splat_u32s(127 << 23);
            let bits = s.transmute_u32s_f32s(self.0);
            let steps = s.add_u32s(s.sub_u32s(bits, s.splat_u32s(SQRT_HALF_F32)), bias);
            let biased = s.wrapping_dyn_shr_u32s(steps, s.splat_u32s(23));
            let mantissa = s.add_u32s(s.sub_u32s(bits, s.wrapping_dyn_shl_u32s(biased, s.splat_u32s(23))), bias);
            let exponent = s.transmute_f32s_u32s(s.or_u32s(biased, s.splat_u32s(0x4b00_0000)));
            (Self(s.transmute_f32s_u32s(mantissa)), Self(exponent) - Self::splat(8_388_608.0 + 127.0))
        }
        #[inline(always)]
        fn exp2_whole(self) -> Self {
            let s = token::<S>();
            let bits = s.transmute_u32s_f32s((self + Self::splat(MAGIC_F32 + 127.0)).0);
            Self(s.transmute_f32s_u32s(s.wrapping_dyn_shl_u32s(bits, s.splat_u32s(23))))
        }
        #[inline(always)]
        fn round(self) -> Self {
            (self + Self::splat(MAGIC_F32)) - Self::splat(MAGIC_F32)
        }
    };
    (@whole F64) => {
        #[inline(always)]
        fn mantissa_exponent(self) -> (Self, Self) {
            let (mut m, mut e) = (self, self);
            let exponents: &mut [f64] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut e.0));
            let mantissas: &mut [f64] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut m.0));
            for (m, e) in mantissas.iter_mut().zip(exponents) {
                (*m, *e) = m.mantissa_exponent();
            }
            (m, e)
        }
        #[inline(always)]
        fn exp2_whole(self) -> Self {
            let mut x = self;
            for x in bytemuck::cast_slice_mut::<_, f64>(std::slice::from_mut(&mut x.0)) {
                *x = x.exp2_whole();
            }
            x
        }
        #[inline(always)]
        fn round(self) -> Self {
            (self + Self::splat(MAGIC_F64)) - Self::splat(MAGIC_F64)
        }
    };
}

/// 2³¹ − 128.
const MOST_I32: f64 = 2_147_483_520.0;
/// Adding and subtracting 1.5 · 2^(mantissa bits) rounds to a whole number.
const MAGIC_F32: f32 = 12_582_912.0;
const MAGIC_F64: f64 = 6_755_399_441_055_744.0;
pub(super) const SQRT_HALF_F32: u32 = std::f32::consts::FRAC_1_SQRT_2.to_bits();
const SQRT_HALF_F64: u64 = std::f64::consts::FRAC_1_SQRT_2.to_bits();

register!(
    F32,
    f32,
    f32s,
    m32s,
    F32_LANES,
    splat_f32s,
    add_f32s,
    sub_f32s,
    mul_f32s,
    div_f32s,
    neg_f32s,
    mul_add_f32s,
    sqrt_f32s,
    abs_f32s,
    less_than_f32s,
    select_f32s,
    first_true_m32s
);
register!(
    F64,
    f64,
    f64s,
    m64s,
    F64_LANES,
    splat_f64s,
    add_f64s,
    sub_f64s,
    mul_f64s,
    div_f64s,
    neg_f64s,
    mul_add_f64s,
    sqrt_f64s,
    abs_f64s,
    less_than_f64s,
    select_f64s,
    first_true_m64s
);

macro_rules! scalar {
    ($scalar:ident, $bits:ident, $mantissa_bits:expr, $bias:expr, $sqrt_half:ident, $magic:ident, $register:ident,
     $quantised:expr, $ln:expr, $exp:expr, $asinh:expr) => {
        impl Lane for $scalar {
            type Scalar = $scalar;
            type Mask = bool;
            const WIDTH: usize = 1;
            #[inline(always)]
            fn splat(x: $scalar) -> Self {
                x
            }
            #[inline(always)]
            fn load(from: &[$scalar]) -> Self {
                from[0]
            }
            #[inline(always)]
            fn store(self, to: &mut [$scalar]) {
                to[0] = self;
            }
            #[inline(always)]
            fn fma(self, a: Self, b: Self) -> Self {
                $scalar::mul_add(self, a, b)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                $scalar::sqrt(self)
            }
            #[inline(always)]
            fn abs(self) -> Self {
                $scalar::abs(self)
            }
            #[inline(always)]
            fn lt(self, other: Self) -> bool {
                self < other
            }
            #[inline(always)]
            fn select(mask: bool, a: Self, b: Self) -> Self {
                if mask { a } else { b }
            }
            #[inline(always)]
            fn any(mask: bool) -> bool {
                mask
            }
            #[inline(always)]
            fn mantissa_exponent(self) -> (Self, Self) {
                const BIAS: $bits = $bias << $mantissa_bits;
                let bits = self.to_bits();
                let biased = bits.wrapping_sub($sqrt_half).wrapping_add(BIAS) >> $mantissa_bits;
                let mantissa = bits.wrapping_sub(biased << $mantissa_bits).wrapping_add(BIAS);
                ($scalar::from_bits(mantissa), biased as $scalar - $bias as $scalar)
            }
            #[inline(always)]
            fn exp2_whole(self) -> Self {
                $scalar::from_bits((self + ($magic + $bias as $scalar)).to_bits() << $mantissa_bits)
            }
            #[inline(always)]
            fn round(self) -> Self {
                (self + $magic) - $magic
            }
        }
        impl Real for $scalar {
            const QUANTISED: bool = $quantised;
            const LN_TERMS: usize = $ln;
            const EXP_TERMS: usize = $exp;
            const ASINH_TERMS: usize = $asinh;
            #[inline(always)]
            fn from_f64(x: f64) -> Self {
                x as $scalar
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                self as f64
            }
            #[inline(always)]
            fn from_i32(x: i32) -> Self {
                x as $scalar
            }
            #[inline(always)]
            fn to_i32(self) -> i32 {
                // the magic constant rounds to even on every instruction set
                let whole = if self.abs() < 4e6 { self.round() } else { self };
                let within = Lane::min(Lane::max(whole, -MOST_I32 as $scalar), MOST_I32 as $scalar);
                // SAFETY: the number is within the range of an i32. A checked cast would not be done in registers.
                unsafe { within.to_int_unchecked() }
            }
            #[inline(always)]
            fn is_finite(self) -> bool {
                $scalar::is_finite(self)
            }
            fn dispatch<W: Work<Self>>(isa: Isa, work: W) {
                #[cfg(target_arch = "x86_64")]
                match isa {
                    Isa::Avx512 if W::WIDE => {
                        if let Some(simd) = V4::try_new() {
                            return Simd::vectorize(simd, On(work, std::marker::PhantomData::<$scalar>));
                        }
                    }
                    Isa::Avx512 | Isa::Avx2 => {
                        if let Some(simd) = V3::try_new() {
                            return Simd::vectorize(simd, On(work, std::marker::PhantomData::<$scalar>));
                        }
                    }
                    Isa::Scalar => {}
                }
                #[cfg(target_arch = "aarch64")]
                if isa == Isa::Neon
                    && let Some(simd) = pulp::aarch64::Neon::try_new()
                {
                    return Simd::vectorize(simd, On(work, std::marker::PhantomData::<$scalar>));
                }
                work.run::<$scalar>();
            }
        }
        impl<W: Work<$scalar>> pulp::WithSimd for On<W, $scalar> {
            type Output = ();
            #[inline(always)]
            fn with_simd<S: Simd>(self, _: S) {
                self.0.run::<$register<S>>();
            }
        }
    };
}

/// Carries work into functions compiled for one instruction set.
struct On<W, R>(W, std::marker::PhantomData<R>);

scalar!(f32, u32, 23, 127u32, SQRT_HALF_F32, MAGIC_F32, F32, true, 5, 8, 4);
scalar!(f64, u64, 52, 1023u64, SQRT_HALF_F64, MAGIC_F64, F64, false, 12, 14, 9);
