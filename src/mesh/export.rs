//! Export to an Abaqus input file: geometry, element sets, orientations, sections and materials.

use super::vector::{norm, sub};
use super::{Block, Mesh, Seen, Thread};
use crate::case::fabric::Material;
use crate::error::{Error, Result};
use std::collections::HashMap;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Writes a mesh as an Abaqus input file. Where a yarn or thread closes through the periodic cell, the far nodes are
/// written as copies, so that every element has its true shape; the sets `PERIODIC_COPY` and `PERIODIC_ORIGINAL` list the
/// copies and their originals in the same order.
pub fn write_inp(mesh: &Mesh, path: &Path) -> Result<()> {
    let file = File::create(path).map_err(|e| Error::file(path, e))?;
    let mut out = BufWriter::new(file);
    inp(mesh, &mut out).and_then(|()| out.flush()).map_err(|e| Error::file(path, e))
}

/// Numbers of nodes in the file: originals first, then copies in the order in which elements ask for them.
struct Numbers {
    originals: usize,
    copies: Vec<Seen>,
    known: HashMap<(usize, [i32; 2]), usize>,
}

impl Numbers {
    fn of(&mut self, seen: Seen) -> usize {
        if seen.image == [0, 0] {
            return seen.node + 1;
        }
        let next = self.originals + self.copies.len() + 1;
        *self.known.entry((seen.node, seen.image)).or_insert_with(|| {
            self.copies.push(seen);
            next
        })
    }
}

/// Writes the text of the input file.
pub fn inp(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    let mut numbers = Numbers { originals: mesh.nodes.len(), copies: Vec::new(), known: HashMap::new() };
    let mut elements = Vec::new();
    let mut next = 1;
    for (i, block) in mesh.blocks.iter().enumerate() {
        hexahedra(block, &set("BLOCK", i), &mut numbers, &mut next, &mut elements)?;
    }
    for (i, thread) in mesh.threads.iter().enumerate() {
        beams(mesh, thread, &set("THREAD", i), &mut numbers, &mut next, &mut elements)?;
    }
    writeln!(out, "*HEADING\ntricot mesh; units mm, N, s, tonne, MPa")?;
    writeln!(out, "*NODE")?;
    let originals = (0..mesh.nodes.len()).map(|node| Seen { node, image: [0, 0] });
    for (i, seen) in originals.chain(numbers.copies.iter().copied()).enumerate() {
        let [x, y, z] = mesh.position(seen);
        writeln!(out, "{}, {x:.9}, {y:.9}, {z:.9}", i + 1)?;
    }
    out.write_all(&elements)?;
    if !numbers.copies.is_empty() {
        let copies: Vec<usize> = (0..numbers.copies.len()).map(|i| mesh.nodes.len() + i + 1).collect();
        let masters: Vec<usize> = numbers.copies.iter().map(|seen| seen.node + 1).collect();
        for (name, nodes) in [("PERIODIC_COPY", copies), ("PERIODIC_ORIGINAL", masters)] {
            writeln!(out, "*NSET, NSET={name}, UNSORTED")?;
            for line in nodes.chunks(16) {
                writeln!(out, "{}", line.iter().map(usize::to_string).collect::<Vec<_>>().join(", "))?;
            }
        }
    }
    for (i, block) in mesh.blocks.iter().enumerate() {
        solid_section(block, &set("BLOCK", i), out)?;
    }
    for (i, thread) in mesh.threads.iter().enumerate() {
        beam_section(mesh, thread, &set("THREAD", i), out)?;
    }
    Ok(())
}

fn set(kind: &str, index: usize) -> String {
    format!("{kind}_{}", index + 1)
}

fn hexahedra(block: &Block, set: &str, numbers: &mut Numbers, next: &mut usize, out: &mut Vec<u8>) -> io::Result<()> {
    writeln!(out, "** {}\n*ELEMENT, TYPE=C3D8, ELSET={set}", block.name)?;
    for layer in 0..block.layers {
        for column in 0..block.columns {
            for slice in 0..block.slices {
                let corners = block.corners(slice, column, layer).map(|c| numbers.of(c).to_string());
                writeln!(out, "{next}, {}", corners.join(", "))?;
                *next += 1;
            }
        }
    }
    Ok(())
}

