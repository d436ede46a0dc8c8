//! Checks that the size, load steps and resolution of a periodic fabric cell are consistent.

use crate::case::Case;
use crate::case::domain::Cell;
use crate::case::fabric::Fabric;
use crate::case::provenance::Provenance;
use crate::error::Result;
use crate::rigs::check::{MAX_BEAMS, MAX_HEXES, MAX_POSITION_MM, fabric};

/// Checks a cell whose numbers of yarns are given at a path of the case.
pub fn check(case: &Case, &Cell { warps, wefts }: &Cell, path: &str, provenance: &Provenance) -> Result<()> {
    let fabric = fabric(case, "cell", provenance)?;
    if wefts % 2 == 1 {
        let message = format!("{wefts} is odd, a tricot repeats after two courses: give an even number");
        return Err(provenance.error(&format!("{path}.wefts"), message));
    }
    size(case, fabric, [warps, wefts], path, provenance)
}

fn size(case: &Case, fabric: &Fabric, [warps, wefts]: [usize; 2], path: &str, provenance: &Provenance) -> Result<()> {
    let lengths = [warps as f64 * fabric.warp.pitch_mm, wefts as f64 * fabric.weft.pitch_mm];
    for (name, count, length) in [("warps", warps, lengths[0]), ("wefts", wefts, lengths[1])] {
        if length > MAX_POSITION_MM {
            let message = format!(
                "{count} make a cell of {length} mm, at most {MAX_POSITION_MM} mm: use fewer, cells are periodic"
            );
            return Err(provenance.error(&format!("{path}.{name}"), message));
        }
    }
    let resolution = &case.resolution.refined();
    let slices = lengths.map(|length| (length / resolution.slice_mm).round().max(1.0));
    let sections =
        [warps * resolution.warp_columns, wefts * resolution.weft_columns].map(|n| (n * resolution.layers) as f64);
    let hexes = sections[0] * slices[1] + sections[1] * slices[0];
    if hexes > MAX_HEXES {
        let message =
            format!("makes {hexes:.2e} hexahedra, at most {MAX_HEXES:e}: use longer slices or fewer columns, layers");
        return Err(provenance.error("resolution", message));
    }
    let beams = (warps * wefts * resolution.beams_per_lap) as f64;
    if beams > MAX_BEAMS {
        let message = format!("{} makes {beams:.2e} beams, at most {MAX_BEAMS:e}: use fewer", resolution.beams_per_lap);
        return Err(provenance.error("resolution.beams_per_lap", message));
    }
    for (name, slices, length) in [("warp", slices[1], lengths[1]), ("weft", slices[0], lengths[0])] {
        if slices < 3.0 {
            let message = format!(
                "{} leaves {slices} slices along a {name} yarn of {length} mm, at least 3: give a smaller length",
                resolution.slice_mm
            );
            return Err(provenance.error("resolution.slice_mm", message));
        }
    }
    Ok(())
}
