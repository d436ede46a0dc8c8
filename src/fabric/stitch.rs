//! Path of a stitching thread: a tricot lap is a loop around the legs of the next loop of its wale, on the weft face, and
//! an underlap across the warp yarn, on the warp face. One lap is generated; the next is its mirror image.

use super::polyline::Polyline;
use super::section::Section;
use crate::case::fabric::{Fabric, Lap, Stitch, Yarn};
use crate::error::{Error, Result};
use crate::kernel::math::smooth;
use crate::mesh::vector::{Vector, between, norm, sub};
use crate::mesh::{Part, Thread, quality};
use libm::{cos, sin};
use std::f64::consts::{FRAC_PI_2, PI};

/// Spacing of the points of a path, mm.
const SPACING: f64 = 0.004;

/// Measures of a fabric from which the path follows, mm.
#[derive(Debug, Clone)]
pub struct Layout {
    pub warp: Section,
    pub weft: Section,
    /// Distance between warps along x and between wefts along y.
    pub pitch: [f64; 2],
    /// Heights of the mid-planes of warps and wefts; the plies meet at z = 0.
    pub middle: [f64; 2],
    /// Half distance between the legs of a loop.
    pub half_legs: f64,
    /// Distance between the axes of two threads, which is the radius of every bend of a thread around another.
    pub bend: f64,
    /// Distance between the axis of a thread and a yarn.
    pub stand_off: f64,
    /// Shift of both legs towards the warp that the thread goes around.
    pub shift: f64,
    /// Length over which the underlap turns out of and into its legs.
    ramp: f64,
    /// Which side of its wale the entry leg takes at the weft: −1 the inner (closed lap), 1 the outer (open lap).
    entry: f64,
}

/// Points of one lap from the top of its entry leg to the top of the next, around a warp at x = 0 from the wale at
/// half a warp pitch, course at y = 0.
#[derive(Debug, Clone)]
pub struct Path {
    pub line: Polyline,
    /// Length of the loop, both legs included, mm; the rest is the underlap.
    pub loop_length: f64,
}

fn section(yarn: &Yarn) -> Section {
    Section { width: yarn.width_mm, thickness: yarn.thickness_mm, truncation: yarn.truncation }
}

/// Points from `from` to `to` along a curve of about the given length.
fn sweep(length: f64, from: f64, to: f64, curve: impl Fn(f64) -> Vector) -> impl Iterator<Item = Vector> {
    let steps = (length.abs() / SPACING).ceil().max(2.0) as usize;
    (0..=steps).map(move |i| curve(from + (to - from) * i as f64 / steps as f64))
}

impl Layout {
    /// Takes the measures from a fabric and refuses those that leave no room for a loop.
    pub fn new(fabric: &Fabric) -> Result<Self> {
        let stitch = &fabric.stitch;
        let [warp, weft] = [section(&fabric.warp), section(&fabric.weft)];
        let pitch = [fabric.warp.pitch_mm, fabric.weft.pitch_mm];
        let stand_off = stitch.radius_mm + stitch.clearance_yarn_mm;
        let gap = pitch[0] - warp.width;
        let layout = Self {
            middle: [fabric.ply_gap_mm / 2.0 + warp.thickness / 2.0, -fabric.ply_gap_mm / 2.0 - weft.thickness / 2.0],
            half_legs: stitch.radius_mm + stitch.clearance_thread_mm / 2.0,
            bend: 2.0 * stitch.radius_mm + stitch.clearance_thread_mm,
            shift: (gap / 2.0 - stand_off).clamp(0.0, stitch.leg_shift_mm),
            ramp: stitch.underlap_ramp_mm,
            entry: match stitch.lap {
                Lap::Closed => -1.0,
                Lap::Open => 1.0,
            },
            warp,
            weft,
            pitch,
            stand_off,
        };
        layout.check(stitch.radius_mm)?;
        Ok(layout)
    }

    fn check(&self, radius: f64) -> Result<()> {
        let advice = "lower fabric.stitch.radius_mm or fabric.stitch.clearance_thread_mm";
        if 2.0 * self.bend >= self.pitch[1] {
            return Err(Error::geometry(
                "fabric.stitch.radius_mm",
                format!(
                    "loops bend with a radius of {:.3} mm (two thread radii and the clearance between threads), which must \
                     be below half of fabric.weft.pitch_mm = {} mm; {advice}",
                    self.bend, self.pitch[1]
                ),
            ));
        }
        let head = 2.0 * (self.half_legs + self.bend + radius);
        if head >= self.pitch[0] {
            return Err(Error::geometry(
                "fabric.stitch.radius_mm",
                format!(
                    "loop heads are {head:.3} mm wide, which must be below fabric.warp.pitch_mm = {} mm; {advice}",
                    self.pitch[0]
                ),
            ));
        }
        Ok(())
    }

