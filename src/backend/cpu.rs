//! The CPU backend: stages split into fixed chunks that rayon spreads over threads.
//!
//! Stages that do not wait for each other run as one parallel loop, and so do the stages of a chain, one after another within each
//! chunk of units. Chunks write disjoint memory or add integers, so the result does not depend on the number of threads or on
//! which thread takes a chunk.

use super::Backend;
use crate::kernel::buffer::{Array, Buffer, Contents, Description, Kind};
use crate::kernel::interface::{Access, Slot};
use crate::kernel::io::{Binding, Io};
use crate::kernel::lane::{Isa, Real};
use crate::kernel::row::Row;
use crate::kernel::stage::{Code, Cut, Order, Stage};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// Units of a chain in a chunk.
const UNITS: usize = 16;

/// Buffers in host memory, and threads to work on them.
pub struct Cpu<R: Real> {
    arrays: Vec<Array>,
    kinds: Vec<Kind>,
    saved: Vec<(Buffer, Array)>,
    requested: Vec<Contents>,
    isa: Isa,
    pool: Option<rayon::ThreadPool>,
    threads: usize,
    /// Name and nanoseconds of each stage, summed over threads.
    spent: Vec<(&'static str, AtomicU64)>,
    precision: std::marker::PhantomData<R>,
}

/// A precision that the CPU can run, with the matching function of a kernel.
pub trait Precision: Real {
    fn function(kernel: &Code) -> fn(&Io<Self>, Range<usize>);
    const NAME: &'static str;
}

impl Precision for f32 {
    const NAME: &'static str = "f32";
    fn function(kernel: &Code) -> fn(&Io<f32>, Range<usize>) {
        kernel.f32
    }
}

impl Precision for f64 {
    const NAME: &'static str = "f64";
    fn function(kernel: &Code) -> fn(&Io<f64>, Range<usize>) {
        kernel.f64
    }
}

impl<R: Precision> Cpu<R> {
    /// Buffers as described, on `threads` threads (0 for all cores) with instruction set `isa`.
    pub fn new(buffers: &[Description], threads: usize, isa: Isa) -> Self {
        let threads = if threads > 0 { threads } else { std::thread::available_parallelism().map_or(1, |n| n.get()) };
        let pool = (threads > 1).then(|| {
            rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads of the CPU backend start")
        });
        Self {
            arrays: buffers.iter().map(Array::new::<R>).collect(),
            kinds: buffers.iter().map(|description| description.kind).collect(),
            saved: Vec::new(),
            requested: Vec::new(),
            isa,
            pool,
            threads,
            spent: Vec::new(),
            precision: std::marker::PhantomData,
        }
    }

    /// Runs groups of stages that do not wait for each other.
    fn run_groups(groups: &[Group<R>], rows: &[Row<R>], parallel: bool) {
        for row in rows {
            for group in groups {
                let work = |chunk: &Vec<Piece>| group.run(chunk, row);
                if parallel && group.chunks.len() > 1 {
                    group.chunks.par_iter().with_max_len(1).for_each(work);
                } else {
                    group.chunks.iter().for_each(work);
                }
            }
        }
    }
}

/// Stages that may run at the same time, cut into chunks of one or, in a chain, of all of them.
struct Group<'a, R: Real> {
    stages: Vec<Bound<'a, R>>,
    chunks: Vec<Vec<Piece>>,
}

/// A stage with its buffers bound.
struct Bound<'a, R: Real> {
    bindings: Vec<Binding>,
    params: &'a [u8],
    function: fn(&Io<R>, Range<usize>),
    isa: Isa,
    spent: &'a AtomicU64,
}

// SAFETY: bindings are addresses of arrays that outlive the run; `Access` keeps chunks apart.
unsafe impl<R: Real> Sync for Bound<'_, R> {}

/// A range of items of one stage in a group.
struct Piece {
    stage: usize,
    items: Range<usize>,
}

impl<R: Real> Group<'_, R> {
    fn run(&self, chunk: &[Piece], row: &Row<R>) {
        let mut started = Instant::now();
        for Piece { stage, items } in chunk {
            let stage = &self.stages[*stage];
            let io = Io { bindings: &stage.bindings, row, params: stage.params, isa: stage.isa, items: items.clone() };
            (stage.function)(&io, items.clone());
            let ended = Instant::now();
            stage.spent.fetch_add((ended - started).as_nanos() as u64, Ordering::Relaxed);
            started = ended;
        }
    }

    /// Adds the chunks of a stage, or its pieces to the chunks of its chain.
    fn cut(&mut self, stage: &Stage) {
        let number = self.stages.len() - 1;
        let pieces: Vec<Range<usize>> = match &stage.cut {
            Cut::Grain(grain) => {
                let Range { start, end } = stage.items();
                (start..end).step_by(*grain).map(|first| first..(first + grain).min(end)).collect()
            }
            Cut::Units(units) => {
                // the last units first: the longest, the lines of threads, are behind those of yarns
                let last = units.len() - 1;
                (0..last).step_by(UNITS).rev().map(|unit| units[unit]..units[last.min(unit + UNITS)]).collect()
            }
        };
        let continues = number > 0 && stage.order == Order::Follows;
        if !continues {
            self.chunks.extend(pieces.iter().map(|_| Vec::new()));
        }
        let first = self.chunks.len() - pieces.len();
        for (chunk, items) in self.chunks[first..].iter_mut().zip(pieces) {
            if !items.is_empty() {
                chunk.push(Piece { stage: number, items });
            }
        }
    }
}

