//! The interface of a kernel: its buffer bindings and the constants shared with its WGSL twin, each declared once.
//!
//! A kernel lists [`Slot`]s. Its Rust function finds the number of a slot by name at compile time (`slot!`), the twin gets its
//! bindings from the same list, and the plan binds buffers by the same names. The slot of an effect exists only [`Slot::when`]
//! the kernel has the flag of that effect; later slots are numbered accordingly.

use super::buffer::Kind;

/// Write access of the items of a stage to a buffer. The same item may also read the buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// Item `i` owns `stride` numbers from `i · stride` in each of `planes` equal parts of the buffer.
    Own { planes: usize, stride: usize },
    /// Items own disjoint numbers, given by a table or by the constants of the stage.
    Scatter,
    /// Integers to which any item may add; the order does not matter.
    Atomic,
}

/// Stride of rows whose length is known only to the plan.
const OF_THE_PLAN: usize = 0;

/// A buffer binding of a kernel. Slots that are read precede slots that are written.
#[derive(Debug, Clone, Copy)]
pub struct Slot {
    /// Name of the variable in the twin, and of the buffer at binding.
    pub name: &'static str,
    pub kind: Kind,
    /// Write access; `None` for a read-only buffer.
    pub access: Option<Access>,
    /// Whether the kernel has the slot under its flags.
    pub there: bool,
}

impl Slot {
    const fn new(name: &'static str, kind: Kind, access: Option<Access>) -> Self {
        Self { name, kind, access, there: true }
    }

    /// A read-only buffer.
    pub const fn read(name: &'static str, kind: Kind) -> Self {
        Self::new(name, kind, None)
    }

    /// A buffer of `planes` planes, in each of which an item owns one number.
    pub const fn planes(name: &'static str, kind: Kind, planes: usize) -> Self {
        Self::new(name, kind, Some(Access::Own { planes, stride: 1 }))
    }

    /// A buffer in which an item owns `stride` consecutive numbers.
    pub const fn row(name: &'static str, kind: Kind, stride: usize) -> Self {
        assert!(stride != OF_THE_PLAN);
        Self::new(name, kind, Some(Access::Own { planes: 1, stride }))
    }

    /// A buffer in which an item owns consecutive numbers; the plan gives their count when it binds the buffer.
    pub const fn row_of_plan(name: &'static str, kind: Kind) -> Self {
        Self::new(name, kind, Some(Access::Own { planes: 1, stride: OF_THE_PLAN }))
    }

    /// A buffer in which items own disjoint numbers given by a table.
    pub const fn scatter(name: &'static str, kind: Kind) -> Self {
        Self::new(name, kind, Some(Access::Scatter))
    }

    /// Integers to which any item may add.
    pub const fn atomic(name: &'static str, kind: Kind) -> Self {
        Self::new(name, kind, Some(Access::Atomic))
    }

    /// Makes the slot conditional on a flag.
    pub const fn when(self, flag: bool) -> Self {
        Self { there: self.there && flag, ..self }
    }

    /// The access with the stride given by the plan, if any.
    ///
    /// # Errors
    /// The mismatch: a missing stride, or a stride for a slot that already has one.
    pub(super) fn access_with(&self, given: Option<usize>) -> Result<Option<Access>, &'static str> {
        match (self.access, given) {
            (Some(Access::Own { planes, stride: OF_THE_PLAN }), Some(stride)) => {
                Ok(Some(Access::Own { planes, stride }))
            }
            (Some(Access::Own { stride: OF_THE_PLAN, .. }), None) => Err("needs a stride"),
            (access, None) => Ok(access),
            (_, Some(_)) => Err("takes no stride"),
        }
    }

    /// Whether the twin declares the buffer as atomic integers.
    pub(super) fn is_atomic(&self) -> bool {
        self.access == Some(Access::Atomic)
    }
}

/// The declaration of a buffer in a twin.
pub(super) fn declaration(name: &str, kind: Kind, atomic: bool, written: bool, number: usize) -> String {
    let scalar = match kind {
        Kind::Scalar => "f32",
        Kind::Int => "i32",
        Kind::Uint => "u32",
    };
    let element = if atomic { format!("atomic<{scalar}>") } else { scalar.to_owned() };
    let mode = if written { "read_write" } else { "read" };
    format!("@group(1) @binding({number}) var<storage, {mode}> {name}: array<{element}>;")
}

/// Number of a slot among the active ones; compilation fails if the slot is not active.
pub const fn place(slots: &[Slot], name: &str) -> usize {
    let (found, there) = find(slots, name);
    assert!(there, "the kernel does not have this slot with its flags");
    found
}

/// Number of a slot that is active with a `flag`; without the flag, a number that no buffer has.
pub const fn place_when(slots: &[Slot], name: &str, flag: bool) -> usize {
    let (found, there) = find(slots, name);
    assert!(there || !flag, "the kernel does not have this slot with its flags");
    if there { found } else { usize::MAX }
}

/// Number of active slots before a named slot, and whether that slot is active.
const fn find(slots: &[Slot], name: &str) -> (usize, bool) {
    let (mut i, mut number) = (0, 0);
    while i < slots.len() {
        if same(slots[i].name, name) {
            return (number, slots[i].there);
        }
        number += slots[i].there as usize;
        i += 1;
    }
    panic!("the kernel declares no slot of this name")
}

