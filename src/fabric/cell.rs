//! The periodic cell: straight warps along y above straight wefts along x, bound by closed chains of thread. Nothing is
//! cut at the border of the cell; what sticks out is what enters on the other side.

use super::section::Section;
use super::stitch::Layout;
use super::{MOST_NODES, not_negative, positive, quantised, require};
use crate::case::Case;
use crate::case::domain::Resolution;
use crate::case::fabric::{Fabric, Yarn};
use crate::error::{Error, Result};
use crate::mesh::{Block, Mesh, Part, Ply, Thread, clearance, quality};
use std::f64::consts::PI;

/// Fewest beams that still bend around the corners of a lap.
const FEWEST_BEAMS: usize = 24;
/// Depth to which a thread may start inside a body, as a share of its radius: the penalty takes it up.
const DEPTH: f64 = 0.1;

/// Builds a cell of `warps × wefts` yarns.
pub fn build(case: &Case, fabric: &Fabric, warps: usize, wefts: usize) -> Result<Mesh> {
    check(fabric, &case.resolution, warps, wefts)?;
    let layout = Layout::new(fabric)?;
    let [px, py] = layout.pitch;
    let period = [quantised(warps as f64 * px), quantised(wefts as f64 * py)];
    let mut mesh = Mesh { period: Some(period), ..Mesh::default() };
    let resolution = &case.resolution;
    for i in 0..warps {
        add_yarn(&mut mesh, Ply::Warp, i, &layout, &fabric.warp, resolution)?;
    }
    for j in 0..wefts {
        add_yarn(&mut mesh, Ply::Weft, j, &layout, &fabric.weft, resolution)?;
    }
    add_threads(&mut mesh, &layout, fabric, resolution.beams_per_lap, warps, wefts)?;
    for (ply, areal_mass) in [(Ply::Warp, fabric.warp.areal_mass_g_m2), (Ply::Weft, fabric.weft.areal_mass_g_m2)] {
        let volume: f64 = mesh.blocks.iter().filter(|b| b.ply == ply).map(|b| quality::volume(&mesh, b)).sum();
        for block in mesh.blocks.iter_mut().filter(|b| b.ply == ply) {
            block.density = areal_mass * quality::TONNES_PER_MM2 * period[0] * period[1] / volume;
        }
    }
    check_contact(case, fabric, &mesh)?;
    Ok(mesh)
}

