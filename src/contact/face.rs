//! A face of a structured surface seen from a slave point: closest point on a bilinear patch, and the walk over the surface.

use super::{Body, shift};
use crate::kernel::lane::Real;
use crate::kernel::node::{Displacements, Lattice};
use crate::kernel::vector::{Vector, add, apply, cross, dot, fma, norm, scale, sub};

/// Geometry that all faces share. Without `PERIODIC` there are no images, and bodies are open.
pub struct Surface<'a, R, const PERIODIC: bool> {
    pub bodies: &'a [Body],
    /// First node of the fibre line at each ring position of each body.
    pub ring_lines: &'a [u32],
    pub reference: Lattice<'a>,
    pub displacement: Displacements<'a, R>,
    /// F̄ − I.
    pub gradient: &'a [[R; 3]; 3],
    /// Periods in quanta.
    pub period: [i32; 2],
}

/// Where on a surface: ring position, and slice counted on through periodic images.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    pub ring: i32,
    pub slice: i32,
}

/// The corners of a face relative to the slave: in the reference and now, in the order (r, s), (r, s+1), (r+1, s+1), (r+1, s).
#[derive(Clone, Copy)]
pub struct Corners<R> {
    pub nodes: [usize; 4],
    pub reference: [Vector<R>; 4],
    pub current: [Vector<R>; 4],
}

/// The point of a face closest to the slave.
#[derive(Clone, Copy)]
pub struct Closest<R> {
    /// Coordinates on the face, −1 to 1: along the slice and along the ring.
    pub xi: R,
    pub eta: R,
    /// From the closest point to the slave, mm.
    pub offset: Vector<R>,
    pub distance: R,
    /// Outward unit normal of the face there.
    pub normal: Vector<R>,
    /// Whether the point lies inside the face rather than on its border.
    pub interior: bool,
}

/// Where a walk has come to: a face, its corners and the point closest to the slave.
pub type Walked<R> = (Place, Corners<R>, Closest<R>);

