//! Cross-section of a yarn: an ellipse with both tips cut off (Eq. 1 of the paper). Coordinates u across the width and
//! v through the thickness, from the centre, mm.

use crate::kernel::math::smooth;
use libm::{acos, asin, atan2, cos, sin};
use std::f64::consts::PI;

/// A truncated ellipse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// Width between the cuts, mm.
    pub width: f64,
    /// Thickness at the centre, mm.
    pub thickness: f64,
    /// Width between the cuts over the width of the whole ellipse.
    pub truncation: f64,
}

impl Section {
    /// Half axes of the whole ellipse, across the width and through the thickness, mm.
    pub fn half_axes(&self) -> [f64; 2] {
        [self.width / (2.0 * self.truncation), self.thickness / 2.0]
    }

    /// Half thickness at `u`, mm; zero beyond the tips of the whole ellipse.
    pub fn half_thickness(&self, u: f64) -> f64 {
        let [a, b] = self.half_axes();
        b * (1.0 - (u / a) * (u / a)).max(0.0).sqrt()
    }

    /// Half height of the cut faces, mm.
    pub fn edge(&self) -> f64 {
        self.half_thickness(self.width / 2.0)
    }

    /// Area, mm²: the integral of twice the half thickness between the cuts.
    pub fn area(&self) -> f64 {
        let [a, b] = self.half_axes();
        let t = self.truncation;
        2.0 * a * b * (t * (1.0 - t * t).sqrt() + asin(t))
    }

    /// Area of the polygon that `columns` make of the section, mm²: that of its mesh.
    pub fn meshed_area(&self, columns: usize) -> f64 {
        let half = |column: usize| self.half_thickness(self.width * (column as f64 / columns as f64 - 0.5));
        (0..columns).map(|c| self.width / columns as f64 * (half(c) + half(c + 1))).sum()
    }

    /// Nodes of a mesh of `columns × layers` quadrilaterals of equal width: one row per layer boundary, from −v up, each
    /// from −u to +u.
    pub fn grid(&self, columns: usize, layers: usize) -> Vec<Vec<[f64; 2]>> {
        (0..=layers)
            .map(|layer| {
                let share = 2.0 * layer as f64 / layers as f64 - 1.0;
                (0..=columns)
                    .map(|column| {
                        let u = self.width * (column as f64 / columns as f64 - 0.5);
                        [u, share * self.half_thickness(u)]
                    })
                    .collect()
            })
            .collect()
    }

    /// Point of the outline where the outward normal points along `angle`: on the ellipse, or the corner at a cut.
    fn facing(&self, angle: f64) -> [f64; 2] {
        let [a, b] = self.half_axes();
        let [c, s] = [cos(angle), sin(angle)];
        let whole = libm::hypot(a * c, b * s);
        let u = a * a * c / whole;
        let half = self.width / 2.0;
        if u.abs() <= half { [u, b * b * s / whole] } else { [half.copysign(c), self.edge().copysign(s)] }
    }

    /// Point at a distance from the outline, where its outward normal points along `angle`.
    pub fn offset_at(&self, angle: f64, distance: f64) -> [f64; 2] {
        let [u, v] = self.facing(angle);
        [u + distance * cos(angle), v + distance * sin(angle)]
    }

    /// Distance from the centre of the tangent whose outward normal points along `angle`.
    pub fn support(&self, angle: f64) -> f64 {
        let [u, v] = self.facing(angle);
        u * cos(angle) + v * sin(angle)
    }

    /// Angle of the outward normal of the ellipse at `u` on its upper half, 0 to π.
    pub fn normal_angle(&self, u: f64) -> f64 {
        let [a, b] = self.half_axes();
        let theta = acos((u / a).clamp(-1.0, 1.0));
        atan2(sin(theta) / b, cos(theta) / a)
    }

