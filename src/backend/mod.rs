//! Backends run stages on buffers. They know no physics.

pub mod adapter;
pub mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;
#[cfg(not(feature = "gpu"))]
#[path = "no_gpu.rs"]
pub mod gpu;

use crate::kernel::buffer::{Buffer, Contents};
use crate::kernel::row::Row;
use crate::kernel::stage::Stage;
use std::ops::{Range, Sub};

/// A machine that runs stages. Numbers cross to the host as f64, whatever the precision of the run.
pub trait Backend {
    /// Runs all stages once for each row.
    fn run(&mut self, stages: &[Stage], rows: &[Row<f64>]);
    /// The scalars of a buffer.
    fn scalars(&self, buffer: Buffer) -> Vec<f64>;
    /// The signed integers of a buffer.
    fn ints(&self, buffer: Buffer) -> Vec<i32>;
    /// The unsigned integers of a buffer.
    fn uints(&self, buffer: Buffer) -> Vec<u32>;
    /// Replaces the scalars of a buffer.
    fn set_scalars(&mut self, buffer: Buffer, values: &[f64]);
    /// Asks for the numbers of a buffer as they are after all that was run so far. A device goes on meanwhile.
    fn request(&mut self, buffer: Buffer);
    /// The numbers that were asked for, in order; a device is waited for once.
    fn receive(&mut self) -> Vec<Contents>;
    /// Brings buffers to the host, waiting for a device once: until the next run or change, reading them needs no further wait.
    fn bring(&mut self, _buffers: &[Buffer]) {}
    /// Copies the numbers of a buffer to another of the same kind and length.
    fn copy(&mut self, from: Buffer, to: Buffer);
    /// Sets every number of a buffer to zero.
    fn clear(&mut self, buffer: Buffer);
    /// Sets some numbers of a buffer to zero.
    fn clear_part(&mut self, buffer: Buffer, numbers: Range<usize>);
    /// Bytes of a buffer, for hashes and checkpoints.
    fn bytes(&self, buffer: Buffer) -> Vec<u8>;
    /// Replaces the bytes of a buffer of the same length.
    fn set_bytes(&mut self, buffer: Buffer, bytes: &[u8]);
    /// Keeps a copy of some buffers, in place of the copies kept before.
    fn save(&mut self, buffers: &[Buffer]);
    /// Restores the last saved copies.
    fn restore(&mut self);
    /// The fault of a failed device: numbers read since then are void.
    fn fault(&self) -> Option<String> {
        None
    }
    /// Seconds spent so far in each stage, or in stages that a device runs at once, by name in the order of first use.
    fn timings(&self) -> Vec<(String, f64)>;
    /// What a device was asked to do so far.
    fn traffic(&self) -> Option<Traffic> {
        None
    }
    /// One line for reports.
    fn describe(&self) -> String;
}

/// What the host asked a device to do, and its own time for it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Traffic {
    pub dispatches: u64,
    pub submissions: u64,
    /// Times that the host waited for the device.
    pub waits: u64,
    /// Bytes that were read back.
    pub bytes_read: u64,
    /// Time for recording and submitting, and for waiting, s.
    pub recording_s: f64,
    pub waiting_s: f64,
}

impl Sub for Traffic {
    type Output = Self;

    /// What was asked since an earlier state.
    fn sub(self, earlier: Self) -> Self {
        Self {
            dispatches: self.dispatches - earlier.dispatches,
            submissions: self.submissions - earlier.submissions,
            waits: self.waits - earlier.waits,
            bytes_read: self.bytes_read - earlier.bytes_read,
            recording_s: self.recording_s - earlier.recording_s,
            waiting_s: self.waiting_s - earlier.waiting_s,
        }
    }
}
