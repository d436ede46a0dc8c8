//! Pictures of frames, during a run or from frames on disk.
//!
//! A frame on disk is drawn with the mesh of its case, which every results folder contains as `case.json`.

use super::CASE;
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::mesh::frame::Frame;
use crate::output::picture::{View, render};
use crate::output::vtu_read;
use crate::rigs;
use crate::rigs::read::read;
use std::path::{Path, PathBuf};

/// Draws a frame (`.vtu`), or a frame from the folder of a run or mesh, to a PNG: the frame with the number or name `frame`, or
/// the last.
///
/// # Errors
/// Names the missing or unreadable file, or lists the frames and fields that can be drawn.
pub fn picture(source: &Path, frame: Option<&str>, view: &View, out: &Path) -> Result<String> {
    if !out.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png")) {
        return Err(Error::file(out, "pictures are written as PNG: give a name that ends with .png"));
    }
    if let Some([low, high]) = view.range
        && !(low < high)
    {
        return Err(Error::case("--range", format!("{low},{high} is no range: give the lower end first")));
    }
    let path = if source.is_dir() {
        frame_of(source, frame)?
    } else if frame.is_some() {
        return Err(Error::file(source, "is one frame already: give the folder of its run to choose with --frame"));
    } else {
        source.to_path_buf()
    };
    if !path.is_file() {
        return Err(Error::file(path, "no such file: give the folder of a run, or one of its frames (.vtu)"));
    }
    let loaded = read(&case_of(&path)?, &[])?;
    let mesh = rigs::scene(&loaded.case)?.mesh;
    let frame = vtu_read::read(&path, &mesh)?;
    let replaced = if out.exists() { ", which is replaced" } else { "" };
    render(&mesh, &frame, &View { title: loaded.case.title, ..view.clone() })?.write_png(out)?;
    Ok(format!("{} drawn as {}{replaced}", path.display(), out.display()))
}

/// A frame from the collection of a run, or the mesh if the folder holds no run.
fn frame_of(dir: &Path, wanted: Option<&str>) -> Result<PathBuf> {
    let (collection, mesh) = (dir.join("run.pvd"), dir.join("mesh.vtu"));
    if !collection.exists() && mesh.exists() && wanted.is_none() {
        return Ok(mesh);
    }
    if !collection.exists() {
        return Err(Error::file(
            dir,
            "no run.pvd in this folder: give the folder of a run, or one of its frames (.vtu)",
        ));
    }
    let frames = vtu_read::read_collection(&collection)?;
    let Some(wanted) = wanted else {
        return frames.into_iter().last().ok_or_else(|| Error::file(&collection, "lists no frame yet"));
    };
    // 0003-25deg
    let name = |path: &Path| path.file_stem().map_or(String::new(), |name| name.to_string_lossy().into_owned());
    let is_it = |path: &PathBuf| {
        let name = name(path);
        let (number, what) = name.split_once('-').unwrap_or((&name, ""));
        what == wanted || name == wanted || number.parse::<usize>().is_ok_and(|n| wanted.parse() == Ok(n))
    };
    let names = || frames.iter().map(|path| name(path)).collect::<Vec<_>>().join(", ");
    let found = frames.iter().find(|path| is_it(path)).cloned();
    found.ok_or_else(|| Error::file(dir, format!("has no frame {wanted}; there are {}", names())))
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
pub(super) fn draw(mesh: &Mesh, frame: &Frame, title: &str, width: usize, path: &Path) -> Result<()> {
    let view = View { width_px: width, title: title.to_owned(), ..View::default() };
    render(mesh, frame, &view)?.write_png(path)
}
