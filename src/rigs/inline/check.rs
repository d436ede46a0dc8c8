//! Checks an inline mesh: sizes, shapes, names, and the nodes selected by the conditions.

use super::conditions::TOLERANCE_MM;
use crate::case::Case;
use crate::case::check::distinct;
use crate::case::domain::{Condition, InlineBlock, InlineMesh, InlineThread};
use crate::case::provenance::Provenance;
use crate::case::suggest::advice;
use crate::error::Result;
use crate::rigs::check::{self, MAX_BEAMS, MAX_HEXES, MAX_POSITION_MM};
use crate::rigs::tools;
use crate::settings::steps::Step;
use glam::DVec3;

pub fn check(case: &Case, mesh: &InlineMesh, provenance: &Provenance) -> Result<()> {
    if case.fabric.is_some() {
        return Err(
            provenance.error("domain.mesh", "holds its own materials, so that the fabric is not used: remove fabric")
        );
    }
    if mesh.blocks.is_empty() && mesh.threads.is_empty() {
        return Err(provenance.error("domain.mesh", "holds neither blocks nor threads, give at least one"));
    }
    names(mesh, provenance)?;
    let hexes: f64 = mesh.blocks.iter().map(|b| b.elements.iter().map(|&n| n as f64).product::<f64>()).sum();
    if hexes > MAX_HEXES {
        let message = format!("hold {hexes:.2e} hexahedra, at most {MAX_HEXES:e}: lower elements");
        return Err(provenance.error("domain.mesh.blocks", message));
    }
    let beams: f64 = mesh.threads.iter().map(|t| t.nodes.len() as f64 - 1.0).sum();
    if beams > MAX_BEAMS {
        return Err(provenance.error("domain.mesh.threads", format!("hold {beams:.2e} beams, at most {MAX_BEAMS:e}")));
    }
    for (i, body) in mesh.blocks.iter().enumerate() {
        block(body, &format!("domain.mesh.blocks.{i}"), provenance)?;
    }
    for (i, body) in mesh.threads.iter().enumerate() {
        thread(body, &format!("domain.mesh.threads.{i}"), provenance)?;
    }
    extent(mesh, provenance)?;
    for (i, condition) in mesh.conditions.iter().enumerate() {
        catches(mesh, condition, &format!("domain.mesh.conditions.{i}"), provenance)?;
    }
    tools::check(case, &mesh.tools, "domain.mesh.tools", provenance)?;
    steps(case, mesh, provenance)
}

fn names(mesh: &InlineMesh, provenance: &Provenance) -> Result<()> {
    let blocks = mesh.blocks.iter().enumerate().map(|(i, b)| (format!("domain.mesh.blocks.{i}.name"), &b.name));
    let threads = mesh.threads.iter().enumerate().map(|(i, t)| (format!("domain.mesh.threads.{i}.name"), &t.name));
    distinct(blocks.chain(threads), "body", provenance)?;
    let conditions = mesh.conditions.iter().enumerate();
    let conditions =
        conditions.filter_map(|(i, c)| Some((format!("domain.mesh.conditions.{i}.name"), c.name.as_ref()?)));
    distinct(conditions, "condition", provenance)
}

fn block(block: &InlineBlock, path: &str, provenance: &Provenance) -> Result<()> {
    if block.fibre.iter().map(|c| c * c).sum::<f64>() < 1e-24 {
        return Err(provenance.error(&format!("{path}.fibre"), "has no length, give a direction such as [1, 0, 0]"));
    }
    match (&block.corners, &block.nodes) {
        (Some([low, high]), None) => {
            for (c, axis) in ["x", "y", "z"].into_iter().enumerate() {
                if high[c] - low[c] < TOLERANCE_MM {
                    let message = format!(
                        "no thickness along {axis}: from {} to {} mm; give the corner with the smaller x, y and z first",
                        low[c], high[c]
                    );
                    return Err(provenance.error(&format!("{path}.corners"), message));
                }
            }
            Ok(())
        }
        (None, Some(nodes)) => hexes(nodes, block.elements, path, provenance),
        (Some(_), Some(_)) => Err(provenance.error(path, "has both corners and nodes, give one of them")),
        (None, None) => Err(provenance.error(path, "has neither corners nor nodes, give one of them")),
    }
}

