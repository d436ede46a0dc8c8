//! The frames of a run, and their pictures.

use super::picture::draw;
use super::session::Run;
use crate::error::Result;
use crate::output::vtu;
use std::sync::Arc;

/// Width of a picture, px.
const WIDTH: usize = 1200;

impl Run<'_> {
    /// A frame for ParaView, and a picture of it. What the rig adds is measured and written at once; the rest is given to the
    /// [writer](super::writer).
    pub(super) fn write_frame(&mut self, name: &str) -> Result<()> {
        self.simulation.bring_frame();
        let s = &self.simulation;
        let mut frame = s.frame();
        s.alive()?;
        let dir = self.options.output.clone();
        let name = format!("{:04}-{name}", self.frames.len());
        self.observer.frame(s, &mut frame, &dir, &name)?;
        let file = format!("frames/{name}.vtu");
        self.frames.push((frame.time, file.clone()));
        let picture = self.loaded.case.output.pictures.then(|| format!("{name}.png"));
        self.pictures.extend(picture.clone());
        let (mesh, frames, title) = (Arc::clone(&self.mesh), self.frames.clone(), self.loaded.case.title.clone());
        self.writer.add(move || {
            vtu::write(&mesh, &frame, &dir.join(file))?;
            vtu::write_collection(&dir.join("run.pvd"), &frames)?;
            picture.map_or(Ok(()), |file| draw(&mesh, &frame, &title, WIDTH, &dir.join(file)))
        })
    }

    /// Takes frames and pictures that could not be written off the lists.
    pub(super) fn list_what_is_there(&mut self) {
        let dir = &self.options.output;
        self.frames.retain(|(_, file)| dir.join(file).is_file());
        self.pictures.retain(|file| dir.join(file).is_file());
    }
}
