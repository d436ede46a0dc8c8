//! A curve given by many points, and its division into beams, shorter where it bends.

use crate::mesh::vector::{Vector, between, norm, sub, unit};

/// Points with their arc length.
#[derive(Debug, Clone)]
pub struct Polyline {
    points: Vec<Vector>,
    arc: Vec<f64>,
}

impl Polyline {
    /// Joins the points and drops repeated ones.
    pub fn new(points: impl IntoIterator<Item = Vector>) -> Self {
        let mut line = Self { points: Vec::new(), arc: Vec::new() };
        for point in points {
            let step = line.points.last().map_or(0.0, |&last| norm(sub(point, last)));
            if line.points.is_empty() || step > 1e-9 {
                line.arc.push(line.length() + step);
                line.points.push(point);
            }
        }
        line
    }

    pub fn points(&self) -> &[Vector] {
        &self.points
    }

    /// Total length, mm.
    pub fn length(&self) -> f64 {
        self.arc.last().copied().unwrap_or(0.0)
    }

    /// Point at arc length `s`, clamped to the ends.
    pub fn at(&self, s: f64) -> Vector {
        let next = self.arc.partition_point(|&a| a <= s).clamp(1, self.arc.len() - 1);
        let [from, to] = [self.arc[next - 1], self.arc[next]];
        between(self.points[next - 1], self.points[next], ((s - from) / (to - from)).clamp(0.0, 1.0))
    }

    /// Arc lengths of the `beams + 1` ends of beams. A beam on a curve of curvature κ has the length √(8ε/κ), with a sagitta ε of
    /// 0.04 radii, between 0.8 and 6 radii; all lengths are then scaled to the given number.
    pub fn graded(&self, beams: usize, radius: f64) -> Vec<f64> {
        let [sagitta, shortest, longest, window] = [0.04 * radius, 0.8 * radius, 6.0 * radius, 0.4 * radius];
        let steps = (self.length() / (0.1 * radius)).ceil().max(1.0) as usize;
        let step = self.length() / steps as f64;
        let tangent = |s: f64| unit(sub(self.at(s + 0.5 * step), self.at(s - 0.5 * step)));
        let mut count = vec![0.0];
        for i in 0..steps {
            let s = (i as f64 + 0.5) * step;
            let [before, after] = [(s - window).max(step), (s + window).min(self.length() - step)];
            let curvature = norm(sub(tangent(after), tangent(before))) / (after - before).abs().max(step);
            let length = (8.0 * sagitta / curvature.max(1e-9)).sqrt().clamp(shortest, longest);
            count.push(count[i] + step / length);
        }
        (0..=beams)
            .map(|beam| {
                let wanted = count[steps] * beam as f64 / beams as f64;
                let next = count.partition_point(|&c| c <= wanted).clamp(1, steps);
                let share = (wanted - count[next - 1]) / (count[next] - count[next - 1]);
                step * (next as f64 - 1.0 + share.clamp(0.0, 1.0))
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn length_and_points_of_a_bent_line() {
        let line = Polyline::new([[0.0; 3], [0.0; 3], [3.0, 0.0, 0.0], [3.0, 4.0, 0.0]]);
        assert_eq!(line.length(), 7.0);
        assert_eq!(line.at(5.0), [3.0, 2.0, 0.0]);
        assert_eq!(line.at(9.0), [3.0, 4.0, 0.0]);
    }

    #[test]
    fn beams_are_even_on_a_straight_line_and_short_in_a_bend() {
        let straight = Polyline::new([[0.0; 3], [6.0, 0.0, 0.0]]).graded(6, 0.1);
        for (i, s) in straight.iter().enumerate() {
            assert!((s - i as f64).abs() < 1e-9, "{straight:?}");
        }
        let arc = (0..=100).map(|i| libm::sincos(std::f64::consts::PI * f64::from(i) / 200.0));
        let bent =
            Polyline::new(std::iter::once([0.0, -5.0, 0.0]).chain(arc.map(|(s, c)| [0.2 * (1.0 - c), 0.2 * s, 0.0])));
        let ends = bent.graded(20, 0.1);
        assert_eq!(ends.len(), 21);
        assert!((ends[20] - bent.length()).abs() < 1e-9);
        assert!(ends[1] - ends[0] > 3.0 * (ends[20] - ends[19]), "{ends:?}");
    }
}
