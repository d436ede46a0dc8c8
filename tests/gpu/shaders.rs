//! The WGSL twins of all stages: each is there, compiles by itself, and sees the buffers, the row and the parameters of its stage
//! with the layout that Rust gives them, as naga parses it.

use super::scenes;
use crate::common::{bare, block, charmetant, coarse_cell, framed, held_specimen, loaded, neo_hookean, reduced, with};
use naga::{AddressSpace, ScalarKind, StorageAccess, TypeInner};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::mem::offset_of;
use std::panic::catch_unwind;
use tricot::kernel::buffer::{Description, Kind};
use tricot::kernel::interface::Access;
use tricot::kernel::row::Row;
use tricot::kernel::shader::{ENTRY, Text};
use tricot::kernel::stage::Stage;
use tricot::run::simulation;
use tricot::simulate::BackendConfig;
use tricot::{conditions, contact, dynamics, elements, tools};

/// Scenes that together have every effect, and each effect missing once.
pub(super) fn scenes() -> Vec<(&'static str, Value)> {
    let (cell, specimen) = (coarse_cell(), held_specimen());
    let held = json!({ "within": [[-0.1, -0.1, -0.1], [0.1, 1.1, 1.1]], "displacement_mm": [0, 0, 0] });
    let thread = json!({
        "name": "thread", "nodes": [[0, 0, 2], [1, 0, 2], [2, 0.2, 2], [3, 0, 2]], "radius_mm": 0.1,
        "axial_n": 100, "bending_n_mm2": 0.01, "linear_density_tex": 10
    });
    let free = with(
        bare(),
        &[
            (
                "/domain/mesh/blocks",
                json!([
                    block("rubber", [3, 2, 1], [[0.0; 3], [3.0, 1.0, 1.0]], 1e-9, neo_hookean(1.0, 0.3)),
                    block("yarn", [3, 2, 1], [[0.0, 0.0, 2.5], [3.0, 1.0, 3.5]], 1e-9, charmetant()),
                ]),
            ),
            ("/domain/mesh/threads", json!([thread])),
            ("/domain/mesh/conditions", json!([held])),
            ("/effects/gravity_mm_s2", json!([0, 0, -9810])),
        ],
    );
    let lines = with(free.clone(), &[("/effects/fibre_lines", json!({})), ("/effects/contact", json!({}))]);
    let without_mass = with(cell.clone(), &[("/effects/contact_mass", Value::Null)]);
    let falling = with(lines.clone(), &[("/effects/gravity_mm_s2", Value::Null)]);
    let rough = with(lines.clone(), &[("/domain/mesh/friction", json!(0.3)), ("/effects/damping", json!({}))]);
    let smooth = with(
        cell.clone(),
        &[
            ("/fabric/friction", json!(0)),
            ("/fabric/stitch/thermal_strain", json!(0)),
            ("/effects/bending", json!(false)),
            ("/effects/damping", Value::Null),
        ],
    );
    vec![
        ("tools", scenes::tools()),
        ("cell", cell),
        ("cell without contact mass", without_mass),
        ("specimen", specimen),
        ("frame", framed()),
        ("free", free.clone()),
        ("free with lines and contact", lines),
        ("without gravity", falling),
        ("cell of reduced hexahedra", reduced(coarse_cell())),
        ("free reduced hexahedra", reduced(free)),
        ("free with friction and damping", rough),
        ("cell without friction, thermal strain, bending and damping", smooth),
    ]
}

/// Every stage of every scene, with the buffers of its plan.
fn stages() -> Vec<(String, Stage, Vec<Description>)> {
    let mut all = Vec::new();
    for (scene, case) in scenes() {
        let simulation =
            simulation(&loaded(&case), BackendConfig::default()).unwrap_or_else(|e| panic!("{scene}: {e}"));
        let plan = &simulation.model.plan;
        for stage in [&plan.step, &plan.search, &plan.watch, &plan.diagnose, &plan.collect].into_iter().flatten() {
            all.push((format!("{scene}, {}", stage.name()), stage.clone(), plan.buffers.clone()));
        }
    }
    all
}