    /// Height of the plane of the loop heads: a thread there rests on the weft where the head reaches furthest.
    pub fn head_plane(&self) -> f64 {
        let resting = self.weft.resting_disc(self.bend - self.pitch[1] / 2.0, self.stand_off);
        self.middle[1] - resting.unwrap_or(self.weft.edge() + self.stand_off).max(self.weft.edge())
    }

    /// Angle in the (y, z) plane of the common normal at both ends of the straight piece between the bend of a leg and the
    /// weft: the line that touches both from below.
    pub fn tangent(&self) -> Result<f64> {
        let centre = [self.bend - self.pitch[1] / 2.0, self.head_plane() - self.middle[1]];
        let excess = |angle: f64| {
            self.bend + centre[0] * cos(angle) + centre[1] * sin(angle) - self.stand_off - self.weft.support(angle)
        };
        // Between its two tangents the weft lies inside the half plane of the bend: start there and close in on the lower one.
        let candidates = (0..=64).map(|i| PI * (1.0 + f64::from(i) / 64.0));
        let [mut low, mut high] =
            [candidates.fold(PI, |best, angle| if excess(angle) > excess(best) { angle } else { best }), 2.0 * PI];
        if excess(low) <= 0.0 || excess(high) >= 0.0 {
            return Err(Error::geometry(
                "fabric.weft.thickness_mm",
                format!(
                    "no straight line touches both a weft of {} × {} mm and a loop bent with radius {:.3} mm; lower \
                     fabric.weft.thickness_mm or fabric.stitch.radius_mm",
                    self.weft.width, self.weft.thickness, self.bend
                ),
            ));
        }
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            if excess(middle) > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        Ok(0.5 * (low + high))
    }

    /// Point of a leg that turns around the other one between the height `turn` and the middle of the weft, `t` from 0 to 1.
    fn turning(&self, turn: f64, side: f64, lead: f64, t: f64) -> Vector {
        let share = smooth(t);
        let angle = FRAC_PI_2 * share;
        let xi = side * self.half_legs * sin(angle) - self.shift * (1.0 - share);
        [xi, lead * self.half_legs * cos(angle), turn + (self.middle[1] - turn) * t]
    }

