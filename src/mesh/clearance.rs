//! Clearance between threads and their neighbours in the reference position.

use super::vector::{Vector, add, between, dot, norm, scale, sub};
use super::{Block, Mesh, Ply};

/// The smallest gap between the surfaces of a thread and another body, mm; negative where they overlap.
#[derive(Debug, Clone, PartialEq)]
pub struct Clearance {
    pub gap: f64,
    /// Name of the thread.
    pub thread: String,
    /// Name of the yarn or of the other thread.
    pub other: String,
    /// Point on the axis of the thread, mm.
    pub at: Vector,
}

/// Smallest gap between any thread and the yarns of a ply, at `samples` evenly spaced points of each beam (1: its first node).
/// Yarns are straight, so distances are measured to the polygon of their first section; points beyond either end of an open yarn
/// do not count.
pub fn thread_yarn(mesh: &Mesh, ply: Ply, samples: usize) -> Option<Clearance> {
    let outlines: Vec<Outline> = mesh.blocks.iter().filter(|b| b.ply == ply).map(|b| Outline::of(mesh, b)).collect();
    let mut best: Option<Clearance> = None;
    for thread in &mesh.threads {
        for beam in 0..thread.beams() {
            let [a, b] = thread.beam(beam).map(|n| mesh.position(n));
            for sample in 0..samples {
                let at = between(a, b, sample as f64 / samples as f64);
                for outline in &outlines {
                    let limit = best.as_ref().map_or(f64::INFINITY, |c| c.gap) + thread.radius;
                    if let Some(distance) = outline.distance(at, limit) {
                        best = Some(Clearance {
                            gap: distance - thread.radius,
                            thread: thread.name.clone(),
                            other: outline.block.name.clone(),
                            at,
                        });
                    }
                }
            }
        }
    }
    best
}

/// Polygon of the section of a straight yarn.
struct Outline<'a> {
    block: &'a Block,
    /// Period across the yarn; zero for none.
    period: f64,
    centre: [f64; 2],
    /// Half extents of the bounding box.
    half: [f64; 2],
    /// Start and end of an open yarn along the fibre.
    ends: [f64; 2],
    points: Vec<[f64; 2]>,
}

impl<'a> Outline<'a> {
    fn of(mesh: &Mesh, block: &'a Block) -> Self {
        let surface = super::surface::Surface::new(block);
        let mut outline = Self {
            block,
            period: 0.0,
            centre: [0.0; 2],
            half: [0.0; 2],
            ends: [f64::NEG_INFINITY, f64::INFINITY],
            points: Vec::new(),
        };
        outline.points = (0..surface.ring()).map(|r| outline.across(mesh.position(surface.node(r, 0)))).collect();
        if let Some([lx, ly]) = mesh.period {
            outline.period = (lx * block.fibre[1]).abs() + (ly * block.fibre[0]).abs();
        }
        if block.wrap.is_none() {
            let along = |r: usize, slice: usize| dot(mesh.position(surface.node(r, slice)), block.fibre);
            outline.ends = [
                (0..surface.ring()).map(|r| along(r, 0)).fold(f64::INFINITY, f64::min),
                (0..surface.ring()).map(|r| along(r, block.slices)).fold(f64::NEG_INFINITY, f64::max),
            ];
        }
        for axis in 0..2 {
            let [low, high] = outline
                .points
                .iter()
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], p| [l.min(p[axis]), h.max(p[axis])]);
            outline.centre[axis] = 0.5 * (low + high);
            outline.half[axis] = 0.5 * (high - low);
        }
        outline
    }

    /// Coordinates across the fibre and through the thickness.
    fn across(&self, p: Vector) -> [f64; 2] {
        let [fx, fy, _] = self.block.fibre;
        [fx * p[1] - fy * p[0], p[2]]
    }

    /// Signed distance of the nearest periodic image of a point, negative inside, if it is below `limit`.
    fn distance(&self, p: Vector, limit: f64) -> Option<f64> {
        let [mut u, v] = self.across(p);
        if self.period > 0.0 {
            u -= self.period * ((u - self.centre[0]) / self.period).round();
        }
        let beyond = [(u - self.centre[0]).abs() - self.half[0], (v - self.centre[1]).abs() - self.half[1]];
        let along = dot(p, self.block.fibre);
        if beyond[0].max(beyond[1]) >= limit || along < self.ends[0] || along > self.ends[1] {
            return None;
        }
        let mut nearest = f64::INFINITY;
        let mut inside = true;
        for (i, a) in self.points.iter().enumerate() {
            let b = self.points[(i + 1) % self.points.len()];
            let [e, d] = [[b[0] - a[0], b[1] - a[1]], [u - a[0], v - a[1]]];
            let t = ((e[0] * d[0] + e[1] * d[1]) / (e[0] * e[0] + e[1] * e[1])).clamp(0.0, 1.0);
            nearest = nearest.min(libm::hypot(d[0] - t * e[0], d[1] - t * e[1]));
            // Sections are convex and run counter-clockwise.
            inside &= e[0] * d[1] - e[1] * d[0] >= 0.0;
        }
        let signed = if inside { -nearest } else { nearest };
        (signed < limit).then_some(signed)
    }
}

/// A beam: its thread, the arc length at its middle, its length, and the turns of the closed chain by which its image is ahead.
struct Segment {
    ends: [Vector; 2],
    thread: usize,
    arc: f64,
    length: f64,
    turns: i32,
}

