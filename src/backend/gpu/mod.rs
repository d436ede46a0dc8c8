//! The GPU backend: the WGSL twins of the stages, through wgpu. Only this folder knows wgpu.
//!
//! Steps are recorded into compute passes, as dispatches of one stage or several with an offset into a buffer of rows for each step. A few
//! steps are one submission, so that the device computes while the host records the next ones; no submission takes longer than
//! drivers allow. The host waits only for numbers that it asked for, once for all of them: see `readback`.
//!
//! Dispatches do not overlap: wgpu puts a barrier before each one that uses a buffer otherwise than the one before did.
//!
//! A device that fails stays failed: later reads return zeros, and [`Backend::fault`] says why.

mod clock;
mod device;
mod pipeline;
mod rates;
mod readback;
mod self_test;

pub use device::{Device, devices};
pub use rates::Rates;

use super::{Backend, Traffic};
use crate::error::{Error, Result};
use crate::kernel::buffer::{Array, Buffer, Contents, Description, Initial, Kind};
use crate::kernel::dispatch::Dispatch;
use crate::kernel::row::Row;
use crate::kernel::stage::Stage;
use clock::{Clock, Time};
use pipeline::Bound;
use readback::Staged;
use std::cell::RefCell;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;
use wgpu::util::DeviceExt as _;

/// Rows that can be recorded before a submission.
const ROWS: u64 = 512;
/// Bytes from one row to the next: the largest alignment of offsets that adapters ask for.
const ROW_STRIDE: u64 = 256;
/// Most steps in a submission, and its longest duration by the time of steps before, s: Windows resets a device after 2 s.
const SUBMITTED: usize = 8;
const LONGEST: f64 = 0.1;

/// Buffers on a device, and work that waits to be submitted.
pub struct Gpu {
    device: Arc<Device>,
    buffers: Vec<wgpu::Buffer>,
    /// Kind and length of each buffer; empty buffers have room for one number.
    shapes: Vec<(Kind, usize)>,
    rows: wgpu::Buffer,
    row_group: wgpu::BindGroup,
    /// Dispatches of lists of stages, by [`key`].
    bound: HashMap<u64, Vec<Bound>>,
    saved: Vec<(Buffer, wgpu::Buffer)>,
    work: RefCell<Work>,
}

/// Commands recorded but not submitted, and what was measured.
struct Work {
    encoder: wgpu::CommandEncoder,
    /// Whether anything is recorded.
    recorded: bool,
    /// Rows written since the last submission.
    rows: u64,
    clock: Option<Clock>,
    times: Vec<Time>,
    requested: Vec<Staged>,
    /// Bytes of buffers that nothing has changed since they were read, by number.
    brought: HashMap<usize, Vec<u8>>,
    /// Staging buffers that are not in use.
    free: Vec<wgpu::Buffer>,
    /// When the host last received numbers, the rows recorded since then, and the time of a row over the time before, s.
    received: Instant,
    since: u64,
    pace: f64,
    traffic: Traffic,
}

