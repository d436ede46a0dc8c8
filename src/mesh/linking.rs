//! Interlocking of the loops of the stitch: Gauss linking numbers of loop heads with the legs of the next loop of their wale.

use super::vector::{Vector, add, cross, dot, norm, scale, sub};
use super::{Mesh, Part, Ply};
use std::f64::consts::PI;

/// Far from every loop, mm.
const FAR: f64 = 1e3;

/// Linking of the head of one loop with the next loop of its wale.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Thread of the head.
    pub head: String,
    /// Thread of the legs.
    pub legs: String,
    /// Linking numbers of the head, closed across its own legs, with the entry and exit leg, each closed far away.
    pub numbers: [f64; 2],
    /// Linking number of the head with the whole next loop: 0, since the stitch is a chain of slip knots.
    pub whole: f64,
}

impl Link {
    /// Whether both legs pass through the head, in opposite directions.
    pub fn holds(&self) -> bool {
        let [entry, exit] = self.numbers.map(|x| x.round() as i64);
        entry.abs() == 1 && exit == -entry && self.whole.round() == 0.0
    }
}

/// Threads and top nodes of the whole loops of an open stitch through whose heads no whole loop passes.
pub fn open_heads(mesh: &Mesh) -> Vec<(usize, usize)> {
    let Some(wale) = wale(mesh) else { return Vec::new() };
    let loops = loops(mesh, wale);
    let open = |head: &&Loop| next(mesh, wale, &loops, head).is_none();
    loops.iter().filter(open).map(|head| (head.thread, head.first + head.apex)).collect()
}

/// Direction of the wales, which run along the warps.
fn wale(mesh: &Mesh) -> Option<Vector> {
    mesh.blocks.iter().find(|b| b.ply == Ply::Warp).map(|b| b.fibre)
}

/// The next loop of the wale, whose legs start nearest to the apex of a head, and the shift of its image, mm.
fn next<'a>(mesh: &Mesh, wale: Vector, loops: &'a [Loop], head: &Loop) -> Option<(&'a Loop, Vector)> {
    let apex = head.nodes[head.apex];
    let image = |l: &Loop| {
        let whole = |k: usize, period: f64| ((apex[k] - l.base[k]) / period).round() * period;
        mesh.period.map_or([0.0; 3], |[lx, ly]| [whole(0, lx), whole(1, ly), 0.0])
    };
    let away = |l: &Loop| {
        let d = sub(apex, add(l.base, image(l)));
        libm::hypot(d[0], d[1])
    };
    let nearest = loops.iter().min_by(|a, b| away(a).total_cmp(&away(b)))?;
    let height = dot(sub(apex, head.base), wale);
    (mesh.period.is_some() || away(nearest) <= 0.5 * height).then(|| (nearest, image(nearest)))
}

/// A whole loop: its nodes, from the top of the entry leg to the top of the exit leg.
struct Loop {
    thread: usize,
    /// First node of an open thread's loop.
    first: usize,
    nodes: Vec<Vector>,
    /// Node furthest along the wale.
    apex: usize,
    /// Midpoint between the tops of its legs.
    base: Vector,
}

/// One entry per loop of a stitched fabric; where threads are cut, per whole loop whose next loop is whole too.
pub fn links(mesh: &Mesh) -> Vec<Link> {
    let Some(wale) = wale(mesh) else { return Vec::new() };
    let loops = loops(mesh, wale);
    let name = |l: &Loop| mesh.threads[l.thread].name.clone();
    let mut links = Vec::new();
    for head in &loops {
        let Some((next, image)) = next(mesh, wale, &loops, head) else { continue };
        let height = dot(sub(head.nodes[head.apex], head.base), wale);
        let above = |p: &Vector| dot(sub(*p, head.base), wale) > 0.5 * height;
        let closed: Vec<Vector> = head.nodes.iter().copied().filter(above).collect();
        let legs: Vec<Vector> = next.nodes.iter().map(|&p| add(p, image)).collect();
        let leg = |nodes: &[Vector]| linking(&closed, &detour(nodes, scale(wale, FAR)));
        let exit: Vec<Vector> = legs[next.apex..].iter().rev().copied().collect();
        // The exit leg is walked backwards so that both start at the warp; along the thread it counts the other way.
        let numbers = [leg(&legs[..=next.apex]), -leg(&exit)];
        links.push(Link { head: name(head), legs: name(next), numbers, whole: linking(&closed, &legs) });
    }
    links
}

