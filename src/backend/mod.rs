//! Backends run stages on buffers. They know no physics.

pub mod adapter;
pub mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;
#[cfg(not(feature = "gpu"))]
#[path = "no_gpu.rs"]
pub mod gpu;

use crate::kernel::buffer::Buffer;
use crate::kernel::row::Row;
use crate::kernel::stage::Stage;

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
    /// Sets every number of a buffer to zero.
    fn clear(&mut self, buffer: Buffer);
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
    /// Seconds spent in each stage so far, by name, in the order of first use.
    fn timings(&self) -> Vec<(&'static str, f64)>;
    /// One line for reports.
    fn describe(&self) -> String;
}
