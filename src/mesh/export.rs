//! Export to an Abaqus input file, which CalculiX also reads: geometry, sets, orientations, sections and materials.
//!
//! Materials are linear about rest: engineering constants of the law at small strain, with the constants of the law itself in
//! comments for use with a user material. A thread is a beam with a square section that has EA and EI of the thread. The section
//! is thinner than the envelope, whose radius a contact definition needs and a comment names. CalculiX has no linear beam with a
//! round section.

use super::vector::{norm, sub};
use super::{Block, Mesh, Ply, Seen, Thread};
use crate::error::{Error, Result};
use crate::settings::material::Material;
use std::collections::HashMap;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// A set of nodes by name.
pub type NodeSet = (String, Vec<usize>);

/// Writes a mesh as an Abaqus input file, with further node sets. Where a yarn or thread closes through the periodic cell, the far
/// nodes are written as copies, so that every element has its true shape; for each direction the sets `PERIODIC_X_COPY` and
/// `PERIODIC_X_ORIGINAL` list the copies and their originals in the same order (`Y` and `XY` likewise).
pub fn write_inp(mesh: &Mesh, sets: &[NodeSet], path: &Path) -> Result<()> {
    let file = File::create(path).map_err(|e| Error::file(path, e))?;
    let mut out = BufWriter::new(file);
    inp(mesh, sets, &mut out).and_then(|()| out.flush()).map_err(|e| Error::file(path, e))
}

/// Numbers of nodes in the file: originals first, then copies in the order in which elements use them.
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
pub fn inp(mesh: &Mesh, sets: &[NodeSet], out: &mut dyn Write) -> io::Result<()> {
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
    writeln!(out, "*NODE, NSET=ALL_NODES")?;
    let originals = (0..mesh.nodes.len()).map(|node| Seen { node, image: [0, 0] });
    for (i, seen) in originals.chain(numbers.copies.iter().copied()).enumerate() {
        let [x, y, z] = mesh.position(seen);
        writeln!(out, "{}, {x:.9}, {y:.9}, {z:.9}", i + 1)?;
    }
    out.write_all(&elements)?;
    element_groups(mesh, out)?;
    let copies = || numbers.copies.iter().enumerate().map(|(i, seen)| (mesh.nodes.len() + i + 1, *seen));
    for (name, is_there) in [("X", [true, false]), ("Y", [false, true]), ("XY", [true, true])] {
        let own = || copies().filter(|(_, seen)| seen.image.map(|i| i != 0) == is_there);
        node_set(out, &format!("PERIODIC_{name}_COPY"), own().map(|(number, _)| number))?;
        node_set(out, &format!("PERIODIC_{name}_ORIGINAL"), own().map(|(_, seen)| seen.node + 1))?;
    }
    for (name, nodes) in sets {
        node_set(out, &label(name), nodes.iter().map(|node| node + 1))?;
    }
    node_set(out, "YARN_ENDS", yarn_ends(mesh).map(|node| node + 1))?;
    node_set(out, "THREAD_ENDS", thread_ends(mesh).map(|node| node + 1))?;
    let mut known = Vec::new();
    for (i, block) in mesh.blocks.iter().enumerate() {
        solid_section(mesh, i, block, &mut known, out)?;
    }
    for (i, thread) in mesh.threads.iter().enumerate() {
        beam_section(mesh, i, thread, &mut known, out)?;
    }
    Ok(())
}

/// Writes a set of nodes, unless it is empty.
fn node_set(out: &mut dyn Write, name: &str, nodes: impl Iterator<Item = usize>) -> io::Result<()> {
    let numbers: Vec<String> = nodes.map(|n| n.to_string()).collect();
    if !numbers.is_empty() {
        writeln!(out, "*NSET, NSET={name}, UNSORTED")?;
    }
    numbers.chunks(16).try_for_each(|line| writeln!(out, "{}", line.join(", ")))
}

/// A name in the form that decks allow.
fn label(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_uppercase() } else { '_' }).collect()
}

