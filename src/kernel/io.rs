//! What a kernel sees of its buffers: references that keep the items of a stage apart.

use super::interface::Access;
use super::lane::{Isa, Real};
use super::row::Row;
use bytemuck::Pod;
use std::marker::PhantomData;
use std::ops::Range;
use std::sync::atomic::{AtomicI32, AtomicU32, Ordering};

/// A bound buffer.
#[derive(Clone, Copy)]
pub struct Binding {
    pub address: *mut u8,
    /// Length in numbers, and bytes per number.
    pub len: usize,
    pub size: usize,
    pub access: Option<Access>,
}

/// A kernel's view of one chunk: its buffers, the row of the step and its parameters.
pub struct Io<'a, R: Real> {
    pub(crate) bindings: &'a [Binding],
    pub row: &'a Row<R>,
    pub(crate) params: &'a [u8],
    pub(crate) isa: Isa,
    pub(crate) items: Range<usize>,
}

// SAFETY: addresses are only turned into references in the ways that `Access` allows, which keeps the items of one
// stage apart. Stages run one after the other, or as a chain: then a unit reads what its stages write only in its own parts of
// a `View`.
unsafe impl<R: Real> Sync for Io<'_, R> {}

impl<R: Real> Io<'_, R> {
    /// A buffer; checks the size of its numbers against the type used by the kernel.
    fn binding<T>(&self, index: usize) -> Binding {
        let b = self.bindings[index];
        assert_eq!(b.size, size_of::<T>(), "buffer {index} holds other numbers");
        b
    }

    fn read<T>(&self, index: usize) -> &[T] {
        let b = self.binding::<T>(index);
        assert!(b.access.is_none(), "buffer {index} is bound for writing");
        // SAFETY: the backend binds live arrays, and no stage writes to a buffer that it reads.
        unsafe { std::slice::from_raw_parts(b.address.cast(), b.len) }
    }

    /// Scalars bound for reading.
    #[inline(always)]
    pub fn scalars(&self, index: usize) -> &[R] {
        self.read(index)
    }
    /// Signed integers bound for reading.
    #[inline(always)]
    pub fn ints(&self, index: usize) -> &[i32] {
        self.read(index)
    }
    /// Unsigned integers bound for reading.
    #[inline(always)]
    pub fn uints(&self, index: usize) -> &[u32] {
        self.read(index)
    }

    /// A buffer bound for reading that another stage of the chain writes.
    pub fn view<T: Pod>(&self, index: usize) -> View<'_, T> {
        let b = self.binding::<T>(index);
        assert!(b.access.is_none(), "buffer {index} is bound for writing");
        View { address: b.address.cast(), len: b.len, life: PhantomData }
    }

    /// The numbers that the items of this chunk own in a buffer.
    pub fn own<T: Pod>(&self, index: usize) -> Own<'_, T> {
        let b = self.binding::<T>(index);
        let Some(Access::Own { planes, stride }) = b.access else { panic!("buffer {index} is not bound as Own") };
        Own {
            address: b.address.cast(),
            plane: b.len / planes,
            planes,
            stride,
            items: self.items.clone(),
            life: PhantomData,
        }
    }

    /// A buffer in which items write to disjoint places given by a table.
    pub fn scatter<T: Pod>(&self, index: usize) -> Scatter<'_, T> {
        let b = self.binding::<T>(index);
        assert_eq!(b.access, Some(Access::Scatter), "buffer {index} is not bound as Scatter");
        Scatter { address: b.address.cast(), len: b.len, life: PhantomData }
    }

    /// Signed integers to which every item may add.
    pub fn atomics(&self, index: usize) -> &[AtomicI32] {
        let b = self.binding::<AtomicI32>(index);
        assert_eq!(b.access, Some(Access::Atomic), "buffer {index} is not bound as Atomic");
        // SAFETY: atomics may be shared.
        unsafe { std::slice::from_raw_parts(b.address.cast(), b.len) }
    }

    /// Unsigned integers to which every item may add.
    pub fn atomic_uints(&self, index: usize) -> &[AtomicU32] {
        let b = self.binding::<AtomicU32>(index);
        assert_eq!(b.access, Some(Access::Atomic), "buffer {index} is not bound as Atomic");
        // SAFETY: atomics may be shared.
        unsafe { std::slice::from_raw_parts(b.address.cast(), b.len) }
    }

    /// The constants of the stage.
    #[inline(always)]
    pub fn params<P: Pod>(&self) -> P {
        bytemuck::pod_read_unaligned(self.params)
    }
}

