//! Shear angle, macroscopic deformation gradient and normalised shear force.
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
//! cell under the same kinematics has dW/dγ = V P̄ : dF̄/dγ, with P̄ the mean first Piola–Kirchhoff stress, hence
//!
//! F_nor = (V P̄ : dF̄/dγ) / (A₀ cos γ).

use crate::kernel::record::{Record, Recorded};
use crate::mesh::Mesh;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, SQRT_2};

/// Trellis shear F̄(γ) = [[cos γ/2, sin γ/2], [sin γ/2, cos γ/2]]: both fibre directions keep their length.
pub fn trellis(angle: f64) -> [[f64; 2]; 2] {
    let (s, c) = (0.5 * angle).sin_cos();
    [[c, s], [s, c]]
}

/// F̄ of trellis shear with stretched fibre directions x and y: `stretch` gives the lengths of their images.
pub fn gradient(angle: f64, stretch: [f64; 2]) -> [[f64; 2]; 2] {
    trellis(angle).map(|row| [row[0] * stretch[0], row[1] * stretch[1]])
}

/// dF̄/dγ of [`gradient`] at constant stretches, per rad.
pub fn gradient_rate(angle: f64, stretch: [f64; 2]) -> [[f64; 2]; 2] {
    let (s, c) = (0.5 * angle).sin_cos();
    [[-0.5 * s * stretch[0], 0.5 * c * stretch[1]], [0.5 * c * stretch[0], -0.5 * s * stretch[1]]]
}

/// Shear angle of any in-plane gradient: 90° minus the angle between the images of x and y.
pub fn angle_of([[a, b], [c, d]]: [[f64; 2]; 2]) -> f64 {
    (a * b + c * d).atan2(a * d - b * c)
}

/// Normalised shear force from virtual power, N/mm. `stress` is V P̄, the first Piola–Kirchhoff stress integrated over the
/// volume of the cell, N·mm (row: force direction); `area` is the reference area A₀, mm².
pub fn normalised_force(stress: [[f64; 2]; 2], angle: f64, stretch: [f64; 2], area: f64) -> f64 {
    let rate = gradient_rate(angle, stretch);
    let power: f64 = stress.iter().flatten().zip(rate.iter().flatten()).map(|(p, f)| p * f).sum();
    power / (area * angle.cos())
}

/// F_nor of a periodic cell or a picture frame from row to row, N/mm. Since ∫ A₀ F_nor cos γ dγ is the external work, the work between two angles
/// gives the mean force.
#[derive(Debug, Clone, Copy)]
pub struct CellCurve {
    area: f64,
    /// Shear angle (rad) and external work (mJ) at the last row.
    last: [f64; 2],
}

impl CellCurve {
    /// For an unsheared cell.
    pub fn new(mesh: &Mesh) -> Self {
        Self::of(mesh.period.map_or(f64::NAN, |[x, y]| x * y))
    }

    /// For an unsheared fabric of a reference area, mm².
    pub fn of(area: f64) -> Self {
        Self { area, last: [0.0; 2] }
    }

    /// Continues from an angle, rad, and the external work up to that angle, mJ.
    pub fn start(&mut self, angle: f64, work: f64) {
        self.last = [angle, work];
    }

    /// Angle at the last row, rad.
    pub fn angle(&self) -> f64 {
        self.last[0]
    }

    /// Mean force since the last row; `None` if the angle has not changed.
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

/// Membrane forces along the fibre directions x and y, N per mm of reference width across them: the components of V P̄/A₀ that
/// are work-conjugate to the stretches.
pub fn membrane_forces(stress: [[f64; 2]; 2], angle: f64, area: f64) -> [f64; 2] {
    let image = trellis(angle);
    [0, 1].map(|k| (stress[0][k] * image[0][k] + stress[1][k] * image[1][k]) / area)
}

/// Membrane force along both fibre directions of a cell sheared by pulling one corner while its two neighbours are free, N/mm.
/// No work is done at the free corners, so the tractions on the two sides that meet in the pulled corner are equal. The balance
/// of moments aligns them with the diagonal. The power of a traction p is p cos(45° − γ/2) on the stretch of either direction
/// and p sin(45° − γ/2) = F_nor cos γ on the shear angle, so the membrane force is F_nor (1 + sin γ). For negative angles the
/// other diagonal is pulled.
pub fn corner_force(normalised: f64, angle: f64) -> f64 {
    normalised * 1.0_f64.copysign(angle) * (1.0 + angle.abs().sin())
}

/// Displacement of the machine that shears a picture frame of side `side` to an angle: Eq. 15 solved for it.
pub fn frame_displacement(angle: f64, side: f64) -> f64 {
    2.0 * side * (FRAC_PI_4 - 0.5 * angle).cos() - SQRT_2 * side
}

/// Shear angle in a picture frame of side `side` at a machine `displacement` (Eq. 15 with 90° for the printed 45°, so that γ(0)
/// = 0).
pub fn frame_angle(displacement: f64, side: f64) -> f64 {
    FRAC_PI_2 - 2.0 * ((SQRT_2 * side + displacement) / (2.0 * side)).acos()
}

/// Normalised shear force of a picture frame (Eqs 16 and 17), N/mm. `force` is the machine force minus the force of the empty
/// frame, N; `side` is the side of the frame, `fabric` the side of the sheared square.
pub fn frame_normalised(force: f64, angle: f64, side: f64, fabric: f64) -> f64 {
    force / (2.0 * (FRAC_PI_4 - 0.5 * angle).cos()) * side / (fabric * fabric)
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
}