    /// Curve at a distance from the upper half, from the upper corner at +u over the top to the one at −u. It starts and
    /// ends vertically, `corner` beyond the cut faces, turns around the corners with that radius and blends to
    /// `distance` along the top.
    pub fn offset(&self, distance: f64, corner: f64) -> Vec<[f64; 2]> {
        const ARC: usize = 200;
        const TOP: usize = 4000;
        let half = self.width / 2.0;
        let [a, b] = self.half_axes();
        let blend = (0.3 + 4.0 * (corner - distance).abs()).min(0.45 * self.width);
        let start = acos(self.truncation);
        let turn = self.normal_angle(half);
        let mut curve: Vec<[f64; 2]> = (0..ARC)
            .map(|i| turn * i as f64 / ARC as f64)
            .map(|angle| [half + corner * cos(angle), self.edge() + corner * sin(angle)])
            .collect();
        for i in 0..=TOP / 2 {
            let theta = start + (PI / 2.0 - start) * i as f64 / (TOP / 2) as f64;
            let [u, v] = [a * cos(theta), b * sin(theta)];
            let away = distance + (corner - distance) * (1.0 - smooth((half - u) / blend));
            let angle = self.normal_angle(u);
            curve.push([u + away * cos(angle), v + away * sin(angle)]);
        }
        let mirrored: Vec<[f64; 2]> = curve.iter().rev().skip(1).map(|[u, v]| [-u, *v]).collect();
        curve.extend(mirrored);
        curve
    }

    /// Height of the centre of a disc of radius `radius` that rests on the section at `u`, mm; `None` beside the section.
    pub fn resting_disc(&self, u: f64, radius: f64) -> Option<f64> {
        let [mut low, mut high] = [(u - radius).max(-self.width / 2.0), (u + radius).min(self.width / 2.0)];
        if low > high {
            return None;
        }
        // Both terms are concave in the point of contact, so their sum has one maximum.
        let height = |p: f64| self.half_thickness(p) + (radius * radius - (u - p) * (u - p)).max(0.0).sqrt();
        for _ in 0..100 {
            let third = (high - low) / 3.0;
            if height(low + third) < height(high - third) {
                low += third;
            } else {
                high -= third;
            }
        }
        Some(height(0.5 * (low + high)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WARP: Section = Section { width: 4.59, thickness: 0.38, truncation: 0.95 };
    const WEFT: Section = Section { width: 2.08, thickness: 0.38, truncation: 0.95 };

    #[test]
    fn area_is_that_of_the_paper_s_sections() {
        assert!((WARP.area() - 1.4228).abs() < 5e-5, "{}", WARP.area());
        assert!((WEFT.area() - 0.6447).abs() < 5e-5, "{}", WEFT.area());
    }

    #[test]
    fn fine_grids_converge_to_the_closed_form_from_inside() {
        let [coarse, fine] = [WEFT.meshed_area(8), WEFT.meshed_area(4000)];
        assert!(coarse < 0.99 * WEFT.area());
        assert!((fine / WEFT.area() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_disc_rests_on_the_top_and_on_the_corner() {
        let top = WEFT.resting_disc(0.0, 0.1).unwrap();
        assert!((top - 0.29).abs() < 1e-9);
        let corner = WEFT.resting_disc(1.04 + 0.1, 0.1).unwrap();
        assert!((corner - WEFT.edge()).abs() < 1e-6);
        assert_eq!(WEFT.resting_disc(1.2, 0.1), None);
    }

    #[test]
    fn the_offset_keeps_its_distance() {
        let curve = WARP.offset(0.11, 0.11);
        assert!((curve[0][0] - (WARP.width / 2.0 + 0.11)).abs() < 1e-12);
        for p in curve {
            let nearest = (0..=20000)
                .map(|i| WARP.width * (f64::from(i) / 20000.0 - 0.5))
                .map(|u| libm::hypot(p[0] - u, p[1] - WARP.half_thickness(u)))
                .fold(f64::INFINITY, f64::min);
            assert!((nearest - 0.11).abs() < 1e-5, "{p:?} {nearest}");
        }
    }

    #[test]
    fn the_tangent_touches_where_its_normal_points() {
        let angle = 1.3;
        let [u, v] = WEFT.offset_at(angle, 0.0);
        assert!((u * cos(angle) + v * sin(angle) - WEFT.support(angle)).abs() < 1e-12);
        assert!((WEFT.normal_angle(u) - angle).abs() < 1e-12);
        assert!((v - WEFT.half_thickness(u)).abs() < 1e-12);
        let [u, v] = WEFT.offset_at(PI + 0.1, 0.2);
        assert!((u + 1.04 + 0.2 * cos(0.1)).abs() < 1e-12 && (v + WEFT.edge() + 0.2 * sin(0.1)).abs() < 1e-12);
    }
}