/// A buffer of which a unit reads only its own parts, while other units may write to theirs.
#[derive(Clone, Copy)]
pub struct View<'a, T> {
    address: *const T,
    len: usize,
    life: PhantomData<&'a T>,
}

impl<T: Pod> View<'_, T> {
    /// Numbers in the buffer.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.len
    }
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }
    #[inline(always)]
    pub fn get(&self, index: usize) -> T {
        self.slice(index, 1)[0]
    }
    /// Numbers `first .. first + count`.
    #[inline(always)]
    pub fn slice(&self, first: usize, count: usize) -> &[T] {
        assert!(first <= self.len && count <= self.len - first);
        // SAFETY: in range, and only this unit writes to these places, in other stages.
        unsafe { std::slice::from_raw_parts(self.address.add(first), count) }
    }
}

/// The part of a buffer that a chunk of items owns.
pub struct Own<'a, T> {
    address: *mut T,
    plane: usize,
    planes: usize,
    stride: usize,
    items: Range<usize>,
    life: PhantomData<&'a mut T>,
}

impl<T: Pod> Own<'_, T> {
    /// The numbers of items `first .. first + count` in one plane.
    #[inline(always)]
    pub fn slice(&mut self, plane: usize, first: usize, count: usize) -> &mut [T] {
        assert!(plane < self.planes && first >= self.items.start && first + count <= self.items.end);
        // SAFETY: the items are this chunk's, chunks are disjoint, and the borrow of `self` keeps slices apart.
        unsafe {
            std::slice::from_raw_parts_mut(
                self.address.add(plane * self.plane + first * self.stride),
                count * self.stride,
            )
        }
    }

    /// The numbers of one item in one plane.
    #[inline(always)]
    pub fn item(&mut self, plane: usize, item: usize) -> &mut [T] {
        self.slice(plane, item, 1)
    }

    /// The first number of one item in one plane.
    #[inline(always)]
    pub fn at(&mut self, plane: usize, item: usize) -> &mut T {
        &mut self.slice(plane, item, 1)[0]
    }
}

/// A buffer with disjoint writes.
pub struct Scatter<'a, T> {
    address: *mut T,
    len: usize,
    life: PhantomData<&'a mut T>,
}

impl<T: Pod> Scatter<'_, T> {
    /// Numbers in the buffer.
    pub fn len(&self) -> usize {
        self.len
    }
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }
    #[inline(always)]
    pub fn get(&self, index: usize) -> T {
        assert!(index < self.len);
        // SAFETY: in range, and only this item touches this place.
        unsafe { *self.address.add(index) }
    }
    #[inline(always)]
    pub fn set(&mut self, index: usize, value: T) {
        assert!(index < self.len);
        // SAFETY: in range, and only this item touches this place.
        unsafe { *self.address.add(index) = value }
    }
    /// Numbers `first .. first + count`, all of which only this item touches.
    #[inline(always)]
    pub fn slice(&mut self, first: usize, count: usize) -> &mut [T] {
        assert!(first <= self.len && count <= self.len - first);
        // SAFETY: in range, only this item touches these places, and the borrow of `self` keeps slices apart.
        unsafe { std::slice::from_raw_parts_mut(self.address.add(first), count) }
    }
}

/// A number stored as the bits of an f32.
#[inline(always)]
pub fn read<R: Real>(place: &AtomicU32) -> R {
    R::from_f64(f64::from(f32::from_bits(place.load(Ordering::Relaxed))))
}

/// Raises a shared maximum of non-negative numbers, stored as the bits of an f32.
#[inline(always)]
pub fn raise<R: Real>(place: &AtomicU32, value: R) {
    let bits = (value.to_f64() as f32).to_bits();
    if bits > place.load(Ordering::Relaxed) {
        place.fetch_max(bits, Ordering::Relaxed);
    }
}