/// Writes sets of the elements of both plies and of the stitch.
fn element_groups(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    let of_ply = |ply: Ply| {
        let own = mesh.blocks.iter().enumerate().filter(move |(_, block)| block.ply == ply);
        own.map(|(i, _)| set("BLOCK", i)).collect::<Vec<_>>()
    };
    let threads = mesh.threads.iter().enumerate();
    let stitch: Vec<String> = threads
        .flat_map(|(i, thread)| {
            slopes(mesh, thread).into_iter().map(move |(slope, _)| format!("{}_{slope}", set("THREAD", i)))
        })
        .collect();
    for (name, members) in [("WARP", of_ply(Ply::Warp)), ("WEFT", of_ply(Ply::Weft)), ("STITCH", stitch)] {
        if !members.is_empty() {
            writeln!(out, "*ELSET, ELSET={name}")?;
        }
        members.chunks(8).try_for_each(|line| writeln!(out, "{}", line.join(", ")))?;
    }
    Ok(())
}

/// Nodes of the cut ends of yarns.
fn yarn_ends(mesh: &Mesh) -> impl Iterator<Item = usize> + '_ {
    let open = mesh.blocks.iter().filter(|block| block.wrap.is_none());
    open.flat_map(|block| {
        let grid = (0..=block.layers).flat_map(move |layer| (0..=block.columns).map(move |column| (column, layer)));
        grid.flat_map(move |(column, layer)| [0, block.slices].map(|slice| block.node(slice, column, layer).node))
    })
}

/// Nodes at the ends of threads.
fn thread_ends(mesh: &Mesh) -> impl Iterator<Item = usize> + '_ {
    let open = mesh.threads.iter().filter(|thread| thread.wrap.is_none());
    open.flat_map(|thread| [thread.first, thread.first + thread.count - 1])
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

/// The flat and the steep beams of a thread, where it has any: the first section axis must not point along the beam, so each kind
/// needs its own.
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
        let kind = if thread.bending > 0.0 { "B31" } else { "T3D2" };
        writeln!(out, "*ELEMENT, TYPE={kind}, ELSET={set}_{name}")?;
        for i in beams {
            let [a, b] = thread.beam(i).map(|n| numbers.of(n));
            writeln!(out, "{}, {a}, {b}", *next + i)?;
        }
    }
    *next += thread.beams();
    Ok(())
}

/// Writes the section of a block, and its material unless another block has written it.
fn solid_section(
    mesh: &Mesh,
    index: usize,
    block: &Block,
    known: &mut Vec<String>,
    out: &mut dyn Write,
) -> io::Result<()> {
    let [a, b, c] = block.fibre;
    // Any second direction not along the fibre completes the orientation.
    let [d, e, f] = if c.abs() > 0.9 { [1.0, 0.0, 0.0] } else { [-b, a, 0.0] };
    let set = set("BLOCK", index);
    let own = |ply: Ply| mesh.blocks.iter().filter(move |other| other.ply == ply);
    let same = own(block.ply).all(|other| other.material == block.material && other.density == block.density);
    let material = match block.ply {
        Ply::Warp if same => "WARP".to_owned(),
        Ply::Weft if same => "WEFT".to_owned(),
        _ => format!("MATERIAL_{set}"),
    };
    writeln!(out, "** {}: local direction 1 is the fibre", block.name)?;
    writeln!(out, "*ORIENTATION, NAME=ORIENTATION_{set}\n{}", numbers(&[a, b, c, d, e, f]))?;
    writeln!(out, "*SOLID SECTION, ELSET={set}, MATERIAL={material}, ORIENTATION=ORIENTATION_{set}")?;
    if known.contains(&material) {
        return Ok(());
    }
    writeln!(out, "*MATERIAL, NAME={material}")?;
    known.push(material);
    match &block.material {
        Material::Charmetant { k_elong_mpa, k_comp_mpa, p_comp, k_dist_mpa, k_sh_mpa, compaction_cap } => {
            let law = [*k_elong_mpa, *k_comp_mpa, *p_comp, *k_dist_mpa, *k_sh_mpa, *compaction_cap];
            writeln!(out, "** at rest, of the hyperelastic law of Charmetant et al. with")?;
            writeln!(out, "** K_elong, K_comp, p_comp, K_dist, K_sh, cap: {}", numbers(&law))?;
            let constants = numbers(&at_rest(&law));
            let (first, last) = constants.rsplit_once(", ").unwrap_or_default();
            writeln!(out, "*ELASTIC, TYPE=ENGINEERING CONSTANTS\n{first},\n{last}")?;
        }
        Material::NeoHookean { young_mpa, poisson } => {
            writeln!(
                out,
                "** at rest, of a compressible neo-Hookean law\n*ELASTIC\n{}",
                numbers(&[*young_mpa, *poisson])
            )?;
        }
    }
    writeln!(out, "*DENSITY\n{}", numbers(&[block.density]))
}