impl<R: Real, const PERIODIC: bool> Surface<'_, R, PERIODIC> {
    /// A node of a body's surface, and its image shift in quanta.
    #[inline(always)]
    pub fn node(&self, body: usize, image: [i32; 2], place: Place) -> (usize, [i32; 2]) {
        let (station, shift) = self.station(body, image, place.slice);
        (self.line(body, place.ring) + station, shift)
    }

    /// The first node of the fibre line at a ring position, which may be counted on around the ring.
    #[inline(always)]
    fn line(&self, body: usize, ring: i32) -> usize {
        let b = &self.bodies[body];
        // hardly ever divides
        let ring = if (ring as u32) < b.ring { ring as u32 } else { ring.rem_euclid(b.ring as i32) as u32 };
        self.ring_lines[(b.ring_start + ring) as usize] as usize
    }

    /// The place of a slice on fibre lines, and its image shift in quanta.
    #[inline(always)]
    fn station(&self, body: usize, image: [i32; 2], slice: i32) -> (usize, [i32; 2]) {
        let (mut image, mut slice) = (image, slice);
        if self.is_closed(body) {
            let b = &self.bodies[body];
            let turns = slice.div_euclid(b.slices as i32);
            slice -= turns * b.slices as i32;
            image = [image[0] + turns * b.wrap[0], image[1] + turns * b.wrap[1]];
        }
        (slice as usize, shift::<PERIODIC>(self.period, image))
    }

    /// Whether a slice of faces is on a body.
    #[inline(always)]
    fn has_slice(&self, body: usize, slice: i32) -> bool {
        self.is_closed(body) || (0..self.bodies[body].slices as i32).contains(&slice)
    }

    /// Whether the last slice of a body is followed by the first.
    #[inline(always)]
    pub fn is_closed(&self, body: usize) -> bool {
        PERIODIC && self.bodies[body].closed == 1
    }

    /// Whether a face is in the first or last slice of an open body.
    #[inline(always)]
    pub fn is_end(&self, body: usize, place: Place) -> bool {
        !(self.has_slice(body, place.slice - 1) && self.has_slice(body, place.slice + 1))
    }

    /// Whether the point closest to a slave is on the rim of an open end.
    #[inline(always)]
    pub fn is_rim(&self, body: usize, place: Place, point: &Closest<R>) -> bool {
        let one = R::from_f64(1.0);
        let ahead = point.xi >= one && !self.has_slice(body, place.slice + 1);
        ahead || point.xi <= -one && !self.has_slice(body, place.slice - 1)
    }

    /// Reference and current position of a surface node relative to the slave node.
    #[inline(always)]
    pub fn from_slave(&self, slave: usize, node: usize, shift: [i32; 2]) -> (Vector<R>, Vector<R>) {
        let rest: Vector<R> = self.reference.between(node, slave, shift);
        let affine = if PERIODIC { add(rest, apply(self.gradient, rest)) } else { rest };
        (rest, add(affine, self.displacement.between(node, slave)))
    }

    /// The corners of a face.
    #[inline(always)]
    pub fn corners(&self, slave: usize, body: usize, image: [i32; 2], place: Place) -> Corners<R> {
        let zero = [R::from_f64(0.0); 3];
        let mut corners = Corners { nodes: [0; 4], reference: [zero; 4], current: [zero; 4] };
        let lines = [self.line(body, place.ring), self.line(body, place.ring + 1)];
        let stations = [self.station(body, image, place.slice), self.station(body, image, place.slice + 1)];
        for (a, (ring, slice)) in [(0, 0), (0, 1), (1, 1), (1, 0)].into_iter().enumerate() {
            let (station, shift) = stations[slice];
            let node = lines[ring] + station;
            corners.nodes[a] = node;
            (corners.reference[a], corners.current[a]) = self.from_slave(slave, node, shift);
        }
        corners
    }

    /// Walks from a face downhill in distance to the one closest to the slave. Of two faces whose common edge is closest, the
    /// one that the slave is more in front of is taken: behind the other it need not be inside the body.
    #[inline(always)]
    pub fn walk(&self, slave: usize, body: usize, image: [i32; 2], from: Place) -> Walked<R> {
        let b = self.bodies[body];
        let one = R::from_f64(1.0);
        let mut place = from;
        let mut corners = self.corners(slave, body, image, place);
        let mut point = closest(&corners.current);
        for _ in 0..MOST_FACES {
            if point.interior {
                break;
            }
            let mut moved = false;
            for along_ring in [true, false] {
                let coordinate = if along_ring { point.eta } else { point.xi };
                if coordinate.abs() < one {
                    continue;
                }
                let step = if coordinate > R::from_f64(0.0) { 1 } else { -1 };
                let mut next = place;
                if along_ring {
                    next.ring += step;
                } else {
                    next.slice += step;
                    if !self.has_slice(body, next.slice) {
                        continue;
                    }
                }
                let next_corners = self.corners(slave, body, image, next);
                let next_point = closest(&next_corners.current);
                if next_point.better_than(&point) {
                    (place, corners, point, moved) = (next, next_corners, next_point, true);
                    break;
                }
            }
            if !moved {
                break;
            }
        }
        place.ring = place.ring.rem_euclid(b.ring as i32);
        (place, corners, point)
    }

    /// The closest face of all around the slice of one that was found. In front of an open end the two sides of a thin rim may
    /// be as near as each other, and a walk stays on the one that it began on.
    #[inline(always)]
    pub fn around(&self, slave: usize, body: usize, image: [i32; 2], found: Walked<R>) -> Walked<R> {
        let ring = self.bodies[body].ring as i32;
        let mut best = found;
        for step in 1..ring {
            let place = Place { ring: (found.0.ring + step).rem_euclid(ring), ..found.0 };
            best = self.closer(best, slave, body, image, place, near_edge(1, 0));
        }
        best
    }

    /// The closest face of one where a walk has ended and those beside it that rise above it: in front of a fold each of its
    /// sides may be where a walk ends.
    #[inline(always)]
    pub fn beside(&self, slave: usize, body: usize, image: [i32; 2], found: Walked<R>) -> Walked<R> {
        let ring = self.bodies[body].ring as i32;
        let place = found.0;
        let mut best = found;
        for step in [-1, 1] {
            for k in 1..=RING_REACH {
                let next = Place { ring: place.ring + k * step, ..place };
                if k == 1 && !self.rises(slave, body, image, place, next, &found.2) {
                    break;
                }
                best = self.closer(best, slave, body, image, next, near_edge(step, 0));
            }
            let next = Place { slice: place.slice + step, ..place };
            if self.has_slice(body, next.slice) && self.rises(slave, body, image, place, next, &found.2) {
                best = self.closer(best, slave, body, image, next, near_edge(0, step));
            }
        }
        best.0.ring = best.0.ring.rem_euclid(ring);
        best
    }

    /// A face instead of another one if it is closer and not seen from behind; `edge` is the one on the side of that other one.
    #[inline(always)]
    fn closer(
        &self,
        best: Walked<R>,
        slave: usize,
        body: usize,
        image: [i32; 2],
        place: Place,
        edge: [usize; 2],
    ) -> Walked<R> {
        let corners = self.corners(slave, body, image, place);
        // more than what `better_than` takes for a tie
        if is_beyond(&corners.current, edge, best.2.distance * R::from_f64(1.001) + R::from_f64(1e-6)) {
            return best;
        }
        let point = closest(&corners.current);
        if !point.is_behind() && point.better_than(&best.2) { (place, corners, point) } else { best }
    }
}