/// Checks the number of nodes, and for a positive Jacobian determinant at each corner of each hexahedron.
fn hexes(nodes: &[[f64; 3]], elements: [usize; 3], path: &str, provenance: &Provenance) -> Result<()> {
    let [slices, columns, layers] = elements;
    let count = elements.iter().map(|n| n + 1).product::<usize>();
    if nodes.len() != count {
        let message = format!(
            "{} nodes, but elements [{slices}, {columns}, {layers}] need ({slices} + 1) × ({columns} + 1) × ({layers} + 1) \
             = {count}",
            nodes.len()
        );
        return Err(provenance.error(&format!("{path}.nodes"), message));
    }
    let node = |s: usize, c: usize, l: usize| DVec3::from(nodes[(l * (columns + 1) + c) * (slices + 1) + s]);
    for element in 0..slices * columns * layers {
        let [s, c, l] = [element % slices, element / slices % columns, element / (slices * columns)];
        for corner in 0..8 {
            let [i, j, k] = [corner & 1, corner >> 1 & 1, corner >> 2];
            let along = node(s + 1, c + j, l + k) - node(s, c + j, l + k);
            let across = node(s + i, c + 1, l + k) - node(s + i, c, l + k);
            let up = node(s + i, c + j, l + 1) - node(s + i, c + j, l);
            let volume = along.dot(across.cross(up));
            if volume <= TOLERANCE_MM.powi(3) {
                let message = format!(
                    "the hexahedron of slice {s}, column {c}, layer {l} is inside out or flat (volume {volume:.3e} mm³ at \
                     a corner): list nodes slices fastest, then columns, then layers, right-handed"
                );
                return Err(provenance.error(&format!("{path}.nodes"), message));
            }
        }
    }
    Ok(())
}

fn thread(thread: &InlineThread, path: &str, provenance: &Provenance) -> Result<()> {
    for (i, node) in thread.nodes.iter().enumerate() {
        if i > 0 && (DVec3::from(*node) - DVec3::from(thread.nodes[i - 1])).abs().max_element() < TOLERANCE_MM {
            let message = format!("{node:?} repeats the node before it, a beam needs a length: remove one");
            return Err(provenance.error(&format!("{path}.nodes.{i}"), message));
        }
    }
    if thread.nodes.len() == 3 && thread.is_ring() {
        let message =
            "the last node lies where the first does, and a ring has three beams or more: move it or add nodes";
        return Err(provenance.error(&format!("{path}.nodes"), message));
    }
    Ok(())
}

/// The extent of a scene must fit the range of positions; its location is arbitrary.
fn extent(mesh: &InlineMesh, provenance: &Provenance) -> Result<()> {
    let in_blocks = mesh.blocks.iter().flat_map(|b| {
        let nodes = b.corners.iter().flatten().chain(b.nodes.iter().flatten());
        nodes.map(move |x| (x, &b.name))
    });
    let in_threads = mesh.threads.iter().flat_map(|t| t.nodes.iter().map(move |x| (x, &t.name)));
    let all: Vec<(&[f64; 3], &String)> = in_blocks.chain(in_threads).collect();
    for (c, axis) in ["x", "y", "z"].into_iter().enumerate() {
        let order = |a: &&(&[f64; 3], &String), b: &&(&[f64; 3], &String)| a.0[c].total_cmp(&b.0[c]);
        let (Some((low, lower)), Some((high, upper))) = (all.iter().min_by(order), all.iter().max_by(order)) else {
            continue;
        };
        let far = low[c].min(-high[c]) < -MAX_POSITION_MM;
        if far && high[c] - low[c] > 2.0 * MAX_POSITION_MM - 1.0 {
            let message = format!(
                "reaches along {axis} from {} mm ({lower:?}) to {} mm ({upper:?}), further than {} mm: move bodies together",
                low[c],
                high[c],
                2.0 * MAX_POSITION_MM - 1.0
            );
            return Err(provenance.error("domain.mesh", message));
        }
    }
    Ok(())
}