impl Work {
    /// Notes that commands are recorded which may change any buffer.
    fn changes(&mut self) {
        self.recorded = true;
        self.brought.clear();
    }
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
            work: RefCell::new(Work {
                encoder,
                recorded: false,
                rows: 0,
                clock,
                times: Vec::new(),
                requested: Vec::new(),
                brought: HashMap::new(),
                free: Vec::new(),
                received: Instant::now(),
                since: 0,
                pace: LONGEST,
                traffic: Traffic::default(),
            }),
            device,
        })
    }

    /// Submits what is recorded.
    fn flush(&self) {
        let mut work = self.work.borrow_mut();
        if !work.recorded {
            return;
        }
        let empty = self.device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let recorded = std::mem::replace(&mut work.encoder, empty);
        self.device.queue.submit([recorded.finish()]);
        (work.rows, work.recorded) = (0, false);
        work.traffic.submissions += 1;
    }

    fn numbers<T: bytemuck::Pod>(&self, buffer: Buffer) -> Vec<T> {
        bytemuck::pod_collect_to_vec(&self.bytes(buffer))
    }

    /// Records dispatches for rows in place; each in its own pass if timed.
    fn record(&self, work: &mut Work, ready: &[Bound], rows: &[u32], timed: bool) {
        let dispatch = |pass: &mut wgpu::ComputePass, bound: &Bound| {
            pass.set_pipeline(&bound.pipeline.pipeline);
            pass.set_bind_group(1, &bound.buffers, &[]);
            pass.set_bind_group(2, &bound.constants, &[]);
            pass.dispatch_workgroups(bound.workgroups[0], bound.workgroups[1], 1);
        };
        let Work { encoder, clock, traffic, .. } = work;
        traffic.dispatches += (ready.len() * rows.len()) as u64;
        if let Some(clock) = clock.as_mut().filter(|clock| timed && clock.takes(ready.len())) {
            for (i, bound) in ready.iter().enumerate() {
                let (label, timestamp_writes) = (Some(&bound.name[..]), Some(clock.around(i)));
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label, timestamp_writes });
                pass.set_bind_group(0, &self.row_group, &[rows[0]]);
                dispatch(&mut pass, bound);
            }
            clock.resolve(encoder, ready.iter().map(|bound| bound.name.clone()));
            return;
        }
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        for row in rows {
            pass.set_bind_group(0, &self.row_group, &[*row]);
            ready.iter().for_each(|bound| dispatch(&mut pass, bound));
        }
    }

    /// Whether a call of a list of dispatches, each run `rows` times, is timed.
    fn counts(&self, ready: &[Bound], rows: u64) -> bool {
        let work = &mut *self.work.borrow_mut();
        let mut timed = false;
        for bound in ready {
            let known = work.times.iter().position(|t| t.name == bound.name);
            let place = known.unwrap_or(work.times.len());
            if known.is_none() {
                work.times.push(Time::new(bound.name.clone()));
            }
            timed |= work.times[place].is_due(rows);
        }
        timed
    }
}

/// Hash that identifies a list of stages among the lists of its plan.
fn key(stages: &[Stage]) -> u64 {
    let mut hasher = DefaultHasher::new();
    for stage in stages {
        (stage.kernel.shader, stage.first, stage.count, &stage.reads, &stage.params).hash(&mut hasher);
        stage.writes.iter().for_each(|(buffer, _)| buffer.hash(&mut hasher));
    }
    hasher.finish()
}