/// Faces that a thread node can touch at once.
pub const MOST_TOUCHED: usize = 12;
/// Places around the ring that are looked at on either side of the closest face.
const RING_REACH: i32 = 3;

/// Faces of one body within a distance of a slave.
pub struct Near<R> {
    pub count: usize,
    pub faces: [(Corners<R>, Closest<R>); MOST_TOUCHED],
}

impl<R: Real> Near<R> {
    /// No face.
    pub fn none() -> Self {
        let zero = R::from_f64(0.0);
        let corners = Corners { nodes: [0; 4], reference: [[zero; 3]; 4], current: [[zero; 3]; 4] };
        let offset = [zero; 3];
        let point = Closest { xi: zero, eta: zero, offset, distance: zero, normal: offset, interior: false };
        Self { count: 0, faces: [(corners, point); MOST_TOUCHED] }
    }
}

impl<R: Real, const PERIODIC: bool> Surface<'_, R, PERIODIC> {
    /// All faces within `reach` (mm) of the slave, found by spreading from the closest one, which is in the first place of `near`
    /// already; in front of an open end, all around its rim.
    ///
    /// Each keeps its own distance, whether its inside, edge or corner is closest: the sum of their penalties is an energy
    /// without jumps, also where a thread lies in a fold of a crushed surface or passes an edge. The closest face alone
    /// would change its normal there from step to step.
    #[inline(always)]
    pub fn faces_within(&self, slave: usize, body: usize, image: [i32; 2], place: Place, reach: R, near: &mut Near<R>) {
        let first = near.faces[0];
        let b = self.bodies[body];
        let wide = b.ring as i32 > 2 * RING_REACH;
        let (touches_back, touches_on) = borders_within(&first.0, &first.1, reach);
        let steps = [(-1, touches_back.0), (1, touches_on.0)];
        let rim = self.is_rim(body, place, &first.1);
        near.count = 1;
        // around the ring, as long as faces are near; then the same in the slices before and after
        for slice in [0, -1, 1] {
            if !self.has_slice(body, place.slice + slice) {
                continue;
            }
            if slice != 0 {
                let border = if slice < 0 { touches_back.1 } else { touches_on.1 };
                let next = Place { slice: place.slice + slice, ..place };
                if !border && !self.rises(slave, body, image, place, next, &near.faces[0].1) {
                    continue;
                }
                if !self.add_near(near, slave, body, image, next, reach, near_edge(0, slice)) {
                    continue;
                }
            }
            if slice == 0 && rim {
                for k in 1..b.ring as i32 {
                    let next = Place { ring: place.ring + k, ..place };
                    self.add_near(near, slave, body, image, next, reach, near_edge(1, 0));
                }
                continue;
            }
            for (step, border) in steps {
                for k in 1..=if wide { RING_REACH } else { 1 } {
                    let next = Place { ring: place.ring + k * step, slice: place.slice + slice };
                    let beside = Place { slice: place.slice, ..next };
                    if k == 1 && !border && !self.rises(slave, body, image, place, beside, &near.faces[0].1) {
                        break;
                    }
                    if !self.add_near(near, slave, body, image, next, reach, near_edge(step, 0)) {
                        break;
                    }
                }
            }
        }
    }

    /// Adds a face if it is within reach; says whether it is. Where the first one is seen from the front, one that is seen from
    /// behind is the other side of a thin edge. `edge` is the one on the side of those that were looked at before.
    #[inline(always)]
    #[expect(clippy::too_many_arguments)]
    fn add_near(
        &self,
        near: &mut Near<R>,
        slave: usize,
        body: usize,
        image: [i32; 2],
        place: Place,
        reach: R,
        edge: [usize; 2],
    ) -> bool {
        if near.count == MOST_TOUCHED {
            return false;
        }
        let corners = self.corners(slave, body, image, place);
        if is_beyond(&corners.current, edge, reach) {
            return false;
        }
        let point = closest(&corners.current);
        let is_near = point.distance < reach && (near.faces[0].1.is_behind() || !point.is_behind());
        if is_near {
            near.faces[near.count] = (corners, point);
            near.count += 1;
        }
        is_near
    }

    /// Whether the far edge of a neighbouring face lies above the plane of the closest point: only then can the neighbour be
    /// nearer than their common edge.
    #[inline(always)]
    fn rises(&self, slave: usize, body: usize, image: [i32; 2], place: Place, next: Place, point: &Closest<R>) -> bool {
        let (ring, slice) = (next.ring - place.ring, next.slice - place.slice);
        let far = |step: i32| i32::from(step > 0);
        let ends = if ring != 0 {
            [(next.ring + far(ring), next.slice), (next.ring + far(ring), next.slice + 1)]
        } else {
            [(next.ring, next.slice + far(slice)), (next.ring + 1, next.slice + far(slice))]
        };
        let mut rises = false;
        for (ring, slice) in ends {
            let (node, shift) = self.node(body, image, Place { ring, slice });
            let above = add(self.from_slave(slave, node, shift).1, point.offset);
            rises = rises || dot(above, point.normal) > R::from_f64(1e-4);
        }
        rises
    }
}

