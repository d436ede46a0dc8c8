//! Yarns in plan view (along z), and the distance from an edge of one to the facing edge of the next.
//!
//! Boxes around an outline, and around runs of segments of its edges, rule out most segments. A box is larger than what it holds
//! by far more than rounding, and a box with NaN rules out nothing: the search returns the bits of a search of all segments.

use crate::mesh::frame::Frame;
use crate::mesh::{Block, Mesh, Seen};
use glam::{DVec2, DVec3, Vec3Swizzles};

/// Range of the periodic images searched, in cells to each side.
const REACH: i32 = 2;
/// Segments in a box.
const RUN: usize = 8;
/// Margin at the ends of a segment, as a share of it, so that rounding does not lose the seam between two images of a chain.
const MARGIN: f64 = 1e-9;
/// Margin around a box, as a share of its size, of its coordinates and of its distance: covers [`MARGIN`] and rounding.
const SLACK: f64 = 1e-6;

/// A yarn in plan view: centreline and edges at slice boundaries 0 ..= slices, mm.
pub(super) struct Outline {
    centre: Vec<DVec2>,
    normal: Vec<DVec2>,
    /// Outermost nodes on the −n and on the +n side.
    edges: [Vec<DVec2>; 2],
    /// Unit vector along the sides of the boxes: from the first section to the last.
    axis: DVec2,
    /// Box around both edges, and boxes around each [`RUN`] segments of each edge.
    whole: Rect,
    runs: [Vec<Rect>; 2],
}

/// A yarn that may be next to another one, in some periodic images.
pub(super) struct Neighbour<'a> {
    outline: &'a Outline,
    /// Displacements of the images, mm.
    shifts: Vec<DVec2>,
}

/// The ray on which a gap is measured; it also reaches back, to `least` < 0.
struct Ray {
    start: DVec2,
    n: DVec2,
    /// Crossings at this distance or less do not count, mm.
    least: f64,
}

/// A box with sides along the axis of its outline and across, mm.
struct Rect {
    middle: DVec2,
    /// Half of the length and of the width.
    half: DVec2,
}

/// Displacements of all periodic images searched, mm; a single zero for a free scene.
pub(super) fn shifts(mesh: &Mesh, frame: &Frame) -> Vec<DVec2> {
    let reach = if mesh.period.is_some() { REACH } else { 0 };
    (-reach..=reach)
        .flat_map(|i| (-reach..=reach).map(move |j| [i, j]))
        .map(|image| DVec3::from(frame.shift(mesh.period.unwrap_or_default(), image)).xy())
        .collect()
}

/// Neighbours of block `index`: all blocks of its ply in all images, except itself where it is.
pub(super) fn neighbours<'a>(
    mesh: &Mesh,
    outlines: &'a [Outline],
    shifts: &[DVec2],
    index: usize,
) -> Vec<Neighbour<'a>> {
    let neighbour = |other: usize| {
        let elsewhere = |shift: &DVec2| other != index || *shift != DVec2::ZERO;
        Neighbour { outline: &outlines[other], shifts: shifts.iter().copied().filter(elsewhere).collect() }
    };
    (0..mesh.blocks.len()).filter(|&other| mesh.blocks[other].ply == mesh.blocks[index].ply).map(neighbour).collect()
}

impl Outline {
    pub(super) fn of(mesh: &Mesh, frame: &Frame, block: &Block) -> Self {
        let place = |seen: Seen| DVec3::from(frame.position(mesh, seen)).xy();
        let mut nodes = Vec::with_capacity((block.slices + 1) * block.lines());
        for s in 0..=block.slices {
            nodes.extend(
                (0..=block.layers).flat_map(|k| (0..=block.columns).map(move |j| block.node(s, j, k))).map(place),
            );
        }
        let sections: Vec<&[DVec2]> = nodes.chunks_exact(block.lines()).collect();
        let centre: Vec<DVec2> = sections.iter().map(|s| s.iter().sum::<DVec2>() / s.len() as f64).collect();
        // Across the seam of a closed yarn, the section before the first is the last but one, one period back.
        let turn = centre[block.slices] - centre[0];
        let tangent = |s: usize| {
            let last = block.slices;
            match block.wrap {
                Some(_) if s == 0 || s == last => centre[1] - centre[last - 1] + turn,
                _ => centre[(s + 1).min(last)] - centre[s.saturating_sub(1)],
            }
        };
        let normal: Vec<DVec2> = (0..=block.slices).map(tangent).map(turned).collect();
        let edge = |sign: f64| -> Vec<DVec2> {
            (0..=block.slices).map(|s| outermost(sections[s], normal[s], sign).unwrap_or(centre[s])).collect()
        };
        let edges = [edge(-1.0), edge(1.0)];
        let axis = turn.normalize_or(DVec2::X);
        let whole = Rect::around(edges.iter().flatten(), axis);
        // neighbouring runs share a point
        let run = |chain: &[DVec2], first: usize| Rect::around(chain[first..].iter().take(RUN + 1), axis);
        let runs = [0, 1].map(|side| (0..block.slices).step_by(RUN).map(|first| run(&edges[side], first)).collect());
        Self { centre, normal, edges, axis, whole, runs }
    }