impl<R: Precision> Backend for Cpu<R> {
    fn run(&mut self, stages: &[Stage], rows: &[Row<f64>]) {
        let rows: Vec<Row<R>> = rows.iter().map(Row::cast).collect();
        for stage in stages {
            if !self.spent.iter().any(|(name, _)| *name == stage.name) {
                self.spent.push((stage.name, AtomicU64::new(0)));
            }
        }
        let addresses: Vec<*mut u8> = self.arrays.iter_mut().map(Array::address).collect();
        let (arrays, kinds) = (&self.arrays, &self.kinds);
        let bindings = |stage: &Stage| -> Vec<Binding> {
            let (reads, writes) =
                (stage.reads.iter().map(|b| (*b, None)), stage.writes.iter().map(|(b, a)| (*b, Some(*a))));
            let slots = stage.kernel.slots.iter().filter(|slot| slot.there);
            let bind = |((buffer, access), slot): ((Buffer, Option<Access>), &Slot)| {
                let (len, size) = (arrays[buffer.0].len(), arrays[buffer.0].size());
                let own = match access {
                    Some(Access::Own { planes, stride }) => planes * stride * (stage.first + stage.count),
                    _ => 0,
                };
                let fits = kinds[buffer.0] == slot.kind && own <= len;
                assert!(fits, "stage `{}`, slot `{}`: the buffer does not fit", stage.name, slot.name);
                Binding { address: addresses[buffer.0], len, size, access }
            };
            reads.chain(writes).zip(slots).map(bind).collect()
        };
        let mut groups: Vec<Group<R>> = Vec::new();
        let mut before: Option<&Stage> = None;
        for stage in stages.iter().filter(|stage| stage.count > 0) {
            let joins = match stage.order {
                Order::Waits => false,
                Order::Beside => before.is_some(),
                Order::Follows => before.is_some_and(|before| stage.continues(before)),
            };
            before = Some(stage);
            if !joins {
                groups.push(Group { stages: Vec::new(), chunks: Vec::new() });
            }
            let group = groups.last_mut().expect("just pushed");
            let spent = self.spent.iter().find(|(name, _)| *name == stage.name).map(|(_, spent)| spent);
            group.stages.push(Bound {
                bindings: bindings(stage),
                params: &stage.params,
                function: R::function(&stage.kernel),
                isa: self.isa,
                spent: spent.expect("every stage has a timer"),
            });
            group.cut(stage);
        }
        match &self.pool {
            Some(pool) => pool.install(|| Self::run_groups(&groups, &rows, true)),
            None => Self::run_groups(&groups, &rows, false),
        }
    }

    fn scalars(&self, buffer: Buffer) -> Vec<f64> {
        self.arrays[buffer.0].slice::<R>().iter().map(|x| x.to_f64()).collect()
    }

    fn ints(&self, buffer: Buffer) -> Vec<i32> {
        self.arrays[buffer.0].slice::<i32>().to_vec()
    }

    fn uints(&self, buffer: Buffer) -> Vec<u32> {
        self.arrays[buffer.0].slice::<u32>().to_vec()
    }

    fn set_scalars(&mut self, buffer: Buffer, values: &[f64]) {
        for (to, from) in self.arrays[buffer.0].slice_mut::<R>().iter_mut().zip(values) {
            *to = R::from_f64(*from);
        }
    }

    fn request(&mut self, buffer: Buffer) {
        let contents = match self.kinds[buffer.0] {
            Kind::Scalar => Contents::Scalars(self.scalars(buffer)),
            Kind::Int => Contents::Ints(self.ints(buffer)),
            Kind::Uint => Contents::Uints(self.uints(buffer)),
        };
        self.requested.push(contents);
    }

    fn receive(&mut self) -> Vec<Contents> {
        std::mem::take(&mut self.requested)
    }

    fn copy(&mut self, from: Buffer, to: Buffer) {
        let bytes = self.bytes(from);
        self.set_bytes(to, &bytes);
    }

    fn clear(&mut self, buffer: Buffer) {
        self.arrays[buffer.0].clear();
    }

    fn clear_part(&mut self, buffer: Buffer, numbers: Range<usize>) {
        self.arrays[buffer.0].clear_part(numbers);
    }

    fn bytes(&self, buffer: Buffer) -> Vec<u8> {
        self.arrays[buffer.0].bytes().to_vec()
    }

    fn set_bytes(&mut self, buffer: Buffer, bytes: &[u8]) {
        self.arrays[buffer.0].set_bytes(bytes);
    }

    fn save(&mut self, buffers: &[Buffer]) {
        self.saved = buffers.iter().map(|b| (*b, self.arrays[b.0].clone())).collect();
    }

    fn restore(&mut self) {
        for (buffer, array) in &self.saved {
            self.arrays[buffer.0].set_bytes(array.bytes());
        }
    }

    fn timings(&self) -> Vec<(String, f64)> {
        let threads = self.threads as f64;
        self.spent
            .iter()
            .map(|(name, ns)| ((*name).to_owned(), ns.load(Ordering::Relaxed) as f64 * 1e-9 / threads))
            .collect()
    }

    fn describe(&self) -> String {
        format!("cpu, {} thread{}, {:?}, {}", self.threads, if self.threads == 1 { "" } else { "s" }, self.isa, R::NAME)
    }
}