/// Which borders of a face are within reach of the slave: (ring, slice) on the low and on the high side.
#[inline(always)]
fn borders_within<R: Real>(corners: &Corners<R>, point: &Closest<R>, reach: R) -> ((bool, bool), (bool, bool)) {
    /// Faces are neither flat nor rectangles: their borders may be nearer than they look along the face by this factor.
    const SLANT: f64 = 0.5;
    let p = patch(&corners.current);
    let one = R::from_f64(1.0);
    let room = (reach * reach - point.distance * point.distance).max(R::from_f64(0.0));
    let (slice, ring) = (fma(p[3], point.eta, p[1]), fma(p[3], point.xi, p[2]));
    let within = |gap: R, tangent: Vector<R>| gap * gap * dot(tangent, tangent) * R::from_f64(SLANT * SLANT) < room;
    (
        (within(point.eta + one, ring), within(point.xi + one, slice)),
        (within(one - point.eta, ring), within(one - point.xi, slice)),
    )
}

/// Corners at the ends of the edge that a face shares with the one it is reached from, by a step around the ring or along the
/// slices.
#[inline(always)]
fn near_edge(ring: i32, slice: i32) -> [usize; 2] {
    match (ring, slice) {
        (1, _) => [0, 1],
        (-1, _) => [3, 2],
        (_, 1) => [0, 3],
        _ => [1, 2],
    }
}

/// Whether all of a face is sure to be farther from the slave than `reach` (mm): it lies behind a plane that is so far away,
/// across the direction to the closest point of one of its edges. True of most neighbours of a face that is touched, and
/// much cheaper than their closest points.
#[inline(always)]
fn is_beyond<R: Real>(q: &[Vector<R>; 4], edge: [usize; 2], reach: R) -> bool {
    /// More than rounding moves a distance, as a share of it.
    const ROUNDING: f64 = 1e-4;
    let zero = R::from_f64(0.0);
    let (from, along) = (q[edge[0]], sub(q[edge[1]], q[edge[0]]));
    let share = (-dot(from, along) / dot(along, along)).max(zero).min(R::from_f64(1.0));
    let nearest = fma(along, share, from);
    let square = dot(nearest, nearest);
    let least = dot(q[0], nearest).min(dot(q[1], nearest)).min(dot(q[2], nearest)).min(dot(q[3], nearest));
    least > zero && least * least > reach * reach * square * R::from_f64(1.0 + ROUNDING)
}

/// Faces that a walk passes at most.
const MOST_FACES: usize = 12;

/// Middle and derivatives of a bilinear patch.
#[inline(always)]
fn patch<R: Real>(q: &[Vector<R>; 4]) -> [Vector<R>; 4] {
    let quarter = R::from_f64(0.25);
    let (s01, s23) = (add(q[0], q[1]), add(q[2], q[3]));
    let (d01, d32) = (sub(q[1], q[0]), sub(q[2], q[3]));
    [
        scale(add(s01, s23), quarter),
        scale(add(d01, d32), quarter),
        scale(sub(s23, s01), quarter),
        scale(sub(d32, d01), quarter),
    ]
}

/// Point of a patch.
#[inline(always)]
fn at<R: Real>(p: &[Vector<R>; 4], xi: R, eta: R) -> Vector<R> {
    fma(p[3], xi * eta, fma(p[2], eta, fma(p[1], xi, p[0])))
}

