//! Peak rates of a device: bytes moved and operations done per second, measured with a long copy and with long chains of
//! multiply–adds. The benchmark compares the time of a step with them.

use super::device::Device;
use std::time::Instant;
use wgpu::util::DeviceExt as _;

/// The peak rates of a device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rates {
    /// Bytes read and written, 1/s.
    pub bytes: f64,
    /// Additions and multiplications of f32, 1/s.
    pub operations: f64,
}

const TEXT: &str = "
@group(0) @binding(0) var<storage, read> from_here: array<vec4<f32>>;
@group(0) @binding(1) var<storage, read_write> to_there: array<vec4<f32>>;

fn item(workgroup: vec3<u32>, workgroups: vec3<u32>, local: u32) -> u32 {
    return (workgroup.y * workgroups.x + workgroup.x) * 64u + local;
}

@compute @workgroup_size(64)
fn move_bytes(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let i = item(workgroup, workgroups, local);
    if i < arrayLength(&from_here) {
        to_there[i] = from_here[i] + vec4<f32>(1.0);
    }
}

@compute @workgroup_size(64)
fn multiply_add(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let i = item(workgroup, workgroups, local);
    if i >= arrayLength(&from_here) {
        return;
    }
    let s = from_here[i];
    var a = s;
    var b = s + vec4<f32>(1.0);
    for (var k = 0u; k < 256u; k++) {
        a = fma(a, s, b);
        b = fma(b, s, a);
    }
    to_there[i] = a + b;
}
";

/// Operations of an invocation of `multiply_add`: 256 turns of two multiply–adds of four numbers.
const OPERATIONS: f64 = 256.0 * 2.0 * 4.0 * 2.0;
/// Bytes of each of the two buffers; less on an adapter that cannot bind as much.
const BYTES: u64 = 256 << 20;
/// Number of rounds, of which the best counts.
const ROUNDS: usize = 5;

impl Device {
    /// Measures the peak rates of the device.
    pub fn rates(&self) -> Rates {
        let gpu = &self.device;
        let bytes = BYTES.min(self.listed().binding_bytes) / 16 * 16;
        let items = bytes / 16;
        let numbers = vec![0.5f32; (bytes / 4) as usize];
        let buffer = || {
            gpu.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("rates"),
                contents: bytemuck::cast_slice(&numbers),
                usage: wgpu::BufferUsages::STORAGE,
            })
        };
        let buffers = [buffer(), buffer()];
        let module = gpu.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("rates"),
            source: wgpu::ShaderSource::Naga(std::borrow::Cow::Owned(
                naga::front::wgsl::parse_str(TEXT).expect("the text of this file compiles"),
            )),
        });
        let row = self.workgroups_in_a_row() as u64;
        let seconds = |entry: &str| {
            let pipeline = gpu.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry),
                layout: None,
                module: &module,
                entry_point: Some(entry),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            });
            let group = gpu.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(entry),
                layout: &pipeline.get_bind_group_layout(0),
                entries: &[0, 1]
                    .map(|i| wgpu::BindGroupEntry { binding: i, resource: buffers[i as usize].as_entire_binding() }),
            });
            let once = || {
                let started = Instant::now();
                let mut encoder = gpu.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
                pass.set_pipeline(&pipeline);
                pass.set_bind_group(0, &group, &[]);
                let workgroups = items.div_ceil(64);
                pass.dispatch_workgroups(workgroups.min(row) as u32, workgroups.div_ceil(row) as u32, 1);
                drop(pass);
                self.queue.submit([encoder.finish()]);
                if let Err(error) = gpu.poll(wgpu::PollType::wait_indefinitely()) {
                    self.note(&error.to_string());
                }
                started.elapsed().as_secs_f64()
            };
            (0..ROUNDS).map(|_| once()).fold(f64::INFINITY, f64::min)
        };
        Rates {
            bytes: 2.0 * bytes as f64 / seconds("move_bytes"),
            operations: items as f64 * OPERATIONS / seconds("multiply_add"),
        }
    }
}
