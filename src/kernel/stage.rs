//! Stages and plans: the whole algorithm as data. A backend runs stages and knows no physics.

use super::buffer::{Buffer, Description};
use super::lane::{Isa, Lane, Real, Work};
use super::row::Row;
use super::shader::Shader;
use bytemuck::Pod;
use std::marker::PhantomData;
use std::ops::Range;
use std::sync::atomic::{AtomicI32, AtomicU32, Ordering};

/// How the items of a stage write to a buffer. Reads of the same buffer by the same item are allowed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// Item `i` owns `stride` numbers from `i · stride` in each of `planes` equal parts of the buffer.
    Own { planes: usize, stride: usize },
    /// Items own disjoint numbers that a table or the constants of the stage name.
    Scatter,
    /// Integers that any item may add to; the order does not matter.
    Atomic,
}

/// One parallel loop over items.
#[derive(Clone)]
pub struct Stage {
    /// Name in messages, timings and `check --explain`.
    pub name: &'static str,
    /// First item.
    pub first: usize,
    /// Number of items.
    pub count: usize,
    /// Items in one chunk of work; fixed, so that results do not depend on the number of threads.
    pub grain: usize,
    /// Buffers in the order of the kernel's constants.
    pub reads: Vec<Buffer>,
    /// Buffers written, numbered after the reads.
    pub writes: Vec<(Buffer, Access)>,
    /// Small constants of the stage, laid out as the kernel's `Params`.
    pub params: Vec<u8>,
    /// Constants in the text of the shader.
    pub constants: Vec<(&'static str, usize)>,
    pub kernel: Code,
    /// Whether it must wait for the stages before it; else it may run beside them.
    pub waits: bool,
}

/// Everything a backend needs to run a scene.
#[derive(Default, Clone)]
pub struct Plan {
    pub buffers: Vec<Description>,
    /// Run when the contact candidates are used up.
    pub search: Vec<Stage>,
    /// Run every time step.
    pub step: Vec<Stage>,
    /// Run every few steps, to see whether a search is due.
    pub watch: Vec<Stage>,
    /// Run when energies and limits are wanted.
    pub diagnose: Vec<Stage>,
    /// Run after that, to add up what the host reads.
    pub collect: Vec<Stage>,
}

/// A kernel, written once for every precision and register width.
pub trait Kernel: 'static {
    /// Its WGSL twin.
    const SHADER: Shader;
    /// Whether it works on registers, and gains from the widest; one that works number by number is compiled for fewer.
    const WIDE: bool = true;
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>);
}

/// The code of a kernel with flags: `flagged!(Integrate; lines, gravity)` is that of `Integrate<true, false>` if there are lines and
/// there is no gravity.
macro_rules! flagged {
    ($($kernel:ident)::+; $($flag:expr),+) => { flagged!(@ ($($kernel)::+) []; $($flag),+) };
    (@ ($($kernel:tt)+) [$($known:tt)*]; $flag:expr $(, $rest:expr)*) => {
        if $flag {
            flagged!(@ ($($kernel)+) [$($known)* true,]; $($rest),*)
        } else {
            flagged!(@ ($($kernel)+) [$($known)* false,]; $($rest),*)
        }
    };
    (@ ($($kernel:tt)+) [$($known:tt)*];) => { Code::of::<$($kernel)+<$($known)*>>() };
}
pub(crate) use flagged;

/// A kernel as function pointers for the CPU, and where its WGSL twin is.
#[derive(Clone, Copy)]
pub struct Code {
    pub f32: fn(&Io<f32>, Range<usize>),
    pub f64: fn(&Io<f64>, Range<usize>),
    pub shader: Shader,
}

impl Code {
    pub fn of<K: Kernel>() -> Self {
        Self { f32: run::<K, f32>, f64: run::<K, f64>, shader: K::SHADER }
    }
}

fn run<K: Kernel, R: Real>(io: &Io<R>, items: Range<usize>) {
    struct Job<'a, K, R: Real>(&'a Io<'a, R>, Range<usize>, PhantomData<K>);
    impl<K: Kernel, R: Real> Work<R> for Job<'_, K, R> {
        const WIDE: bool = K::WIDE;
        #[inline(always)]
        fn run<L: Lane<Scalar = R>>(self) {
            K::run::<L>(self.0, self.1);
        }
    }
    R::dispatch(io.isa, Job(io, items, PhantomData::<K>));
}

/// A bound buffer.
#[derive(Clone, Copy)]
pub struct Binding {
    pub address: *mut u8,
    /// Numbers.
    pub len: usize,
    pub access: Option<Access>,
}

/// What a kernel sees of one chunk: its buffers, the row of the step and its parameters.
pub struct Io<'a, R: Real> {
    pub(crate) bindings: &'a [Binding],
    pub row: &'a Row<R>,
    pub(crate) params: &'a [u8],
    pub(crate) isa: Isa,
    pub(crate) items: Range<usize>,
}

// SAFETY: addresses are only turned into references in the ways that `Access` allows, which keeps the items of one
// stage apart; stages run one after the other.
unsafe impl<R: Real> Sync for Io<'_, R> {}

impl<R: Real> Io<'_, R> {
    fn read<T>(&self, index: usize) -> &[T] {
        let b = self.bindings[index];
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

    /// The numbers that the items of this chunk own in a buffer.
    pub fn own<T: Pod>(&self, index: usize) -> Own<'_, T> {
        let b = self.bindings[index];
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

    /// A buffer in which items write to disjoint places named by a table.
    pub fn scatter<T: Pod>(&self, index: usize) -> Scatter<'_, T> {
        let b = self.bindings[index];
        assert_eq!(b.access, Some(Access::Scatter), "buffer {index} is not bound as Scatter");
        Scatter { address: b.address.cast(), len: b.len, life: PhantomData }
    }

    /// Signed integers that every item may add to.
    pub fn atomics(&self, index: usize) -> &[AtomicI32] {
        let b = self.bindings[index];
        assert_eq!(b.access, Some(Access::Atomic), "buffer {index} is not bound as Atomic");
        // SAFETY: atomics may be shared.
        unsafe { std::slice::from_raw_parts(b.address.cast(), b.len) }
    }

    /// Unsigned integers that every item may add to.
    pub fn atomic_uints(&self, index: usize) -> &[AtomicU32] {
        let b = self.bindings[index];
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
}

/// Raises a shared maximum of non-negative numbers, kept as the bits of an f32.
#[inline(always)]
pub fn raise<R: Real>(place: &AtomicU32, value: R) {
    let bits = (value.to_f64() as f32).to_bits();
    if bits > place.load(Ordering::Relaxed) {
        place.fetch_max(bits, Ordering::Relaxed);
    }
}