/// Smallest gap between two threads, or between two beams of one thread whose nearest ends are further than `arc` apart
/// along it.
pub fn thread_thread(mesh: &Mesh, arc: f64) -> Option<Clearance> {
    let thickest = mesh.threads.iter().map(|t| t.radius).fold(0.0, f64::max);
    let originals = segments(mesh);
    let mut lengths = vec![0.0; mesh.threads.len()];
    originals.iter().for_each(|s| lengths[s.thread] += s.length);
    let images = images(mesh, &originals);
    let low = |s: &Segment| s.ends[0][0].min(s.ends[1][0]);
    let widest = originals.iter().map(|s| (s.ends[1][0] - s.ends[0][0]).abs()).fold(0.0, f64::max);
    let mut best: Option<Clearance> = None;
    let mut gap = f64::INFINITY;
    for a in &originals {
        let radius = mesh.threads[a.thread].radius;
        let reach = |gap: f64| gap + radius + thickest;
        let [start, end] = [low(a), a.ends[0][0].max(a.ends[1][0])];
        let from = images.partition_point(|b| low(b) < start - reach(gap) - widest);
        for b in &images[from..] {
            if low(b) > end + reach(gap) {
                break;
            }
            if (1..3).any(|i| apart(a, b, i) > reach(gap)) {
                continue;
            }
            if a.thread == b.thread {
                let ahead = (b.arc + f64::from(b.turns) * lengths[b.thread] - a.arc).abs();
                // a ring has two ways around it
                let is_ring = mesh.threads[a.thread].wrap == Some([0, 0]);
                let middles = if is_ring { ahead.min(lengths[a.thread] - ahead) } else { ahead };
                if middles - 0.5 * (a.length + b.length) <= arc {
                    continue;
                }
            }
            let [p, q] = closest(a.ends, b.ends);
            let here = norm(sub(p, q)) - radius - mesh.threads[b.thread].radius;
            if here < gap {
                gap = here;
                let name = |s: &Segment| mesh.threads[s.thread].name.clone();
                best = Some(Clearance { gap, thread: name(a), other: name(b), at: p });
            }
        }
    }
    best
}

fn segments(mesh: &Mesh) -> Vec<Segment> {
    let mut all = Vec::with_capacity(mesh.beams());
    for (index, thread) in mesh.threads.iter().enumerate() {
        let mut arc = 0.0;
        for beam in 0..thread.beams() {
            let ends = thread.beam(beam).map(|n| mesh.position(n));
            let length = norm(sub(ends[1], ends[0]));
            all.push(Segment { ends, thread: index, arc: arc + 0.5 * length, length, turns: 0 });
            arc += length;
        }
    }
    all
}

/// The segments and their periodic images that can come near them, sorted by their lower end along x.
fn images(mesh: &Mesh, originals: &[Segment]) -> Vec<Segment> {
    let [lx, ly] = mesh.period.unwrap_or_default();
    let span = i32::from(mesh.period.is_some());
    let mut all = Vec::new();
    for i in -span..=span {
        for j in -span..=span {
            let shift = [f64::from(i) * lx, f64::from(j) * ly, 0.0];
            all.extend(originals.iter().map(|s| {
                // Along a closed chain the next image continues the arc length; sideways it is another thread.
                let [wi, wj] = mesh.threads[s.thread].wrap.unwrap_or_default();
                let turns = wi * i + wj * j;
                let along = if [i, j] == [wi * turns, wj * turns] { turns } else { i32::MAX };
                Segment { ends: s.ends.map(|p| add(p, shift)), thread: s.thread, turns: along, ..*s }
            }));
        }
    }
    let low = |s: &Segment| s.ends[0][0].min(s.ends[1][0]);
    all.sort_by(|a, b| low(a).total_cmp(&low(b)));
    all
}

fn apart(a: &Segment, b: &Segment, axis: usize) -> f64 {
    let range = |s: &Segment| [s.ends[0][axis].min(s.ends[1][axis]), s.ends[0][axis].max(s.ends[1][axis])];
    let [[a0, a1], [b0, b1]] = [range(a), range(b)];
    (b0 - a1).max(a0 - b1)
}

/// Closest points of two segments.
fn closest([p, p1]: [Vector; 2], [q, q1]: [Vector; 2]) -> [Vector; 2] {
    let [d, e, r] = [sub(p1, p), sub(q1, q), sub(p, q)];
    let [dd, ee, de, dr, er] = [dot(d, d), dot(e, e), dot(d, e), dot(d, r), dot(e, r)];
    let denominator = dd * ee - de * de;
    let free = if denominator > 1e-14 * dd * ee { (de * er - dr * ee) / denominator } else { 0.0 };
    let t = ((de * free.clamp(0.0, 1.0) + er) / ee).clamp(0.0, 1.0);
    let s = ((de * t - dr) / dd).clamp(0.0, 1.0);
    [add(p, scale(d, s)), add(q, scale(e, t))]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closest_points_of_crossed_parallel_and_end_to_end_segments() {
        let distance = |a, b| {
            let [p, q] = closest(a, b);
            norm(sub(p, q))
        };
        let x = [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]];
        assert!((distance(x, [[0.3, -1.0, 0.5], [0.3, 2.0, 0.5]]) - 0.5).abs() < 1e-15);
        assert!((distance(x, [[0.5, 0.4, 0.0], [3.0, 0.4, 0.0]]) - 0.4).abs() < 1e-15);
        assert!((distance(x, [[2.0, 0.0, 0.0], [3.0, 1.0, 0.0]]) - 1.0).abs() < 1e-15);
        assert!((distance(x, [[1.6, 0.8, 0.0], [3.0, 5.0, 0.0]]) - 1.0).abs() < 1e-15);
    }
}
