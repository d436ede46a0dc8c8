//! The GPU backend: the WGSL twins of the stages, through wgpu. Only this folder knows wgpu.
//!
//! Steps are recorded into one compute pass, a dispatch for each stage and an offset into a buffer of rows for each step, and
//! submitted when something is read, so that a burst of steps, the look at how far nodes have moved and the copy of the
//! status are one submission. Dispatches that share no buffer that either writes may overlap.
//!
//! A device that fails stays failed: what is read from it afterwards is zeros, and [`Backend::fault`] says why.

mod device;
mod pipeline;
mod rates;

pub use device::{Device, Listed, devices};
pub use rates::Rates;

use super::Backend;
use super::cpu::Cpu;
use crate::error::{Error, Result};
use crate::kernel::buffer::{Array, Buffer, Description, Initial, Kind};
use crate::kernel::exact::{self, Exact};
use crate::kernel::lane::Isa;
use crate::kernel::row::Row;
use crate::kernel::stage::{Code, Stage, wires};
use pipeline::Bound;
use std::cell::RefCell;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::sync::Arc;
use wgpu::util::DeviceExt as _;

/// Rows that can be recorded before a submission.
const ROWS: u64 = 512;
/// Bytes from one row to the next: the largest alignment of offsets that adapters ask for.
const ROW_STRIDE: u64 = 256;
/// Calls of a list of stages between two that are timed.
const TIMED_EVERY: u64 = 7;
/// Stages of a timed call at most.
const TIMED_STAGES: u32 = 64;

/// Buffers on a device, and what waits to be submitted.
pub struct Gpu {
    device: Arc<Device>,
    buffers: Vec<wgpu::Buffer>,
    /// Kind and length of each buffer; those without numbers have room for one.
    shapes: Vec<(Kind, usize)>,
    rows: wgpu::Buffer,
    row_group: wgpu::BindGroup,
    /// By [`key`].
    bound: HashMap<u64, Bound>,
    saved: Vec<(Buffer, wgpu::Buffer)>,
    work: RefCell<Work>,
}

/// Commands that are recorded and not submitted, and times that are measured.
struct Work {
    encoder: wgpu::CommandEncoder,
    /// Rows written since the last submission.
    rows: u64,
    clock: Option<Clock>,
    times: Vec<Time>,
}

/// Timestamps of one timed call.
struct Clock {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    /// Stages with a timestamp before and after, not yet read.
    waiting: Vec<&'static str>,
}

/// Time of a stage.
struct Time {
    stage: &'static str,
    calls: u64,
    runs: u64,
    timed: u64,
    timed_s: f64,
}

