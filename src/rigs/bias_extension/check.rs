//! Checks that the size, load steps and resolution of a bias-extension specimen are consistent.

use crate::case::Case;
use crate::case::domain::{Clamps, Specimen};
use crate::case::fabric::Fabric;
use crate::case::provenance::Provenance;
use crate::error::Result;
use crate::rigs::check::{MAX_BEAMS, MAX_HEXES, MAX_POSITION_MM, fabric, pitches, steps};
use crate::settings::steps::Step;

/// Smallest number of pitches of each ply along each side.
const FEWEST_PITCHES: f64 = 2.0;

pub fn check(case: &Case, specimen: &Specimen, provenance: &Provenance) -> Result<()> {
    let fabric = fabric(case, "specimen", provenance)?;
    steps(case, provenance, |step| match step {
        Step::Shear { .. } => Some("shear needs a periodic cell: use domain.cell, or move the clamp of the specimen"),
        Step::Stretch { .. } => Some("only a cell has a stretch of its own: use move, with conditions on nodes"),
        _ => None,
    })?;
    let moves = case.steps.iter().position(|s| matches!(s, Step::Move { .. }));
    if specimen.clamps == Clamps::AfterPretension {
        let tightens = case.steps.iter().position(|s| matches!(s, Step::Pretension { .. }));
        if tightens.is_none_or(|i| moves.is_some_and(|j| j < i)) {
            let message =
                "after_pretension needs a pretension step before any move, or the clamps start too late: use start";
            return Err(provenance.error("domain.specimen.clamps", message));
        }
    }
    if moves.is_some() && specimen.displacement_mm == 0.0 {
        let message = "is 0, so that the move step moves nothing: give a displacement or remove the step";
        return Err(provenance.error("domain.specimen.displacement_mm", message));
    }
    size(case, specimen, fabric, provenance)
}

fn size(case: &Case, specimen: &Specimen, fabric: &Fabric, provenance: &Provenance) -> Result<()> {
    let [along, across] = specimen.half();
    let end = along + specimen.displacement_mm;
    if end > MAX_POSITION_MM {
        let message = format!(
            "{} puts the moved clamp at x = {end} mm (half the length, clamp_mm and displacement_mm), at most \
             {MAX_POSITION_MM} mm: shorten the specimen",
            specimen.length_mm
        );
        return Err(provenance.error("domain.specimen.length_mm", message));
    }
    if across > MAX_POSITION_MM {
        let message =
            format!("{} is too wide, at most {} mm: use a smaller one", specimen.width_mm, 2.0 * MAX_POSITION_MM);
        return Err(provenance.error("domain.specimen.width_mm", message));
    }
    let sides = [("domain.specimen.length_mm", specimen.length_mm), ("domain.specimen.width_mm", specimen.width_mm)];
    pitches(fabric, FEWEST_PITCHES, &sides, provenance)?;
    let resolution = &case.resolution.refined();
    let shortest = specimen.length_mm.min(specimen.width_mm);
    if 3.0 * resolution.slice_mm > shortest {
        let message = format!(
            "{} leaves less than 3 slices over the {shortest} mm of the shorter side: give a smaller length",
            resolution.slice_mm
        );
        return Err(provenance.error("resolution.slice_mm", message));
    }
    let area = 4.0 * along * across;
    let sections = [(&fabric.warp, resolution.warp_columns), (&fabric.weft, resolution.weft_columns)];
    let hexes: f64 = sections.iter().map(|(yarn, columns)| area / yarn.pitch_mm * *columns as f64).sum::<f64>()
        * resolution.layers as f64
        / resolution.slice_mm;
    if hexes > MAX_HEXES {
        let message = format!(
            "makes about {hexes:.2e} hexahedra, at most {MAX_HEXES:e}: use longer slices or fewer columns, layers"
        );
        return Err(provenance.error("resolution", message));
    }
    let laps = area / (fabric.warp.pitch_mm * fabric.weft.pitch_mm);
    let beams = laps * resolution.beams_per_lap as f64;
    if beams > MAX_BEAMS {
        let message =
            format!("{} makes about {beams:.2e} beams, at most {MAX_BEAMS:e}: use fewer", resolution.beams_per_lap);
        return Err(provenance.error("resolution.beams_per_lap", message));
    }
    Ok(())
}
