//! Crossings of warp and weft: shear and slip of the plies at each crossing, and the gaps next to it.
//!
//! The mid-line of a yarn joins the centroids of its section nodes. In the reference state every pair of mid-lines that cross
//! in the plane (x, y) marks one material point on each yarn. In a deformed state:
//! - the position is the current crossing of the two mid-lines, midway between them in z;
//! - the effective shear angle is the angle between the mid-lines in the reference state minus the current angle. The direction
//!   of a mid-line at a section is the vector from the previous to the next section, linear in between;
//! - the directions are the mid-line directions at the crossing, oriented along the axis of the shear;
//! - the slip is the in-plane distance between the two material points;
//! - widths and gaps are taken from the nearest stations ([`yarns`](super::yarns)).
//!
//! Without slip the effective angle of trellis shear is its γ, and the slip is zero.

use super::Spread;
use super::yarns::Yarn;
use crate::error::{Error, Result};
use crate::mesh::frame::Frame;
use crate::mesh::{Block, Mesh, Ply};
use glam::{DVec2, DVec3, Vec3Swizzles};

/// Range of the periodic images searched, in cells to each side.
const REACH: i32 = 2;
/// Tolerance beyond the ends of a segment, as a share of its length, so that rounding loses no crossing at a joint.
const MARGIN: f64 = 1e-9;

/// A pair of yarns that cross in the reference state.
#[derive(Debug, Clone)]
pub struct Pair {
    /// Indices of the blocks.
    pub warp: usize,
    pub weft: usize,
    /// Crossing in the reference state, mm.
    pub reference: DVec2,
    /// Periodic image of the warp at the crossing, in periods.
    image: [i32; 2],
    /// Positions along warp and weft, in slices.
    at: [f64; 2],
    /// Signs that orient the mid-line directions along the axis, in the reference state.
    signs: [f64; 2],
    /// Relative orientation of warp and weft, and the angle of [`turn`], in the reference state.
    side: f64,
    rest: f64,
}

/// A crossing in a deformed state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Crossing of the mid-lines, mm; NaN if they cross no longer.
    pub position: DVec3,
    /// Effective shear angle, rad; NaN if the mid-lines cross no longer.
    pub angle: f64,
    /// Directions of warp and weft along the axis, rad from x; NaN if the mid-lines cross no longer.
    pub direction: [f64; 2],
    /// Vector from the warp's material point to the weft's, mm.
    pub slip: DVec2,
    /// Width and gap of warp and weft at their nearest stations, mm.
    pub width: [f64; 2],
    pub gap: [f64; 2],
}

/// All crossings of a mesh, ordered by warp, then by weft.
#[derive(Debug, Clone)]
pub struct Crossings {
    pub pairs: Vec<Pair>,
}

impl Crossings {
    /// Crossings of a mesh. Shear is positive if it turns the yarns towards `axis`: the direction of the pull, or the diagonal
    /// (1, 1) of a cell.
    pub fn of(mesh: &Mesh, axis: DVec2) -> Self {
        let frame = Frame { gradient: [[1.0, 0.0], [0.0, 1.0]], positions: mesh.nodes.clone(), ..Frame::default() };
        let lines = midlines(mesh, &frame);
        let mut pairs = Vec::new();
        for (warp, weft) in candidates(mesh) {
            let hits = hits([&lines[warp], &lines[weft]], mesh, &frame);
            let Some(Hit { image, at, place }) = hits.into_iter().min_by(|a, b| a.at[1].total_cmp(&b.at[1])) else {
                continue;
            };
            let directions = [lines[warp].direction(at[0]), lines[weft].direction(at[1])];
            let signs = directions.map(|d| if d.dot(axis) < 0.0 { -1.0 } else { 1.0 });
            let side = (signs[0] * signs[1] * directions[0].perp_dot(directions[1])).signum();
            let rest = turn(directions, signs, side);
            pairs.push(Pair { warp, weft, reference: place, image, at, signs, side, rest });
        }
        Self { pairs }
    }

