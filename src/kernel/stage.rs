//! Stages and plans: the whole algorithm as data. A backend runs stages and knows no physics.

use super::buffer::{Buffer, Description};
use super::interface::{Access, Slot};
use super::io::Io;
use super::lane::{Lane, Real, Work};
use super::shader::Shader;
use bytemuck::Pod;
use std::marker::PhantomData;
use std::ops::Range;
use std::sync::Arc;

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

/// When the items of a stage run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Order {
    /// After all previous stages.
    Waits,
    /// Beside the previous stages, back to the last one that waits.
    Beside,
    /// As a link of a chain: each unit of items after the same unit of the stage before, whatever becomes of the others.
    Follows,
}

/// How the items of a stage are cut; fixed, so that results do not depend on the number of threads.
#[derive(Debug, Clone)]
pub(crate) enum Cut {
    /// Chunks of so many items.
    Grain(usize),
    /// Units of a chain: the first item of each, and the end of the last.
    Units(Arc<[usize]>),
}

/// One parallel loop over items. Only the crate makes stages: a kernel relies on its slots being bound as declared.
#[derive(Clone)]
pub struct Stage {
    pub(crate) name: &'static str,
    /// First item.
    pub(crate) first: usize,
    /// Number of items.
    pub(crate) count: usize,
    pub(crate) cut: Cut,
    /// Buffers of the active slots that are read.
    pub(crate) reads: Vec<Buffer>,
    /// Buffers of the active slots that are written, numbered after the reads.
    pub(crate) writes: Vec<(Buffer, Access)>,
    /// Small constants of the stage, laid out as the kernel's `Params`.
    pub(crate) params: Vec<u8>,
    /// Scene constants for the text of the shader.
    pub(crate) constants: Vec<(&'static str, usize)>,
    pub(crate) kernel: Code,
    pub(crate) order: Order,
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
        let (cut, order) = (Cut::Grain(grain), Order::Waits);
        Self { name, first: 0, count, cut, reads, writes, params, constants: Vec::new(), kernel, order }
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
        Self { order: Order::Beside, ..self }
    }

    /// Cuts the items into the units of a chain, which `starts` with it unless it follows another stage.
    pub(crate) fn in_units(self, units: &Arc<[usize]>, starts: bool) -> Self {
        assert_eq!(units.last(), Some(&self.count), "stage `{}`: units cover all items", self.name);
        let order = if starts { Order::Waits } else { Order::Follows };
        Self { cut: Cut::Units(Arc::clone(units)), order, ..self }
    }

    /// Whether it is the next link of a chain whose last stage is `before`.
    pub(crate) fn continues(&self, before: &Self) -> bool {
        match (&before.cut, &self.cut) {
            (Cut::Units(old), Cut::Units(new)) => self.order == Order::Follows && old.len() == new.len(),
            _ => false,
        }
    }

    /// The first `count` items of the stage as one chunk.
    pub fn beginning(&self, count: usize) -> Self {
        assert!(count <= self.count, "stage `{}` has {} items", self.name, self.count);
        Self { count, cut: Cut::Grain(count), order: Order::Waits, ..self.clone() }
    }

    /// Name for messages, timings and `check --explain`.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// The range of items.
    pub fn items(&self) -> Range<usize> {
        self.first..self.first + self.count
    }

    /// Buffers with the slots that they are bound to.
    pub(crate) fn bound(&self) -> impl Iterator<Item = (Buffer, &'static Slot)> {
        let buffers = self.reads.iter().chain(self.writes.iter().map(|(buffer, _)| buffer));
        buffers.copied().zip(self.kernel.slots.iter().filter(|slot| slot.there))
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