/// Engineering constants at rest of the law of Charmetant et al.: E₁, E₂, E₃, ν₁₂, ν₁₃, ν₂₃, G₁₂, G₁₃, G₂₃.
///
/// With small strains ε its invariants are I_elong = ε₁₁, I_comp = (ε₂₂ + ε₃₃)/2, I_sh² = γ₁₂² + γ₁₃² and
/// I_dist² = ((ε₂₂ − ε₃₃)² + γ₂₃²)/4. Each energy is half a stiffness times its square; for compaction that stiffness is K p c^(p−2) below the cap c.
/// Hence C₂₂ = (K_comp' + K_dist)/4 and C₂₃ = (K_comp' − K_dist)/4. Without a cap the stiffness at rest is zero or infinite; a
/// cap of 0.001 is then used.
fn at_rest(&[elongation, compaction, exponent, distortion, shear, cap]: &[f64; 6]) -> [f64; 9] {
    let cap = if cap > 0.0 { cap } else { 1e-3 };
    let compaction = compaction * exponent * cap.powf(exponent - 2.0);
    let [own, other] = [0.25 * (compaction + distortion), 0.25 * (compaction - distortion)];
    let young = (own * own - other * other) / own;
    [elongation, young, young, 0.0, 0.0, other / own, shear, shear, 0.25 * distortion]
}

/// The numbers of a line. CalculiX reads at most twenty characters of each.
fn numbers(numbers: &[f64]) -> String {
    let short = |x: &f64| {
        let exact = format!("{x:?}");
        if exact.len() > 20 { format!("{x:.12e}") } else { exact }
    };
    numbers.iter().map(short).collect::<Vec<_>>().join(", ")
}

/// Writes the sections of a thread, and its material unless another thread has written it.
fn beam_section(
    mesh: &Mesh,
    index: usize,
    thread: &Thread,
    known: &mut Vec<String>,
    out: &mut dyn Write,
) -> io::Result<()> {
    // EI = E a⁴/12 and EA = E a² give a² = 12 EI/EA
    let side = (12.0 * thread.bending / thread.axial).sqrt();
    let area = if side > 0.0 { side * side } else { std::f64::consts::PI * thread.radius * thread.radius };
    let values = |t: &Thread| [t.radius, t.axial, t.bending, t.linear_density];
    let same = mesh.threads.iter().all(|other| values(other) == values(thread));
    let set = set("THREAD", index);
    let material = if same { "STITCH".to_owned() } else { format!("MATERIAL_{set}") };
    writeln!(
        out,
        "** {}: EA = {} N, EI = {} N mm2, envelope of radius {} mm",
        thread.name, thread.axial, thread.bending, thread.radius
    )?;
    for (name, _) in slopes(mesh, thread) {
        if thread.bending > 0.0 {
            let axis = if name == "FLAT" { "0, 0, -1" } else { "1, 0, 0" };
            writeln!(out, "*BEAM SECTION, SECTION=RECT, ELSET={set}_{name}, MATERIAL={material}")?;
            writeln!(out, "{}\n{axis}", numbers(&[side, side]))?;
        } else {
            writeln!(out, "*SOLID SECTION, ELSET={set}_{name}, MATERIAL={material}\n{}", numbers(&[area]))?;
        }
    }
    if known.contains(&material) {
        return Ok(());
    }
    writeln!(out, "*MATERIAL, NAME={material}\n*ELASTIC\n{}", numbers(&[thread.axial / area, 0.0]))?;
    known.push(material);
    writeln!(out, "*DENSITY\n{}", numbers(&[thread.linear_density / area]))
}