    /// Measures every crossing in a deformed state; `yarns` are the yarn sizes in that state.
    ///
    /// # Errors
    /// A frame or yarns of another mesh.
    pub fn measure(&self, mesh: &Mesh, frame: &Frame, yarns: &[Yarn]) -> Result<Vec<Crossing>> {
        frame.check(mesh)?;
        if yarns.len() != mesh.blocks.len() {
            let message = format!("sizes of {} yarns where the mesh has {}", yarns.len(), mesh.blocks.len());
            return Err(Error::geometry("crossings", message));
        }
        let lines = midlines(mesh, frame);
        let period = mesh.period.unwrap_or_default();
        let crossing = |pair: &Pair| {
            let both = [&lines[pair.warp], &lines[pair.weft]];
            let shift = DVec3::from(frame.shift(period, pair.image));
            let (a, b) = (both[0].point(pair.at[0]), both[1].point(pair.at[1]));
            let slip = (b - a - shift).xy();
            let off = |hit: &Hit| length(hit.place - b.xy() + 0.5 * slip);
            let hit = hits(both, mesh, frame).into_iter().min_by(|p, q| off(p).total_cmp(&off(q)));
            let now = hit.as_ref().map_or(pair.at, |h| h.at);
            let stations = [(pair.warp, now[0]), (pair.weft, now[1])];
            let nearest = stations.map(|(block, at)| (&yarns[block], station(&mesh.blocks[block], at)));
            let size =
                |values: fn(&Yarn) -> &Vec<f64>| nearest.map(|(y, s)| values(y).get(s).copied().unwrap_or(f64::NAN));
            let nowhere = (DVec3::NAN, f64::NAN, [f64::NAN; 2]);
            let (position, angle, direction) = hit.map_or(nowhere, |Hit { at, place, .. }| {
                let directions = [both[0].direction(at[0]), both[1].direction(at[1])];
                let height = 0.5 * (both[0].point(at[0]).z + both[1].point(at[1]).z);
                let angle = turn(directions, pair.signs, pair.side) - pair.rest;
                let along = [0, 1].map(|ply| (pair.signs[ply] * directions[ply]).to_angle());
                (place.extend(height), angle, along)
            });
            Crossing { position, angle, direction, slip, width: size(|y| &y.width), gap: size(|y| &y.gap) }
        };
        Ok(self.pairs.iter().map(crossing).collect())
    }

    /// A crossing value on every hexahedron, blocks in order: linear along each yarn between its crossings, constant beyond the
    /// first and last, NaN on yarns without crossings.
    pub fn along_yarns(&self, mesh: &Mesh, crossings: &[Crossing], value: impl Fn(&Crossing) -> f64) -> Vec<f64> {
        let mut values = Vec::with_capacity(mesh.hexes());
        for (number, block) in mesh.blocks.iter().enumerate() {
            let mut own: Vec<[f64; 2]> = Vec::new();
            for (pair, crossing) in self.pairs.iter().zip(crossings) {
                let sides = [(pair.warp, pair.at[0]), (pair.weft, pair.at[1])];
                own.extend(sides.iter().filter(|(b, _)| *b == number).map(|(_, at)| [*at, value(crossing)]));
            }
            own.retain(|[_, v]| v.is_finite());
            own.sort_by(|a, b| a[0].total_cmp(&b[0]));
            let slices: Vec<f64> = (0..block.slices).map(|s| between(&own, s as f64 + 0.5)).collect();
            (0..block.columns * block.layers).for_each(|_| values.extend(&slices));
        }
        values
    }
}

/// Value at a position from pairs (position, value) in increasing order: linear between two, constant beyond the first and last.
fn between(points: &[[f64; 2]], at: f64) -> f64 {
    let after = points.partition_point(|p| p[0] < at);
    match (after.checked_sub(1).and_then(|i| points.get(i)), points.get(after)) {
        (Some(a), Some(b)) => a[1] + (b[1] - a[1]) * (at - a[0]) / (b[0] - a[0]),
        (Some(only), None) | (None, Some(only)) => only[1],
        (None, None) => f64::NAN,
    }
}

impl Crossing {
    /// Size of the slip, mm.
    pub fn slipped(&self) -> f64 {
        length(self.slip)
    }
}

/// Spread of the effective shear angle, rad.
pub fn angles<'a>(crossings: impl Iterator<Item = &'a Crossing> + Clone) -> Spread {
    Spread::of(crossings.map(|c| c.angle))
}

/// Spread of the size of the slip, mm.
pub fn slips<'a>(crossings: impl Iterator<Item = &'a Crossing> + Clone) -> Spread {
    Spread::of(crossings.map(Crossing::slipped))
}

/// All warps with all wefts.
fn candidates(mesh: &Mesh) -> impl Iterator<Item = (usize, usize)> {
    let of = move |ply: Ply| (0..mesh.blocks.len()).filter(move |&b| mesh.blocks[b].ply == ply);
    of(Ply::Warp).flat_map(move |warp| of(Ply::Weft).map(move |weft| (warp, weft)))
}