impl Gpu {
    /// Buffers as described, on a device.
    ///
    /// # Errors
    /// Buffers that do not fit.
    pub fn new(device: Arc<Device>, descriptions: &[Description]) -> Result<Self> {
        device.fits(descriptions)?;
        let gpu = &device.device;
        let scope = gpu.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        let buffers = descriptions
            .iter()
            .map(|d| {
                if d.len == 0 || matches!(d.initial, Initial::Zero) {
                    let size = 4 * d.len.max(1) as u64;
                    let label = Some(d.name);
                    return gpu.create_buffer(&wgpu::BufferDescriptor {
                        label,
                        size,
                        usage,
                        mapped_at_creation: false,
                    });
                }
                let array = Array::new::<f32>(d);
                let contents = array.bytes();
                gpu.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(d.name), contents, usage })
            })
            .collect();
        let rows = gpu.create_buffer(&wgpu::BufferDescriptor {
            label: Some("rows"),
            size: ROWS * ROW_STRIDE,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        if pollster::block_on(scope.pop()).is_some() {
            let bytes: u64 = descriptions.iter().map(|d| 4 * d.len as u64).sum();
            return Err(Error::Unsupported(format!(
                "the scene needs {:.0} MiB on {}, which has no room for it; coarsen the mesh or use --backend cpu",
                bytes as f64 / f64::from(1 << 20),
                device.listed().name
            )));
        }
        let row_group = gpu.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("row"),
            layout: &device.row_layout,
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                    buffer: &rows,
                    offset: 0,
                    size: wgpu::BufferSize::new(size_of::<Row<f32>>() as u64),
                }),
            }],
        });
        let encoder = gpu.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let clock = device.listed().has_timestamps.then(|| Clock::new(gpu));
        Ok(Self {
            buffers,
            shapes: descriptions.iter().map(|d| (d.kind, d.len)).collect(),
            rows,
            row_group,
            bound: HashMap::new(),
            saved: Vec::new(),
            work: RefCell::new(Work { encoder, rows: 0, clock, times: Vec::new() }),
            device,
        })
    }

    /// Submits what is recorded.
    fn flush(&self) {
        let mut work = self.work.borrow_mut();
        let empty = self.device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let recorded = std::mem::replace(&mut work.encoder, empty);
        self.device.queue.submit([recorded.finish()]);
        work.rows = 0;
    }

    /// Copies `bytes` of a buffer to the host, after all that is recorded.
    fn fetch(&self, from: &wgpu::Buffer, bytes: u64) -> Vec<u8> {
        let gpu = &self.device.device;
        let staging = gpu.create_buffer(&wgpu::BufferDescriptor {
            label: Some("staging"),
            size: bytes.max(4),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        self.work.borrow_mut().encoder.copy_buffer_to_buffer(from, 0, &staging, 0, bytes);
        self.flush();
        staging.map_async(wgpu::MapMode::Read, .., |_| {});
        if let Err(error) = gpu.poll(wgpu::PollType::wait_indefinitely()) {
            self.device.note(&error.to_string());
        }
        match staging.slice(..).get_mapped_range() {
            Ok(view) if self.device.fault().is_none() => view[..bytes as usize].to_vec(),
            Ok(_) => vec![0; bytes as usize],
            Err(error) => {
                self.device.note(&error.to_string());
                vec![0; bytes as usize]
            }
        }
    }

    fn numbers<T: bytemuck::Pod>(&self, buffer: Buffer) -> Vec<T> {
        bytemuck::pod_collect_to_vec(&self.bytes(buffer))
    }

    /// Records stages for one row that is in place; each in a pass of its own if they are timed.
    fn record(&self, work: &mut Work, stages: &[Stage], rows: &[u32], timed: bool) {
        let ready: Vec<(&Stage, &Bound)> =
            stages.iter().filter(|s| s.count > 0).filter_map(|s| Some((s, self.bound.get(&key(s))?))).collect();
        let dispatch = |pass: &mut wgpu::ComputePass, bound: &Bound| {
            pass.set_pipeline(&bound.pipeline.pipeline);
            pass.set_bind_group(1, &bound.buffers, &[]);
            pass.set_bind_group(2, &bound.constants, &[]);
            pass.dispatch_workgroups(bound.workgroups[0], bound.workgroups[1], 1);
        };
        let Work { encoder, clock, .. } = work;
        if let Some(clock) = clock.as_mut().filter(|_| timed && ready.len() <= TIMED_STAGES as usize) {
            for (i, (stage, bound)) in ready.iter().enumerate() {
                let timestamp_writes = Some(wgpu::ComputePassTimestampWrites {
                    query_set: &clock.queries,
                    beginning_of_pass_write_index: Some(2 * i as u32),
                    end_of_pass_write_index: Some(2 * i as u32 + 1),
                });
                let label = Some(stage.name);
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label, timestamp_writes });
                pass.set_bind_group(0, &self.row_group, &[rows[0]]);
                dispatch(&mut pass, bound);
                drop(pass);
                clock.waiting.push(stage.name);
            }
            encoder.resolve_query_set(&clock.queries, 0..2 * ready.len() as u32, &clock.resolved, 0);
            return;
        }
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        for row in rows {
            pass.set_bind_group(0, &self.row_group, &[*row]);
            ready.iter().for_each(|(_, bound)| dispatch(&mut pass, bound));
        }
    }

    /// Reads the timestamps of the last timed call.
    fn read_clock(&self) {
        let resolved = match &self.work.borrow().clock {
            Some(clock) if !clock.waiting.is_empty() => clock.resolved.clone(),
            _ => return,
        };
        let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(&self.fetch(&resolved, resolved.size()));
        let period = f64::from(self.device.queue.get_timestamp_period()) * 1e-9;
        let work = &mut *self.work.borrow_mut();
        let waiting = work.clock.as_mut().map(|clock| std::mem::take(&mut clock.waiting)).unwrap_or_default();
        for (stage, ticks) in waiting.into_iter().zip(ticks.chunks_exact(2)) {
            if let Some(time) = work.times.iter_mut().find(|t| t.stage == stage) {
                time.timed += 1;
                time.timed_s += ticks[1].saturating_sub(ticks[0]) as f64 * period;
            }
        }
    }
}