/// Coordinates of the closest point of the unbounded patch to the origin, kept within ±2.
#[inline(always)]
fn project<R: Real>(q: &[Vector<R>; 4]) -> (R, R) {
    let p = patch(q);
    let (zero, two) = (R::from_f64(0.0), R::from_f64(2.0));
    let (mut xi, mut eta) = (zero, zero);
    for _ in 0..3 {
        let (t1, t2) = (fma(p[3], eta, p[1]), fma(p[3], xi, p[2]));
        let r = at(&p, xi, eta);
        let (g11, g12, g22) = (dot(t1, t1), dot(t1, t2), dot(t2, t2));
        let (b1, b2) = (dot(t1, r), dot(t2, r));
        let inverse = R::from_f64(1.0) / (g11 * g22 - g12 * g12).max(R::from_f64(1e-20));
        let (dx, dy) = ((g12 * b2 - g22 * b1) * inverse, (g12 * b1 - g11 * b2) * inverse);
        xi = (xi + dx).min(two).max(-two);
        eta = (eta + dy).min(two).max(-two);
        if dx.abs() + dy.abs() < R::from_f64(1e-4) {
            break;
        }
    }
    (xi, eta)
}

/// The closest point of a face to the origin, where the slave is.
#[inline(always)]
pub fn closest<R: Real>(q: &[Vector<R>; 4]) -> Closest<R> {
    let p = patch(q);
    let one = R::from_f64(1.0);
    let (mut xi, mut eta) = project(q);
    let interior = xi.abs() <= one && eta.abs() <= one;
    if !interior {
        // on the border: best along each edge that the projection left through
        let along_eta = |xi: R| {
            let (o, t) = (fma(p[1], xi, p[0]), fma(p[3], xi, p[2]));
            (-dot(o, t) / dot(t, t)).min(one).max(-one)
        };
        let along_xi = |eta: R| {
            let (o, t) = (fma(p[2], eta, p[0]), fma(p[3], eta, p[1]));
            (-dot(o, t) / dot(t, t)).min(one).max(-one)
        };
        let (cx, cy) = (xi.min(one).max(-one), eta.min(one).max(-one));
        let first = (cx, along_eta(cx));
        let second = (along_xi(cy), cy);
        let square = |(xi, eta): (R, R)| {
            let r = at(&p, xi, eta);
            dot(r, r)
        };
        (xi, eta) = match (xi.abs() > one, eta.abs() > one) {
            (true, false) => first,
            (false, true) => second,
            _ if square(second) < square(first) => second,
            _ => first,
        };
    }
    let offset = scale(at(&p, xi, eta), -one);
    let n = cross(fma(p[3], xi, p[2]), fma(p[3], eta, p[1]));
    let normal = scale(n, one / norm(n).max(R::from_f64(1e-20)));
    Closest { xi, eta, offset, distance: norm(offset), normal, interior }
}

impl<R: Real> Closest<R> {
    /// Height of the slave above the face's tangent plane, mm.
    #[inline(always)]
    pub fn height(&self) -> R {
        dot(self.offset, self.normal)
    }

    /// Whether the slave is behind the inside of the face.
    #[inline(always)]
    pub fn is_behind(&self) -> bool {
        self.interior && self.height() < R::from_f64(0.0)
    }

    /// Whether this point is closer than another, or as close with the slave more in front of its face.
    #[inline(always)]
    fn better_than(&self, other: &Self) -> bool {
        let tie = other.distance * R::from_f64(1e-4) + R::from_f64(1e-7);
        if (self.distance - other.distance).abs() < tie {
            self.height() > other.height() + tie
        } else {
            self.distance < other.distance
        }
    }

    /// Direction in which the slave is pushed, and signed distance of the slave point from the surface, mm; `None` where the
    /// point lies beside the border of a face it has passed under. The middle of a thread is never inside a body: if the
    /// border is closest, it is outside, whatever side of the face's plane it is on.
    ///
    /// The direction is the gradient of the distance, so that contact has an energy: a node behind a fold is pushed to the
    /// fold, not along the normal of either face, where it would rattle between the two and gain energy with every change.
    #[inline(always)]
    pub fn normal_and_distance(&self, is_thread: bool) -> Option<(Vector<R>, R)> {
        let height = self.height();
        if self.interior || self.distance < R::from_f64(1e-6) {
            return Some((self.normal, height));
        }
        let one = R::from_f64(1.0);
        if is_thread || height >= R::from_f64(0.0) {
            return Some((scale(self.offset, one / self.distance), self.distance));
        }
        let is_under = -height > R::from_f64(0.7) * self.distance;
        is_under.then(|| (scale(self.offset, -one / self.distance), -self.distance))
    }

    /// Weights of the four corners.
    #[inline(always)]
    pub fn weights(&self) -> [R; 4] {
        let (one, quarter) = (R::from_f64(1.0), R::from_f64(0.25));
        let (a, b, c, d) = (one - self.xi, one + self.xi, one - self.eta, one + self.eta);
        [quarter * a * c, quarter * b * c, quarter * b * d, quarter * a * d]
    }
}
