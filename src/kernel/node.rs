//! Access to nodal state: three planes (x, y, z) per buffer.

use super::io::Io;
use super::lane::Real;
use super::position::{QUANTUM, difference};
use super::vector::Vector;

/// Three planes of a buffer. They have the same length, so one bounds check of a node index serves all three.
#[derive(Clone, Copy)]
struct Planes<'a, T> {
    values: [&'a [T]; 3],
}

impl<'a, T: Copy> Planes<'a, T> {
    #[inline(always)]
    fn new(all: &'a [T]) -> Self {
        let plane = all.len() / 3;
        let (x, rest) = all.split_at(plane);
        let (y, rest) = rest.split_at(plane);
        Self { values: [x, y, &rest[..plane]] }
    }

    #[inline(always)]
    fn at(&self, node: usize) -> [T; 3] {
        let [x, y, z] = self.values;
        assert!(node < x.len());
        // SAFETY: the planes have the same length.
        unsafe { [*x.get_unchecked(node), *y.get_unchecked(node), *z.get_unchecked(node)] }
    }
}

/// Displacements: quanta and remainders.
#[derive(Clone, Copy)]
pub struct Displacements<'a, R> {
    quanta: Planes<'a, i32>,
    remainder: Planes<'a, R>,
}

impl<'a, R: Real> Displacements<'a, R> {
    /// From the bindings of a kernel.
    #[inline(always)]
    pub fn new(io: &'a Io<R>, quanta: usize, remainder: usize) -> Self {
        Self { quanta: Planes::new(io.ints(quanta)), remainder: Planes::new(io.scalars(remainder)) }
    }

    /// Quanta and remainders of a node.
    #[inline(always)]
    pub fn at(&self, node: usize) -> ([i32; 3], Vector<R>) {
        (self.quanta.at(node), self.remainder.at(node))
    }

    /// Displacement of `a` minus displacement of `b`, mm.
    #[inline(always)]
    pub fn between(&self, a: usize, b: usize) -> Vector<R> {
        let (qa, ra, qb, rb) = (self.quanta.at(a), self.remainder.at(a), self.quanta.at(b), self.remainder.at(b));
        let mut apart = [R::from_f64(0.0); 3];
        for k in 0..3 {
            apart[k] = difference(qa[k], ra[k], qb[k], rb[k]);
        }
        apart
    }
}

/// A vector field on nodes.
#[derive(Clone, Copy)]
pub struct Field<'a, R> {
    values: Planes<'a, R>,
}

impl<'a, R: Real> Field<'a, R> {
    /// From a binding of a kernel.
    #[inline(always)]
    pub fn new(io: &'a Io<R>, index: usize) -> Self {
        Self { values: Planes::new(io.scalars(index)) }
    }

    #[inline(always)]
    pub fn at(&self, node: usize) -> Vector<R> {
        self.values.at(node)
    }
}

/// Whole quanta per node (reference positions).
#[derive(Clone, Copy)]
pub struct Lattice<'a> {
    quanta: Planes<'a, i32>,
}

impl<'a> Lattice<'a> {
    /// From a binding of a kernel.
    #[inline(always)]
    pub fn new<R: Real>(io: &'a Io<R>, index: usize) -> Self {
        Self { quanta: Planes::new(io.ints(index)) }
    }

    /// Quanta of a node.
    #[inline(always)]
    pub fn at(&self, node: usize) -> [i32; 3] {
        self.quanta.at(node)
    }

    /// Reference position of `a` minus that of `b`, plus whole quanta `shift` along x and y, mm.
    #[inline(always)]
    pub fn between<R: Real>(&self, a: usize, b: usize, shift: [i32; 2]) -> Vector<R> {
        let (a, b, shift) = (self.quanta.at(a), self.quanta.at(b), [shift[0], shift[1], 0]);
        let mut apart = [R::from_f64(0.0); 3];
        for k in 0..3 {
            apart[k] = R::from_i32(a[k].wrapping_sub(b[k]).wrapping_add(shift[k])) * R::from_f64(QUANTUM);
        }
        apart
    }
}