/// What makes a stage different from the other stages of its plan.
fn key(stage: &Stage) -> u64 {
    let mut hasher = DefaultHasher::new();
    (stage.kernel.shader, stage.first, stage.count, &stage.reads, &stage.params).hash(&mut hasher);
    stage.writes.iter().for_each(|(buffer, _)| buffer.hash(&mut hasher));
    hasher.finish()
}

impl Clock {
    fn new(gpu: &wgpu::Device) -> Self {
        let count = 2 * TIMED_STAGES;
        Self {
            queries: gpu.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("stages"),
                ty: wgpu::QueryType::Timestamp,
                count,
            }),
            resolved: gpu.create_buffer(&wgpu::BufferDescriptor {
                label: Some("times of stages"),
                size: 8 * u64::from(count),
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            waiting: Vec::new(),
        }
    }
}

impl Backend for Gpu {
    fn run(&mut self, stages: &[Stage], rows: &[Row<f64>]) {
        for stage in stages.iter().filter(|s| s.count > 0) {
            if !self.bound.contains_key(&key(stage)) {
                match Bound::new(&self.device, stage, &self.buffers) {
                    Ok(bound) => _ = self.bound.insert(key(stage), bound),
                    Err(error) => return self.device.note(&error.to_string()),
                }
            }
        }
        self.read_clock();
        for rows in rows.chunks(ROWS as usize) {
            if self.work.borrow().rows + rows.len() as u64 > ROWS {
                self.flush();
            }
            let mut work = self.work.borrow_mut();
            let first = work.rows * ROW_STRIDE;
            let mut bytes = vec![0u8; rows.len() * ROW_STRIDE as usize];
            for (row, place) in rows.iter().zip(bytes.chunks_exact_mut(ROW_STRIDE as usize)) {
                place[..size_of::<Row<f32>>()].copy_from_slice(bytemuck::bytes_of(&row.cast::<f32>()));
            }
            self.device.queue.write_buffer(&self.rows, first, &bytes);
            work.rows += rows.len() as u64;
            let offsets: Vec<u32> = (0..rows.len() as u64).map(|i| (first + i * ROW_STRIDE) as u32).collect();
            let mut timed = false;
            for stage in stages.iter().filter(|s| s.count > 0) {
                let known = work.times.iter().position(|t| t.stage == stage.name);
                let place = known.unwrap_or(work.times.len());
                if known.is_none() {
                    work.times.push(Time { stage: stage.name, calls: 0, runs: 0, timed: 0, timed_s: 0.0 });
                }
                let time = &mut work.times[place];
                timed |= time.calls.is_multiple_of(TIMED_EVERY);
                time.calls += 1;
                time.runs += rows.len() as u64;
            }
            let last = if timed { offsets.len() - 1 } else { offsets.len() };
            self.record(&mut work, stages, &offsets[..last], false);
            if timed {
                self.record(&mut work, stages, &offsets[last..], true);
            }
        }
    }

    fn scalars(&self, buffer: Buffer) -> Vec<f64> {
        debug_assert_eq!(self.shapes[buffer.0].0, Kind::Scalar);
        self.numbers::<f32>(buffer).into_iter().map(f64::from).collect()
    }

    fn ints(&self, buffer: Buffer) -> Vec<i32> {
        self.numbers(buffer)
    }

    fn uints(&self, buffer: Buffer) -> Vec<u32> {
        self.numbers(buffer)
    }