/// Name, offset and size of a field.
type Field<N> = (N, usize, usize);

/// The fields of a struct.
macro_rules! fields {
    ($type:ty: $($field:ident),*) => {{
        fn size<T, F>(_: fn(&T) -> &F) -> usize {
            size_of::<F>()
        }
        let all = vec![$((stringify!($field), offset_of!($type, $field), size(|x: &$type| &x.$field))),*];
        assert_eq!(all.iter().map(|f| f.2).sum::<usize>(), size_of::<$type>(), "a field is missing here");
        all
    }};
}

/// The parameters of each file of kernels, as Rust lays them out.
fn parameters(file: &str) -> Vec<Field<&'static str>> {
    match file {
        "elements/hex8" | "elements/hex8_reduced" => fields!(elements::block::Params: nodes, left),
        "contact/grid" | "contact/candidates" | "contact/penalty" | "contact/pairs" | "contact/threads"
        | "contact/tie" | "tools/touch" => fields!(
            contact::Params: period, cells, capacity, faces, slots, beam_slots, slabs, state, origin, cell, skin, friction, tangential, damping,
            force_quantum, stiffness_quantum, thread_radius, thread_thread, self_arc, depth, apart
        ),
        "conditions/prescribed" => fields!(conditions::prescribed::Params: first_thread),
        "tools/motion" => fields!(tools::motion::Params: gravity, mass_factor),
        "dynamics/assemble" => fields!(
            dynamics::assemble::Params: first_thread, force_quantum, stiffness_quantum, mass_factor, mass_memory,
            mass_per_stiffness, gravity
        ),
        "dynamics/fibre_lines" => fields!(dynamics::fibre_lines::Params: beta),
        "dynamics/integrate" => fields!(dynamics::integrate::Params: first_thread, gravity),
        "dynamics/energy" => fields!(dynamics::energy::Params: count, length, into, centre),
        "dynamics/totals" => fields!(dynamics::totals::Params: start, count, lanes, stride, columns, length, into),
        "dynamics/time_step" => fields!(dynamics::time_step::Params: first_thread, mass_per_stiffness, axial),
        _ => Vec::new(),
    }
}

/// The members of a uniform struct: those named `field_x`, `field_xy` and so on belong to one array `field`.
fn members(module: &naga::Module, name: &str) -> Option<(Vec<Field<String>>, u32)> {
    let (_, variable) = module.global_variables.iter().find(|(_, v)| v.name.as_deref() == Some(name))?;
    let TypeInner::Struct { members, span } = &module.types[variable.ty].inner else { panic!("{name} is no struct") };
    let mut merged: Vec<Field<String>> = Vec::new();
    for member in members {
        let full = member.name.clone().unwrap();
        let stem = match full.rsplit_once('_') {
            Some((stem, axes)) if !axes.is_empty() && axes.chars().all(|c| "xyz".contains(c)) => stem.to_owned(),
            _ => full,
        };
        let size = module.types[member.ty].inner.size(module.to_ctx()) as usize;
        match merged.last_mut() {
            Some((last, offset, sum)) if *last == stem => {
                assert_eq!(*offset + *sum, member.offset as usize, "{stem} has holes");
                *sum += size;
            }
            _ => merged.push((stem, member.offset as usize, size)),
        }
    }
    Some((merged, *span))
}