/// 90° minus the angle between two directions oriented along the axis by their signs.
fn turn([a, b]: [DVec2; 2], [p, q]: [f64; 2], side: f64) -> f64 {
    (p * q * a.dot(b)).atan2(side * p * q * a.perp_dot(b))
}

/// Index of the measured station nearest to a position along a block.
fn station(block: &Block, at: f64) -> usize {
    let nearest = at.round().max(0.0) as usize;
    match block.wrap {
        Some(_) => nearest % block.slices,
        None => nearest.clamp(1, block.slices.max(2) - 1) - 1,
    }
}

/// A mid-line at slice boundaries 0 ..= slices, mm.
struct Midline {
    points: Vec<DVec3>,
    /// Not normalised.
    directions: Vec<DVec2>,
    low: DVec2,
    high: DVec2,
}

fn midlines(mesh: &Mesh, frame: &Frame) -> Vec<Midline> {
    mesh.blocks.iter().map(|block| Midline::of(mesh, frame, block)).collect()
}

impl Midline {
    fn of(mesh: &Mesh, frame: &Frame, block: &Block) -> Self {
        let count = block.lines() as f64;
        let section = |s: usize| {
            let nodes = (0..=block.layers).flat_map(|k| (0..=block.columns).map(move |j| block.node(s, j, k)));
            nodes.map(|seen| DVec3::from(frame.position(mesh, seen))).sum::<DVec3>() / count
        };
        let points: Vec<DVec3> = (0..=block.slices).map(section).collect();
        let last = block.slices;
        let along = |a: usize, b: usize| (points[b] - points[a]).xy();
        let direction = |s: usize| match block.wrap {
            // across the seam, the section before the first is the last but one, one period back
            Some(_) if s == 0 || s == last => along(0, 1) + along(last - 1, last),
            _ => along(s.saturating_sub(1), (s + 1).min(last)),
        };
        let directions = (0..=last).map(direction).collect();
        let low = points.iter().fold(DVec2::INFINITY, |low, p| p.xy().min(low));
        let high = points.iter().fold(DVec2::NEG_INFINITY, |high, p| p.xy().max(high));
        Self { low, high, directions, points }
    }

    /// Slice, and share of the slice, at a position along the line.
    fn split(&self, at: f64) -> (usize, f64) {
        let slice = (at.max(0.0) as usize).min(self.points.len() - 2);
        (slice, at - slice as f64)
    }

    fn point(&self, at: f64) -> DVec3 {
        let (s, t) = self.split(at);
        self.points[s] + t * (self.points[s + 1] - self.points[s])
    }

    /// Unit direction at a position.
    fn direction(&self, at: f64) -> DVec2 {
        let (s, t) = self.split(at);
        let [a, b] = [self.directions[s], self.directions[s + 1]].map(unit);
        unit(a + t * (b - a))
    }
}

/// A crossing of two mid-lines.
struct Hit {
    /// Image of the first line.
    image: [i32; 2],
    /// Positions along both lines, in slices.
    at: [f64; 2],
    place: DVec2,
}

/// All crossings of a warp, in its nearby periodic images, with a weft.
fn hits([warp, weft]: [&Midline; 2], mesh: &Mesh, frame: &Frame) -> Vec<Hit> {
    let reach = if mesh.period.is_some() { REACH } else { 0 };
    let images = (-reach..=reach).flat_map(|i| (-reach..=reach).map(move |j| [i, j]));
    let mut found = Vec::new();
    for image in images {
        let shift = DVec3::from(frame.shift(mesh.period.unwrap_or_default(), image)).xy();
        if (warp.high + shift).cmplt(weft.low).any() || (warp.low + shift).cmpgt(weft.high).any() {
            continue;
        }
        for (s, a) in warp.points.windows(2).enumerate() {
            let (p, r) = (a[0].xy() + shift, (a[1] - a[0]).xy());
            for (t, b) in weft.points.windows(2).enumerate() {
                let u = (b[1] - b[0]).xy();
                let between = b[0].xy() - p;
                let area = r.perp_dot(u);
                let [m, n] = [between.perp_dot(u) / area, between.perp_dot(r) / area];
                let inside = -MARGIN..=1.0 + MARGIN;
                if inside.contains(&m) && inside.contains(&n) {
                    found.push(Hit { image, at: [s as f64 + m, t as f64 + n], place: p + m * r });
                }
            }
        }
    }
    found
}

/// Vector length without intermediate overflow.
fn length(v: DVec2) -> f64 {
    v.x.hypot(v.y)
}

