//! Stages and plans: the whole algorithm as data. A backend runs stages and knows no physics.

use super::buffer::{Buffer, Description};
use super::interface::{Access, Slot};
use super::lane::{Isa, Lane, Real, Work};
use super::row::Row;
use super::shader::Shader;
use bytemuck::Pod;
use std::marker::PhantomData;
use std::ops::Range;
use std::sync::atomic::{AtomicI32, AtomicU32, Ordering};

/// The buffer to bind to a slot, if any, and the number of entries per item if only the plan knows it.
#[derive(Debug, Clone, Copy)]
pub struct Wire {
    buffer: Option<Buffer>,
    stride: Option<usize>,
}

impl From<Buffer> for Wire {
    fn from(buffer: Buffer) -> Self {
        Self { buffer: Some(buffer), stride: None }
    }
}

impl From<Option<Buffer>> for Wire {
    fn from(buffer: Option<Buffer>) -> Self {
        Self { buffer, stride: None }
    }
}

impl From<(Buffer, usize)> for Wire {
    fn from((buffer, stride): (Buffer, usize)) -> Self {
        Self { buffer: Some(buffer), stride: Some(stride) }
    }
}

/// Buffers by the names of slots: `wires![mass, velocity, forces: beam_force]`; a buffer may be an option, or have a stride.
macro_rules! wires {
    ($($name:ident $(: $buffer:expr)?),* $(,)?) => {
        [$((stringify!($name), crate::kernel::stage::wires!(@ $name $($buffer)?))),*]
    };
    (@ $name:ident) => { crate::kernel::stage::Wire::from($name) };
    (@ $name:ident $buffer:expr) => { crate::kernel::stage::Wire::from($buffer) };
}
pub(crate) use wires;

