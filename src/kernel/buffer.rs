//! Buffers: plain arrays of scalars or integers, aligned to cache lines, the same bytes on every backend.

use super::lane::Real;
use bytemuck::{Pod, Zeroable};
use std::ops::Range;

/// Number type of a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Scalars of the run's precision.
    Scalar,
    /// Signed integers.
    Int,
    /// Unsigned integers.
    Uint,
}

/// Handle of a buffer in a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Buffer(pub(crate) usize);

impl Buffer {
    /// Index of its description in the plan.
    pub fn number(self) -> usize {
        self.0
    }
}

/// Description of a buffer in a plan.
#[derive(Debug, Clone)]
pub struct Description {
    pub name: &'static str,
    pub kind: Kind,
    /// Length in numbers, not bytes.
    pub len: usize,
    /// Part of the state: hashed and written to checkpoints.
    pub persistent: bool,
    /// Initial contents; the rest is zero.
    pub initial: Initial,
}

/// Initial contents.
#[derive(Debug, Clone)]
pub enum Initial {
    Zero,
    Scalar(Vec<f64>),
    Int(Vec<i32>),
    Uint(Vec<u32>),
}

/// Memory aligned to cache lines.
#[derive(Clone, Copy, Zeroable, Pod)]
#[repr(C, align(64))]
pub(crate) struct CacheLine([u8; 64]);

/// An array of one kind in host memory, aligned to cache lines.
#[derive(Clone)]
pub struct Array {
    lines: Vec<CacheLine>,
    len: usize,
    size: usize,
}

impl Array {
    /// Zeros, `len` numbers of `size` bytes.
    pub fn zeros(len: usize, size: usize) -> Self {
        let lines = vec![CacheLine::zeroed(); (len * size).div_ceil(64)];
        Self { lines, len, size }
    }

    /// The described buffer in precision `R`.
    pub fn new<R: Real>(description: &Description) -> Self {
        let size = if description.kind == Kind::Scalar { size_of::<R>() } else { 4 };
        let mut array = Self::zeros(description.len, size);
        match &description.initial {
            Initial::Zero => {}
            Initial::Scalar(values) => {
                for (to, from) in array.slice_mut::<R>().iter_mut().zip(values) {
                    *to = R::from_f64(*from);
                }
            }
            Initial::Int(values) => array.slice_mut::<i32>()[..values.len()].copy_from_slice(values),
            Initial::Uint(values) => array.slice_mut::<u32>()[..values.len()].copy_from_slice(values),
        }
        array
    }

    pub fn slice<T: Pod>(&self) -> &[T] {
        assert_eq!(size_of::<T>(), self.size);
        &bytemuck::cast_slice(&self.lines)[..self.len]
    }

    pub fn slice_mut<T: Pod>(&mut self) -> &mut [T] {
        assert_eq!(size_of::<T>(), self.size);
        &mut bytemuck::cast_slice_mut(&mut self.lines)[..self.len]
    }

    /// The bytes of all numbers.
    pub fn bytes(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.lines)[..self.len * self.size]
    }

    /// Replaces the bytes of all numbers.
    pub fn set_bytes(&mut self, bytes: &[u8]) {
        bytemuck::cast_slice_mut::<_, u8>(&mut self.lines)[..self.len * self.size].copy_from_slice(bytes);
    }

    /// Sets all numbers to zero.
    pub fn clear(&mut self) {
        self.lines.fill(CacheLine::zeroed());
    }

    /// Sets some numbers to zero.
    pub fn clear_part(&mut self, numbers: Range<usize>) {
        let size = self.size;
        bytemuck::cast_slice_mut::<_, u8>(&mut self.lines)[numbers.start * size..numbers.end * size].fill(0);
    }

    /// Address of the first number; it is stable for the lifetime of the array.
    pub fn address(&mut self) -> *mut u8 {
        self.lines.as_mut_ptr().cast()
    }

    pub fn len(&self) -> usize {
        self.len
    }

    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Bytes per number.
    pub fn size(&self) -> usize {
        self.size
    }
}

/// Numbers of a buffer on the host.
#[derive(Debug, Clone, PartialEq)]
pub enum Contents {
    Scalars(Vec<f64>),
    Ints(Vec<i32>),
    Uints(Vec<u32>),
}

impl Contents {
    /// The scalars of a buffer of scalars; none of another.
    pub fn scalars(self) -> Vec<f64> {
        if let Self::Scalars(values) = self { values } else { Vec::new() }
    }

    /// The unsigned integers of a buffer of them; none of another.
    pub fn uints(self) -> Vec<u32> {
        if let Self::Uints(values) = self { values } else { Vec::new() }
    }
}