/// The flat and the steep beams of a thread, where it has any: a first section axis must not be along its beam, so each
/// kind needs its own.
fn slopes(mesh: &Mesh, thread: &Thread) -> Vec<(&'static str, Vec<usize>)> {
    let steep = |&i: &usize| {
        let [a, b] = thread.beam(i).map(|n| mesh.position(n));
        let along = sub(b, a);
        along[2].abs() > 0.7 * norm(along)
    };
    let (steep, flat): (Vec<usize>, Vec<usize>) = (0..thread.beams()).partition(steep);
    [("FLAT", flat), ("STEEP", steep)].into_iter().filter(|(_, beams)| !beams.is_empty()).collect()
}

fn beams(
    mesh: &Mesh,
    thread: &Thread,
    set: &str,
    numbers: &mut Numbers,
    next: &mut usize,
    out: &mut Vec<u8>,
) -> io::Result<()> {
    writeln!(out, "** {}", thread.name)?;
    for (name, beams) in slopes(mesh, thread) {
        writeln!(out, "*ELEMENT, TYPE=B31, ELSET={set}_{name}")?;
        for i in beams {
            let [a, b] = thread.beam(i).map(|n| numbers.of(n));
            writeln!(out, "{}, {a}, {b}", *next + i)?;
        }
    }
    *next += thread.beams();
    Ok(())
}

fn solid_section(block: &Block, set: &str, out: &mut dyn Write) -> io::Result<()> {
    let [a, b, c] = block.fibre;
    // Any second direction that is not along the fibre completes the orientation.
    let [d, e, f] = if c.abs() > 0.9 { [1.0, 0.0, 0.0] } else { [-b, a, 0.0] };
    writeln!(out, "** {}: local direction 1 is the fibre", block.name)?;
    writeln!(out, "*ORIENTATION, NAME=ORIENTATION_{set}\n{}", numbers(&[a, b, c, d, e, f]))?;
    writeln!(out, "*SOLID SECTION, ELSET={set}, MATERIAL=MATERIAL_{set}, ORIENTATION=ORIENTATION_{set}")?;
    writeln!(out, "*MATERIAL, NAME=MATERIAL_{set}\n*DENSITY\n{}", numbers(&[block.density]))?;
    match &block.material {
        Material::Charmetant { k_elong_mpa, k_comp_mpa, p_comp, k_dist_mpa, k_sh_mpa, .. } => {
            writeln!(out, "** K_elong, K_comp, p_comp, K_dist, K_sh of the hyperelastic law of Charmetant et al.")?;
            writeln!(out, "*USER MATERIAL, CONSTANTS=5")?;
            writeln!(out, "{}", numbers(&[*k_elong_mpa, *k_comp_mpa, *p_comp, *k_dist_mpa, *k_sh_mpa]))
        }
        Material::NeoHookean { young_mpa, poisson } => {
            let shear = young_mpa / (2.0 * (1.0 + poisson));
            let bulk = young_mpa / (3.0 * (1.0 - 2.0 * poisson));
            writeln!(
                out,
                "** the same moduli at small strain\n*HYPERELASTIC, NEO HOOKE\n{}",
                numbers(&[shear / 2.0, 2.0 / bulk])
            )
        }
    }
}

/// Numbers of a line. CalculiX reads no more than twenty characters of each.
fn numbers(numbers: &[f64]) -> String {
    let short = |x: &f64| {
        let exact = format!("{x:?}");
        if exact.len() > 20 { format!("{x:.12e}") } else { exact }
    };
    numbers.iter().map(short).collect::<Vec<_>>().join(", ")
}

fn beam_section(mesh: &Mesh, thread: &Thread, set: &str, out: &mut dyn Write) -> io::Result<()> {
    let area = std::f64::consts::PI * thread.radius * thread.radius;
    let young = thread.axial / area;
    let second = thread.bending / young;
    writeln!(out, "** {}: EA = {} N, EI = {} N mm2", thread.name, thread.axial, thread.bending)?;
    for (name, _) in slopes(mesh, thread) {
        let axis = if name == "FLAT" { "0, 0, -1" } else { "1, 0, 0" };
        writeln!(
            out,
            "*BEAM GENERAL SECTION, SECTION=GENERAL, ELSET={set}_{name}, DENSITY={}",
            numbers(&[thread.linear_density / area])
        )?;
        writeln!(out, "{}", numbers(&[area, second, 0.0, second, 2.0 * second]))?;
        writeln!(out, "{axis}\n{}", numbers(&[young, young / 2.0]))?;
    }
    Ok(())
}
