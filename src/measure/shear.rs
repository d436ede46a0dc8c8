//! Shear angle, macroscopic gradient and normalised shear force.
//!
//! Angles are in radians, lengths in mm, forces in N, normalised forces in N/mm.
//!
//! # Why the normalised force of a simulation has a 1/cos γ
//! In a picture frame of side L that holds a square of fabric with side l, the diagonal measures 2L cos(45° − γ/2), so
//! the machine has moved by d = 2L cos(45° − γ/2) − √2 L (Eq. 15 solved for d) and dd/dγ = L sin(45° − γ/2).
//! Eq. 16 resolves the net machine force into the sides, F_m = 2 F_s cos(45° − γ/2). The power of the machine is then
//!
//! F_m dd/dγ = F_s L · 2 sin(45° − γ/2) cos(45° − γ/2) = F_s L sin(90° − γ) = F_s L cos γ,
//!
//! and since Eq. 17 defines F_nor = F_s L / l², with A₀ = l² the reference area, dW/dγ = F_nor A₀ cos γ. A homogenised
//! cell under the same kinematics has dW/dγ = V P̄ : dF̄/dγ, with P̄ the mean first Piola stress, hence
//!
//! F_nor = (V P̄ : dF̄/dγ) / (A₀ cos γ).
//!
//! The bias test fits in: with D = H − W its motion is d = D(√2 cos(45° − γ/2) − 1) (Eq. 18 solved for d), so
//! dd/dγ = (D/2)(cos γ/2 − sin γ/2). Zone C has the area W(2H − 3W)/2 and the angle γ, zone B the area W² and the angle
//! γ/2, and power balances as
//!
//! F_m (D/2)(cos γ/2 − sin γ/2) = W(2H − 3W)/2 · F_nor(γ) cos γ + ½ W² F_nor(γ/2) cos(γ/2),
//!
//! which divided by W/2 is Eq. 19.

use crate::error::{Error, Result};
use crate::kernel::record::{Record, Recorded};
use crate::mesh::Mesh;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, SQRT_2};

/// Trellis shear F̄(γ) = [[cos γ/2, sin γ/2], [sin γ/2, cos γ/2]]: both fibre directions keep their length.
pub fn trellis(angle: f64) -> [[f64; 2]; 2] {
    let (s, c) = (0.5 * angle).sin_cos();
    [[c, s], [s, c]]
}

/// F̄ of trellis shear with its fibre directions x and y stretched: their images have these lengths.
pub fn gradient(angle: f64, stretch: [f64; 2]) -> [[f64; 2]; 2] {
    trellis(angle).map(|row| [row[0] * stretch[0], row[1] * stretch[1]])
}

/// dF̄/dγ of [`gradient`] at constant stretches, per rad.
pub fn gradient_rate(angle: f64, stretch: [f64; 2]) -> [[f64; 2]; 2] {
    let (s, c) = (0.5 * angle).sin_cos();
    [[-0.5 * s * stretch[0], 0.5 * c * stretch[1]], [0.5 * c * stretch[0], -0.5 * s * stretch[1]]]
}

/// Shear angle of any in-plane gradient: 90° less the angle between the images of x and y.
pub fn angle_of([[a, b], [c, d]]: [[f64; 2]; 2]) -> f64 {
    (a * b + c * d).atan2(a * d - b * c)
}

/// Normalised shear force from virtual power, N/mm: `stress` is V P̄, the first Piola stress summed over the volume of the
/// cell, N·mm (row: force direction); `area` is the reference area A₀, mm².
pub fn normalised_force(stress: [[f64; 2]; 2], angle: f64, stretch: [f64; 2], area: f64) -> f64 {
    let rate = gradient_rate(angle, stretch);
    let power: f64 = stress.iter().flatten().zip(rate.iter().flatten()).map(|(p, f)| p * f).sum();
    power / (area * angle.cos())
}

/// F_nor of a periodic cell from row to row, N/mm: since ∫ A₀ F_nor cos γ dγ is the external work, the work between two angles
/// gives the mean force.
#[derive(Debug, Clone, Copy)]
pub struct CellCurve {
    area: f64,
    /// Shear angle (rad) and external work (mJ) at the last row.
    last: [f64; 2],
}

impl CellCurve {
    /// Of a cell that has not been sheared.
    pub fn new(mesh: &Mesh) -> Self {
        Self { area: mesh.period.map_or(f64::NAN, |[x, y]| x * y), last: [0.0; 2] }
    }

    /// Goes on from an angle, rad, and the external work up to there, mJ.
    pub fn start(&mut self, angle: f64, work: f64) {
        self.last = [angle, work];
    }

    /// Angle at the last row, rad.
    pub fn angle(&self) -> f64 {
        self.last[0]
    }

    /// Mean force since the last row; `None` where the angle is the same.
    pub fn push(&mut self, angle: f64, work: f64) -> Option<f64> {
        let [before, done] = std::mem::replace(&mut self.last, [angle, work]);
        let turned = libm::sin(angle) - libm::sin(before);
        (turned.abs() > 1e-9).then(|| (work - done) / (self.area * turned))
    }
}

impl Recorded for CellCurve {
    fn record(&mut self, record: &mut Record) {
        self.last.record(record);
    }
}

/// Membrane forces along the fibre directions x and y, N per mm of reference width across them: the components of V P̄/A₀ that do
/// work on their stretches.
pub fn membrane_forces(stress: [[f64; 2]; 2], angle: f64, area: f64) -> [f64; 2] {
    let image = trellis(angle);
    [0, 1].map(|k| (stress[0][k] * image[0][k] + stress[1][k] * image[1][k]) / area)
}

