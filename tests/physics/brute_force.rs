//! What pushes a point out of bodies, by looking at every face, edge and corner: the answer that contact must give.

use crate::common::norm;
use std::collections::BTreeSet;
use tricot::mesh::Mesh;
use tricot::mesh::surface::Surface;
use tricot::mesh::vector::sub;

/// From the closest point of a bilinear face to a point, by sampling and shrinking.
fn offset(corners: &[[f64; 3]; 4], point: [f64; 3]) -> [f64; 3] {
    let at = |s: f64, t: f64| {
        let w = [(1.0 - s) * (1.0 - t), s * (1.0 - t), s * t, (1.0 - s) * t];
        [0, 1, 2].map(|k| point[k] - (0..4).map(|a| w[a] * corners[a][k]).sum::<f64>())
    };
    let (mut s, mut t, mut step, mut best) = (0.5, 0.5, 0.5, at(0.5, 0.5));
    for _ in 0..40 {
        let (from_s, from_t) = (s, t);
        for i in -4..=4 {
            for j in -4..=4 {
                let here = [from_s + f64::from(i) * 0.25 * step, from_t + f64::from(j) * 0.25 * step];
                let here = here.map(|x: f64| x.clamp(0.0, 1.0));
                let d = at(here[0], here[1]);
                if norm(d) < norm(best) {
                    (best, s, t) = (d, here[0], here[1]);
                }
            }
        }
        step *= 0.6;
    }
    best
}

/// From the closest point of an edge to a point.
fn from_edge([a, b]: [[f64; 3]; 2], point: [f64; 3]) -> [f64; 3] {
    let (along, to) = (sub(b, a), sub(point, a));
    let dot = |x: [f64; 3], y: [f64; 3]| (0..3).map(|k| x[k] * y[k]).sum::<f64>();
    let share = (dot(along, to) / dot(along, along)).clamp(0.0, 1.0);
    [0, 1, 2].map(|k| to[k] - share * along[k])
}

/// What the closed surface of the first block does to a point outside, for each unit of penalty: faces less edges plus corners, each
/// by how deep the point lies in its radius, away from where it is closest, mm.
pub(super) fn push(mesh: &Mesh, places: &[[f64; 3]], point: [f64; 3], radius: f64) -> [f64; 3] {
    let faces = Surface::new(&mesh.blocks[0]).closed();
    let mut sum = [0.0; 3];
    let mut add = |sign: f64, away: [f64; 3]| {
        let depth = (radius - norm(away)).max(0.0);
        sum = [0, 1, 2].map(|k| sum[k] + sign * depth * away[k] / norm(away));
    };
    let (mut edges, mut corners) = (BTreeSet::new(), BTreeSet::new());
    for face in &faces {
        let nodes = face.map(|seen| seen.node);
        add(1.0, offset(&nodes.map(|node| places[node]), point));
        edges.extend((0..4).map(|a| [nodes[a].min(nodes[(a + 1) % 4]), nodes[a].max(nodes[(a + 1) % 4])]));
        corners.extend(nodes);
    }
    edges.into_iter().for_each(|ends: [usize; 2]| add(-1.0, from_edge(ends.map(|node| places[node]), point)));
    corners.into_iter().for_each(|node: usize| add(1.0, sub(point, places[node])));
    sum
}
