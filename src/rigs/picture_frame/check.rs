//! Checks that the size and load steps of a picture frame are consistent.

use crate::case::Case;
use crate::case::domain::PictureFrame;
use crate::case::provenance::Provenance;
use crate::error::Result;
use crate::rigs::check::{fabric, pitches, steps};
use crate::settings::steps::Step;

/// Smallest number of pitches of each ply along the square.
const FEWEST_PITCHES: f64 = 2.0;

pub fn check(case: &Case, frame: &PictureFrame, provenance: &Provenance) -> Result<()> {
    let fabric = fabric(case, "picture frame", provenance)?;
    let stretches = frame.tension_strain > 0.0;
    steps(case, provenance, |step| match step {
        Step::Stretch { .. } => Some("only a cell has a stretch of its own: give domain.picture_frame.tension_strain"),
        Step::Move { .. } if !stretches => {
            Some("nothing to move: give domain.picture_frame.tension_strain, or use shear")
        }
        Step::Move { to, .. } if *to != 1.0 => Some("the frame turns with whole tension only: move to 1"),
        _ => None,
    })?;
    let moves = case.steps.iter().position(|step| matches!(step, Step::Move { .. }));
    let shears = case.steps.iter().position(|step| matches!(step, Step::Shear { .. }));
    if stretches && (moves.is_none() || shears.is_some_and(|shears| moves > Some(shears))) {
        let message = "is not applied before the frame shears: add a move step before it";
        return Err(provenance.error("domain.picture_frame.tension_strain", message));
    }
    if frame.fabric_mm > frame.frame_mm {
        let message =
            format!("{} mm does not fit the frame of {} mm: give at most that", frame.fabric_mm, frame.frame_mm);
        return Err(provenance.error("domain.picture_frame.fabric_mm", message));
    }
    pitches(fabric, FEWEST_PITCHES, &[("domain.picture_frame.fabric_mm", frame.fabric_mm)], provenance)
}
