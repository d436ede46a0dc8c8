//! Adapters, and the device of a run with its limits and faults.

use super::Gpu;
use super::pipeline::Pipeline;
use crate::backend::Backend;
use crate::backend::adapter::Adapter;
use crate::error::{Error, Result};
use crate::kernel::buffer::Description;
use crate::kernel::dispatch::Dispatch;
use std::collections::HashMap;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Storage buffers that the widest stage binds, and that a dispatch of several stages may bind.
const STORAGE_BUFFERS: u32 = 16;
const MOST_STORAGE_BUFFERS: u32 = 32;

/// Kind of an adapter that computes on the CPU.
const SOFTWARE: &str = "software";

/// An open device.
pub struct Device {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    listed: Adapter,
    limits: wgpu::Limits,
    /// Layout of the row of schedule data, which all stages share.
    pub(super) row_layout: wgpu::BindGroupLayout,
    /// Compiled stages, by text.
    pipelines: Mutex<HashMap<String, Arc<Pipeline>>>,
    faults: Arc<Mutex<Faults>>,
}

/// The first error, and the loss of the device, which explains the errors that follow from it.
#[derive(Default)]
struct Faults {
    first: Option<String>,
    lost: Option<String>,
}

impl fmt::Debug for Device {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.listed.name)
    }
}

fn instance() -> wgpu::Instance {
    wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: wgpu::Backends::PRIMARY,
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    })
}

fn adapters() -> Vec<wgpu::Adapter> {
    let mut all = pollster::block_on(instance().enumerate_adapters(wgpu::Backends::PRIMARY));
    all.sort_by_key(|adapter| match adapter.get_info().device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::VirtualGpu => 1,
        wgpu::DeviceType::IntegratedGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    });
    all
}

fn list(adapter: &wgpu::Adapter) -> Adapter {
    let (info, limits) = (adapter.get_info(), adapter.limits());
    Adapter {
        name: info.name,
        interface: info.backend.to_string(),
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
        kind: match info.device_type {
            wgpu::DeviceType::DiscreteGpu => "discrete GPU",
            wgpu::DeviceType::IntegratedGpu => "integrated GPU",
            wgpu::DeviceType::VirtualGpu => "virtual GPU",
            wgpu::DeviceType::Cpu => SOFTWARE,
            wgpu::DeviceType::Other => "other",
        },
        is_discrete: info.device_type == wgpu::DeviceType::DiscreteGpu,
        binding_bytes: limits.max_storage_buffer_binding_size,
        buffer_bytes: limits.max_buffer_size,
        storage_buffers: limits.max_storage_buffers_per_shader_stage,
        workgroup_bytes: limits.max_compute_workgroup_storage_size,
        has_timestamps: adapter.features().contains(wgpu::Features::TIMESTAMP_QUERY),
    }
}