impl Backend for Gpu {
    fn run(&mut self, stages: &[Stage], rows: &[Row<f64>]) {
        let list = key(stages);
        if !self.bound.contains_key(&list) {
            let dispatches = Dispatch::of(stages, self.device.storage_buffers());
            let bound = dispatches.iter().map(|dispatch| Bound::new(&self.device, dispatch, &self.buffers));
            match bound.collect::<Result<_>>() {
                Ok(bound) => _ = self.bound.insert(list, bound),
                Err(error) => return self.device.note(&error.to_string()),
            }
        }
        let ready = &self.bound[&list];
        let timed = self.counts(ready, rows.len() as u64);
        let (mut left, started) = (rows, Instant::now());
        while !left.is_empty() {
            let most = ((LONGEST / self.work.borrow().pace) as usize).clamp(1, SUBMITTED);
            let (now, later) = left.split_at(most.min(left.len()));
            left = later;
            if self.work.borrow().rows + now.len() as u64 > ROWS {
                self.flush();
            }
            let mut work = self.work.borrow_mut();
            let first = work.rows * ROW_STRIDE;
            let mut bytes = vec![0u8; now.len() * ROW_STRIDE as usize];
            for (row, place) in now.iter().zip(bytes.chunks_exact_mut(ROW_STRIDE as usize)) {
                place[..size_of::<Row<f32>>()].copy_from_slice(bytemuck::bytes_of(&row.cast::<f32>()));
            }
            self.device.queue.write_buffer(&self.rows, first, &bytes);
            work.changes();
            work.rows += now.len() as u64;
            work.since += now.len() as u64;
            let offsets: Vec<u32> = (0..now.len() as u64).map(|i| (first + i * ROW_STRIDE) as u32).collect();
            let (plain, last) = offsets.split_at(offsets.len() - usize::from(timed && left.is_empty()));
            if !plain.is_empty() {
                self.record(&mut work, ready, plain, false);
            }
            if !last.is_empty() {
                self.record(&mut work, ready, last, true);
            }
            drop(work);
            if !left.is_empty() {
                self.flush();
            }
        }
        self.work.borrow_mut().traffic.recording_s += started.elapsed().as_secs_f64();
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

    fn request(&mut self, buffer: Buffer) {
        let staged = self.stage(buffer);
        self.work.borrow_mut().requested.push(staged);
    }

    fn receive(&mut self) -> Vec<Contents> {
        let requested = std::mem::take(&mut self.work.borrow_mut().requested);
        let kinds: Vec<Kind> = requested.iter().map(Staged::kind).collect();
        kinds.into_iter().zip(self.land(requested)).map(|(kind, bytes)| readback::contents(kind, &bytes)).collect()
    }

    fn copy(&mut self, from: Buffer, to: Buffer) {
        let work = &mut *self.work.borrow_mut();
        work.encoder.copy_buffer_to_buffer(&self.buffers[from.0], 0, &self.buffers[to.0], 0, None);
        work.changes();
    }

    fn clear(&mut self, buffer: Buffer) {
        self.clear_part(buffer, 0..self.shapes[buffer.0].1);
    }

    fn clear_part(&mut self, buffer: Buffer, numbers: Range<usize>) {
        let work = &mut *self.work.borrow_mut();
        let (from, bytes) = (4 * numbers.start as u64, 4 * numbers.len() as u64);
        work.encoder.clear_buffer(&self.buffers[buffer.0], from, Some(bytes));
        work.changes();
    }

    fn bytes(&self, buffer: Buffer) -> Vec<u8> {
        if let Some(bytes) = self.work.borrow().brought.get(&buffer.0) {
            return bytes.clone();
        }
        self.land(vec![self.stage(buffer)]).pop().unwrap_or_default()
    }

    fn bring(&mut self, buffers: &[Buffer]) {
        let missing: Vec<Buffer> =
            buffers.iter().copied().filter(|b| !self.work.borrow().brought.contains_key(&b.0)).collect();
        let landed = self.land(missing.iter().map(|buffer| self.stage(*buffer)).collect());
        self.work.borrow_mut().brought.extend(missing.into_iter().map(|buffer| buffer.0).zip(landed));
    }

    fn set_bytes(&mut self, buffer: Buffer, bytes: &[u8]) {
        // a write would overtake everything recorded but not submitted
        self.flush();
        self.work.borrow_mut().brought.remove(&buffer.0);
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
        work.recorded = true;
    }

    fn restore(&mut self) {
        let mut work = self.work.borrow_mut();
        for (buffer, copy) in &self.saved {
            work.encoder.copy_buffer_to_buffer(copy, 0, &self.buffers[buffer.0], 0, None);
        }
        work.changes();
    }

    fn fault(&self) -> Option<String> {
        self.device.fault()
    }

    fn timings(&self) -> Vec<(String, f64)> {
        self.land(Vec::new());
        self.work.borrow().times.iter().map(Time::whole).collect()
    }

    fn traffic(&self) -> Option<Traffic> {
        Some(self.work.borrow().traffic)
    }

    fn describe(&self) -> String {
        let listed = self.device.listed();
        format!("gpu, {}, {}, f32", listed.name, listed.interface)
    }
}
