//! Pictures of frames: while a run writes them, and of frames that are on disk already.
//!
//! A frame on disk is drawn with the mesh of its case, which every folder of results holds as `case.json`.

use super::{CASE, scene};
use crate::case::read::read;
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::mesh::frame::Frame;
use crate::output::picture::{View, render};
use crate::output::vtu_read;
use std::path::{Path, PathBuf};

/// Draws a frame (`.vtu`), or the last frame of the folder of a run or mesh, to a PNG.
///
/// # Errors
/// Names the file that is missing or cannot be read, or the fields that could be drawn instead.
pub fn picture(source: &Path, field: Option<&str>, width: usize, out: &Path) -> Result<String> {
    let path = if source.is_dir() { last_frame(source)? } else { source.to_path_buf() };
    if !path.is_file() {
        return Err(Error::file(path, "no such file: give the folder of a run, or one of its frames (.vtu)"));
    }
    let loaded = read(&case_of(&path)?, &[])?;
    let (mesh, _) = scene(&loaded)?;
    let frame = vtu_read::read(&path, &mesh)?;
    draw(&mesh, &frame, &loaded.case.title, field, width, out)?;
    Ok(format!("{} drawn as {}", path.display(), out.display()))
}

/// The last frame in the collection of a run, or the mesh of a folder that holds no run.
fn last_frame(dir: &Path) -> Result<PathBuf> {
    let (collection, mesh) = (dir.join("run.pvd"), dir.join("mesh.vtu"));
    if !collection.exists() && mesh.exists() {
        return Ok(mesh);
    }
    if !collection.exists() {
        return Err(Error::file(
            dir,
            "no run.pvd in this folder: give the folder of a run, or one of its frames (.vtu)",
        ));
    }
    let frames = vtu_read::read_collection(&collection)?;
    frames.into_iter().last().ok_or_else(|| Error::file(&collection, "lists no frame yet"))
}

/// The case of the run that a frame belongs to.
fn case_of(frame: &Path) -> Result<PathBuf> {
    let folders = frame.ancestors().skip(1).take(2);
    folders.map(|folder| folder.join(CASE)).find(|case| case.exists()).ok_or_else(|| {
        let message =
            format!("no {CASE} beside this frame or one folder above: leave frames in the folder of their run");
        Error::file(frame, message)
    })
}

/// Renders a frame and writes the picture.
pub(super) fn draw(
    mesh: &Mesh,
    frame: &Frame,
    title: &str,
    field: Option<&str>,
    width: usize,
    path: &Path,
) -> Result<()> {
    let view = View { field: field.map(str::to_owned), width_px: width, title: title.to_owned(), ..View::default() };
    render(mesh, frame, &view)?.write_png(path)
}
