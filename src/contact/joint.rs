//! Forces and stiffness for the corners of a face, the nodes that carry a point, or those of a piece of a thread, in quanta.
//! Consecutive contacts often share these nodes: their sums are added to the nodes together.

use super::add_force;
use crate::kernel::lane::Real;
use crate::kernel::vector::{Vector, scale};
use std::sync::atomic::{AtomicI32, Ordering};

/// A vector in quanta.
#[inline(always)]
pub(crate) fn quanta<R: Real>(v: Vector<R>) -> [i32; 3] {
    [v[0].to_i32(), v[1].to_i32(), v[2].to_i32()]
}

/// Sums for some nodes.
pub(crate) struct Joint<const N: usize> {
    pub nodes: [usize; N],
    forces: [[i32; 3]; N],
    stiffness: [i32; N],
}

impl<const N: usize> Joint<N> {
    #[inline(always)]
    pub fn new(nodes: [usize; N]) -> Self {
        Self { nodes, forces: [[0; 3]; N], stiffness: [0; N] }
    }

    /// Adds the sums of a node to those of the scene.
    #[inline(always)]
    fn give(&self, a: usize, forces: &[AtomicI32], stiffness: &[AtomicI32]) {
        if self.forces[a] != [0; 3] {
            add_force(forces, self.nodes[a], self.forces[a]);
        }
        if self.stiffness[a] != 0 {
            stiffness[self.nodes[a]].fetch_add(self.stiffness[a], Ordering::Relaxed);
        }
    }

    /// Adds all sums to those of the scene.
    #[inline(always)]
    pub fn finish(&mut self, forces: &[AtomicI32], stiffness: &[AtomicI32]) {
        for a in 0..N {
            self.give(a, forces, stiffness);
        }
        *self = Self::new(self.nodes);
    }

    /// The sums of some nodes; those of other nodes are finished first.
    #[inline(always)]
    pub fn of(&mut self, nodes: [usize; N], forces: &[AtomicI32], stiffness: &[AtomicI32]) -> &mut Self {
        if nodes != self.nodes {
            self.finish(forces, stiffness);
            self.nodes = nodes;
        }
        self
    }

    /// As [`Self::of`], for pieces of a thread: the next piece shares all nodes but one with the one before.
    #[inline(always)]
    pub fn go_on(&mut self, nodes: [usize; N], forces: &[AtomicI32], stiffness: &[AtomicI32]) {
        if self.nodes[1..] != nodes[..N - 1] {
            self.of(nodes, forces, stiffness);
            return;
        }
        self.give(0, forces, stiffness);
        for a in 1..N {
            (self.forces[a - 1], self.stiffness[a - 1]) = (self.forces[a], self.stiffness[a]);
        }
        (self.nodes, self.forces[N - 1], self.stiffness[N - 1]) = (nodes, [0; 3], 0);
    }

    /// Adds stiffness by weights.
    #[inline(always)]
    pub fn stiffen<R: Real>(&mut self, quanta: R, weights: &[R; N]) {
        for a in 0..N {
            self.stiffness[a] = self.stiffness[a].wrapping_add((quanta * weights[a].abs()).to_i32());
        }
    }

    /// Distributes a force by weights: the last node takes the rounding error of the others.
    #[inline(always)]
    pub fn share<R: Real>(&mut self, force: [i32; 3], weights: &[R; N]) {
        let mut rest = force;
        let all: Vector<R> = [R::from_i32(force[0]), R::from_i32(force[1]), R::from_i32(force[2])];
        for a in 0..N - 1 {
            let part = quanta(scale(all, weights[a]));
            for k in 0..3 {
                rest[k] = rest[k].wrapping_sub(part[k]);
            }
            self.push(a, part);
        }
        self.push(N - 1, rest);
    }

    /// Adds a force to a node.
    #[inline(always)]
    pub fn push(&mut self, a: usize, force: [i32; 3]) {
        for k in 0..3 {
            self.forces[a][k] = self.forces[a][k].wrapping_add(force[k]);
        }
    }
}
