//! The compiled shader of a stage, and its bound buffers.

use super::device::Device;
use crate::error::{Error, Result};
use crate::kernel::shader::{ENTRY, Text, WORKGROUP};
use crate::kernel::stage::Stage;
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
    /// Compiles the text of a stage.
    ///
    /// # Errors
    /// Text that does not compile, by file and line; workgroup memory beyond the adapter's.
    pub(super) fn new(device: &Device, stage: &Stage, text: &Text) -> Result<Self> {
        let (module, _) = text.module()?;
        let shared: u32 = module
            .global_variables
            .iter()
            .filter(|(_, variable)| variable.space == naga::AddressSpace::WorkGroup)
            .map(|(_, variable)| module.types[variable.ty].inner.size(module.to_ctx()))
            .sum();
        if shared > device.workgroup_bytes() {
            return Err(Error::Unsupported(format!(
                "the stage `{}` shares {shared} bytes in a workgroup, and {} has {}: coarsen the mesh along its longest yarns or threads, or \
                 use --backend cpu",
                stage.name,
                device.listed().name,
                device.workgroup_bytes()
            )));
        }
        let gpu = &device.device;
        let reads = stage.reads.len();
        let entries: Vec<_> = (0..reads + stage.writes.len())
            .map(|i| entry(i as u32, wgpu::BufferBindingType::Storage { read_only: i < reads }))
            .collect();
        let layout = |entries: &[wgpu::BindGroupLayoutEntry]| {
            gpu.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(stage.name), entries })
        };
        let buffers = layout(&entries);
        let constants = layout(&[0, 1].map(|i| entry(i, wgpu::BufferBindingType::Uniform)));
        let source = wgpu::ShaderSource::Naga(Cow::Owned(module));
        let checks = wgpu::ShaderRuntimeChecks {
            force_loop_bounding: false,
            int_div_checks: false,
            ..wgpu::ShaderRuntimeChecks::checked()
        };
        // SAFETY: every loop of the shaders ends after a number of turns that their tables bound, and no divisor is zero.
        let module = unsafe {
            gpu.create_shader_module_trusted(wgpu::ShaderModuleDescriptor { label: Some(stage.name), source }, checks)
        };
        let pipeline = gpu.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(stage.name),
            layout: Some(&gpu.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(stage.name),
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
            Some(fault) => Err(Error::Device(format!("the stage `{}` does not compile on {fault}", stage.name))),
            None => Ok(Self { pipeline, buffers, constants }),
        }
    }
}

/// A stage ready to be dispatched.
pub struct Bound {
    pub(super) pipeline: Arc<Pipeline>,
    pub(super) buffers: wgpu::BindGroup,
    pub(super) constants: wgpu::BindGroup,
    /// Workgroups along x and y.
    pub(super) workgroups: [u32; 2],
}

impl Bound {
    /// Binds the buffers of a stage, and its range of items and parameters.
    pub(super) fn new(device: &Device, stage: &Stage, buffers: &[wgpu::Buffer]) -> Result<Self> {
        let pipeline = device.pipeline(stage)?;
        let uniform = |bytes: &[u8]| {
            let mut padded = bytes.to_vec();
            padded.resize(bytes.len().next_multiple_of(16).max(16), 0);
            device.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some(stage.name),
                contents: &padded,
                usage: wgpu::BufferUsages::UNIFORM,
            })
        };
        let items = uniform(bytemuck::bytes_of(&[stage.first as u32, stage.count as u32]));
        let params = uniform(&stage.params);
        let group = |layout, bound: &[&wgpu::Buffer]| {
            let entries: Vec<_> = bound
                .iter()
                .enumerate()
                .map(|(i, b)| wgpu::BindGroupEntry { binding: i as u32, resource: b.as_entire_binding() })
                .collect();
            device.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(stage.name),
                layout,
                entries: &entries,
            })
        };
        let all = stage.reads.iter().chain(stage.writes.iter().map(|(b, _)| b));
        let all: Vec<&wgpu::Buffer> = all.map(|b| &buffers[b.0]).collect();
        let workgroups = (stage.count * stage.kernel.shader.share.invocations()).div_ceil(WORKGROUP);
        let row = device.workgroups_in_a_row();
        Ok(Self {
            buffers: group(&pipeline.buffers, &all),
            constants: group(&pipeline.constants, &[&items, &params]),
            pipeline,
            workgroups: [workgroups.min(row) as u32, workgroups.div_ceil(row) as u32],
        })
    }
}