fn unit(v: DVec2) -> DVec2 {
    v / length(v)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::shear::{angle_of, trellis};
    use crate::measure::yarns;
    use crate::mesh::sample;

    fn measured(gradient: [[f64; 2]; 2], change: impl Fn(&Mesh, &mut Frame)) -> Vec<Crossing> {
        let mesh = sample::plies();
        let mut frame = sample::frame(&mesh, gradient);
        change(&mesh, &mut frame);
        let yarns = yarns::measure(&mesh, &frame).unwrap();
        Crossings::of(&mesh, DVec2::ONE).measure(&mesh, &frame, &yarns).unwrap()
    }

    #[test]
    fn every_warp_crosses_every_weft_once_a_cell() {
        let mesh = sample::plies();
        let pairs = Crossings::of(&mesh, DVec2::ONE).pairs;
        assert_eq!(pairs.len(), 8);
        for p in pairs {
            let wanted = [-5.0 + 5.0 * p.warp as f64, -3.75 + 2.5 * (p.weft - 2) as f64];
            let off: Vec<f64> = (0..2).map(|k| (p.reference[k] - wanted[k]).rem_euclid(10.0)).collect();
            assert!(off.iter().all(|o| *o < 1e-9 || *o > 10.0 - 1e-9), "{:?} {wanted:?}", p.reference);
        }
    }

    #[test]
    fn an_affine_field_gives_its_angle_at_every_crossing_and_no_slip() {
        let sheared = [-60.0_f64, -5.0, 0.0, 25.0, 70.0].map(|d| trellis(d.to_radians()));
        for gradient in sheared.into_iter().chain([[[1.02, 0.4], [-0.1, 0.9]], [[1.0, 0.3], [0.0, 1.0]]]) {
            let crossings = measured(gradient, |_, _| {});
            assert_eq!(crossings.len(), 8);
            for c in crossings {
                assert!((c.angle - angle_of(gradient)).abs() < 1e-12, "{c:?}");
                // warps run along y, wefts along x
                let images = [1, 0].map(|k| gradient[1][k].atan2(gradient[0][k]));
                let off = [0, 1].map(|ply| (c.direction[ply] - images[ply]).sin().abs());
                assert!(off.iter().all(|o| *o < 1e-12), "{:?} {images:?}", c.direction);
                assert!(c.slipped() < 1e-12 && c.position.is_finite());
            }
        }
        let flat = measured(trellis(0.0), |_, _| {});
        let sizes = |c: &Crossing| [c.width, c.gap].concat();
        let wanted = [4.59, 2.08, 0.41, 0.42];
        assert!(flat.iter().all(|c| sizes(c).iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-12)));
    }

    #[test]
    fn a_ply_that_slides_slips_by_that_and_keeps_its_angle() {
        let slide = |mesh: &Mesh, frame: &mut Frame| {
            let first = mesh.blocks.iter().find(|b| b.ply == Ply::Weft).unwrap().first;
            for p in &mut frame.positions[first..] {
                *p = [p[0] + 0.3, p[1] - 0.4, p[2]];
            }
        };
        for c in measured(trellis(0.5), slide) {
            assert!((c.slipped() - 0.5).abs() < 1e-12 && (c.angle - 0.5).abs() < 1e-12);
            assert!((c.slip[0] - 0.3).abs() < 1e-12);
        }
    }

    #[test]
    fn values_go_linearly_from_crossing_to_crossing_along_each_yarn() {
        let mesh = sample::plies();
        let crossings = measured(trellis(0.2), |_, _| {});
        let all = Crossings::of(&mesh, DVec2::ONE);
        let same = all.along_yarns(&mesh, &crossings, |c| c.angle);
        assert_eq!(same.len(), mesh.hexes());
        assert!(same.iter().all(|a| (a - 0.2).abs() < 1e-12));
        let points = [[1.0, 3.0], [3.0, 7.0]];
        assert_eq!([0.0, 1.0, 1.5, 3.0, 9.0].map(|at| between(&points, at)), [3.0, 3.0, 4.0, 7.0, 7.0]);
        assert!(between(&[], 1.0).is_nan());
    }

    #[test]
    fn yarns_of_another_mesh_are_refused() {
        let mesh = sample::plies();
        let frame = sample::frame(&mesh, trellis(0.0));
        let error = Crossings::of(&mesh, DVec2::ONE).measure(&mesh, &frame, &[]).unwrap_err();
        assert!(error.to_string().contains("0 yarns"));
    }
}