fn check_yarn(yarn: &Yarn, name: &str) -> Result<()> {
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

fn check(fabric: &Fabric, resolution: &Resolution, warps: usize, wefts: usize) -> Result<()> {
    require(warps >= 2, "domain.cell.warps", || format!("is {warps}, but a cell needs at least 2 warps"))?;
    require(wefts >= 2 && wefts.is_multiple_of(2), "domain.cell.wefts", || {
        format!("is {wefts}, but must be even and at least 2: the stitch repeats after two wefts")
    })?;
    check_yarn(&fabric.warp, "warp")?;
    check_yarn(&fabric.weft, "weft")?;
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
    positive(resolution.slice_mm, "resolution.slice_mm")?;
    let [lx, ly] = [warps as f64 * fabric.warp.pitch_mm, wefts as f64 * fabric.weft.pitch_mm];
    require(2.5 * resolution.slice_mm <= lx.min(ly), "resolution.slice_mm", || {
        format!("is {} mm, but a yarn of {} mm needs at least 3 slices", resolution.slice_mm, lx.min(ly))
    })?;
    let lines = |columns: usize| (columns + 1) as f64 * (resolution.layers + 1) as f64;
    let nodes = warps as f64 * lines(resolution.warp_columns) * ly / resolution.slice_mm
        + wefts as f64 * lines(resolution.weft_columns) * lx / resolution.slice_mm
        + warps as f64 * wefts as f64 * resolution.beams_per_lap as f64;
    require(nodes <= MOST_NODES, "resolution", || {
        format!("asks for {nodes:.1e} nodes, more than {MOST_NODES:.0e}; coarsen it or choose a smaller cell")
    })
}

fn add_yarn(
    mesh: &mut Mesh,
    ply: Ply,
    index: usize,
    layout: &Layout,
    yarn: &Yarn,
    resolution: &Resolution,
) -> Result<()> {
    let [lx, ly] = mesh.period.unwrap_or_default();
    let (section, columns, pitch, length, middle): (&Section, _, _, _, _) = match ply {
        Ply::Warp => (&layout.warp, resolution.warp_columns, layout.pitch[0], ly, layout.middle[0]),
        _ => (&layout.weft, resolution.weft_columns, layout.pitch[1], lx, layout.middle[1]),
    };
    let slices = (length / resolution.slice_mm).round() as usize;
    // Slices of equal quanta, but for the last: their hexahedra share shapes.
    let slice_length = quantised(length / slices as f64);
    let centre = quantised((index as f64 + 0.5) * pitch);
    let first = mesh.nodes.len();
    for row in section.grid(columns, resolution.layers) {
        for [u, v] in row {
            let [u, z] = [quantised(u), quantised(middle + v)];
            mesh.nodes.extend((0..slices).map(|slice| slice as f64 * slice_length).map(|along| {
                match ply {
                    // Fibres along y and layers along z: columns run against x.
                    Ply::Warp => [centre - u, along, z],
                    _ => [along, centre + u, z],
                }
            }));
        }
    }
    let (name, wrap, fibre) = match ply {
        Ply::Warp => ("warp", [0, 1], [0.0, 1.0, 0.0]),
        _ => ("weft", [1, 0], [1.0, 0.0, 0.0]),
    };
    let block = Block {
        name: format!("{name} {}", index + 1),
        ply,
        first,
        slices,
        columns,
        layers: resolution.layers,
        wrap: Some(wrap),
        fibre,
        density: 0.0,
        material: yarn.material.clone(),
        velocity: [0.0; 3],
    };
    let worst = quality::scaled_jacobian(mesh, &block);
    if worst <= 0.0 {
        return Err(Error::geometry(
            format!("fabric.{name}"),
            format!("its hexahedra have a scaled Jacobian of {worst:.3}; lower truncation or use fewer columns"),
        ));
    }
    mesh.blocks.push(block);
    Ok(())
}

fn add_threads(
    mesh: &mut Mesh,
    layout: &Layout,
    fabric: &Fabric,
    beams: usize,
    warps: usize,
    wefts: usize,
) -> Result<()> {
    let stitch = &fabric.stitch;
    let lap: Vec<([f64; 3], Part)> =
        layout.path()?.beams(beams, stitch.radius_mm).into_iter().map(|(p, part)| (p.map(quantised), part)).collect();
    for i in 0..warps {
        let first = mesh.nodes.len();
        let x = quantised((i as f64 + 0.5) * layout.pitch[0]);
        for j in 0..wefts {
            let y = quantised(j as f64 * layout.pitch[1]);
            let side = if j % 2 == 0 { 1.0 } else { -1.0 };
            mesh.nodes.extend(lap.iter().map(|(p, _)| [x + side * p[0], y + p[1], p[2]]));
        }
        mesh.threads.push(Thread {
            name: format!("thread {}", i + 1),
            first,
            count: beams * wefts,
            wrap: Some([0, 1]),
            radius: stitch.radius_mm,
            axial: stitch.young_mpa * PI * stitch.radius_mm * stitch.radius_mm,
            bending: stitch.bending_n_mm2,
            rest_curvature: stitch.rest_curvature,
            linear_density: stitch.linear_density_tex * quality::TONNES_PER_MM_OF_TEX,
            thermal_strain: stitch.thermal_strain,
            velocity: [0.0; 3],
            parts: (0..wefts).flat_map(|_| lap.iter().map(|(_, part)| *part)).collect(),
        });
    }
    Ok(())
}

/// Refuses threads that start deeper inside a yarn or another thread than the start of contact can take up.
fn check_contact(case: &Case, fabric: &Fabric, mesh: &Mesh) -> Result<()> {
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
        && let Some(start) = clearance::thread_thread(mesh, contact.self_contact_arc_mm)
        && start.gap < deepest(2.0 * radius)
    {
        let advice = "raise fabric.stitch.clearance_thread_mm or resolution.beams_per_lap";
        return refuse("fabric.stitch.clearance_thread_mm", &start, 2.0 * radius, advice);
    }
    Ok(())
}
