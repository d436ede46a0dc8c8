//! The mesh of a case as files, without running it.

use super::picture::draw;
use super::write_case;
use crate::error::Result;
use crate::mesh::frame::Frame;
use crate::mesh::{export, report};
use crate::output::{directory, vtu};
use crate::rigs;
use crate::rigs::read::Loaded;
use crate::scene::Scene;
use std::path::Path;

/// Writes the mesh of a case to a folder as VTU and Abaqus input; returns a report. A folder that is not empty is refused; with
/// `force`, files left there by a run or mesh are moved aside.
///
/// # Errors
/// Geometry that cannot be meshed, or a folder that cannot be used.
pub fn mesh(loaded: &Loaded, dir: &Path, force: bool) -> Result<String> {
    let Scene { mesh, motions, ties, .. } = rigs::scene(&loaded.case)?;
    let _held = directory::prepare(dir, force)?;
    write_case(&loaded.case, dir)?;
    let frame = Frame { gradient: [[1.0, 0.0], [0.0, 1.0]], positions: mesh.nodes.clone(), ..Frame::default() };
    vtu::write(&mesh, &frame, &dir.join("mesh.vtu"))?;
    let mut sets: Vec<_> = motions.into_iter().map(|motion| (motion.name, motion.nodes)).collect();
    sets.push(("ties".into(), ties.iter().map(|tie| tie.node).collect()));
    export::write_inp(&mesh, &sets, &dir.join("mesh.inp"))?;
    draw(&mesh, &frame, &loaded.case.title, 1600, &dir.join("mesh.png"))?;
    let files = format!("written    {0}/mesh.vtu, {0}/mesh.inp, {0}/mesh.png", dir.display());
    Ok(format!("{}\n{files}", report::report(&mesh, &loaded.case.title)))
}