    /// Extent along n at a station.
    pub(super) fn width(&self, s: usize) -> f64 {
        (self.edges[1][s] - self.edges[0][s]).dot(self.normal[s])
    }

    /// Gap from the +n edge at a station to the nearest facing edge beyond the centre of its own section; NaN if there is none.
    ///
    /// An edge counts only if it faces this one where the ray crosses it first.
    pub(super) fn gap(&self, s: usize, neighbours: &[Neighbour]) -> f64 {
        let (edge, n) = (self.edges[1][s], self.normal[s]);
        let least = (self.centre[s] - edge).dot(n);
        let mut nearest = f64::NAN;
        for Neighbour { outline: other, shifts } in neighbours {
            let slant = DVec2::new(other.axis.dot(n).abs(), other.axis.perp_dot(n).abs());
            for shift in shifts {
                let ray = Ray { start: edge - *shift, n, least };
                if !other.whole.may_cross(&ray, slant, nearest) {
                    continue;
                }
                for (side, sign) in [(0, 1.0), (1, -1.0)] {
                    if let Some((gap, segment)) = other.crossing(side, &ray, slant, nearest)
                        && sign * n.dot(other.normal[segment]) > 0.0
                    {
                        nearest = gap.min(nearest);
                    }
                }
            }
        }
        nearest
    }

    /// Distance at which a ray first crosses an edge, and the crossed segment, if that is no further than `most`; beyond it,
    /// some crossing or none. NaN sets no limit.
    fn crossing(&self, side: usize, ray: &Ray, slant: DVec2, most: f64) -> Option<(f64, usize)> {
        let along = |p: DVec2| (p - ray.start).perp_dot(ray.n);
        let across = |p: DVec2| (p - ray.start).dot(ray.n);
        let mut nearest: Option<(f64, usize)> = None;
        for (run, rect) in self.runs[side].iter().enumerate() {
            if !rect.may_cross(ray, slant, nearest.map_or(most, |(distance, _)| distance.min(most))) {
                continue;
            }
            let first = run * RUN;
            let mut a = along(self.edges[side][first]);
            for (i, ends) in self.edges[side][first..].windows(2).take(RUN).enumerate() {
                let b = along(ends[1]);
                let margin = MARGIN * (b - a).abs();
                if a.min(b) <= margin && a.max(b) >= -margin && margin > 0.0 {
                    let distance = across(ends[0]) + (across(ends[1]) - across(ends[0])) * a / (a - b);
                    let closer = nearest.is_none_or(|(known, _)| distance.total_cmp(&known).is_lt());
                    if distance > ray.least && closer {
                        nearest = Some((distance, first + i));
                    }
                }
                a = b;
            }
        }
        nearest
    }
}

impl Rect {
    /// The box around some points; NaN points are ignored, since no ray crosses a segment that ends there.
    fn around<'a>(points: impl Iterator<Item = &'a DVec2>, axis: DVec2) -> Self {
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for p in points {
            let place = DVec2::new(axis.dot(*p), axis.perp_dot(*p));
            (low, high) = (place.min(low), place.max(high));
        }
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let slack = SLACK * (half.x + half.y + middle.x.abs() + middle.y.abs());
        Self { middle: middle.x * axis + middle.y * axis.perp(), half: half + slack }
    }

    /// Whether a ray may cross something in this box beyond its least distance and no further than `most`. `slant` has the sizes
    /// of the components of the axis along the ray and across. NaN sets no limit.
    fn may_cross(&self, ray: &Ray, slant: DVec2, most: f64) -> bool {
        let to = self.middle - ray.start;
        let (across, along) = (to.dot(ray.n), to.perp_dot(ray.n).abs());
        let slack = SLACK * (to.x.abs() + to.y.abs());
        let depth = self.half.x * slant.x + self.half.y * slant.y + slack;
        let breadth = self.half.x * slant.y + self.half.y * slant.x + slack;
        !(along > breadth || across + depth < ray.least || across - depth > most)
    }
}

/// The last of the points that reach furthest along `sign` n.
fn outermost(points: &[DVec2], n: DVec2, sign: f64) -> Option<DVec2> {
    let reaches = points.iter().map(|p| (sign * p.dot(n), *p));
    reaches.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, p)| p)
}