fn loops(mesh: &Mesh, wale: Vector) -> Vec<Loop> {
    let mut loops = Vec::new();
    for (index, thread) in mesh.threads.iter().enumerate() {
        let beams = thread.beams();
        let closed = thread.wrap.is_some();
        let starts = (usize::from(!closed)..beams)
            .filter(|&i| thread.parts[i] == Part::Loop && thread.parts[(i + beams - 1) % beams] == Part::Underlap);
        for start in starts {
            let mut nodes = Vec::new();
            let mut beam = start;
            while beam < beams && thread.parts[beam] == Part::Loop {
                nodes.push(mesh.position(thread.beam(beam)[0]));
                beam += 1;
            }
            if beam == beams && !closed {
                continue;
            }
            nodes.push(mesh.position(thread.beam(beam - 1)[1]));
            let height = |i: usize| dot(nodes[i], wale);
            let apex = (0..nodes.len()).fold(0, |best, i| if height(i) > height(best) { i } else { best });
            let [a, b] = [nodes[0], nodes[nodes.len() - 1]];
            let base = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * (a[2] + b[2])];
            loops.push(Loop { thread: index, first: thread.first + start, nodes, apex, base });
        }
    }
    loops
}

/// Closes an open leg by a detour around the fabric: down from its end, far along the wale, up and back to its start.
fn detour(leg: &[Vector], far: Vector) -> Vec<Vector> {
    let [start, end] = [leg[0], leg[leg.len() - 1]];
    let mut closed = leg.to_vec();
    closed.extend([
        [end[0], end[1], -FAR],
        [end[0] + far[0], end[1] + far[1], -FAR],
        [start[0] + far[0], end[1] + far[1], FAR],
        [start[0], start[1], FAR],
    ]);
    closed
}

/// Linking number of two closed polygons: the sum of the signed solid angles that pairs of their segments span, divided by 4π.
/// Exact up to rounding.
pub fn linking(a: &[Vector], b: &[Vector]) -> f64 {
    let mut total = 0.0;
    for (i, &p) in a.iter().enumerate() {
        let q = a[(i + 1) % a.len()];
        for (j, &r) in b.iter().enumerate() {
            let s = b[(j + 1) % b.len()];
            // The differences of points on both segments span a parallelogram: two triangles seen from the origin.
            let corners = [sub(r, p), sub(s, p), sub(s, q), sub(r, q)];
            total += solid_angle(corners[0], corners[1], corners[2]) + solid_angle(corners[0], corners[2], corners[3]);
        }
    }
    total / (4.0 * PI)
}

/// Signed solid angle of a triangle seen from the origin (van Oosterom and Strackee, 1983).
fn solid_angle(a: Vector, b: Vector, c: Vector) -> f64 {
    let [la, lb, lc] = [norm(a), norm(b), norm(c)];
    let volume = dot(a, cross(b, c));
    2.0 * libm::atan2(volume, la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(centre: Vector, upright: bool) -> Vec<Vector> {
        [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[s, t]| add(centre, if upright { [s, 0.0, t] } else { [s, t, 0.0] }))
            .to_vec()
    }

    #[test]
    fn linked_squares_count_one_and_separate_ones_none() {
        let flat = square([0.0; 3], false);
        assert!((linking(&flat, &square([1.0, 0.2, 0.1], true)).abs() - 1.0).abs() < 1e-12);
        assert!(linking(&flat, &square([3.0, 0.2, 0.1], true)).abs() < 1e-12);
        let reversed: Vec<Vector> = flat.iter().rev().copied().collect();
        let other = square([1.0, 0.2, 0.1], true);
        assert!((linking(&flat, &other) + linking(&reversed, &other)).abs() < 1e-12);
    }
}
