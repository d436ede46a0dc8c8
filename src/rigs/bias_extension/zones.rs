//! The three zones of a bias-extension specimen, defined by how many yarns through a point are clamped: two in zone A, one in
//! zone B, none in zone C.

use crate::measure::Spread;
use crate::measure::crossings::Crossing;
use glam::DVec2;

/// Zone of a point in the reference state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Zone {
    /// Both yarns are clamped: no shear.
    A,
    /// One yarn is clamped: half the shear angle.
    B,
    /// No yarn is clamped: full shear angle.
    C,
}

impl Zone {
    pub fn name(self) -> &'static str {
        match self {
            Self::A => "A",
            Self::B => "B",
            Self::C => "C",
        }
    }
}

/// The free rectangle between the clamps in its reference state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strip {
    /// Centre, mm, and unit direction of the pull.
    pub centre: DVec2,
    pub axis: DVec2,
    /// Length between the clamps along the axis, and width, mm.
    pub length: f64,
    pub width: f64,
}

impl Strip {
    /// Zone of a point whose two yarns have the directions `yarns`.
    pub fn zone(&self, point: DVec2, yarns: [DVec2; 2]) -> Zone {
        let held = yarns.into_iter().filter(|&yarn| self.held(point, yarn)).count();
        [Zone::C, Zone::B, Zone::A][held]
    }

    /// Zone of a point that is at least `margin` (mm, along and across the pull) away from every other zone and from the edges.
    pub fn core(&self, point: DVec2, yarns: [DVec2; 2], margin: f64) -> Option<Zone> {
        let zone = self.zone(point, yarns);
        let along = self.axis * margin;
        let around = [along, -along, along.perp(), -along.perp()].map(|way| point + way);
        let inside = |p: DVec2| {
            let [along, across] = self.place(p);
            along.abs() <= 0.5 * self.length && across.abs() <= 0.5 * self.width && self.zone(p, yarns) == zone
        };
        around.into_iter().all(inside).then_some(zone)
    }

    /// Coordinates along and across the pull, from the centre.
    fn place(&self, point: DVec2) -> [f64; 2] {
        let way = point - self.centre;
        [self.axis.dot(way), self.axis.perp_dot(way)]
    }

    /// Whether the straight yarn through a point meets a clamp.
    fn held(&self, point: DVec2, yarn: DVec2) -> bool {
        let [along, across] = self.place(point);
        let [c, s] = [self.axis.dot(yarn), self.axis.perp_dot(yarn)];
        let meets = |clamp: f64| (across + (clamp - along) * s / c).abs() <= 0.5 * self.width;
        meets(0.5 * self.length) || meets(-0.5 * self.length)
    }
}

/// Spread of a value in zones A, B and C, over the crossings with a zone.
pub fn spreads(crossings: &[Crossing], zones: &[Option<Zone>], value: impl Fn(&Crossing) -> f64 + Copy) -> [Spread; 3] {
    [Zone::A, Zone::B, Zone::C].map(|zone| {
        let own = crossings.iter().zip(zones).filter(move |(_, z)| **z == Some(zone));
        Spread::of(own.map(move |(c, _)| value(c)))
    })
}

/// Spread of the effective shear angle in zones A, B and C, rad.
pub fn angles(crossings: &[Crossing], zones: &[Option<Zone>]) -> [Spread; 3] {
    spreads(crossings, zones, |c| c.angle)
}

/// Zone means over the crossings with a zone; NaN if there are none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Means {
    /// Mean effective shear angle in zones A, B and C, rad, and its standard deviation.
    pub angle: [f64; 3],
    pub angle_std: [f64; 3],
    /// Slip of the plies in zones A, B and C, mm.
    pub slip: [f64; 3],
    /// Sizes of warp and weft in zone C, mm.
    pub width: [f64; 2],
    pub gap: [f64; 2],
    pub broadness: [f64; 2],
    /// Directions of warp and weft in zone C, rad from x.
    pub direction: [f64; 2],
}

