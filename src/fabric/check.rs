//! Requirements on every piece of fabric: sizes, resolution, shape of hexahedra, room for threads.

use super::{not_negative, positive, require};
use crate::case::Case;
use crate::case::domain::Resolution;
use crate::case::fabric::{Fabric, Yarn};
use crate::error::{Error, Result};
use crate::mesh::{Block, Mesh, Ply, clearance, quality};

/// Fewest beams that can follow the corners of a lap.
const FEWEST_BEAMS: usize = 24;
/// Depth to which a thread may start inside a body, as a share of its radius; penalty contact resolves it.
const DEPTH: f64 = 0.1;

/// Refuses sizes from which no yarn or stitch can be made.
pub fn fabric(fabric: &Fabric) -> Result<()> {
    yarn(&fabric.warp, "warp")?;
    yarn(&fabric.weft, "weft")?;
    not_negative(fabric.ply_gap_mm, "fabric.ply_gap_mm")?;
    let stitch = &fabric.stitch;
    positive(stitch.radius_mm, "fabric.stitch.radius_mm")?;
    positive(stitch.young_mpa, "fabric.stitch.young_mpa")?;
    positive(stitch.linear_density_tex, "fabric.stitch.linear_density_tex")?;
    not_negative(stitch.bending_n_mm2, "fabric.stitch.bending_n_mm2")?;
    not_negative(stitch.clearance_yarn_mm, "fabric.stitch.clearance_yarn_mm")?;
    not_negative(stitch.clearance_thread_mm, "fabric.stitch.clearance_thread_mm")?;
    not_negative(stitch.leg_shift_mm, "fabric.stitch.leg_shift_mm")?;
    not_negative(stitch.underlap_ramp_mm, "fabric.stitch.underlap_ramp_mm")?;
    Ok(())
}

fn yarn(yarn: &Yarn, name: &str) -> Result<()> {
    let at = |field: &str| format!("fabric.{name}.{field}");
    positive(yarn.pitch_mm, &at("pitch_mm"))?;
    positive(yarn.width_mm, &at("width_mm"))?;
    positive(yarn.thickness_mm, &at("thickness_mm"))?;
    positive(yarn.areal_mass_g_m2, &at("areal_mass_g_m2"))?;
    require((0.5..=0.99).contains(&yarn.truncation), &at("truncation"), || {
        format!("is {}, but must lie between 0.5 and 0.99", yarn.truncation)
    })?;
    require(yarn.width_mm < yarn.pitch_mm, &at("width_mm"), || {
        format!(
            "is {} mm, so neighbouring {name}s overlap; it must be below fabric.{name}.pitch_mm = {} mm",
            yarn.width_mm, yarn.pitch_mm
        )
    })
}

/// Refuses a resolution without elements, or with too few beams to bend around corners.
pub fn resolution(resolution: &Resolution) -> Result<()> {
    for (value, name) in [
        (resolution.warp_columns, "warp_columns"),
        (resolution.weft_columns, "weft_columns"),
        (resolution.layers, "layers"),
    ] {
        require(value >= 1, &format!("resolution.{name}"), || "is 0, but must be at least 1".into())?;
    }
    require(resolution.beams_per_lap >= FEWEST_BEAMS, "resolution.beams_per_lap", || {
        format!(
            "is {}, but a lap needs at least {FEWEST_BEAMS} beams to go around its corners",
            resolution.beams_per_lap
        )
    })?;
    let fewest = resolution.beams_per_lap - resolution.lap_spread();
    require(fewest >= FEWEST_BEAMS, "resolution.lap_variation", || {
        format!(
            "is {}, which leaves {fewest} of {} beams to some laps, but a lap needs at least {FEWEST_BEAMS}; lower it or \
             raise resolution.beams_per_lap",
            resolution.lap_variation, resolution.beams_per_lap
        )
    })?;
    positive(resolution.slice_mm, "resolution.slice_mm")
}

/// Refuses a yarn with an inverted hexahedron.
pub fn shape(mesh: &Mesh, block: &Block, name: &str) -> Result<()> {
    let worst = quality::scaled_jacobian(mesh, block);
    if worst > 0.0 {
        return Ok(());
    }
    Err(Error::geometry(
        format!("fabric.{name}"),
        format!("its hexahedra have a scaled Jacobian of {worst:.3}; lower truncation or use fewer columns"),
    ))
}

/// Refuses threads that start deeper inside a yarn or another thread than contact at the start can resolve.
pub fn contact(case: &Case, fabric: &Fabric, mesh: &Mesh) -> Result<()> {
    let Some(contact) = &case.effects.contact else { return Ok(()) };
    let radius = fabric.stitch.radius_mm;
    let ratio = contact.initial_radius_ratio;
    let refuse = |what: &str, start: &clearance::Clearance, between: f64, advice: &str| {
        let room = (start.gap + between).max(0.0) / between;
        let ratio_advice = if room >= 0.01 {
            format!(" or set effects.contact.initial_radius_ratio to {:.2} or less", (room * 100.0).floor() / 100.0)
        } else {
            String::new()
        };
        let other = if start.other == start.thread { "another of its own beams" } else { &start.other };
        Err(Error::geometry(
            what,
            format!(
                "{} starts {:.3} mm inside {other}; contact starts at {ratio} of the radius of {radius} mm, which takes up \
                 at most {:.3} mm; {advice}{ratio_advice}",
                start.thread,
                -start.gap,
                (1.0 - ratio + DEPTH) * between
            ),
        ))
    };
    let deepest = |between: f64| -(1.0 - ratio + DEPTH) * between;
    if contact.thread_yarn {
        for (ply, name) in [(Ply::Warp, "warp"), (Ply::Weft, "weft")] {
            if let Some(start) = clearance::thread_yarn(mesh, ply, 1)
                && start.gap < deepest(radius)
            {
                let advice = format!(
                    "lower fabric.{name}.width_mm or fabric.stitch.radius_mm, or raise fabric.{name}.pitch_mm,"
                );
                return refuse(&format!("fabric.{name}.width_mm"), &start, radius, &advice);
            }
        }
    }
    if contact.thread_thread
        && let Some(start) = clearance::thread_thread(mesh, mesh.self_arc())
        && start.gap < deepest(2.0 * radius)
    {
        let advice = "raise fabric.stitch.clearance_thread_mm or resolution.beams_per_lap";
        return refuse("fabric.stitch.clearance_thread_mm", &start, 2.0 * radius, advice);
    }
    Ok(())
}
