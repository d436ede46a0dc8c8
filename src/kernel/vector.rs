//! Vectors of three numbers, for kernels that work one item at a time. Products and sums are rounded separately: a fused
//! operation costs a function call wherever the compiler leaves the functions of an instruction set.

use super::lane::Lane;

/// Three components.
pub type Vector<L> = [L; 3];

#[inline(always)]
pub fn add<L: Lane>(a: Vector<L>, b: Vector<L>) -> Vector<L> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
pub fn sub<L: Lane>(a: Vector<L>, b: Vector<L>) -> Vector<L> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub fn scale<L: Lane>(a: Vector<L>, s: L) -> Vector<L> {
    [a[0] * s, a[1] * s, a[2] * s]
}

/// `a s + b`.
#[inline(always)]
pub fn fma<L: Lane>(a: Vector<L>, s: L, b: Vector<L>) -> Vector<L> {
    [a[0] * s + b[0], a[1] * s + b[1], a[2] * s + b[2]]
}

#[inline(always)]
pub fn dot<L: Lane>(a: Vector<L>, b: Vector<L>) -> L {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub fn cross<L: Lane>(a: Vector<L>, b: Vector<L>) -> Vector<L> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
pub fn norm<L: Lane>(a: Vector<L>) -> L {
    dot(a, a).sqrt()
}

/// Matrix times vector.
#[inline(always)]
pub fn apply<L: Lane>(m: &[[L; 3]; 3], a: Vector<L>) -> Vector<L> {
    [dot(m[0], a), dot(m[1], a), dot(m[2], a)]
}

/// `a` where the mask holds, else `b`.
#[inline(always)]
pub fn select<L: Lane>(mask: L::Mask, a: Vector<L>, b: Vector<L>) -> Vector<L> {
    [L::select(mask, a[0], b[0]), L::select(mask, a[1], b[1]), L::select(mask, a[2], b[2])]
}