    fn set_scalars(&mut self, buffer: Buffer, values: &[f64]) {
        let values: Vec<f32> = values.iter().map(|x| *x as f32).collect();
        self.set_bytes(buffer, bytemuck::cast_slice(&values));
    }

    fn clear(&mut self, buffer: Buffer) {
        self.work.borrow_mut().encoder.clear_buffer(&self.buffers[buffer.0], 0, None);
    }

    fn bytes(&self, buffer: Buffer) -> Vec<u8> {
        match self.shapes[buffer.0].1 {
            0 => Vec::new(),
            len => self.fetch(&self.buffers[buffer.0], 4 * len as u64),
        }
    }

    fn set_bytes(&mut self, buffer: Buffer, bytes: &[u8]) {
        // a write comes before everything that is recorded and not submitted
        self.flush();
        self.device.queue.write_buffer(&self.buffers[buffer.0], 0, bytes);
    }

    fn save(&mut self, buffers: &[Buffer]) {
        if !self.saved.iter().map(|(b, _)| b).eq(buffers) {
            let copy = |buffer: &Buffer| {
                let usage = wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
                let (label, size) = (Some("saved"), self.buffers[buffer.0].size());
                let descriptor = wgpu::BufferDescriptor { label, size, usage, mapped_at_creation: false };
                (*buffer, self.device.device.create_buffer(&descriptor))
            };
            self.saved = buffers.iter().map(copy).collect();
        }
        let mut work = self.work.borrow_mut();
        for (buffer, copy) in &self.saved {
            work.encoder.copy_buffer_to_buffer(&self.buffers[buffer.0], 0, copy, 0, None);
        }
    }

    fn restore(&mut self) {
        let mut work = self.work.borrow_mut();
        for (buffer, copy) in &self.saved {
            work.encoder.copy_buffer_to_buffer(copy, 0, &self.buffers[buffer.0], 0, None);
        }
    }

    fn fault(&self) -> Option<String> {
        self.device.fault()
    }

    fn timings(&self) -> Vec<(&'static str, f64)> {
        self.read_clock();
        let work = self.work.borrow();
        work.times.iter().map(|t| (t.stage, t.timed_s / t.timed.max(1) as f64 * t.runs as f64)).collect()
    }

    fn describe(&self) -> String {
        let listed = self.device.listed();
        format!("gpu, {}, {}, f32", listed.name, listed.interface)
    }
}

/// Whether the device does integers and sums with remainders as the CPU does, bit by bit.
fn self_test(device: &Arc<Device>) -> Result<()> {
    const ITEMS: usize = 512;
    let (starts, steps): (Vec<i32>, Vec<f64>) = (0..ITEMS).map(exact::start).unzip();
    let description = |name, kind, len, initial| Description { name, kind, len, persistent: false, initial };
    let buffers = [
        description("increments", Kind::Scalar, ITEMS, Initial::Scalar(steps)),
        description("quanta", Kind::Int, ITEMS, Initial::Int(starts)),
        description("remainders", Kind::Scalar, ITEMS, Initial::Zero),
        description("sum", Kind::Int, 1, Initial::Zero),
    ];
    let [increments, quanta, remainders, sum] = [0, 1, 2, 3].map(Buffer);
    let wires = wires![increments, quanta, remainders, sum];
    let stage = Stage::new("self-test", Code::of::<Exact>(), (ITEMS, ITEMS), &wires, [0u32; 0]);
    let mut gpu = Gpu::new(Arc::clone(device), &buffers)?;
    let mut cpu = Cpu::<f32>::new(&buffers, 1, Isa::Scalar);
    let both: [&mut dyn Backend; 2] = [&mut gpu, &mut cpu];
    let [ours, theirs] = both.map(|backend| {
        backend.run(std::slice::from_ref(&stage), &[Row::default()]);
        [quanta, remainders, sum].map(|buffer| backend.bytes(buffer))
    });
    if let Some(fault) = device.fault() {
        return Err(Error::Device(fault));
    }
    if ours == theirs {
        return Ok(());
    }
    Err(Error::Unsupported(format!(
        "{} loses small steps of positions or sums of integers (its compiler re-associates sums): its results would be wrong; use another \
         adapter or --backend cpu",
        device.listed().name
    )))
}
