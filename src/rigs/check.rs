//! Checks shared by the test rigs: limits of a case, permitted load steps, and compatibility of the yarns and threads of a fabric.

use crate::case::fabric::{Fabric, Yarn};
use crate::case::provenance::Provenance;
use crate::case::{Case, FabricSource};
use crate::error::Result;
use crate::settings::steps::Step;

/// Largest number of hexahedra of a case.
pub const MAX_HEXES: f64 = 5e7;
/// Largest number of beams of a case.
pub const MAX_BEAMS: f64 = 1e7;
/// Coordinates are limited to ± this value, mm.
pub const MAX_POSITION_MM: f64 = 250.0;

/// Refuses every load step for which `refused` returns a reason.
pub fn steps(case: &Case, provenance: &Provenance, refused: impl Fn(&Step) -> Option<&'static str>) -> Result<()> {
    for (i, step) in case.steps.iter().enumerate() {
        if let Some(message) = refused(step) {
            return Err(provenance.error(&format!("steps.{i}"), message));
        }
    }
    Ok(())
}

/// Refuses sides of a piece, given by their JSON paths, that hold fewer than so many yarns of a ply.
pub fn pitches(fabric: &Fabric, fewest: f64, sides: &[(&str, f64)], provenance: &Provenance) -> Result<()> {
    let pitch = fabric.warp.pitch_mm.max(fabric.weft.pitch_mm);
    match sides.iter().find(|(_, length)| *length < fewest * pitch) {
        Some((path, length)) => {
            let least = fewest * pitch;
            let message =
                format!("{length} holds less than {fewest} yarns at a pitch of {pitch} mm: give at least {least} mm");
            Err(provenance.error(path, message))
        }
        None => Ok(()),
    }
}

/// The fabric of a case; `what` names the domain in errors.
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

/// One thread at its initial thickness must pass between two yarns of either ply.
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
