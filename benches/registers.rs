//! Registers, scratch memory and instructions of each dispatch, as a real driver compiles it. No hardware is needed: Mesa's RADV
//! compiles for any AMD GPU, `RADV_FORCE_FAMILY=gfx1100 cargo bench --bench registers`. The shaders are those of the cell and of
//! the small specimen, or of the case that is given. The last line is the table as JSON.

#[cfg(target_os = "linux")]
mod offline {
    use ash::{Device, Entry, Instance, khr, vk};
    use naga::back::spv;
    use naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy};
    use serde_json::{Value, json};
    use std::collections::BTreeMap;
    use std::error::Error;
    use std::path::Path;
    use tricot::kernel::dispatch::Dispatch;
    use tricot::kernel::shader::ENTRY;
    use tricot::rigs::read::read;
    use tricot::run::simulation;
    use tricot::simulate::BackendConfig;

    const CASES: [&str; 2] = ["cases/unit_cell_shear.json", "cases/bias_extension_small.json"];
    /// Storage buffers that a dispatch binds at most.
    const BUFFERS: usize = 32;
    /// Statistics in the table, by the names that Mesa gives them.
    const COLUMNS: [&str; 7] = [
        "VGPRs",
        "Spilled VGPRs",
        "Scratch size",
        "LDS size",
        "Subgroups per SIMD",
        "Instructions",
        "Inverse Throughput",
    ];

    type Result<T> = std::result::Result<T, Box<dyn Error>>;

    /// A driver that tells what it compiles.
    struct Compiler {
        // keeps the library loaded
        _entry: Entry,
        instance: Instance,
        device: Device,
        executables: khr::pipeline_executable_properties::Device,
    }

    impl Compiler {
        /// The first device that tells, and its name.
        fn new() -> Result<(Self, String)> {
            // SAFETY: handles are used only while their owners live, here and in the functions below; infos are filled in.
            unsafe {
                let entry = Entry::load()?;
                let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
                let instance =
                    entry.create_instance(&vk::InstanceCreateInfo::default().application_info(&application), None)?;
                let wanted = khr::pipeline_executable_properties::NAME;
                let tells = |device: &vk::PhysicalDevice| {
                    let all = instance.enumerate_device_extension_properties(*device).unwrap_or_default();
                    all.iter().any(|e| e.extension_name_as_c_str() == Ok(wanted))
                };
                let devices = instance.enumerate_physical_devices()?;
                let chosen = devices.into_iter().find(tells).ok_or(
                    "no driver here tells what it compiles; with Mesa's RADV, set RADV_FORCE_FAMILY to gfx1100 or navi21",
                )?;
                let name = instance
                    .get_physical_device_properties(chosen)
                    .device_name_as_c_str()?
                    .to_string_lossy()
                    .into_owned();
                let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
                let mut tell =
                    vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default().pipeline_executable_info(true);
                let mut memory = vk::PhysicalDeviceVulkan12Features::default().vulkan_memory_model(true);
                let extensions = [wanted.as_ptr()];
                let info = vk::DeviceCreateInfo::default()
                    .queue_create_infos(&queues)
                    .enabled_extension_names(&extensions)
                    .push_next(&mut tell)
                    .push_next(&mut memory);
                let device = instance.create_device(chosen, &info, None)?;
                let executables = khr::pipeline_executable_properties::Device::new(&instance, &device);
                Ok((Self { _entry: entry, instance, device, executables }, name))
            }
        }

        /// The statistics of a dispatch.
        fn statistics(&self, dispatch: &Dispatch) -> Result<BTreeMap<String, u64>> {
            let (module, info) = dispatch.text()?.module()?;
            let options = spv::Options {
                lang_version: (1, 5),
                flags: spv::WriterFlags::empty(),
                // as wgpu asks for on a device with robust access to buffers
                bounds_check_policies: BoundsCheckPolicies {
                    index: BoundsCheckPolicy::Restrict,
                    buffer: BoundsCheckPolicy::Unchecked,
                    ..BoundsCheckPolicies::default()
                },
                zero_initialize_workgroup_memory: spv::ZeroInitializeWorkgroupMemoryMode::None,
                force_loop_bounding: false,
                ..spv::Options::default()
            };
            let entry = spv::PipelineOptions { shader_stage: naga::ShaderStage::Compute, entry_point: ENTRY.into() };
            let words = spv::write_vec(&module, &info, &options, Some(&entry))?;
            let device = &self.device;
            let layout = |kind: vk::DescriptorType, count: usize| {
                let binding = |i| {
                    let binding = vk::DescriptorSetLayoutBinding::default().binding(i).descriptor_type(kind);
                    binding.descriptor_count(1).stage_flags(vk::ShaderStageFlags::COMPUTE)
                };
                let bindings: Vec<_> = (0..count as u32).map(binding).collect();
                // SAFETY: see `new`.
                unsafe {
                    let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
                    device.create_descriptor_set_layout(&info, None)
                }
            };
            let buffers = dispatch.buffers().len() + dispatch.cuts().iter().len();
            let layouts = [
                layout(vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC, 1)?,
                layout(vk::DescriptorType::STORAGE_BUFFER, buffers)?,
                layout(vk::DescriptorType::UNIFORM_BUFFER, 2 * dispatch.stages().len())?,
            ];
            let entry = c"main";
            assert_eq!(entry.to_bytes(), ENTRY.as_bytes());
            // SAFETY: see `new`.
            unsafe {
                let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&layouts);
                let layout = device.create_pipeline_layout(&info, None)?;
                let module = device.create_shader_module(&vk::ShaderModuleCreateInfo::default().code(&words), None)?;
                let stage = vk::PipelineShaderStageCreateInfo::default();
                let stage = stage.stage(vk::ShaderStageFlags::COMPUTE).module(module).name(entry);
                let info = vk::ComputePipelineCreateInfo::default()
                    .flags(vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR)
                    .stage(stage)
                    .layout(layout);
                let made = device.create_compute_pipelines(vk::PipelineCache::null(), &[info], None);
                let pipeline = made.map_err(|(_, error)| error)?[0];
                let executable = vk::PipelineExecutableInfoKHR::default().pipeline(pipeline);
                let all = self.executables.get_pipeline_executable_statistics(&executable)?;
                let numbers = all.iter().filter(|s| s.format == vk::PipelineExecutableStatisticFormatKHR::UINT64);
                let read = |s: &vk::PipelineExecutableStatisticKHR| {
                    Some((s.name_as_c_str().ok()?.to_str().ok()?.to_owned(), s.value.u64))
                };
                let found = numbers.filter_map(read).collect();
                device.destroy_pipeline(pipeline, None);
                device.destroy_shader_module(module, None);
                device.destroy_pipeline_layout(layout, None);
                layouts.iter().for_each(|layout| device.destroy_descriptor_set_layout(*layout, None));
                Ok(found)
            }
        }
    }

    impl Drop for Compiler {
        fn drop(&mut self) {
            // SAFETY: see `new`; nothing made from them is left.
            unsafe {
                self.device.destroy_device(None);
                self.instance.destroy_instance(None);
            }
        }
    }

    /// Prints the tables of the cases.
    pub fn print() -> Result<()> {
        let given: Vec<String> = std::env::args().skip(1).filter(|a| a.ends_with(".json")).collect();
        let cases = if given.is_empty() { CASES.map(String::from).to_vec() } else { given };
        let (compiler, name) = Compiler::new()?;
        println!("{name}");
        let mut tables = serde_json::Map::new();
        for case in cases {
            let scene = simulation(&read(Path::new(&case), &[])?, BackendConfig::default())?;
            let plan = &scene.model.plan;
            println!("\n{case}");
            println!("{:64} {}", "dispatch", COLUMNS.map(|column| format!("{column:>18}")).concat());
            let mut table = serde_json::Map::new();
            let lists = [&plan.step, &plan.search, &plan.watch, &plan.diagnose, &plan.collect];
            for dispatch in lists.into_iter().flat_map(|stages| Dispatch::of(stages, BUFFERS)) {
                if table.contains_key(&dispatch.name()) {
                    continue;
                }
                let found = compiler.statistics(&dispatch)?;
                let shown = COLUMNS.map(|column| found.get(column).map_or("".into(), u64::to_string));
                println!("{:64} {}", dispatch.name(), shown.map(|number| format!("{number:>18}")).concat());
                let numbers =
                    COLUMNS.into_iter().filter_map(|column| Some((column.to_owned(), json!(found.get(column)?))));
                table.insert(dispatch.name(), Value::Object(numbers.collect()));
            }
            tables.insert(case, Value::Object(table));
        }
        println!("{}", json!({ "device": name, "cases": tables }));
        Ok(())
    }
}

#[cfg(target_os = "linux")]
fn main() {
    if let Err(error) = offline::print() {
        println!("{error}");
    }
}

#[cfg(not(target_os = "linux"))]
fn main() {
    println!("drivers that compile without hardware are looked for on Linux only");
}