/// All adapters, in the order in which a run prefers them.
pub fn devices() -> Vec<Adapter> {
    adapters().iter().map(list).collect()
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A message on one line.
fn line(message: &str) -> String {
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}

impl Device {
    /// The backend that runs scenes on it.
    ///
    /// # Errors
    /// A scene that the device cannot hold or compute.
    pub fn backend(self: Arc<Self>, descriptions: &[Description]) -> Result<Box<dyn Backend>> {
        Ok(Box::new(Gpu::new(self, descriptions)?))
    }

    /// Whether it computes on the CPU.
    pub fn is_software(&self) -> bool {
        self.listed.kind == SOFTWARE
    }

    /// Opens the first adapter whose name contains `name` (any if empty; hardware before software).
    ///
    /// # Errors
    /// No such adapter, or one that does not meet the needs of the stages.
    pub fn open(name: &str) -> Result<Arc<Self>> {
        let all = adapters();
        let known = || all.iter().map(|a| format!("`{}`", a.get_info().name)).collect::<Vec<_>>().join(", ");
        if all.is_empty() {
            return Err(Error::Unsupported(
                "no adapter was found: install a Vulkan driver (mesa-vulkan-drivers has one in software), or use --backend cpu"
                    .into(),
            ));
        }
        let adapter = all
            .iter()
            .find(|a| a.get_info().name.to_lowercase().contains(&name.to_lowercase()))
            .ok_or_else(|| Error::Unsupported(format!("no adapter is called `{name}`; there are {}", known())))?;
        let listed = list(adapter);
        if listed.storage_buffers < STORAGE_BUFFERS {
            return Err(Error::Unsupported(format!(
                "{} binds {} storage buffers in a stage, and contact needs {STORAGE_BUFFERS}; use another adapter or --backend cpu",
                listed.name, listed.storage_buffers
            )));
        }
        let wanted = adapter.limits();
        let limits = wgpu::Limits {
            max_storage_buffers_per_shader_stage: wanted.max_storage_buffers_per_shader_stage.min(MOST_STORAGE_BUFFERS),
            max_buffers_and_acceleration_structures_per_shader_stage: wanted
                .max_buffers_and_acceleration_structures_per_shader_stage,
            max_storage_buffer_binding_size: wanted.max_storage_buffer_binding_size,
            max_buffer_size: wanted.max_buffer_size,
            max_compute_workgroup_storage_size: wanted.max_compute_workgroup_storage_size,
            max_compute_workgroups_per_dimension: wanted.max_compute_workgroups_per_dimension,
            ..wgpu::Limits::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("tricot"),
            required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
            required_limits: limits.clone(),
            ..wgpu::DeviceDescriptor::default()
        }))
        .map_err(|e| Error::Unsupported(format!("{} cannot be opened: {e}", listed.name)))?;
        let faults = Arc::new(Mutex::new(Faults::default()));
        let (lost, failed) = (Arc::clone(&faults), Arc::clone(&faults));
        device.set_device_lost_callback(move |_, why| {
            let why = if why.is_empty() { "without a word from its driver" } else { &why };
            locked(&lost).lost.get_or_insert(format!("the device was lost, {}", line(why)));
        });
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            locked(&failed).first.get_or_insert(line(&error.to_string()));
        }));
        let row_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("row"),
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: true,
                    min_binding_size: None,
                },
                count: None,
            }],
        });
        let device = Self { device, queue, listed, limits, row_layout, pipelines: Mutex::default(), faults };
        let device = Arc::new(device);
        super::self_test::self_test(&device)?;
        Ok(device)
    }

    /// Properties of the adapter.
    pub fn listed(&self) -> &Adapter {
        &self.listed
    }

    /// The fault of the device, if it has failed.
    pub fn fault(&self) -> Option<String> {
        if locked(&self.faults).first.is_some() {
            // the next poll reports a loss; it may fail too
            _ = self.device.poll(wgpu::PollType::Poll);
        }
        let faults = locked(&self.faults);
        let what = faults.lost.as_ref().or(faults.first.as_ref())?;
        Some(format!("{}: {what}", self.listed.name))
    }

    pub(super) fn note(&self, what: &str) {
        locked(&self.faults).first.get_or_insert(line(what));
    }

    /// Destroys the device as a crashed driver would, to test how a run ends.
    pub fn lose(&self) {
        self.device.destroy();
    }

    /// Whether the buffers of a scene fit.
    ///
    /// # Errors
    /// The buffer that is too large, and what would fit.
    pub(super) fn fits(&self, buffers: &[Description]) -> Result<()> {
        let most = self.limits.max_storage_buffer_binding_size.min(self.limits.max_buffer_size);
        let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
        let largest = buffers.iter().max_by_key(|b| b.len).filter(|b| 4 * b.len as u64 > most);
        let Some(buffer) = largest else { return Ok(()) };
        let bytes = 4 * buffer.len as u64;
        Err(Error::Unsupported(format!(
            "the scene's buffer `{}` has {:.0} MiB, and {} binds at most {:.0} MiB: a scene of {:.0} % of this size would fit; coarsen the \
             mesh, use another adapter, or --backend cpu",
            buffer.name,
            mib(bytes),
            self.listed.name,
            mib(most),
            100.0 * most as f64 / bytes as f64
        )))
    }

    /// The compiled shader of a dispatch; compiled once for each text.
    pub(super) fn pipeline(&self, dispatch: &Dispatch) -> Result<Arc<Pipeline>> {
        let text = dispatch.text()?;
        let mut known = locked(&self.pipelines);
        if let Some(pipeline) = known.get(&text.text) {
            return Ok(Arc::clone(pipeline));
        }
        let pipeline = Arc::new(Pipeline::new(self, dispatch, &text)?);
        known.insert(text.text, Arc::clone(&pipeline));
        Ok(pipeline)
    }

    /// Memory that the workgroups of a stage may share, bytes.
    pub(super) fn workgroup_bytes(&self) -> u32 {
        self.limits.max_compute_workgroup_storage_size
    }

    /// Storage buffers that a dispatch may bind.
    pub(super) fn storage_buffers(&self) -> usize {
        let all = self.limits.max_buffers_and_acceleration_structures_per_shader_stage;
        let of_any_kind = all - self.limits.max_uniform_buffers_per_shader_stage;
        self.limits.max_storage_buffers_per_shader_stage.min(of_any_kind) as usize
    }

    /// Workgroups in one row of a dispatch.
    pub(super) fn workgroups_in_a_row(&self) -> usize {
        self.limits.max_compute_workgroups_per_dimension as usize
    }
}
