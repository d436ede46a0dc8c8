//! What test rigs check alike: limits of a case, which load steps a rig takes, and whether yarns and threads of its fabric go together.

use crate::case::fabric::{Fabric, Yarn};
use crate::case::provenance::Provenance;
use crate::case::{Case, FabricSource};
use crate::error::Result;
use crate::settings::steps::Step;

/// Most hexahedra of one case.
pub const MAX_HEXES: f64 = 5e7;
/// Most beams of one case.
pub const MAX_BEAMS: f64 = 1e7;
/// Positions are held to ± this, mm.
pub const MAX_POSITION_MM: f64 = 250.0;

/// Refuses a load step to which `refused` has an answer.
pub fn steps(case: &Case, provenance: &Provenance, refused: impl Fn(&Step) -> Option<&'static str>) -> Result<()> {
    for (i, step) in case.steps.iter().enumerate() {
        if let Some(message) = refused(step) {
            return Err(provenance.error(&format!("steps.{i}"), message));
        }
    }
    Ok(())
}

/// The fabric of a case whose domain is a `what`.
pub fn fabric<'a>(case: &'a Case, what: &str, provenance: &Provenance) -> Result<&'a Fabric> {
    let Some(FabricSource::Inline(fabric)) = &case.fabric else {
        let message = format!("is missing, a {what} needs one: give a fabric file or the fabric itself");
        return Err(provenance.error("fabric", message));
    };
    yarn("warp", &fabric.warp, provenance)?;
    yarn("weft", &fabric.weft, provenance)?;
    threads(case, fabric, provenance)?;
    Ok(fabric)
}

fn yarn(name: &str, yarn: &Yarn, provenance: &Provenance) -> Result<()> {
    let Yarn { width_mm: width, pitch_mm: pitch, thickness_mm: thickness, .. } = *yarn;
    if width > pitch {
        let message = format!("yarns overlap: {width} mm wide at a pitch_mm of {pitch}, give at most the pitch");
        return Err(provenance.error(&format!("fabric.{name}.width_mm"), message));
    }
    if thickness > width {
        let message =
            format!("{thickness} mm is more than the width_mm of {width}, give a yarn that is wider than thick");
        return Err(provenance.error(&format!("fabric.{name}.thickness_mm"), message));
    }
    Ok(())
}

/// One thread, as thin as it starts, has to pass between two yarns of either ply.
fn threads(case: &Case, fabric: &Fabric, provenance: &Provenance) -> Result<()> {
    let Some(contact) = case.effects.contact.as_ref().filter(|contact| contact.thread_yarn) else { return Ok(()) };
    let (radius, ratio) = (fabric.stitch.radius_mm, contact.initial_radius_ratio);
    for (name, yarn) in [("warp", &fabric.warp), ("weft", &fabric.weft)] {
        let gap = yarn.pitch_mm - yarn.width_mm;
        if 2.0 * radius * ratio > gap + 1e-9 {
            let message = format!(
                "{radius} does not fit: a thread of {:.4} mm diameter at the start (2 × {radius} × \
                 effects.contact.initial_radius_ratio {ratio}) in the {name} gap of {gap:.4} mm; \
                 lower the radius, the ratio or fabric.{name}.width_mm",
                2.0 * radius * ratio
            );
            return Err(provenance.error("fabric.stitch.radius_mm", message));
        }
    }
    Ok(())
}
