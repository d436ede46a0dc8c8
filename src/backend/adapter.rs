//! Properties of an adapter before a device is opened on it.

/// An adapter, as `tricot devices` lists it.
#[derive(Debug, Clone)]
pub struct Adapter {
    pub name: String,
    /// Graphics interface: Vulkan, Metal or Dx12.
    pub interface: String,
    pub driver: String,
    /// Discrete GPU, integrated GPU, virtual GPU, or software.
    pub kind: &'static str,
    /// Whether it is a GPU with memory of its own.
    pub is_discrete: bool,
    /// Largest buffer that a stage can bind, bytes.
    pub binding_bytes: u64,
    /// Largest buffer, bytes.
    pub buffer_bytes: u64,
    /// Storage buffers that a stage can bind.
    pub storage_buffers: u32,
    /// Memory that a workgroup shares, bytes.
    pub workgroup_bytes: u32,
    /// Whether stages can be timed on the device.
    pub has_timestamps: bool,
}
