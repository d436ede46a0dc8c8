//! Which backend runs a scene.

use crate::backend::Backend;
use crate::backend::cpu::Cpu;
use crate::backend::gpu::Device;
use crate::error::{Error, Result};
use crate::kernel::lane::Isa;
use crate::plan::Model;
use crate::settings::integration::Precision;
use std::sync::Arc;

/// Precision, threads and device of a backend.
#[derive(Debug, Clone)]
pub struct BackendConfig {
    pub precision: Precision,
    /// Threads of the CPU; 0 for all cores.
    pub threads: usize,
    pub isa: Isa,
    /// The device that runs the scene; `None` for the CPU.
    pub device: Option<Arc<Device>>,
}

impl Default for BackendConfig {
    fn default() -> Self {
        Self { precision: Precision::F32, threads: 0, isa: Isa::best(), device: None }
    }
}

impl BackendConfig {
    /// # Errors
    /// A scene that the device cannot hold or compute.
    pub(super) fn backend(&self, model: &Model) -> Result<Box<dyn Backend>> {
        let buffers = &model.plan.buffers;
        Ok(match (&self.device, self.precision) {
            (None, Precision::F32) => Box::new(Cpu::<f32>::new(buffers, self.threads, self.isa)),
            (None, Precision::F64) => Box::new(Cpu::<f64>::new(buffers, self.threads, self.isa)),
            (Some(device), Precision::F32) => Arc::clone(device).backend(buffers)?,
            (Some(_), Precision::F64) => {
                let what = "a GPU computes in f32 only; set integration.precision to f32, or use --backend cpu";
                return Err(Error::Unsupported(what.into()));
            }
        })
    }
}
