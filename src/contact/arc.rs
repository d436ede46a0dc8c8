//! Contact points of threads with yarns: points along each beam, on the arc that its chord represents.
//!
//! If only the nodes of a chain of chords made contact, an edge would slip through between two nodes that are further apart
//! than the thread is thick. Points at most a radius apart prevent this, and they hinder a thread that slides over the edge
//! less than fewer points would: drawn without friction straight around the side of a yarn in beams of 2.2 radii, it resists
//! with 0.09 of its tension (rms, `tests/physics/drag.rs`).
//!
//! A point at a share s of the chord lies κl² s(1 − s)/2 outside the chord, with l the chord's length and κ the curvature,
//! which follows from the directions of both neighbours and the distances of their midpoints from the beam's. A point is thus
//! carried by four nodes with constant weights.

/// Number of points on a beam of a given length, mm, and radius, mm.
pub fn points(length: f64, radius: f64) -> usize {
    (libm::ceil(length / radius) as usize).max(1)
}

/// Weights of a point at a share of a beam: of its two ends, of the previous node and of the next one. Takes the lengths of the
/// previous beam, the beam and the next beam, mm.
pub fn weights([before, length, behind]: [f64; 3], share: f64) -> [f64; 4] {
    // height over the chord, per radian between the neighbours
    let rise = 0.5 * length * length * share * (1.0 - share) / (0.5 * before + length + 0.5 * behind);
    let (p, q) = (rise / before, rise / behind);
    [1.0 - share + p, share + q, -p, -q]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_of_a_polygon_lie_on_its_circle() {
        let angle: f64 = 0.2;
        let node = |i: f64| [f64::cos(i * angle), f64::sin(i * angle)];
        let length = 2.0 * f64::sin(0.5 * angle);
        for share in [0.1, 0.5, 0.8] {
            let w = weights([length; 3], share);
            let nodes = [node(0.0), node(1.0), node(-1.0), node(2.0)];
            let at = [0, 1].map(|k| (0..4).map(|a| w[a] * nodes[a][k]).sum::<f64>());
            // the middle of the chord is 0.005 inside
            assert!((at[0].hypot(at[1]) - 1.0).abs() < 1e-4);
            assert!((w.iter().sum::<f64>() - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn points_are_at_most_a_radius_apart() {
        assert_eq!([0.09, 0.15, 0.22, 0.39].map(|length| points(length, 0.1)), [1, 2, 3, 4]);
    }
}
