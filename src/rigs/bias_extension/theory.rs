//! Theory of the bias-extension test without slip: the shear angle of the central zone, and F_nor from the machine force (Eqs
//! 18 and 19 of Zheng et al.).
//!
//! With D = H − W the machine displacement is d = D(√2 cos(45° − γ/2) − 1) (Eq. 18 solved for d), so dd/dγ = (D/2)(cos γ/2 −
//! sin γ/2). Zone C has the area W(2H − 3W)/2 and the angle γ, zone B the area W² and the angle γ/2. The power balance is
//!
//! F_m (D/2)(cos γ/2 − sin γ/2) = W(2H − 3W)/2 · F_nor(γ) cos γ + ½ W² F_nor(γ/2) cos(γ/2),
//!
//! which, divided by W/2, is Eq. 19.

use crate::error::{Error, Result};
use crate::kernel::record::{Record, Recorded};
use std::f64::consts::{FRAC_PI_2, SQRT_2};

/// A bias-extension specimen: `height` along the pull, at least 3/2 `width`, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bias {
    height: f64,
    width: f64,
}

impl Bias {
    /// A specimen of `height` × `width` mm.
    pub fn new(height: f64, width: f64) -> Result<Self> {
        if width > 0.0 && height >= 1.5 * width && height.is_finite() {
            return Ok(Self { height, width });
        }
        let message = "three zones need a width above 0 and a height of at least 1.5 widths";
        Err(Error::geometry(format!("bias specimen of {height} x {width} mm"), message))
    }

    /// Shear angle of the central zone without slip at a machine `displacement` (Eq. 18); NaN beyond the displacement at which
    /// the yarns would be aligned.
    pub fn angle(&self, displacement: f64) -> f64 {
        let d = self.height - self.width;
        FRAC_PI_2 - 2.0 * ((d + displacement) / (SQRT_2 * d)).acos()
    }

    /// Machine force, N, at `angle` for a law F_nor(γ) in N/mm (Eq. 19 solved for F_m).
    pub fn force(&self, angle: f64, law: impl Fn(f64) -> f64) -> f64 {
        let [own, half, lever] = self.coefficients(angle);
        (own * law(angle) + half * law(0.5 * angle)) / lever
    }

    /// F_nor, N/mm, at every sample `(angle, force)` (Eq. 19). Angles increase and lie between 0 and 90°. F_nor is linear
    /// between samples and 0 at γ = 0, so F_nor(γ/2) involves only samples up to γ: one sweep in increasing angle solves the
    /// implicit equation without iteration.
    pub fn normalised(&self, samples: &[(f64, f64)]) -> Result<Vec<f64>> {
        let mut curve = self.curve();
        let point = |&(angle, force): &(f64, f64)| {
            let (last, _) = curve.known[curve.known.len() - 1];
            if angle > last && angle < FRAC_PI_2 && force.is_finite() {
                return Ok(curve.push(angle, force));
            }
            let what = format!("bias curve, angle {angle} rad with force {force} N");
            Err(Error::geometry(what, format!("angles must rise (last: {last}) and stay below 90 degrees")))
        };
        samples.iter().map(point).collect()
    }

    /// An empty F_nor curve, to be filled sample by sample.
    pub fn curve(self) -> BiasCurve {
        BiasCurve { bias: self, known: vec![(0.0, 0.0)] }
    }

    /// Factors of F_nor(γ), F_nor(γ/2) and F_m in Eq. 19, mm, mm and 1.
    fn coefficients(&self, angle: f64) -> [f64; 3] {
        let (s, c) = (0.5 * angle).sin_cos();
        let Self { height, width } = self;
        [(2.0 * height - 3.0 * width) * angle.cos(), width * c, (height / width - 1.0) * (c - s)]
    }
}

/// F_nor of a bias-extension test, sample by sample, during a run.
#[derive(Debug, Clone)]
pub struct BiasCurve {
    bias: Bias,
    known: Vec<(f64, f64)>,
}

impl BiasCurve {
    /// F_nor, N/mm, at an angle (rad) and machine force (N). A measured angle may stall or fall back for a moment: the result
    /// is NaN unless the angle exceeds all earlier ones and is below 90°.
    pub fn push(&mut self, angle: f64, force: f64) -> f64 {
        let (last, _) = self.known[self.known.len() - 1];
        if !(angle > last && angle < FRAC_PI_2 && force.is_finite()) {
            return f64::NAN;
        }
        let [own, half, lever] = self.bias.coefficients(angle);
        let [own_share, rest] = halfway(&self.known, angle);
        let f = (force * lever - half * rest) / (own + half * own_share);
        self.known.push((angle, f));
        f
    }
}

impl Recorded for BiasCurve {
    fn record(&mut self, record: &mut Record) {
        self.known.record(record);
    }
}

/// F_nor(angle/2) as `[a, b]` in a F_nor(angle) + b, from the samples before `angle`.
fn halfway(known: &[(f64, f64)], angle: f64) -> [f64; 2] {
    let half = 0.5 * angle;
    let next = known.partition_point(|&(a, _)| a < half);
    let (a0, f0) = known[next - 1];
    match known.get(next) {
        Some(&(a1, f1)) => [0.0, f0 + (f1 - f0) * (half - a0) / (a1 - a0)],
        None => {
            let t = (half - a0) / (angle - a0);
            [t, f0 * (1.0 - t)]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bias_angle_at_the_end_of_the_published_test() {
        let bias = Bias::new(240.0, 80.0).unwrap();
        assert!((bias.angle(60.0).to_degrees() - 62.95).abs() < 0.005);
        assert!(bias.angle(0.0).abs() < 1e-15);
        assert!(Bias::new(100.0, 80.0).is_err());
    }

    #[test]
    fn bias_force_of_a_linear_law_and_back() {
        let bias = Bias::new(240.0, 80.0).unwrap();
        let expected = [2.6515, 5.7001, 9.1258, 12.9329, 17.1868];
        let mut samples = Vec::new();
        for (i, wanted) in expected.into_iter().enumerate() {
            let angle = (10.0 * (i + 1) as f64).to_radians();
            let force = bias.force(angle, |a| 0.1 * a);
            assert!((force - wanted).abs() < 5e-5, "{force} for {wanted}");
            samples.push((angle, force));
        }
        for (f, (angle, _)) in bias.normalised(&samples).unwrap().iter().zip(&samples) {
            assert!((f - 0.1 * angle).abs() < 1e-14);
        }
        let mut curve = bias.curve();
        assert!(curve.push(-0.01, 0.0).is_nan() && curve.push(0.0, 1.0).is_nan());
        for &(angle, force) in &samples {
            assert!((curve.push(angle, force) - 0.1 * angle).abs() < 1e-14);
            assert!(curve.push(0.9 * angle, force).is_nan(), "an angle that falls back leaves no trace");
        }
        samples.reverse();
        assert!(bias.normalised(&samples).is_err());
    }

    #[test]
    fn bias_inversion_converges_for_a_curved_law() {
        let bias = Bias::new(240.0, 80.0).unwrap();
        let law = |a: f64| 0.02 * a + 0.3 * a * a * a;
        let angles: Vec<f64> = (1..=200).map(|i| 0.005 * f64::from(i)).collect();
        let samples: Vec<_> = angles.iter().map(|&a| (a, bias.force(a, law))).collect();
        for (f, a) in bias.normalised(&samples).unwrap().iter().zip(angles) {
            assert!((f - law(a)).abs() < 2e-6);
        }
    }
}