impl Means {
    pub fn of(crossings: &[Crossing], zones: &[Option<Zone>]) -> Self {
        let angle = angles(crossings, zones);
        let central =
            |value: fn(&Crossing) -> [f64; 2]| [0, 1].map(|ply| spreads(crossings, zones, |c| value(c)[ply])[2].mean);
        Self {
            angle: angle.map(|a| a.mean),
            angle_std: angle.map(|a| a.std),
            slip: spreads(crossings, zones, Crossing::slipped).map(|s| s.mean),
            width: central(|c| c.width),
            gap: central(|c| c.gap),
            broadness: central(|c| [0, 1].map(|ply| c.width[ply] + c.gap[ply])),
            direction: central(|c| c.direction),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    const DIAGONALS: [DVec2; 2] = [DVec2::ONE, DVec2::new(1.0, -1.0)];

    #[test]
    fn areas_of_the_zones_are_those_of_the_three_zone_theory() {
        let strip = Strip { centre: DVec2::ZERO, axis: DVec2::X, length: 240.0, width: 80.0 };
        let mut counts = [0; 3];
        for i in 0..480 {
            for j in 0..160 {
                // no point lies on a border
                let point = DVec2::new(-119.75 + 0.5 * f64::from(i), -39.9 + 0.5 * f64::from(j));
                counts[strip.zone(point, DIAGONALS) as usize] += 1;
            }
        }
        let area = counts.map(|n| 0.25 * f64::from(n));
        // C: W(2H − 3W)/2, B: W², A: the rest
        for (got, wanted) in area.into_iter().zip([3200.0, 6400.0, 9600.0]) {
            assert!((got - wanted).abs() < 0.01 * wanted, "{area:?}");
        }
    }

    #[test]
    fn means_are_those_of_the_crossings_of_each_zone() {
        let crossing = |angle: f64, gap: f64| Crossing {
            position: DVec3::ZERO,
            angle,
            direction: [0.1, -0.1],
            slip: DVec2::new(0.3, 0.4),
            width: [4.0, 2.0],
            gap: [gap, f64::NAN],
        };
        let crossings = [crossing(0.1, 0.2), crossing(0.5, 0.3), crossing(0.7, 0.5), crossing(9.0, 9.0)];
        let means = Means::of(&crossings, &[Some(Zone::A), Some(Zone::C), Some(Zone::C), None]);
        assert!((means.angle[2] - 0.6).abs() < 1e-15 && (means.angle_std[2] - 0.1).abs() < 1e-15);
        assert!(means.angle[0] == 0.1 && means.angle[1].is_nan() && means.slip[2] == 0.5);
        assert!((means.gap[0] - 0.4).abs() < 1e-15 && (means.broadness[0] - 4.4).abs() < 1e-15);
        assert!(means.gap[1].is_nan() && means.width == [4.0, 2.0] && means.direction == [0.1, -0.1]);
    }

    #[test]
    fn a_turned_strip_has_the_same_zones_and_cores_stay_clear_of_borders() {
        let (centre, axis) = (DVec2::new(3.0, -2.0), DVec2::new(0.6, 0.8));
        let turned = Strip { centre, axis, length: 240.0, width: 80.0 };
        let yarns = DIAGONALS.map(|yarn| axis.rotate(yarn));
        let at = |p: [f64; 2]| centre + axis.rotate(p.into());
        let points =
            [([0.0, 0.0], Zone::C), ([110.0, 5.0], Zone::A), ([80.0, 30.0], Zone::B), ([-100.0, -39.0], Zone::B)];
        for (p, zone) in points {
            assert_eq!(turned.zone(at(p), yarns), zone, "{p:?}");
        }
        assert_eq!(turned.core(at([0.0, 0.0]), yarns, 10.0), Some(Zone::C));
        assert_eq!(turned.core(at([75.0, 0.0]), yarns, 10.0), None);
        assert_eq!(turned.core(at([0.0, 35.0]), yarns, 10.0), None);
    }
}
