//! Which nodes of cut threads are held at yarns, and where.

use super::clamps::clamped;
use crate::case::domain::{Specimen, ThreadEnds};
use crate::contact::face::{Patch, closest};
use crate::mesh::surface::Surface;
use crate::mesh::vector::{norm, sub};
use crate::mesh::{Block, Mesh, linking};
use crate::scene::Tie;
use std::collections::BTreeMap;

/// Length of thread, from its end or to either side of the top of a loop, of which the node nearest to a yarn is held, mm.
const REACH: f64 = 2.0;
/// Gap between thread and yarn above which it is not held, mm.
const FAR: f64 = 0.3;
/// A yarn holds worse in its first and last slice: as if it were further away by this, mm.
const TIP: f64 = 0.1;

/// A node at a face of a yarn.
struct Held {
    node: usize,
    corners: [usize; 4],
    weights: [f64; 4],
    /// Distance from the middle of the thread, and the allowance for tips, mm.
    far: f64,
}

/// Ties of a specimen whose cut threads are held; none where its ends are free.
pub(super) fn ties(specimen: &Specimen, mesh: &Mesh) -> Vec<Tie> {
    if specimen.thread_ends == ThreadEnds::Free {
        return Vec::new();
    }
    let mut clamped = clamped(specimen, mesh).concat();
    clamped.sort_unstable();
    let mut held = BTreeMap::new();
    for thread in &mesh.threads {
        let forth: Vec<usize> = (thread.first..thread.first + thread.count).collect();
        let back: Vec<usize> = forth.iter().rev().copied().collect();
        for run in [forth, back].iter().filter(|run| clamped.binary_search(&run[0]).is_err()) {
            hold(mesh, thread.radius, &within(mesh, run), &mut held);
        }
    }
    for (thread, apex) in linking::open_heads(mesh) {
        let thread = &mesh.threads[thread];
        let up: Vec<usize> = (apex..thread.first + thread.count).collect();
        let down: Vec<usize> = (thread.first..=apex).rev().collect();
        let run = [within(mesh, &down), within(mesh, &up)].concat();
        hold(mesh, thread.radius, &run, &mut held);
    }
    held.into_values().map(|Held { node, corners, weights, .. }| Tie { node, corners, weights }).collect()
}

/// The first nodes of a run of neighbours along a thread, as far as the reach.
fn within(mesh: &Mesh, run: &[usize]) -> Vec<usize> {
    let mut arc = 0.0;
    let far = run.windows(2).take_while(|pair| {
        arc += norm(sub(mesh.nodes[pair[1]], mesh.nodes[pair[0]]));
        arc <= REACH
    });
    let count = far.count() + 1;
    run[..count].to_vec()
}

/// Holds the node of a run that is nearest to a yarn.
fn hold(mesh: &Mesh, radius: f64, run: &[usize], held: &mut BTreeMap<usize, Held>) {
    let places =
        run.iter().flat_map(|&node| mesh.blocks.iter().filter_map(move |block| nearest(mesh, block, node, radius)));
    if let Some(best) = places.min_by(|a, b| a.far.total_cmp(&b.far)) {
        held.insert(best.node, best);
    }
}

/// The nearest place for a node on the surface of a yarn, if the node stands in front of the inside of a face.
fn nearest(mesh: &Mesh, block: &Block, node: usize, radius: f64) -> Option<Held> {
    let at = mesh.nodes[node];
    let surface = Surface::new(block);
    // the middle of the section, slice by slice
    let middle = |slice: usize| mesh.nodes[block.line(block.columns / 2, block.layers / 2) + slice];
    let mut best: Option<Held> = None;
    for slice in 0..block.slices {
        let (a, b) = (middle(slice), middle(slice + 1));
        let width = norm(sub(mesh.nodes[block.line(0, 0) + slice], mesh.nodes[block.line(block.columns, 0) + slice]));
        if norm(sub(at, a)).min(norm(sub(at, b))) > width + norm(sub(b, a)) {
            continue;
        }
        for ring in 0..surface.ring() {
            let (next, here) = ((ring + 1) % surface.ring(), ring);
            let corners = [(here, slice), (here, slice + 1), (next, slice + 1), (next, slice)]
                .map(|(ring, slice)| surface.node(ring, slice).node);
            let seen = corners.map(|n| sub(mesh.nodes[n], at));
            let point = closest(&seen, &Patch::new(&seen));
            if !point.interior || point.distance > radius + FAR {
                continue;
            }
            let tip = slice == 0 || slice + 1 == block.slices;
            let far = point.distance + if tip { TIP } else { 0.0 };
            if best.as_ref().is_none_or(|best| far < best.far) {
                best = Some(Held { node, corners, weights: point.weights, far });
            }
        }
    }
    best
}
