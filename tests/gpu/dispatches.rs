//! Dispatches of several stages: how few a step has, that they compile, and that they give the bits of their stages.

use super::scenes::{free, tools};
use super::shaders::scenes;
use super::stages::device;
use crate::common::{advance, coarse_cell, held_specimen, loaded};
use naga::{AddressSpace, Expression, TypeInner};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::sync::Arc;
use tricot::backend::Backend;
use tricot::backend::gpu::Gpu;
use tricot::kernel::dispatch::Dispatch;
use tricot::kernel::row::Row;
use tricot::run::simulation;
use tricot::simulate::BackendConfig;

/// Largest array, in bytes, that a function may index by a variable.
const INDEXED: u32 = 64;

/// The dispatches of each list of stages of each scene.
fn dispatches(each: impl Fn(&str, &Dispatch)) {
    for (scene, case) in scenes() {
        let simulation =
            simulation(&loaded(&case), BackendConfig::default()).unwrap_or_else(|e| panic!("{scene}: {e}"));
        let plan = &simulation.model.plan;
        for stages in [&plan.step, &plan.search, &plan.watch, &plan.diagnose, &plan.collect] {
            Dispatch::of(stages, 32).iter().for_each(|dispatch| each(scene, dispatch));
        }
    }
}

/// A step has at most six dispatches: hexahedra, light forces, two kinds of contact on faces, and the chain of the nodes.
#[test]
fn a_step_has_few_dispatches() {
    for (scene, case) in scenes() {
        let simulation =
            simulation(&loaded(&case), BackendConfig::default()).unwrap_or_else(|e| panic!("{scene}: {e}"));
        let all = Dispatch::of(&simulation.model.plan.step, 32);
        let names: Vec<String> = all.iter().map(Dispatch::name).collect();
        println!("{scene}: {names:?}");
        // a block may have a law of its own
        let laws = names.iter().filter(|name| name.starts_with("hex8")).count();
        // each kind of points meets tools, their forces are summed, and then the tools move
        let tools = names.iter().filter(|name| name.contains("tools")).count();
        assert!(names.len() <= 5 + laws.saturating_sub(1) + tools && tools <= 5, "{scene}: {names:?}");
        // a device that binds few buffers takes more, with the same stages
        let few = Dispatch::of(&simulation.model.plan.step, 16);
        assert!(few.len() >= all.len() && few.iter().all(|d| d.buffers().len() + d.cuts().iter().len() <= 16));
        let stages = |all: &[Dispatch]| all.iter().map(|dispatch| dispatch.stages().len()).sum::<usize>();
        assert_eq!(stages(&few), stages(&all));
    }
}

/// Every dispatch compiles, also of several stages, and no function indexes a large array of its own by a variable: a GPU keeps
/// such an array in memory instead of registers.
#[test]
fn dispatches_compile_without_private_arrays() {
    let largest = RefCell::new(BTreeMap::new());
    dispatches(|scene, dispatch| {
        let name = format!("{scene}, {}", dispatch.name());
        let text = dispatch.text().unwrap_or_else(|e| panic!("{name}: {e}"));
        let (module, _) = text.module().unwrap_or_else(|e| panic!("{name}: {e}"));
        let is_array = |ty| matches!(module.types[ty].inner, TypeInner::Array { .. });
        let mut globals = module.global_variables.iter().map(|(_, variable)| variable);
        assert!(!globals.any(|v| v.space == AddressSpace::Private && is_array(v.ty)), "{name}");
        let entries = module.entry_points.iter().map(|entry| &entry.function);
        for function in module.functions.iter().map(|(_, function)| function).chain(entries) {
            for (_, expression) in function.expressions.iter() {
                let Expression::Access { base, .. } = *expression else { continue };
                let Expression::LocalVariable(local) = function.expressions[base] else { continue };
                let variable = &function.local_variables[local];
                let bytes = module.types[variable.ty].inner.size(module.to_ctx());
                let shown = [&function.name, &variable.name].map(|name| name.clone().unwrap_or_default());
                largest.borrow_mut().insert((bytes, shown), name.clone());
            }
        }
    });
    let largest = largest.into_inner();
    for ((bytes, [function, variable]), dispatch) in largest.iter().rev() {
        println!("{bytes} bytes: `{variable}` of `{function}` in {dispatch}");
    }
    assert!(largest.keys().all(|(bytes, _)| *bytes <= INDEXED), "arrays of more than {INDEXED} bytes");
}

/// Stages that share a dispatch leave the same bits as each of them alone.
#[test]
fn a_dispatch_of_several_stages_gives_the_bits_of_each_alone() {
    let Some(device) = device() else { return };
    for (case, end) in [(coarse_cell(), 2.5e-4), (held_specimen(), 1.2e-4), (free(), 1e-4), (tools(), 1e-4)] {
        let mut simulation = simulation(&loaded(&case), BackendConfig::default()).unwrap();
        advance(&mut simulation, end);
        let plan = &simulation.model.plan;
        let (time, dt) = (simulation.time(), simulation.dt());
        let row = Row { affine: 100.0, ..simulation.schedule.row(time, dt, dt, |_| [1.0; 2]) };
        let after = |alone: bool| {
            let mut gpu = Gpu::new(Arc::clone(&device), &plan.buffers).unwrap_or_else(|e| panic!("{e}"));
            for buffer in plan.all() {
                gpu.set_bytes(buffer, &simulation.backend().bytes(buffer));
            }
            for turn in 0..3 {
                let rows = [Row { turn: f64::from(turn), ..row }];
                if alone {
                    plan.step.iter().for_each(|stage| gpu.run(std::slice::from_ref(stage), &rows));
                } else {
                    gpu.run(&plan.step, &rows);
                }
            }
            assert_eq!(gpu.fault(), None);
            (gpu.traffic().unwrap().dispatches, plan.all().map(|buffer| gpu.bytes(buffer)).collect::<Vec<_>>())
        };
        let ((many, alone), (few, together)) = (after(true), after(false));
        assert!(few < many, "{few} and {many} dispatches");
        for (buffer, (alone, together)) in plan.all().zip(alone.iter().zip(&together)) {
            let changed = alone.chunks(4).zip(together.chunks(4)).filter(|(a, b)| a != b).count();
            assert_eq!(changed, 0, "numbers of `{}` that differ", plan.describe(buffer).name);
        }
    }
}