/// Unit vector at +90° to `v`.
fn turned(v: DVec2) -> DVec2 {
    v.perp() / v.x.hypot(v.y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::shear::trellis;
    use crate::mesh::sample;

    /// The gap by a search of all segments.
    fn plain(own: &Outline, s: usize, neighbours: &[Neighbour]) -> f64 {
        let (edge, n) = (own.edges[1][s], own.normal[s]);
        let least = (own.centre[s] - edge).dot(n);
        let mut nearest = f64::NAN;
        for (other, shift) in neighbours.iter().flat_map(|n| n.shifts.iter().map(|shift| (n.outline, *shift))) {
            for (chain, side) in other.edges.iter().zip([1.0, -1.0]) {
                let facing = |segment: usize| side * n.dot(other.normal[segment]) > 0.0;
                if let Some((gap, segment)) = first(chain, edge - shift, n, least)
                    && facing(segment)
                {
                    nearest = gap.min(nearest);
                }
            }
        }
        nearest
    }

    fn first(chain: &[DVec2], start: DVec2, n: DVec2, least: f64) -> Option<(f64, usize)> {
        let along = |p: DVec2| (p - start).perp_dot(n);
        let across = |p: DVec2| (p - start).dot(n);
        let crossing = |(i, ends): (usize, &[DVec2])| {
            let (a, b) = (along(ends[0]), along(ends[1]));
            let margin = MARGIN * (b - a).abs();
            let crosses = a.min(b) <= margin && a.max(b) >= -margin && margin > 0.0;
            let distance = crosses.then(|| across(ends[0]) + (across(ends[1]) - across(ends[0])) * a / (a - b))?;
            (distance > least).then_some((distance, i))
        };
        chain.windows(2).enumerate().filter_map(crossing).min_by(|x, y| x.0.total_cmp(&y.0))
    }

    /// Number of gaps, and of gaps that are NaN, after a comparison with the plain search, bit by bit.
    fn compare(mesh: &Mesh, frame: &Frame) -> [usize; 2] {
        let outlines: Vec<Outline> = mesh.blocks.iter().map(|b| Outline::of(mesh, frame, b)).collect();
        let shifts = shifts(mesh, frame);
        let mut count = [0; 2];
        for (index, outline) in outlines.iter().enumerate() {
            let neighbours = neighbours(mesh, &outlines, &shifts, index);
            for s in 0..mesh.blocks[index].slices {
                let (quick, all) = (outline.gap(s, &neighbours), plain(outline, s, &neighbours));
                assert!(quick.to_bits() == all.to_bits() || quick.is_nan() && all.is_nan(), "{quick} {all}");
                count = [count[0] + 1, count[1] + usize::from(all.is_nan())];
            }
        }
        count
    }

    #[test]
    fn boxes_hide_no_crossing_of_wavy_yarns() {
        let mut seed = 1_u64;
        let mut random = |size: f64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            size * ((seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0)
        };
        let mut seen = [0; 2];
        for trial in 0..60_u8 {
            let mut mesh = sample::plies();
            let closed = trial % 3 > 0;
            if !closed {
                mesh.period = None;
                for block in &mut mesh.blocks {
                    (block.wrap, block.slices) = (None, block.slices - 1);
                }
            }
            let mut frame = sample::frame(&mesh, trellis(random(1.2)));
            let (noise, wave) = (random(0.3) * f64::from(trial % 2), random(1.0));
            let (waves, away) = (random(2.0), DVec2::new(random(200.0), random(200.0)));
            for p in &mut frame.positions {
                let [x, y, _] = *p;
                p[0] += wave * (waves * y).sin() + random(noise) + away.x;
                p[1] += wave * (waves * x).cos() + random(noise) + away.y;
            }
            if trial % 5 == 0 {
                for _ in 0..20 {
                    let node = (random(0.5).abs() * frame.positions.len() as f64) as usize;
                    frame.positions[node][usize::from(trial % 2)] = f64::NAN;
                }
            }
            let count = compare(&mesh, &frame);
            seen = [seen[0] + count[0], seen[1] + count[1]];
        }
        assert!(0 < seen[1] && seen[1] < seen[0] / 2, "gaps, and gaps without a value: {seen:?}");
    }

    #[test]
    fn boxes_hide_no_crossing_of_straight_yarns() {
        let mesh = sample::plies();
        for degrees in [-60.0_f64, 0.0, 45.0] {
            let [all, empty] = compare(&mesh, &sample::frame(&mesh, trellis(degrees.to_radians())));
            assert!(all > 0 && empty == 0);
        }
    }
}
