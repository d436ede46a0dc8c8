//! Which nodes of cut threads are held at yarns, and where.

use crate::case::Case;
use crate::case::domain::{Domain, ThreadEnds};
use crate::case::effects::Contact;
use crate::contact::face::{Patch, closest};
use crate::fabric::specimen;
use crate::mesh::surface::Surface;
use crate::mesh::vector::{norm, sub};
use crate::mesh::{Block, Mesh, linking};
use std::collections::BTreeMap;

/// Length of thread, from its end or to either side of the top of a loop, of which the node nearest to a yarn is held, mm.
const REACH: f64 = 2.0;
/// Gap between thread and yarn above which it is not held, mm.
const FAR: f64 = 0.3;
/// A yarn holds worse in its first and last slice: as if it were further away by this, mm.
const TIP: f64 = 0.1;

/// Tables of ties, see [`crate::contact::tie`].
#[derive(Default)]
pub struct Ties {
    /// Held node and corners of each tie.
    pub nodes: Vec<u32>,
    /// Weights of the corners and stiffness, N/mm, of each tie.
    pub values: Vec<f64>,
}

/// A node at a face of a yarn.
struct Held {
    node: usize,
    corners: [usize; 4],
    weights: [f64; 4],
    /// Distance from the middle of the thread, and the allowance for tips, mm.
    far: f64,
}

impl Ties {
    /// Ties of a case; none but in a specimen whose cut threads are held.
    pub fn new(case: &Case, mesh: &Mesh, contact: &Contact) -> Self {
        let Domain::Specimen(specimen) = &case.domain else { return Self::default() };
        if specimen.thread_ends == ThreadEnds::Free {
            return Self::default();
        }
        let mut clamped = specimen::clamped(specimen, mesh).concat();
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
        let mut ties = Self::default();
        for Held { node, corners, weights, .. } in held.into_values() {
            ties.nodes.push(node as u32);
            ties.nodes.extend(corners.map(|n| n as u32));
            ties.values.extend(weights.into_iter().chain([contact.tie_n_mm]));
        }
        ties
    }

    /// Number of ties.
    pub fn count(&self) -> usize {
        self.nodes.len() / crate::contact::tie::NODES
    }
}

/// Nodes of threads that a case ties to yarns.
pub fn tied(case: &Case, mesh: &Mesh) -> Vec<usize> {
    let ties = case.effects.contact.as_ref().map(|contact| Ties::new(case, mesh, contact));
    let nodes = ties.map_or_else(Vec::new, |ties| ties.nodes);
    nodes.chunks_exact(crate::contact::tie::NODES).map(|tie| tie[0] as usize).collect()
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
