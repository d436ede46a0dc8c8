//! The mesh of a case as files, without running it.

use super::picture::draw;
use super::{scene, write_case};
use crate::case::read::Loaded;
use crate::error::{Error, Result};
use crate::mesh::frame::Frame;
use crate::mesh::{export, report};
use crate::output::vtu;
use std::path::Path;

/// Writes the mesh of a case to a folder: VTU and Abaqus input; returns its report.
pub fn mesh(loaded: &Loaded, dir: &Path) -> Result<String> {
    let (mesh, _) = scene(loaded)?;
    std::fs::create_dir_all(dir).map_err(|e| Error::file(dir, e))?;
    write_case(&loaded.case, dir)?;
    let frame = Frame { gradient: [[1.0, 0.0], [0.0, 1.0]], positions: mesh.nodes.clone(), ..Frame::default() };
    vtu::write(&mesh, &frame, &dir.join("mesh.vtu"))?;
    export::write_inp(&mesh, &dir.join("mesh.inp"))?;
    draw(&mesh, &frame, &loaded.case.title, None, 1600, &dir.join("mesh.png"))?;
    let files = format!("written    {0}/mesh.vtu, {0}/mesh.inp, {0}/mesh.png", dir.display());
    Ok(format!("{}\n{files}", report::report(&mesh, &loaded.case)))
}
