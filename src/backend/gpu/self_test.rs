//! What a device must compute like the CPU before it may run a scene.

use super::{Device, Gpu};
use crate::backend::Backend;
use crate::backend::cpu::Cpu;
use crate::error::{Error, Result};
use crate::kernel::buffer::{Buffer, Description, Initial, Kind};
use crate::kernel::exact::{self, Exact, Roots, Together};
use crate::kernel::lane::Isa;
use crate::kernel::row::Row;
use crate::kernel::stage::{Code, Stage, wires};
use std::sync::Arc;

/// Items of a stage.
const ITEMS: usize = 512;
/// Relative error of a root of a ratio: Vulkan allows divisions 2.5 units in the last place.
const CLOSE: f64 = 1e-6;

/// Checks that the device computes as the CPU does: integers, sums with remainders and sums by workgroups bit by bit, roots of
/// ratios closely.
pub(super) fn self_test(device: &Arc<Device>) -> Result<()> {
    let (starts, steps): (Vec<i32>, Vec<f64>) = (0..ITEMS).map(exact::start).unzip();
    let ratios = [1.7, 0.3].map(|power| (0..ITEMS).map(|i| libm::pow(i as f64 + 1.0, power)).collect());
    let [above, below] = ratios.map(Initial::Scalar);
    let description = |name, kind, len, initial| Description { name, kind, len, persistent: false, initial };
    let buffers = [
        description("increments", Kind::Scalar, ITEMS, Initial::Scalar(steps)),
        description("quanta", Kind::Int, ITEMS, Initial::Int(starts)),
        description("remainders", Kind::Scalar, ITEMS, Initial::Zero),
        description("sum", Kind::Int, 1, Initial::Zero),
        description("sums of workgroups", Kind::Uint, ITEMS, Initial::Zero),
        description("numerators", Kind::Scalar, ITEMS, above),
        description("denominators", Kind::Scalar, ITEMS, below),
        description("roots", Kind::Scalar, ITEMS, Initial::Zero),
    ];
    let [increments, quanta, remainders, sum, sums, numerators, denominators, out] =
        [0, 1, 2, 3, 4, 5, 6, 7].map(Buffer);
    let stages = [
        Stage::new(
            "steps",
            Code::of::<Exact>(),
            (ITEMS, ITEMS),
            &wires![increments, quanta, remainders, sum],
            [0u32; 0],
        ),
        Stage::new("sums", Code::of::<Together>(), (ITEMS, ITEMS), &wires![sums], [0u32; 0]),
        Stage::new("roots", Code::of::<Roots>(), (ITEMS, ITEMS), &wires![numerators, denominators, out], [0u32; 0]),
    ];
    let mut gpu = Gpu::new(Arc::clone(device), &buffers)?;
    let mut cpu = Cpu::<f32>::new(&buffers, 1, Isa::Scalar);
    let both: [&mut dyn Backend; 2] = [&mut gpu, &mut cpu];
    let [ours, theirs] = both.map(|backend| {
        backend.run(&stages, &[Row::default()]);
        [quanta, remainders, sum, sums, out].into_iter().for_each(|buffer| backend.request(buffer));
        backend.receive()
    });
    if let Some(fault) = device.fault() {
        return Err(Error::Device(fault));
    }
    let is_close = |(ours, theirs): (f64, f64)| (ours - theirs).abs() <= CLOSE * theirs.abs();
    let roots = [&ours[4], &theirs[4]].map(|roots| roots.clone().scalars());
    let wrong = if ours[..3] != theirs[..3] {
        "loses small steps of positions or sums of integers (its compiler re-associates sums)"
    } else if ours[3] != theirs[3] {
        "adds up wrongly within workgroups"
    } else if !roots[0].iter().copied().zip(roots[1].iter().copied()).all(is_close) {
        "divides or takes square roots wrongly"
    } else {
        return Ok(());
    };
    let name = &device.listed().name;
    Err(Error::Unsupported(format!("{name} {wrong}: its results would be wrong; use another adapter or --backend cpu")))
}
