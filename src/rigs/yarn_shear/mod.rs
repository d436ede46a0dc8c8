//! Longitudinal shear of a single yarn (Fig. 8 of Zheng et al.): the outermost fibres on one side are held, those on the other side
//! are moved along themselves, so that all fibres keep their length. While the response is linear, F = K_sh γ L h, with γ the
//! displacement over the width and h the thickness.
//!
//! The section is a rectangle of the yarn's width and area, so that the shear is the same everywhere but near the free ends of the
//! fibres. There the yarn carries less: about one and a half widths of it are missing in F, so that a long yarn, or the difference
//! of two lengths, gives K_sh.

use super::constituents::{
    Property, Pull, force, grip, rectangle, resolution_of, section, steps, unused, yarn as yarn_piece, yarn_of,
};
use super::observer::{Observer, Tables};
use super::{Piece, Rig, check};
use crate::case::Case;
use crate::case::domain::YarnShear;
use crate::case::fabric::Yarn;
use crate::case::provenance::Provenance;
use crate::error::Result;
use crate::fabric::quantised;
use crate::output::page::Page;
use crate::output::results::Results;
use crate::settings::material::Material;
use crate::simulate::Simulation;

/// The longitudinal shear stiffness of a yarn, if its law has one, MPa.
fn stiffness(yarn: &Yarn) -> Option<f64> {
    match yarn.material {
        Material::Charmetant { k_sh_mpa, .. } => Some(k_sh_mpa),
        Material::NeoHookean { .. } => None,
    }
}

impl Rig for YarnShear {
    fn check(&self, case: &Case, provenance: &Provenance) -> Result<()> {
        check::fabric(case, "yarn", provenance)?;
        steps(case, "domain.yarn_shear.displacement_mm", self.displacement_mm, provenance)?;
        unused(case, &resolution_of(case, self.ply, false), "this yarn", provenance)?;
        let (yarn, _) = yarn_of(case, self.ply)?;
        if stiffness(yarn).is_none_or(|stiffness| stiffness == 0.0) {
            let message = "needs a yarn of the charmetant law with a k_sh_mpa above 0, which the test evaluates";
            return Err(provenance.error("domain.yarn_shear", message));
        }
        let slices = (self.length_mm / case.resolution.refined().slice_mm).round();
        if slices < 3.0 {
            let message = format!(
                "leaves {slices} slices along a yarn of {} mm, at least 3: give a smaller length",
                self.length_mm
            );
            return Err(provenance.error("resolution.slice_mm", message));
        }
        Ok(())
    }

    fn piece(&self, case: &Case) -> Result<Piece> {
        let ((yarn, columns), resolution) = (yarn_of(case, self.ply)?, case.resolution.refined());
        let [_, thickness] = rectangle(yarn);
        let slices = (self.length_mm / resolution.slice_mm).round() as usize;
        let mesh = yarn_piece(yarn, [self.length_mm, yarn.width_mm, thickness], [slices, columns, resolution.layers]);
        let end = quantised(0.5 * yarn.width_mm);
        let side = |y: f64| (0..mesh.nodes.len()).filter(|node| mesh.nodes[*node][1] == y).collect();
        let motions = vec![grip("held fibres", side(-end), 0.0), grip("moved fibres", side(end), self.displacement_mm)];
        Ok(Piece { mesh, motions, ..Piece::default() })
    }

    fn observer(&self, case: &Case, _: &Simulation, _: &Tables) -> Result<Box<dyn Observer>> {
        let (yarn, _) = yarn_of(case, self.ply)?;
        let given = stiffness(yarn).unwrap_or_default();
        let [_, thickness] = rectangle(yarn);
        let property = Property { symbol: "K_sh", unit: "MPa", by: "F/(γ L h)", evaluated: f64::NAN, given };
        Ok(Box::new(Pull::new(property, self.length_mm * thickness / yarn.width_mm)))
    }

    fn curves(&self, results: &Results, page: &mut Page) -> Result<()> {
        let caption = "Of the moved fibres, over their displacement along themselves.";
        force(results, page, caption);
        Ok(())
    }

    fn sections(&self, _: &Case, results: &Results, page: &mut Page) -> Result<Vec<String>> {
        Ok(section(results, page))
    }
}