/// Membrane force along both fibre directions of a cell that is sheared by pulling one corner while the two beside it are free,
/// N/mm. No work is done where the free corners move, so the tractions on the two sides that meet in the pulled corner are equal;
/// the balance of moments turns them into the diagonal. A traction p there does p cos(45° − γ/2) on the stretch of either
/// direction and p sin(45° − γ/2) = F_nor cos γ on the shear angle, so the membrane force is F_nor (1 + sin γ). For negative
/// angles the other diagonal is pulled.
pub fn corner_force(normalised: f64, angle: f64) -> f64 {
    normalised * 1.0_f64.copysign(angle) * (1.0 + angle.abs().sin())
}

/// Shear angle in a picture frame of side `side` after the machine has moved by `displacement` (Eq. 15 with 90° for the
/// printed 45°, so that γ(0) = 0).
pub fn frame_angle(displacement: f64, side: f64) -> f64 {
    FRAC_PI_2 - 2.0 * ((SQRT_2 * side + displacement) / (2.0 * side)).acos()
}

/// Normalised shear force of a picture frame (Eqs 16 and 17), N/mm: `force` is the machine force less that of the empty
/// frame, N; `side` the frame, `fabric` the side of the sheared square.
pub fn frame_normalised(force: f64, angle: f64, side: f64, fabric: f64) -> f64 {
    force / (2.0 * (FRAC_PI_4 - 0.5 * angle).cos()) * side / (fabric * fabric)
}

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

    /// Shear angle of the central zone if nothing slips, after the machine has moved by `displacement` (Eq. 18); NaN
    /// beyond the displacement at which the yarns would be aligned.
    pub fn angle(&self, displacement: f64) -> f64 {
        let d = self.height - self.width;
        FRAC_PI_2 - 2.0 * ((d + displacement) / (SQRT_2 * d)).acos()
    }

    /// Machine force, N, at `angle` for a law F_nor(γ) in N/mm (Eq. 19 solved for F_m).
    pub fn force(&self, angle: f64, law: impl Fn(f64) -> f64) -> f64 {
        let [own, half, lever] = self.coefficients(angle);
        (own * law(angle) + half * law(0.5 * angle)) / lever
    }

    /// F_nor, N/mm, at every sample `(angle, force)` (Eq. 19). Angles rise and lie between 0 and 90°. F_nor is taken as
    /// linear between samples and as 0 at 0, so F_nor(γ/2) only involves samples up to γ itself: one sweep from small to
    /// large angles solves the implicit equation, and nothing is left to iterate.
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

    /// A curve of F_nor to be filled sample by sample.
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

/// F_nor of a bias test, sample by sample: what a run knows while it goes on.
#[derive(Debug, Clone)]
pub struct BiasCurve {
    bias: Bias,
    known: Vec<(f64, f64)>,
}

impl BiasCurve {
    /// F_nor, N/mm, at an angle (rad) and machine force (N). A measured angle may stand still or fall back for a moment:
    /// NaN unless it is above all before, and below 90°.
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
    fn trellis_keeps_fibres_and_gives_its_angle_back() {
        for degrees in [-60.0_f64, -10.0, 0.0, 25.0, 70.0] {
            let angle = degrees.to_radians();
            let f = trellis(angle);
            assert!((f[0][0].hypot(f[1][0]) - 1.0).abs() < 1e-15);
            assert!((angle_of(f) - angle).abs() < 1e-14);
            let (high, low, rate) = (trellis(angle + 1e-5), trellis(angle - 1e-5), gradient_rate(angle, [1.0; 2]));
            for i in 0..2 {
                for j in 0..2 {
                    assert!(((high[i][j] - low[i][j]) / 2e-5 - rate[i][j]).abs() < 1e-10);
                }
            }
        }
    }

    #[test]
    fn virtual_power_agrees_with_the_picture_frame() {
        // A fabric with the energy ½ k γ² per reference area: P̄ V = A₀ k γ ∂γ/∂F̄, here for symmetric F̄ with det F̄ = cos γ.
        let (k, area, side) = (0.3, 50.0, 200.0);
        for degrees in [5.0_f64, 30.0, 55.0] {
            let angle = degrees.to_radians();
            let (s, c) = (0.5 * angle).sin_cos();
            // ∂γ/∂F̄ of γ = atan2(F₁·F₂, det F̄), by hand at the trellis state, where F₁·F₂ = sin γ and det F̄ = cos γ.
            let g = area * k * angle * (angle.cos() * s - angle.sin() * c);
            let h = area * k * angle * (angle.cos() * c + angle.sin() * s);
            let stress = [[g, h], [h, g]];
            let force = normalised_force(stress, angle, [1.0; 2], area);
            assert!((force - k * angle / angle.cos()).abs() < 1e-13);
            // The same energy in a frame: F_m = (dW/dγ)/(dd/dγ).
            let machine = area * k * angle / (side * (FRAC_PI_4 - 0.5 * angle).sin());
            assert!((frame_normalised(machine, angle, side, area.sqrt()) - force).abs() < 1e-12);
            let displacement = 2.0 * side * (FRAC_PI_4 - 0.5 * angle).cos() - SQRT_2 * side;
            assert!((frame_angle(displacement, side) - angle).abs() < 1e-12);
        }
        assert!(frame_angle(0.0, 1.0).abs() < 1e-15);
    }

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