    /// Height where legs begin to turn around each other: a little above the lower corner of the warp, or as far below that
    /// they keep their distance from it, if they then keep it from the weft as well.
    fn turn(&self) -> f64 {
        let corner = |axis: usize, section: &Section| (self.pitch[axis] - section.width) / 2.0;
        let [beside_warp, beside_weft] = [corner(0, &self.warp), corner(1, &self.weft)];
        let [below, above] = [self.middle[0] - self.warp.edge(), self.middle[1] + self.weft.edge()];
        let are_clear = |turn: f64| {
            let leg = (0..=200).map(|i| self.turning(turn, -1.0, 1.0, f64::from(i) / 200.0));
            let [warp, weft] = leg.fold([f64::INFINITY; 2], |[warp, weft], [xi, eta, z]| {
                let from_warp = libm::hypot(beside_warp + xi, (below - z).max(0.0));
                let from_weft = libm::hypot(beside_weft - eta, (z - above).max(0.0));
                [warp.min(from_warp), weft.min(from_weft)]
            });
            [warp, weft].map(|distance| distance >= 0.995 * self.stand_off)
        };
        let first = self.middle[0] - 0.9 * self.warp.edge();
        if are_clear(first)[0] {
            return first;
        }
        let [mut high, mut low] = [first, 0.5 * (below + above)];
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if are_clear(middle)[0] {
                low = middle;
            } else {
                high = middle;
            }
        }
        if are_clear(low) == [true; 2] { low } else { first }
    }

    /// Half of a loop from the top of a leg to the middle of the head, `[ξ, η, z]` with ξ from the wale outwards and η from
    /// the course. `side` is that of the leg along x at the weft, `lead` that along y at the warp.
    fn leg(&self, side: f64, lead: f64) -> Result<Vec<Vector>> {
        let [rho, bend, shift, pitch] = [self.half_legs, self.bend, self.shift, self.pitch[1]];
        let [warp, weft] = self.middle;
        let head = self.head_plane();
        let [top, turn] = [warp + self.warp.edge(), self.turn()];
        let mut path: Vec<Vector> = sweep(top - turn, top, turn, |z| [-shift, lead * rho, z]).collect();
        path.extend(sweep(turn - weft, 0.0, 1.0, |t| self.turning(turn, side, lead, t)));
        path.extend(sweep(weft - head, weft, head, |z| [side * rho, 0.0, z]));
        // The flank of the loop: it widens from the distance of the legs to the width of the head.
        let xi = |eta: f64| side * (rho + bend * smooth((eta - bend) / (pitch - bend)));
        path.extend(self.flank(head)?.into_iter().map(|[eta, z]| [xi(eta), eta, z]));
        path.extend(sweep(bend * FRAC_PI_2, 0.0, FRAC_PI_2, |angle| {
            [side * (rho + bend * cos(angle)), pitch + bend * sin(angle), head]
        }));
        path.push([0.0, pitch + bend, head]);
        Ok(path)
    }

    /// Profile `[η, z]` of a flank: around the previous head, straight to the weft, along it, and level into the head.
    fn flank(&self, head: f64) -> Result<Vec<[f64; 2]>> {
        let [bend, pitch] = [self.bend, self.pitch[1]];
        let normal = self.tangent()?;
        let flat = |eta: f64, z: f64| [eta, z, 0.0];
        let bent = |angle: f64| flat(bend + bend * cos(angle), head + bend * sin(angle));
        let mut profile: Vec<Vector> = sweep(bend * (normal - PI), PI, normal, bent).collect();
        let on_weft = |angle: f64| {
            let [u, v] = self.weft.offset_at(angle, self.stand_off);
            flat(pitch / 2.0 + u, self.middle[1] + v)
        };
        let [start, touch] = [bent(normal), on_weft(normal)];
        profile.extend(sweep(touch[0] - start[0], 0.0, 1.0, |t| between(start, touch, t)));
        let leave = self.weft.half_axes()[0] * self.weft.truncation.min(0.6);
        let last = (2.0 * PI - self.weft.normal_angle(leave)).max(normal);
        profile.extend(sweep(leave, normal, last, on_weft));
        // A cubic from the weft to the head, level there.
        let from = on_weft(last);
        let slope = -cos(last) / sin(last);
        let run = pitch - from[0];
        profile.extend(sweep(run, 0.0, 1.0, |t| {
            let eased = smooth(t);
            let z = (1.0 - eased) * from[1] + eased * head + t * (1.0 - t) * (1.0 - t) * run * slope;
            flat(from[0] + t * run, z)
        }));
        Ok(profile.into_iter().map(|[eta, z, _]| [eta, z]).collect())
    }

    /// Underlap over the warp, with the rise along y spread over its length but for a ramp at either end.
    fn underlap(&self) -> Vec<Vector> {
        let corner = (self.pitch[0] - self.warp.width) / 2.0 - self.shift;
        let curve = Polyline::new(self.warp.offset(self.stand_off, corner).into_iter().map(|[u, v]| [u, 0.0, v]));
        let length = curve.length();
        let ramp = self.ramp.min(0.45 * length);
        let [from, to] = [self.half_legs, self.pitch[1] - self.half_legs];
        let rate = (to - from) / (length - ramp);
        let rise = |s: f64| {
            if s < ramp {
                from + rate * s * s / (2.0 * ramp)
            } else if s > length - ramp {
                to - rate * (length - s) * (length - s) / (2.0 * ramp)
            } else {
                from + rate * (s - ramp / 2.0)
            }
        };
        sweep(length, 0.0, length, |s| {
            let [x, _, z] = curve.at(s);
            [x, rise(s), self.middle[0] + z]
        })
        .collect()
    }

    /// One lap.
    pub fn path(&self) -> Result<Path> {
        let mut points = self.leg(self.entry, -1.0)?;
        points.extend(self.leg(-self.entry, 1.0)?.into_iter().rev());
        for point in &mut points {
            point[0] += self.pitch[0] / 2.0;
        }
        let loop_length = Polyline::new(points.iter().copied()).length();
        points.extend(self.underlap());
        Ok(Path { line: Polyline::new(points), loop_length })
    }
}

impl Path {
    /// Arc lengths of both ends, and part, of every beam of one lap.
    pub fn beams(&self, beams: usize, radius: f64) -> Vec<([f64; 2], Part)> {
        let part = |middle: f64| if middle < self.loop_length { Part::Loop } else { Part::Underlap };
        let ends = self.line.graded(beams, radius);
        ends.windows(2).map(|s| ([s[0], s[1]], part(0.5 * (s[0] + s[1])))).collect()
    }
}

/// Length of a curve between two of its points over their distance, less 1.
pub fn excess(arc: f64, from: Vector, to: Vector) -> f64 {
    arc / norm(sub(to, from)) - 1.0
}

/// A thread of the stitch whose nodes start at `first`, with the part of the lap that each beam belongs to and its
/// [`excess`]; a closed chain if it has a `wrap`.
pub fn thread(stitch: &Stitch, name: String, first: usize, wrap: Option<[i32; 2]>, beams: Vec<(Part, f64)>) -> Thread {
    let (parts, excess): (Vec<Part>, Vec<f64>) = beams.into_iter().unzip();
    Thread {
        name,
        first,
        count: parts.len() + usize::from(wrap.is_none()),
        wrap,
        radius: stitch.radius_mm,
        axial: stitch.young_mpa * PI * stitch.radius_mm * stitch.radius_mm,
        bending: stitch.bending_n_mm2,
        rest_curvature: stitch.rest_curvature,
        linear_density: stitch.linear_density_tex * quality::TONNES_PER_MM_OF_TEX,
        thermal_strain: stitch.thermal_strain,
        velocity: [0.0; 3],
        parts,
        excess,
    }
}