const fn same(a: &str, b: &str) -> bool {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    if a.len() != b.len() {
        return false;
    }
    let mut i = 0;
    while i < a.len() {
        if a[i] != b[i] {
            return false;
        }
        i += 1;
    }
    true
}

/// Shared slots of several kernels, followed by the slots of one kernel.
pub const fn joined<const N: usize>(shared: &[Slot], own: &[Slot]) -> [Slot; N] {
    assert!(shared.len() + own.len() == N);
    let mut all = [Slot::read("", Kind::Scalar); N];
    let mut i = 0;
    while i < N {
        all[i] = if i < shared.len() { shared[i] } else { own[i - shared.len()] };
        i += 1;
    }
    all
}

/// Number of a slot, found at compile time: `slot!(Self::SLOTS, "mass")`, or `slot!(Self::SLOTS, "mass", FLAG)` for a slot that
/// depends on a flag.
macro_rules! slot {
    ($slots:expr, $name:literal) => {
        const { crate::kernel::interface::place($slots, $name) }
    };
    ($slots:expr, $name:literal, $flag:expr) => {
        const { crate::kernel::interface::place_when($slots, $name, $flag) }
    };
}
pub(crate) use slot;

/// A Rust constant used by a twin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Constant {
    pub name: &'static str,
    pub value: Value,
}

/// The value of a constant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Value {
    Uint(u32),
    Int(i32),
    /// Bits of an f32.
    Scalar(u32),
}

impl Constant {
    pub const fn uint(name: &'static str, value: usize) -> Self {
        assert!(value <= u32::MAX as usize);
        Self { name, value: Value::Uint(value as u32) }
    }

    pub const fn int(name: &'static str, value: i32) -> Self {
        Self { name, value: Value::Int(value) }
    }

    pub const fn scalar(name: &'static str, value: f64) -> Self {
        Self { name, value: Value::Scalar((value as f32).to_bits()) }
    }

    /// The declaration in the twin. All digits of an f32 are written, so that it reads back as the same number.
    pub(super) fn declaration(&self) -> String {
        let name = self.name;
        match self.value {
            Value::Uint(value) => format!("const {name}: u32 = {value}u;"),
            Value::Int(value) => format!("const {name}: i32 = {value};"),
            Value::Scalar(bits) => format!("const {name}: f32 = {:?};", f64::from(f32::from_bits(bits))),
        }
    }
}

/// Constants under their Rust names: `constants![uint: LEAST, CLOSED; scalar: TIE]`; another name or value is given as in `KIND
/// = 1`.
macro_rules! constants {
    ($($type:ident: $($name:ident $(= $value:expr)?),+);+ $(;)?) => {
        [$($(crate::kernel::interface::constants!(@ $type $name $($value)?)),+),+]
    };
    (@ uint $name:ident) => { crate::kernel::interface::Constant::uint(stringify!($name), $name as usize) };
    (@ uint $name:ident $value:expr) => { crate::kernel::interface::Constant::uint(stringify!($name), $value as usize) };
    (@ int $name:ident) => { crate::kernel::interface::Constant::int(stringify!($name), $name) };
    (@ scalar $name:ident) => { crate::kernel::interface::Constant::scalar(stringify!($name), $name) };
    (@ scalar $name:ident $value:expr) => { crate::kernel::interface::Constant::scalar(stringify!($name), $value) };
}
pub(crate) use constants;

#[cfg(test)]
mod tests {
    use super::*;

    const fn slots(flag: bool) -> [Slot; 3] {
        [Slot::read("mass", Kind::Scalar), Slot::read("extra", Kind::Uint).when(flag), Slot::atomic("force", Kind::Int)]
    }

    #[test]
    fn numbers_follow_what_is_there() {
        assert_eq!([true, false].map(|flag| place(&slots(flag), "force")), [2, 1]);
        assert_eq!(place_when(&slots(true), "extra", true), 1);
        assert_eq!(place_when(&slots(false), "extra", false), usize::MAX);
        assert!(std::panic::catch_unwind(|| place(&slots(false), "extra")).is_err());
        assert!(std::panic::catch_unwind(|| place(&slots(true), "forces")).is_err());
    }

    #[test]
    fn declarations_are_wgsl() {
        let declared =
            |slot: Slot, number| declaration(slot.name, slot.kind, slot.is_atomic(), slot.access.is_some(), number);
        let [mass, _, force] = slots(true);
        assert_eq!(declared(mass, 0), "@group(1) @binding(0) var<storage, read> mass: array<f32>;");
        assert_eq!(declared(force, 1), "@group(1) @binding(1) var<storage, read_write> force: array<atomic<i32>>;");
        const TIE: f64 = 1e-4;
        const NONE: u32 = u32::MAX;
        let [none, kind, tie] = constants![uint: NONE, KIND = 1; scalar: TIE];
        assert_eq!(none.declaration(), "const NONE: u32 = 4294967295u;");
        assert_eq!(kind.declaration(), "const KIND: u32 = 1u;");
        let written = tie.declaration();
        let digits = written.trim_start_matches("const TIE: f32 = ").trim_end_matches(';');
        assert_eq!(digits.parse::<f64>().unwrap() as f32, 1e-4);
    }
}
