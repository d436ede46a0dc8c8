//! Transverse compaction of a piece of yarn between smooth plates, with free sides or in a die of its width.
//!
//! The section is a rectangle of the yarn's width and area, so that the deformation is the same everywhere. With λ_z and λ_y the
//! stretches of thickness and width, a = ln λ_z, b = ln λ_y and s = −(a + b)/2, the law (Eqs 4 to 6 of Zheng et al.) has the
//! energy K_comp s^p + K_dist (a − b)²/8, hence the force of the plates over the initial area
//! P = (½ p K_comp s^(p−1) + ¼ K_dist (b − a))/λ_z. In a die b = 0; with free sides both terms are equal.

mod observer;

use super::constituents::{rectangle, resolution_of, section, steps, unused, yarn as yarn_piece, yarn_of};
use super::observer::{Observer, Tables};
use super::{Piece, Rig, check};
use crate::case::Case;
use crate::case::domain::{Sides, YarnCompaction};
use crate::case::provenance::Provenance;
use crate::error::Result;
use crate::mesh::Mesh;
use crate::output::page::Page;
use crate::output::results::{OVER_DISPLACEMENT, Results};
use crate::scene::Motion;
use crate::settings::material::Material;
use crate::simulate::Simulation;

/// Hexahedra along the piece.
const SLICES: usize = 4;

impl Rig for YarnCompaction {
    fn check(&self, case: &Case, provenance: &Provenance) -> Result<()> {
        check::fabric(case, "yarn", provenance)?;
        unused(case, &resolution_of(case, self.ply, true), "this yarn, of four slices", provenance)?;
        let (yarn, _) = yarn_of(case, self.ply)?;
        let [_, thickness] = rectangle(yarn);
        if self.thickness_mm >= thickness {
            let message =
                format!("is no compaction of a yarn of {thickness:.4} mm (its area over its width): give less");
            return Err(provenance.error("domain.yarn_compaction.thickness_mm", message));
        }
        if !matches!(yarn.material, Material::Charmetant { k_comp_mpa, .. } if k_comp_mpa > 0.0) {
            let message = "needs a yarn of the charmetant law with a k_comp_mpa above 0, which the test evaluates";
            return Err(provenance.error("domain.yarn_compaction", message));
        }
        steps(case, "domain.yarn_compaction.thickness_mm", thickness - self.thickness_mm, provenance)
    }

    fn piece(&self, case: &Case) -> Result<Piece> {
        let (yarn, columns) = yarn_of(case, self.ply)?;
        let [_, thickness] = rectangle(yarn);
        let length = yarn.width_mm / columns as f64 * SLICES as f64;
        let mesh = yarn_piece(yarn, [length, yarn.width_mm, thickness], [SLICES, columns, case.resolution.layers]);
        let plane = |name: &str, axis: usize, end: f64, displacement: f64| {
            let mut motion = Motion { name: name.into(), nodes: side(&mesh, axis, end), ..Motion::default() };
            motion.components[axis] = true;
            motion.displacement[axis] = displacement;
            motion
        };
        let mut motions = vec![
            plane("lower plate", 2, -1.0, 0.0),
            plane("upper plate", 2, 1.0, self.thickness_mm - thickness),
            plane("end", 0, -1.0, 0.0),
            plane("side", 1, -1.0, 0.0),
        ];
        if self.sides == Sides::Held {
            motions.push(plane("other side", 1, 1.0, 0.0));
        }
        Ok(Piece { mesh, motions, ..Piece::default() })
    }

    fn observer(&self, case: &Case, simulation: &Simulation, tables: &Tables) -> Result<Box<dyn Observer>> {
        let (yarn, _) = yarn_of(case, self.ply)?;
        Ok(Box::new(observer::Pressed::of(yarn, self.fibre_density_g_cm3, simulation.mesh(), tables)?))
    }

    fn curves(&self, results: &Results, page: &mut Page) -> Result<()> {
        if let Some(pressed) = results.other("compaction.csv")? {
            let caption = "On the plates, over their approach.";
            let pressure = [("pressure_mpa", "pressure")];
            results.chart(page, &pressed, &OVER_DISPLACEMENT, ["Pressure", "MPa"], &pressure, caption);
            let caption = "Area of the fibres over that of the section.";
            let share = [("fibre_volume_fraction", "fibre volume fraction")];
            results.chart(page, &pressed, &OVER_DISPLACEMENT, ["Fibre volume fraction", "–"], &share, caption);
        }
        Ok(())
    }

    fn sections(&self, _: &Case, results: &Results, page: &mut Page) -> Result<Vec<String>> {
        Ok(section(results, page))
    }
}

/// The nodes of the lowest (−1) or highest (1) plane along an axis.
fn side(mesh: &Mesh, axis: usize, end: f64) -> Vec<usize> {
    let farthest = mesh.nodes.iter().map(|node| end * node[axis]).fold(f64::NEG_INFINITY, f64::max);
    (0..mesh.nodes.len()).filter(|node| end * mesh.nodes[*node][axis] == farthest).collect()
}