fn catches(mesh: &InlineMesh, condition: &Condition, path: &str, provenance: &Provenance) -> Result<()> {
    let [low, high] = condition.within;
    if (0..3).any(|c| low[c] > high[c]) {
        let message = format!("from {low:?} to {high:?} is no box: give the corner with the smaller x, y and z first");
        return Err(provenance.error(&format!("{path}.within"), message));
    }
    if condition.components == [false; 3] {
        let message = "all false: the condition prescribes nothing, set one to true or remove it";
        return Err(provenance.error(&format!("{path}.components"), message));
    }
    for (c, on) in condition.components.into_iter().enumerate() {
        if !on && condition.displacement_mm[c] != 0.0 {
            let message = format!("{} is not applied, since components.{c} is false", condition.displacement_mm[c]);
            return Err(provenance.error(&format!("{path}.displacement_mm.{c}"), message));
        }
    }
    let chosen = |name: &String| condition.body.as_ref().is_none_or(|body| body == name);
    let names = || mesh.blocks.iter().map(|b| &b.name).chain(mesh.threads.iter().map(|t| &t.name));
    if let Some(body) = condition.body.as_ref().filter(|_| !names().any(chosen)) {
        let message = format!("no block or thread is named {body:?}; {}", advice(body, names().map(String::as_str)));
        return Err(provenance.error(&format!("{path}.body"), message));
    }
    let inside = |x: f64, c: usize| x >= low[c] - TOLERANCE_MM && x <= high[c] + TOLERANCE_MM;
    let within = |node: &[f64; 3]| (0..3).all(|c| inside(node[c], c));
    let in_block = mesh.blocks.iter().filter(|b| chosen(&b.name)).any(|block| match (&block.corners, &block.nodes) {
        (Some([from, to]), _) => (0..3).all(|c| {
            let n = block.elements[c];
            (0..=n).any(|i| inside(from[c] + (to[c] - from[c]) * i as f64 / n as f64, c))
        }),
        (None, nodes) => nodes.iter().flatten().any(within),
    });
    if in_block || mesh.threads.iter().filter(|t| chosen(&t.name)).any(|t| t.nodes.iter().any(within)) {
        return Ok(());
    }
    let message = format!("no node lies in the box from {low:?} to {high:?} mm: widen it (bounds are included)");
    Err(provenance.error(&format!("{path}.within"), message))
}

fn steps(case: &Case, mesh: &InlineMesh, provenance: &Provenance) -> Result<()> {
    check::steps(case, provenance, |step| match step {
        Step::Shear { .. } => Some("shear needs a periodic cell: use domain.cell, or move with conditions"),
        Step::Stretch { .. } => Some("only a cell has a stretch of its own: use move, with conditions on nodes"),
        Step::Move { .. } if mesh.conditions.is_empty() && mesh.tools.is_empty() => {
            Some("nothing to move: give domain.mesh.conditions or domain.mesh.tools")
        }
        _ => None,
    })?;
    let moves = case.steps.iter().any(|step| matches!(step, Step::Move { .. }));
    if let Some(i) = mesh.conditions.iter().position(|c| !moves && c.displacement_mm != [0.0; 3]) {
        let path = format!("domain.mesh.conditions.{i}.displacement_mm");
        return Err(provenance.error(&path, "is never applied: add a move step"));
    }
    tools::applied(case, &mesh.tools, "domain.mesh.tools", provenance)?;
    let tightens = case.steps.iter().any(|step| matches!(step, Step::Pretension { .. }));
    if let Some(i) = mesh.threads.iter().position(|t| !tightens && t.thermal_strain != 0.0) {
        let path = format!("domain.mesh.threads.{i}.thermal_strain");
        return Err(provenance.error(&path, "is never applied: add a pretension step"));
    }
    Ok(())
}
