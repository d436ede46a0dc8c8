//! The frames of a run, and their pictures.

use super::picture::draw;
use super::session::Run;
use crate::error::Result;
use crate::output::vtu;

/// Width of a picture, px.
const WIDTH: usize = 1200;

impl Run<'_> {
    /// A frame for ParaView, and a picture of it.
    pub(super) fn write_frame(&mut self, name: &str) -> Result<()> {
        let s = &self.simulation;
        let mut frame = s.frame();
        s.alive()?;
        let dir = &self.options.output;
        let name = format!("{:04}-{name}", self.frames.len());
        self.observer.frame(s, &mut frame, dir, &name)?;
        let file = format!("frames/{name}.vtu");
        vtu::write(s.mesh(), &frame, &dir.join(&file))?;
        self.frames.push((frame.time, file));
        vtu::write_collection(&dir.join("run.pvd"), &self.frames)?;
        if self.loaded.case.output.pictures {
            let file = format!("{name}.png");
            draw(s.mesh(), &frame, &self.loaded.case.title, WIDTH, &dir.join(&file))?;
            self.pictures.push(file);
        }
        Ok(())
    }
}
