//! Ties of cut threads: which thread nodes are tied to yarns, and where.

use crate::contact::face::{Patch, closest};
use crate::mesh::surface::Surface;
use crate::mesh::vector::{norm, sub};
use crate::mesh::{Block, Mesh, linking};
use crate::scene::Tie;
use std::collections::BTreeMap;

/// Length of thread, from its end or to either side of a loop apex, within which the node nearest to a yarn is tied, mm.
const REACH: f64 = 2.0;
/// Gap between thread and yarn above which a node is not tied, mm.
const FAR: f64 = 0.3;
/// Distance penalty for the first and last slice of a yarn, where a tie holds less well, mm.
const TIP: f64 = 0.1;

/// A node tied to a face of a yarn.
struct Held {
    node: usize,
    corners: [usize; 4],
    weights: [f64; 4],
    /// Distance from the middle of the thread plus the end-slice penalty, mm.
    far: f64,
}

/// Ties of the cut threads of a piece; ends at the nodes `clamped` are held already.
pub(super) fn ties(mesh: &Mesh, mut clamped: Vec<usize>) -> Vec<Tie> {
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

/// The leading nodes of a run of thread neighbours, within the reach.
fn within(mesh: &Mesh, run: &[usize]) -> Vec<usize> {
    let mut arc = 0.0;
    let far = run.windows(2).take_while(|pair| {
        arc += norm(sub(mesh.nodes[pair[1]], mesh.nodes[pair[0]]));
        arc <= REACH
    });
    let count = far.count() + 1;
    run[..count].to_vec()
}

/// Ties the node of a run that is nearest to a yarn.
fn hold(mesh: &Mesh, radius: f64, run: &[usize], held: &mut BTreeMap<usize, Held>) {
    let places =
        run.iter().flat_map(|&node| mesh.blocks.iter().filter_map(move |block| nearest(mesh, block, node, radius)));
    if let Some(best) = places.min_by(|a, b| a.far.total_cmp(&b.far)) {
        held.insert(best.node, best);
    }
}

/// The closest-point projection of a node onto the surface of a yarn, if it falls inside a face and the node lies in front of it.
fn nearest(mesh: &Mesh, block: &Block, node: usize, radius: f64) -> Option<Held> {
    let at = mesh.nodes[node];
    let surface = Surface::new(block);
    // centre of the section, slice by slice
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
            if point.on_border || point.distance > radius + FAR {
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
