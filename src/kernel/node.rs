//! Access to the state of nodes: three planes (x, y, z) a buffer.

use super::lane::Real;
use super::position::{QUANTUM, difference};
use super::stage::Io;
use super::vector::Vector;

/// Displacements: quanta and remainders.
#[derive(Clone, Copy)]
pub struct Displacements<'a, R> {
    quanta: &'a [i32],
    remainder: &'a [R],
    plane: usize,
}

impl<'a, R: Real> Displacements<'a, R> {
    /// From the bindings of a kernel.
    #[inline(always)]
    pub fn new(io: &'a Io<R>, quanta: usize, remainder: usize) -> Self {
        let (quanta, remainder) = (io.ints(quanta), io.scalars(remainder));
        Self { quanta, remainder, plane: remainder.len() / 3 }
    }

    /// Displacement of `a` less that of `b`, mm.
    #[inline(always)]
    pub fn between(&self, a: usize, b: usize) -> Vector<R> {
        let mut d = [R::from_f64(0.0); 3];
        for (k, d) in d.iter_mut().enumerate() {
            let (a, b) = (a + k * self.plane, b + k * self.plane);
            *d = difference(self.quanta[a], self.remainder[a], self.quanta[b], self.remainder[b]);
        }
        d
    }
}

/// A vector field on nodes.
#[derive(Clone, Copy)]
pub struct Field<'a, R> {
    values: &'a [R],
    plane: usize,
}

impl<'a, R: Real> Field<'a, R> {
    /// From a binding of a kernel.
    #[inline(always)]
    pub fn new(io: &'a Io<R>, index: usize) -> Self {
        let values = io.scalars(index);
        Self { values, plane: values.len() / 3 }
    }

    #[inline(always)]
    pub fn at(&self, node: usize) -> Vector<R> {
        [self.values[node], self.values[node + self.plane], self.values[node + 2 * self.plane]]
    }
}

/// Whole quanta per node (reference positions).
#[derive(Clone, Copy)]
pub struct Lattice<'a> {
    quanta: &'a [i32],
    plane: usize,
}

impl<'a> Lattice<'a> {
    /// From a binding of a kernel.
    #[inline(always)]
    pub fn new<R: Real>(io: &'a Io<R>, index: usize) -> Self {
        let quanta = io.ints(index);
        Self { quanta, plane: quanta.len() / 3 }
    }

    /// Reference position of `a` less that of `b`, plus whole quanta `shift` along x and y, mm.
    #[inline(always)]
    pub fn between<R: Real>(&self, a: usize, b: usize, shift: [i32; 2]) -> Vector<R> {
        let shift = [shift[0], shift[1], 0];
        let mut d = [R::from_f64(0.0); 3];
        for (k, d) in d.iter_mut().enumerate() {
            let (a, b) = (self.quanta[a + k * self.plane], self.quanta[b + k * self.plane]);
            *d = R::from_i32(a.wrapping_sub(b).wrapping_add(shift[k])) * R::from_f64(QUANTUM);
        }
        d
    }
}
