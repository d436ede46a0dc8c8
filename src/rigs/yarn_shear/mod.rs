//! Longitudinal shear of a single yarn (Fig. 8 of Zheng et al.): the outermost fibres on one side are held, those on the other side
//! are moved along themselves, so that all fibres keep their length. While the response is linear, F = K_sh γ L h, with γ the
//! displacement over the width and h the thickness.
//!
//! The section is a rectangle of the yarn's width and area, so that the shear is the same everywhere but near the free ends of the
//! fibres. There the yarn carries less: about one and a half widths of it are missing in F, so that a long yarn, or the difference
//! of two lengths, gives K_sh.

use super::constituents::{Property, Pull, grip, section, steps, unused};
use super::observer::{Observer, Tables};
use super::{Piece, Rig, check};
use crate::case::Case;
use crate::case::domain::{OnePly, Resolution, YarnShear};
use crate::case::fabric::Yarn;
use crate::case::provenance::Provenance;
use crate::error::Result;
use crate::fabric::quantised;
use crate::fabric::section::Section;
use crate::mesh::{Block, Mesh, Ply, quality};
use crate::output::page::Page;
use crate::output::results::Results;
use crate::settings::material::Material;
use crate::simulate::Simulation;

impl YarnShear {
    /// The yarn, and hexahedra across it.
    fn yarn<'a>(&self, case: &'a Case) -> Result<(&'a Yarn, usize)> {
        let (fabric, resolution) = (case.fabric()?, case.resolution.refined());
        Ok(match self.ply {
            OnePly::Warp => (&fabric.warp, resolution.warp_columns),
            OnePly::Weft => (&fabric.weft, resolution.weft_columns),
        })
    }
}

/// The longitudinal shear stiffness of a yarn, if its law has one, MPa.
fn stiffness(yarn: &Yarn) -> Option<f64> {
    match yarn.material {
        Material::Charmetant { k_sh_mpa, .. } => Some(k_sh_mpa),
        Material::NeoHookean { .. } => None,
    }
}

/// Area of the section of a yarn, mm², and the thickness of a rectangle of the same width and area, mm.
fn section_of(yarn: &Yarn) -> [f64; 2] {
    let section = Section { width: yarn.width_mm, thickness: yarn.thickness_mm, truncation: yarn.truncation };
    [section.area(), section.area() / yarn.width_mm]
}

impl Rig for YarnShear {
    fn check(&self, case: &Case, provenance: &Provenance) -> Result<()> {
        check::fabric(case, "yarn", provenance)?;
        steps(case, "yarn_shear", self.displacement_mm, provenance)?;
        let Resolution { layers, slice_mm, finer, .. } = Resolution::default();
        let used = match self.ply {
            OnePly::Warp => Resolution { warp_columns: Resolution::default().warp_columns, ..case.resolution.clone() },
            OnePly::Weft => Resolution { weft_columns: Resolution::default().weft_columns, ..case.resolution.clone() },
        };
        unused(case, &Resolution { layers, slice_mm, finer, ..used }, "this yarn", provenance)?;
        let (yarn, _) = self.yarn(case)?;
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
        let ((yarn, columns), resolution) = (self.yarn(case)?, case.resolution.refined());
        let [area, thickness] = section_of(yarn);
        let (slices, layers) = ((self.length_mm / resolution.slice_mm).round() as usize, resolution.layers);
        let place = |share: f64, size: f64| quantised((share - 0.5) * size);
        let mut mesh = Mesh::default();
        for layer in 0..=layers {
            for column in 0..=columns {
                let y = place(column as f64 / columns as f64, yarn.width_mm);
                let z = place(layer as f64 / layers as f64, thickness);
                let along = (0..=slices).map(|slice| place(slice as f64 / slices as f64, self.length_mm));
                mesh.nodes.extend(along.map(|x| [x, y, z]));
            }
        }
        mesh.blocks.push(Block {
            name: "yarn".into(),
            ply: Ply::Free,
            first: 0,
            slices,
            columns,
            layers,
            wrap: None,
            fibre: [1.0, 0.0, 0.0],
            density: yarn.areal_mass_g_m2 * quality::TONNES_PER_MM2 * yarn.pitch_mm / area,
            material: yarn.material.clone(),
            velocity: [0.0; 3],
        });
        let side = |side: f64| {
            let y = place(side, yarn.width_mm);
            (0..mesh.nodes.len()).filter(|node| mesh.nodes[*node][1] == y).collect()
        };
        let motions = vec![grip("held fibres", side(0.0), 0.0), grip("moved fibres", side(1.0), self.displacement_mm)];
        Ok(Piece { mesh, motions, ..Piece::default() })
    }

    fn observer(&self, case: &Case, _: &Simulation, _: &Tables) -> Result<Box<dyn Observer>> {
        let (yarn, _) = self.yarn(case)?;
        let given = stiffness(yarn).unwrap_or_default();
        let [_, thickness] = section_of(yarn);
        let property = Property { symbol: "K_sh", unit: "MPa", by: "F/(γ L h)", evaluated: f64::NAN, given };
        Ok(Box::new(Pull::new(property, self.length_mm * thickness / yarn.width_mm)))
    }

    fn curves(&self, results: &Results, page: &mut Page) -> Result<()> {
        let caption = "Of the moved fibres, over their displacement along themselves.";
        results.chart(page, &results.history, &results.axis(), ["Force", "N"], &[("force_n", "force")], caption);
        Ok(())
    }

    fn sections(&self, _: &Case, results: &Results, page: &mut Page) -> Result<Vec<String>> {
        Ok(section(results, page))
    }

    fn columns(&self, results: &Results) -> Vec<&'static str> {
        vec![results.axis().column, "force_n"]
    }
}
