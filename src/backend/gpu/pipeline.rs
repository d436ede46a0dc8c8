//! The compiled shader of a dispatch, and its bound buffers.

use super::device::Device;
use crate::error::{Error, Result};
use crate::kernel::dispatch::Dispatch;
use crate::kernel::shader::{ENTRY, Text};
use std::borrow::Cow;
use std::sync::Arc;
use wgpu::util::DeviceExt as _;

/// A compiled shader with the layouts of its groups.
pub struct Pipeline {
    pub(super) pipeline: wgpu::ComputePipeline,
    buffers: wgpu::BindGroupLayout,
    constants: wgpu::BindGroupLayout,
}

fn entry(binding: u32, ty: wgpu::BufferBindingType) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    }
}

impl Pipeline {
    /// Compiles the text of a dispatch.
    ///
    /// # Errors
    /// Text that does not compile, by file and line; workgroup memory beyond the adapter's.
    pub(super) fn new(device: &Device, dispatch: &Dispatch, text: &Text) -> Result<Self> {
        let (module, _) = text.module()?;
        let (name, links) = (dispatch.name(), dispatch.stages().len());
        let shared: u32 = module
            .global_variables
            .iter()
            .filter(|(_, variable)| variable.space == naga::AddressSpace::WorkGroup)
            .map(|(_, variable)| module.types[variable.ty].inner.size(module.to_ctx()))
            .sum();
        if shared > device.workgroup_bytes() {
            return Err(Error::Unsupported(format!(
                "the stage `{name}` shares {shared} bytes in a workgroup, and {} has {}: coarsen the mesh along its longest yarns or threads, or \
                 use --backend cpu",
                device.listed().name,
                device.workgroup_bytes()
            )));
        }
        let gpu = &device.device;
        let written = dispatch.buffers().into_iter().map(|(_, written)| written);
        let written = written.chain(dispatch.cuts().map(|_| false));
        let storage =
            |(i, written): (usize, bool)| entry(i as u32, wgpu::BufferBindingType::Storage { read_only: !written });
        let layout = |entries: Vec<wgpu::BindGroupLayoutEntry>| {
            gpu.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(&name), entries: &entries })
        };
        let buffers = layout(written.enumerate().map(storage).collect());
        let constants = layout((0..2 * links as u32).map(|i| entry(i, wgpu::BufferBindingType::Uniform)).collect());
        let source = wgpu::ShaderSource::Naga(Cow::Owned(module));
        let checks = wgpu::ShaderRuntimeChecks {
            force_loop_bounding: false,
            int_div_checks: false,
            ..wgpu::ShaderRuntimeChecks::checked()
        };
        // SAFETY: every loop of the shaders ends after a number of turns that their tables bound, and no divisor is zero.
        let module = unsafe {
            gpu.create_shader_module_trusted(wgpu::ShaderModuleDescriptor { label: Some(&name), source }, checks)
        };
        let pipeline = gpu.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(&name),
            layout: Some(&gpu.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(&name),
                bind_group_layouts: &[Some(&device.row_layout), Some(&buffers), Some(&constants)],
                immediate_size: 0,
            })),
            module: &module,
            entry_point: Some(ENTRY),
            compilation_options: wgpu::PipelineCompilationOptions {
                zero_initialize_workgroup_memory: false,
                ..wgpu::PipelineCompilationOptions::default()
            },
            cache: None,
        });
        match device.fault() {
            Some(fault) => Err(Error::Device(format!("the stage `{name}` does not compile on {fault}"))),
            None => Ok(Self { pipeline, buffers, constants }),
        }
    }
}

/// A dispatch with its buffers.
pub struct Bound {
    pub(super) name: String,
    pub(super) pipeline: Arc<Pipeline>,
    pub(super) buffers: wgpu::BindGroup,
    pub(super) constants: wgpu::BindGroup,
    /// Workgroups along x and y.
    pub(super) workgroups: [u32; 2],
}

impl Bound {
    /// Binds the buffers of a dispatch, and the items and parameters of its stages.
    pub(super) fn new(device: &Device, dispatch: &Dispatch, buffers: &[wgpu::Buffer]) -> Result<Self> {
        let pipeline = device.pipeline(dispatch)?;
        let name = dispatch.name();
        let constant = |bytes: &[u8], usage| {
            let mut padded = bytes.to_vec();
            padded.resize(bytes.len().next_multiple_of(16).max(16), 0);
            let (label, contents) = (Some(&name[..]), &padded[..]);
            device.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label, contents, usage })
        };
        let of_stages: Vec<_> = dispatch
            .stages()
            .iter()
            .flat_map(|stage| {
                let items = [stage.first as u32, stage.count as u32];
                [bytemuck::bytes_of(&items), &stage.params].map(|bytes| constant(bytes, wgpu::BufferUsages::UNIFORM))
            })
            .collect();
        let cuts = dispatch.cuts().map(|cuts| constant(bytemuck::cast_slice(&cuts), wgpu::BufferUsages::STORAGE));
        let group = |layout, bound: &[&wgpu::Buffer]| {
            let entries: Vec<_> = bound
                .iter()
                .enumerate()
                .map(|(i, b)| wgpu::BindGroupEntry { binding: i as u32, resource: b.as_entire_binding() })
                .collect();
            device.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(&name),
                layout,
                entries: &entries,
            })
        };
        let bound = dispatch.buffers();
        let all: Vec<&wgpu::Buffer> = bound.iter().map(|(b, _)| &buffers[b.0]).chain(&cuts).collect();
        let workgroups = dispatch.workgroups();
        let row = device.workgroups_in_a_row();
        Ok(Self {
            buffers: group(&pipeline.buffers, &all),
            constants: group(&pipeline.constants, &of_stages.iter().collect::<Vec<_>>()),
            pipeline,
            name,
            workgroups: [workgroups.min(row) as u32, workgroups.div_ceil(row) as u32],
        })
    }
}