/// Compares the declarations in the twin of a stage with the bindings of the stage.
fn check(name: &str, stage: &Stage, buffers: &[Description]) {
    let shader = stage.kernel().shader;
    let text = Text::of(stage).unwrap_or_else(|e| panic!("{name}: {e}"));
    let (module, info) = text.module().unwrap_or_else(|e| panic!("{name}: {e}"));
    let entry = module.entry_points.iter().position(|e| e.name == ENTRY);
    let entry = entry.unwrap_or_else(|| panic!("{name}: no entry point"));
    let uses = info.get_entry_point(entry);
    let (reads, writes) = (stage.reads(), stage.writes());
    let kinds = reads.iter().map(|b| (b, None)).chain(writes.iter().map(|(b, access)| (b, Some(access))));
    let expected: BTreeMap<u32, _> = (0..).zip(kinds).collect();
    let mut found = Vec::new();
    for (handle, variable) in module.global_variables.iter() {
        let Some(binding) = variable.binding.as_ref().filter(|b| b.group == 1) else { continue };
        let shown = format!("{name}: binding {} ({})", binding.binding, variable.name.as_deref().unwrap_or("?"));
        let (buffer, access) = expected.get(&binding.binding).unwrap_or_else(|| panic!("{shown} is too many"));
        let AddressSpace::Storage { access: granted } = variable.space else { panic!("{shown} is no storage") };
        assert_eq!(granted.contains(StorageAccess::STORE), access.is_some(), "{shown}: read or write");
        let TypeInner::Array { base, stride, .. } = module.types[variable.ty].inner else {
            panic!("{shown}: no array")
        };
        let (scalar, atomic) = match module.types[base].inner {
            TypeInner::Scalar(scalar) => (scalar, false),
            TypeInner::Atomic(scalar) => (scalar, true),
            ref other => panic!("{shown} holds {other:?}"),
        };
        let kind = match buffers[buffer.number()].kind {
            Kind::Scalar => ScalarKind::Float,
            Kind::Int => ScalarKind::Sint,
            Kind::Uint => ScalarKind::Uint,
        };
        assert_eq!((scalar.kind, scalar.width, stride), (kind, 4, 4), "{shown}: {}", buffers[buffer.number()].name);
        assert_eq!(atomic, access == &Some(&Access::Atomic), "{shown}: atomic");
        assert!(!uses[handle].is_empty(), "{shown} is bound and not used");
        found.push(binding.binding);
    }
    found.sort_unstable();
    assert_eq!(found, expected.keys().copied().collect::<Vec<_>>(), "{name}: bindings");
    let expected = parameters(shader.file);
    if let Some((members, span)) = members(&module, "params") {
        let names: Vec<Field<&str>> = members.iter().map(|(n, o, s)| (n.as_str(), *o, *s)).collect();
        assert_eq!(names, expected, "{name}: parameters");
        assert!(
            (span as usize).next_multiple_of(16) == stage.params().len().next_multiple_of(16),
            "{name}: {span} bytes"
        );
    }
    if let Some((members, _)) = members(&module, "row") {
        let names: Vec<Field<&str>> = members.iter().map(|(n, o, s)| (n.as_str(), *o, *s)).collect();
        let row = fields!(
            Row<f32>: gradient, rate, dt, dt_mid, thermal, thermal_increment, radius, radius_increment, damping_solid,
            damping_thread, motion, amplitude, cosine, sine, affine, closing, searched, turn
        );
        assert_eq!(names, row, "{name}: row");
    }
}

#[test]
fn every_twin_compiles_and_sees_what_its_stage_binds() {
    let (mut seen, mut failed) = (BTreeSet::new(), 0);
    let stages = stages();
    for (name, stage, buffers) in &stages {
        seen.insert((stage.kernel().shader.file, stage.kernel().shader.kernel));
        failed += usize::from(catch_unwind(|| check(name, stage, buffers)).is_err());
    }
    println!("{seen:#?}");
    let mut unused = BTreeSet::new();
    let mut used = BTreeSet::new();
    for (_, stage, _) in &stages {
        let text = Text::of(stage).unwrap_or_else(|e| panic!("{e}")).text;
        let is_declared = |name: &str| text.contains(&format!("const {name}: "));
        let names = stage.kernel().shader.constants.iter().copied().flatten().map(|constant| constant.name);
        let (here, not_here): (Vec<_>, Vec<_>) = names.partition(|name| is_declared(name));
        used.extend(here);
        unused.extend(not_here);
    }
    let unused: Vec<_> = unused.difference(&used).collect();
    assert!(unused.is_empty(), "no twin uses {unused:?}");
    assert!(seen.len() == 32, "{} kinds of stages", seen.len());
    assert_eq!(failed, 0, "stages without a twin that fits; see above");
}