/// One parallel loop over items. Only the crate makes stages: a kernel relies on its slots being bound as declared.
#[derive(Clone)]
pub struct Stage {
    pub(crate) name: &'static str,
    /// First item.
    pub(crate) first: usize,
    /// Number of items.
    pub(crate) count: usize,
    /// Items per chunk of work; fixed, so that results do not depend on the number of threads.
    pub(crate) grain: usize,
    /// Buffers of the active slots that are read.
    pub(crate) reads: Vec<Buffer>,
    /// Buffers of the active slots that are written, numbered after the reads.
    pub(crate) writes: Vec<(Buffer, Access)>,
    /// Small constants of the stage, laid out as the kernel's `Params`.
    pub(crate) params: Vec<u8>,
    /// Scene constants for the text of the shader.
    pub(crate) constants: Vec<(&'static str, usize)>,
    pub(crate) kernel: Code,
    /// Whether it waits for the previous stages; else it may run beside them.
    pub(crate) waits: bool,
}

impl Stage {
    /// A stage over `count` items in chunks of `grain` that waits for the previous stages. An inactive slot needs no buffer.
    ///
    /// # Panics
    /// If a slot has no buffer, a buffer has no slot, a stride does not fit, or a buffer is written through one slot and bound
    /// to another.
    pub(crate) fn new(
        name: &'static str,
        kernel: Code,
        (count, grain): (usize, usize),
        wires: &[(&'static str, Wire)],
        params: impl Pod,
    ) -> Self {
        let unknown = wires.iter().find(|(wire, _)| kernel.slots.iter().all(|slot| slot.name != *wire));
        assert!(unknown.is_none(), "stage `{name}`: its kernel has no slot for {unknown:?}");
        let (mut reads, mut writes) = (Vec::new(), Vec::new());
        for slot in kernel.slots.iter().filter(|slot| slot.there) {
            let wrong = |what: &str| -> ! { panic!("stage `{name}`, slot `{}`: {what}", slot.name) };
            let wire = wires.iter().find(|(wire, _)| *wire == slot.name).map(|(_, wire)| *wire);
            let Some(Wire { buffer: Some(buffer), stride }) = wire else { wrong("no buffer is bound to it") };
            match slot.access_with(stride).unwrap_or_else(|what| wrong(what)) {
                None if writes.is_empty() => reads.push(buffer),
                None => wrong("is read and declared behind one that is written"),
                Some(access) => writes.push((buffer, access)),
            }
        }
        for (i, (written, _)) in writes.iter().enumerate() {
            let twice = reads.contains(written) || writes[..i].iter().any(|(other, _)| other == written);
            assert!(!twice, "stage `{name}`: a buffer that it writes is bound twice");
        }
        let params = bytemuck::bytes_of(&params).to_vec();
        Self { name, first: 0, count, grain, reads, writes, params, constants: Vec::new(), kernel, waits: true }
    }

    /// A stage of a kernel from outside the crate, with its items, and buffers by slot name.
    ///
    /// # Safety
    /// No two items of the kernel write to the same number of a buffer that it binds with [`Access::Scatter`].
    pub unsafe fn foreign<K: Kernel>(
        name: &'static str,
        items: Range<usize>,
        buffers: &[(&'static str, Buffer)],
    ) -> Self {
        let wires: Vec<_> = buffers.iter().map(|(slot, buffer)| (*slot, Wire::from(*buffer))).collect();
        let stage = Self::new(name, Code::of::<K>(), (items.len(), items.len()), &wires, [0u32; 0]);
        Self { first: items.start, ..stage }
    }

    /// Lets the stage run beside the previous ones.
    pub(crate) fn beside(self) -> Self {
        Self { waits: false, ..self }
    }

    /// The first `count` items of the stage as one chunk.
    pub fn beginning(&self, count: usize) -> Self {
        assert!(count <= self.count, "stage `{}` has {} items", self.name, self.count);
        Self { count, grain: count, ..self.clone() }
    }

    /// Name for messages, timings and `check --explain`.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// The range of items.
    pub fn items(&self) -> Range<usize> {
        self.first..self.first + self.count
    }

    /// Buffers that are read, in slot order.
    pub fn reads(&self) -> &[Buffer] {
        &self.reads
    }

    /// Buffers that are written, in slot order.
    pub fn writes(&self) -> &[(Buffer, Access)] {
        &self.writes
    }

    /// The parameters of the stage.
    pub fn params(&self) -> &[u8] {
        &self.params
    }

    /// The kernel.
    pub fn kernel(&self) -> &Code {
        &self.kernel
    }
}

/// Everything a backend needs to run a scene.
#[derive(Default, Clone)]
pub struct Plan {
    pub buffers: Vec<Description>,
    /// Stages to run when the contact skin is used up.
    pub search: Vec<Stage>,
    /// Stages of every time step.
    pub step: Vec<Stage>,
    /// Stages to run every few steps, to check whether a search is due.
    pub watch: Vec<Stage>,
    /// Stages to run when energies and limits are needed.
    pub diagnose: Vec<Stage>,
    /// Stages to run afterwards, to sum what the host reads.
    pub collect: Vec<Stage>,
}

impl Plan {
    /// All buffers.
    pub fn all(&self) -> impl Iterator<Item = Buffer> + use<> {
        (0..self.buffers.len()).map(Buffer)
    }

    /// The buffer with this name, if any.
    pub fn named(&self, name: &str) -> Option<Buffer> {
        self.buffers.iter().position(|buffer| buffer.name == name).map(Buffer)
    }

    /// The description of a buffer.
    pub fn describe(&self, buffer: Buffer) -> &Description {
        &self.buffers[buffer.0]
    }
}

/// A kernel, written once for every precision and register width.
///
/// The code of an instruction set is what the compiler inlines into `run`. Closures given to adapters of the standard library
/// (`map` of arrays, `from_fn`, `then`, `zip`) often stay functions of their own, without the instruction set, where every register
/// operation is a call: kernels use loops over indices, and functions that are always inlined.
pub trait Kernel: 'static {
    /// Its WGSL twin.
    const SHADER: Shader;
    /// Its buffer bindings.
    const SLOTS: &'static [Slot];
    /// Whether it works on registers and benefits from the widest; a kernel that works number by number is compiled for fewer
    /// widths.
    const WIDE: bool = true;
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>);
}

/// The code of a kernel with flags: `flagged!(Integrate; lines, gravity)` gives `Integrate<true, false>` if there are lines and
/// no gravity.
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

/// A kernel as function pointers for the CPU, the location of its WGSL twin, and their common bindings.
#[derive(Clone, Copy)]
pub struct Code {
    pub f32: fn(&Io<f32>, Range<usize>),
    pub f64: fn(&Io<f64>, Range<usize>),
    pub shader: Shader,
    pub slots: &'static [Slot],
}

impl Code {
    pub fn of<K: Kernel>() -> Self {
        Self { f32: run::<K, f32>, f64: run::<K, f64>, shader: K::SHADER, slots: K::SLOTS }
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
// stage apart; stages run one after the other.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::exact::Exact;

    /// The reason why a stage of [`Exact`] cannot bind these buffers.
    fn refused(wires: &[(&'static str, Wire)]) -> String {
        let bind = || Stage::new("march", Code::of::<Exact>(), (1, 1), wires, [0u32; 0]);
        let reason = std::panic::catch_unwind(std::panic::AssertUnwindSafe(bind)).err().expect("it is refused");
        *reason.downcast::<String>().expect("with a message")
    }

    #[test]
    fn what_does_not_fit_a_slot_is_refused_by_name() {
        let [increments, quanta, remainders, sum] = [0, 1, 2, 3].map(Buffer);
        let missing = refused(&wires![increments, quanta, sum]);
        assert_eq!(missing, "stage `march`, slot `remainders`: no buffer is bound to it");
        assert!(refused(&wires![increments, quanta, remainders, sum, total: sum]).contains("total"));
        assert!(refused(&wires![increments, quanta: (quanta, 2), remainders, sum]).contains("takes no stride"));
        assert!(refused(&wires![increments, quanta, remainders: increments, sum]).contains("bound twice"));
    }
}
