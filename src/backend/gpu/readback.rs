//! Numbers on their way back to the host. A request records a copy into a staging buffer; the host waits once for all copies.

use super::Gpu;
use crate::kernel::buffer::{Buffer, Contents, Kind};
use std::time::Instant;

/// A copy of a buffer that is not yet on the host.
pub(super) struct Staged {
    kind: Kind,
    bytes: u64,
    buffer: wgpu::Buffer,
}

impl Staged {
    pub fn kind(&self) -> Kind {
        self.kind
    }
}

/// The numbers of a buffer from its bytes.
pub(super) fn contents(kind: Kind, bytes: &[u8]) -> Contents {
    match kind {
        Kind::Scalar => {
            let values: Vec<f32> = bytemuck::pod_collect_to_vec(bytes);
            Contents::Scalars(values.into_iter().map(f64::from).collect())
        }
        Kind::Int => Contents::Ints(bytemuck::pod_collect_to_vec(bytes)),
        Kind::Uint => Contents::Uints(bytemuck::pod_collect_to_vec(bytes)),
    }
}

impl Gpu {
    /// Records a copy of a buffer as it is after all that is recorded.
    pub(super) fn stage(&self, buffer: Buffer) -> Staged {
        let (kind, len) = self.shapes[buffer.0];
        self.stage_bytes(&self.buffers[buffer.0], kind, 4 * len as u64)
    }

    fn stage_bytes(&self, from: &wgpu::Buffer, kind: Kind, bytes: u64) -> Staged {
        let work = &mut *self.work.borrow_mut();
        let known = work.free.iter().position(|free| free.size() == bytes.max(4));
        let buffer = known.map(|place| work.free.swap_remove(place)).unwrap_or_else(|| {
            self.device.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("staging"),
                size: bytes.max(4),
                usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                mapped_at_creation: false,
            })
        });
        if bytes > 0 {
            work.encoder.copy_buffer_to_buffer(from, 0, &buffer, 0, bytes);
            work.recorded = true;
        }
        Staged { kind, bytes, buffer }
    }

    /// Waits for copies, and for timestamps if there are any; returns the bytes of the copies: zeros from a device that failed.
    pub(super) fn land(&self, mut staged: Vec<Staged>) -> Vec<Vec<u8>> {
        let resolved = self.work.borrow().clock.as_ref().filter(|clock| clock.waits()).map(|c| c.resolved.clone());
        let is_timed = resolved.is_some();
        staged.extend(resolved.map(|resolved| self.stage_bytes(&resolved, Kind::Uint, resolved.size())));
        if staged.is_empty() {
            return Vec::new();
        }
        let started = Instant::now();
        self.flush();
        let waiting = Instant::now();
        staged.iter().for_each(|copy| copy.buffer.map_async(wgpu::MapMode::Read, .., |_| {}));
        if let Err(error) = self.device.device.poll(wgpu::PollType::wait_indefinitely()) {
            self.device.note(&error.to_string());
        }
        let mut landed: Vec<Vec<u8>> = staged.iter().map(|copy| self.mapped(copy)).collect();
        let work = &mut *self.work.borrow_mut();
        work.traffic.waits += 1;
        work.traffic.recording_s += (waiting - started).as_secs_f64();
        work.traffic.waiting_s += waiting.elapsed().as_secs_f64();
        work.traffic.bytes_read += staged.iter().map(|copy| copy.bytes).sum::<u64>();
        work.pace = work.received.elapsed().as_secs_f64() / work.since.max(1) as f64;
        (work.received, work.since) = (Instant::now(), 0);
        work.free.extend(staged.into_iter().map(|copy| copy.buffer));
        if let Some(clock) = work.clock.as_mut().filter(|_| is_timed) {
            let period = f64::from(self.device.queue.get_timestamp_period()) * 1e-9;
            clock.read(&landed.pop().unwrap_or_default(), period, &mut work.times);
        }
        landed
    }

    /// The bytes of a copy that has been waited for.
    fn mapped(&self, copy: &Staged) -> Vec<u8> {
        let bytes = match copy.buffer.slice(..).get_mapped_range() {
            Ok(view) if self.device.fault().is_none() => view[..copy.bytes as usize].to_vec(),
            Ok(_) => vec![0; copy.bytes as usize],
            Err(error) => {
                self.device.note(&error.to_string());
                vec![0; copy.bytes as usize]
            }
        };
        copy.buffer.unmap();
        bytes
    }
}
