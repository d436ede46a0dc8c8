//! The periodic cell: straight warps along y above straight wefts along x, bound by closed chains of thread. Nothing is cut at
//! the border of the cell: bodies that leave on one side enter on the other.

use super::laps::Laps;
use super::section::Section;
use super::stitch::{self, Layout};
use super::{MOST_NODES, check, quantised, require};
use crate::case::Case;
use crate::case::domain::Resolution;
use crate::case::fabric::{Fabric, Yarn};
use crate::error::Result;
use crate::mesh::{Block, Mesh, Ply, quality};

/// Builds a cell of `warps × wefts` yarns.
pub fn build(case: &Case, fabric: &Fabric, warps: usize, wefts: usize) -> Result<Mesh> {
    let resolution = &case.resolution.refined();
    check(fabric, resolution, warps, wefts)?;
    let layout = Layout::new(fabric)?;
    let [px, py] = layout.pitch;
    let period = [quantised(warps as f64 * px), quantised(wefts as f64 * py)];
    let mut mesh = Mesh { period: Some(period), friction: fabric.friction, ..Mesh::default() };
    for i in 0..warps {
        add_yarn(&mut mesh, Ply::Warp, i, &layout, &fabric.warp, resolution)?;
    }
    for j in 0..wefts {
        add_yarn(&mut mesh, Ply::Weft, j, &layout, &fabric.weft, resolution)?;
    }
    add_threads(&mut mesh, &layout, fabric, resolution, warps, wefts)?;
    for (ply, areal_mass) in [(Ply::Warp, fabric.warp.areal_mass_g_m2), (Ply::Weft, fabric.weft.areal_mass_g_m2)] {
        let volume: f64 = mesh.blocks.iter().filter(|b| b.ply == ply).map(|b| quality::volume(&mesh, b)).sum();
        for block in mesh.blocks.iter_mut().filter(|b| b.ply == ply) {
            block.density = areal_mass * quality::TONNES_PER_MM2 * period[0] * period[1] / volume;
        }
    }
    check::contact(case, fabric, &mesh)?;
    Ok(mesh)
}

fn check(fabric: &Fabric, resolution: &Resolution, warps: usize, wefts: usize) -> Result<()> {
    require(warps >= 2, "domain.cell.warps", || format!("is {warps}, but a cell needs at least 2 warps"))?;
    require(wefts >= 2 && wefts.is_multiple_of(2), "domain.cell.wefts", || {
        format!("is {wefts}, but must be even and at least 2: the stitch repeats after two wefts")
    })?;
    check::fabric(fabric)?;
    check::resolution(resolution)?;
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
    // All slices but the last have equal lengths in quanta, so that their hexahedra share shapes.
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
    check::shape(mesh, &block, name)?;
    mesh.blocks.push(block);
    Ok(())
}

fn add_threads(
    mesh: &mut Mesh,
    layout: &Layout,
    fabric: &Fabric,
    resolution: &Resolution,
    warps: usize,
    wefts: usize,
) -> Result<()> {
    let path = layout.path()?;
    let laps = Laps::new(&path, resolution, fabric.stitch.radius_mm);
    for i in 0..warps {
        let first = mesh.nodes.len();
        let x = quantised((i as f64 + 0.5) * layout.pitch[0]);
        let mut beams = Vec::new();
        for j in 0..wefts {
            let y = quantised(j as f64 * layout.pitch[1]);
            let side = if j % 2 == 0 { 1.0 } else { -1.0 };
            for &([from, to], part) in laps.lap(i as i64, j as i64) {
                let [a, b] = [from, to].map(|arc| path.line.at(arc).map(quantised));
                mesh.nodes.push([x + side * a[0], y + a[1], a[2]]);
                beams.push((part, stitch::excess(to - from, a, b)));
            }
        }
        mesh.threads.push(stitch::thread(&fabric.stitch, format!("thread {}", i + 1), first, Some([0, 1]), beams));
    }
    Ok(())
}
