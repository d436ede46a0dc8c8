//! The frames of a run, and their pictures.

use super::picture::draw;
use super::session::Run;
use crate::error::Result;
use crate::mesh::solid::{Triangle, surface};
use crate::mesh::vector::{add, norm, sub};
use crate::output::{map, vtu};
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
        let tools = (!s.mesh().tools.is_empty()).then(|| (format!("frames/{name}.tools.vtp"), self.tools()));
        let (mesh, frames, title) = (Arc::clone(&self.mesh), self.frames.clone(), self.loaded.case.title.clone());
        self.writer.add(move || {
            vtu::write(&mesh, &frame, &dir.join(file))?;
            vtu::write_collection(&dir.join("run.pvd"), &frames)?;
            if let Some((file, triangles)) = tools {
                map::write_surface(&triangles, &dir.join(file))?;
                let beside = |(time, file): &(f64, String)| (*time, file.replace(".vtu", ".tools.vtp"));
                vtu::write_collection(&dir.join("tools.pvd"), &frames.iter().map(beside).collect::<Vec<_>>())?;
            }
            picture.map_or(Ok(()), |file| draw(&mesh, &frame, &title, WIDTH, &dir.join(file)))
        })
    }

    /// Surfaces of all tools where they are now.
    fn tools(&self) -> Vec<Triangle> {
        let (mesh, states) = (self.simulation.mesh(), self.simulation.tools());
        let far = |at: [f64; 3]| mesh.nodes.iter().map(|node| norm(sub(*node, at))).fold(0.0, f64::max);
        let moved = mesh.tools.iter().zip(&states).flat_map(|(tool, state)| {
            let here = surface(tool, far(tool.at_mm)).into_iter();
            here.map(|triangle| triangle.map(|corner| add(corner, state.displacement)))
        });
        moved.collect()
    }

    /// Takes frames and pictures that could not be written off the lists.
    pub(super) fn list_what_is_there(&mut self) {
        let dir = &self.options.output;
        self.frames.retain(|(_, file)| dir.join(file).is_file());
        self.pictures.retain(|file| dir.join(file).is_file());
    }
}
