//! Rigid tools of a case: their checks, and the files of their shapes.

use crate::case::Case;
use crate::case::check::distinct;
use crate::case::provenance::Provenance;
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::mesh::centre::REACH;
use crate::mesh::solid::{self, Triangle};
use crate::settings::steps::Step;
use crate::settings::tool::{Shape, Tool};
use serde_json::{Value, json};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// Checks tools given at a path of the case.
///
/// # Errors
/// The first contradiction, by its JSON path.
pub(super) fn check(case: &Case, tools: &[Tool], path: &str, provenance: &Provenance) -> Result<()> {
    if !tools.is_empty() && case.effects.contact.is_none() {
        return Err(provenance.error(path, "touch nothing, since effects.contact is null: remove one of them"));
    }
    let names = tools.iter().enumerate().map(|(i, tool)| (format!("{path}.{i}.name"), &tool.name));
    distinct(names, "tool", provenance)?;
    for (i, tool) in tools.iter().enumerate() {
        let at = |field: &str| format!("{path}.{i}.{field}");
        match &tool.shape {
            Shape::Box { size_mm, edge_radius_mm } => {
                let least = size_mm.iter().copied().fold(f64::INFINITY, f64::min);
                if 2.0 * edge_radius_mm > least {
                    let message = format!("{edge_radius_mm} mm is more than half of the smallest size, {least} mm");
                    return Err(provenance.error(&at("shape.box.edge_radius_mm"), message));
                }
            }
            Shape::Mesh { triangles_mm: Some(triangles), .. } => {
                solid::check(triangles).map_err(|message| provenance.error(&at("shape.mesh"), message))?;
            }
            Shape::Mesh { .. } => {
                return Err(provenance.error(&at("shape.mesh"), "has neither file nor triangles_mm, give one of them"));
            }
            Shape::Plane | Shape::Sphere { .. } | Shape::Cylinder { .. } => {}
        }
        motion(tool, &at, provenance)?;
    }
    Ok(())
}

/// Refuses displacements along free axes, forces along others, and freedom of no axis.
fn motion(tool: &Tool, at: &dyn Fn(&str) -> String, provenance: &Provenance) -> Result<()> {
    let Some(free) = &tool.free else { return Ok(()) };
    if free.axes == [false; 3] {
        return Err(
            provenance.error(&at("free.axes"), "all false: the tool is free along no axis, set one or remove free")
        );
    }
    for k in 0..3 {
        if free.axes[k] && tool.displacement_mm[k] != 0.0 {
            let message = format!("{} mm is not applied, since free.axes.{k} is true", tool.displacement_mm[k]);
            return Err(provenance.error(&at(&format!("displacement_mm.{k}")), message));
        }
        if !free.axes[k] && free.force_n[k] != 0.0 {
            let message = format!("{} N is not applied, since free.axes.{k} is false", free.force_n[k]);
            return Err(provenance.error(&at(&format!("free.force_n.{k}")), message));
        }
    }
    Ok(())
}

/// Refuses displacements and forces of tools that no load step applies.
///
/// # Errors
/// The first of them, by its JSON path.
pub(super) fn applied(case: &Case, tools: &[Tool], path: &str, provenance: &Provenance) -> Result<()> {
    if case.steps.iter().any(|step| matches!(step, Step::Move { .. })) {
        return Ok(());
    }
    for (i, tool) in tools.iter().enumerate() {
        let message = "is never applied: add a move step";
        if tool.displacement_mm != [0.0; 3] {
            return Err(provenance.error(&format!("{path}.{i}.displacement_mm"), message));
        }
        if tool.free.as_ref().is_some_and(|free| free.force_n != [0.0; 3]) {
            return Err(provenance.error(&format!("{path}.{i}.free.force_n"), message));
        }
    }
    Ok(())
}

/// Refuses tools whose origin is so far from a node that their difference exceeds the range of positions.
pub(super) fn near(mesh: &Mesh) -> Result<()> {
    for tool in &mesh.tools {
        let far = |x: &[f64; 3]| (0..3).any(|k| (x[k] - tool.at_mm[k]).abs() > REACH);
        if let Some(node) = mesh.nodes.iter().position(far) {
            let message = format!(
                "its origin at {:?} mm is further than {REACH} mm from node {node}: move them together",
                tool.at_mm
            );
            return Err(Error::geometry(format!("tool {:?}", tool.name), message));
        }
    }
    Ok(())
}

/// Replaces the STL files that the tools of a case name, relative to the case, by their triangles.
///
/// # Errors
/// A file that cannot be read, by its JSON path.
pub(super) fn inline(value: &mut Value, provenance: &Provenance) -> Result<()> {
    let Some(tools) = value.pointer_mut("/domain/mesh/tools").and_then(Value::as_array_mut) else { return Ok(()) };
    for (i, tool) in tools.iter_mut().enumerate() {
        let Some(shape) = tool.pointer_mut("/shape/mesh").and_then(Value::as_object_mut) else { continue };
        let Some(name) = shape.get("file").and_then(Value::as_str) else { continue };
        let fail = |message: String| Err(provenance.error(&format!("domain.mesh.tools.{i}.shape.mesh.file"), message));
        if shape.get("triangles_mm").is_some_and(|triangles| !triangles.is_null()) {
            return fail("stands beside triangles_mm, give one of them".into());
        }
        let path = provenance.case.parent().unwrap_or(Path::new("")).join(name);
        match triangles(&path) {
            Ok(triangles) => {
                shape.remove("file");
                shape.insert("triangles_mm".into(), json!(triangles));
            }
            Err(error) => return fail(format!("the STL file {} cannot be read: {error}", path.display())),
        }
    }
    Ok(())
}

/// The triangles of an STL file.
fn triangles(path: &Path) -> std::io::Result<Vec<Triangle>> {
    let mut reader = BufReader::new(File::open(path)?);
    let corner = |corner: &stl_io::Vertex| corner.0.map(f64::from);
    stl_io::create_stl_reader(&mut reader)?.map(|triangle| Ok(triangle?.vertices.each_ref().map(corner))).collect()
}
