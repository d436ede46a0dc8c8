//! Replaces the GPU backend in a build without the feature `gpu`: there is no device, and a request for one is an error.

use super::Backend;
use super::adapter::Adapter;
use crate::error::{Error, Result};
use crate::kernel::buffer::Description;
use std::convert::Infallible;
use std::sync::Arc;

/// A device: none can be opened.
#[derive(Debug)]
pub struct Device(Infallible);

/// The adapters of this machine: none.
pub fn devices() -> Vec<Adapter> {
    Vec::new()
}

impl Device {
    /// # Errors
    /// Always: this build has no GPU backend.
    pub fn open(_name: &str) -> Result<Arc<Self>> {
        Err(Error::Unsupported(
            "this build has no GPU backend: build it with the feature gpu, or use --backend cpu".into(),
        ))
    }

    pub fn is_software(&self) -> bool {
        match self.0 {}
    }

    /// The backend that runs scenes on it.
    ///
    /// # Errors
    /// None: there is no device.
    pub fn backend(self: Arc<Self>, _descriptions: &[Description]) -> Result<Box<dyn Backend>> {
        match self.0 {}
    }
}
