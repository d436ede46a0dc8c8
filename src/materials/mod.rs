//! Constitutive laws of yarns. A law is one file with its WGSL twin, an arm of [`Law`], and a row in the materials test.

pub mod charmetant;
pub mod neo_hookean;

use crate::kernel::interface::{Constant, constants};
use crate::kernel::lane::Lane;
use crate::settings::material::Material as Choice;

/// A 3 × 3 tensor, rows first.
pub type Tensor<L> = [[L; 3]; 3];

/// Numbers that a law may keep in its row of the material table.
pub const PARAMETERS: usize = 8;
/// What twins know of all laws.
pub const CONSTANTS: [Constant; 1] = constants![uint: PARAMETERS];

/// A hyperelastic law in the frame of the fibre (axis 1), from the displacement gradient H = F − I: forming strains from
/// H loses nothing to cancellation at small strain.
pub trait Material: 'static {
    /// Its WGSL twin under `shaders/`.
    const SHADER: &'static str;
    /// What that takes from Rust.
    const CONSTANTS: &'static [Constant];

    /// First Piola–Kirchhoff stress, MPa.
    fn stress<L: Lane>(parameters: &[L; PARAMETERS], h: &Tensor<L>) -> Tensor<L>;
    /// Strain energy per reference volume, MPa, by mode (elongation, compaction, distortion, longitudinal shear).
    fn energy<L: Lane>(parameters: &[L; PARAMETERS], h: &Tensor<L>) -> [L; 4];
    /// Upper estimates of the tangent stiffness.
    fn moduli<L: Lane>(parameters: &[L; PARAMETERS], h: &Tensor<L>) -> Moduli<L>;
}

/// Upper estimates of tangent stiffness by what is strained, MPa of the reference volume.
pub struct Moduli<L> {
    /// The cross-section, per displacement gradient across the fibre of motion across it.
    pub across: L,
    /// Longitudinal shear: motion along the fibre that varies across it, and motion across it that varies along it.
    pub shear: L,
    /// The fibre.
    pub along: L,
    /// Tension of the fibre, which resists motion across it that varies along it.
    pub tension: L,
}

impl<L: Lane> Moduli<L> {
    /// Row sum of a corner's stiffness per volume, less that of the fibre: from the sizes of the derivatives of its shape function
    /// along each axis and across the fibre, and their sums over all corners.
    #[inline(always)]
    pub fn rows(&self, [along, second, third]: [L; 3], across: L, sums: [L; 3], sum_across: L) -> L {
        // motion of the corner across the fibre, and along it
        let sideways = (self.across * across)
            .fma(sum_across, along * (self.shear * (sums[0] + sum_across) + self.tension * sums[0]));
        let lengthways = self.shear * across.fma(sums[0], second.fma(sums[1], third * sums[2]));
        sideways.max(lengthways)
    }
}

/// The laws there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Law {
    Charmetant,
    NeoHookean,
}

/// The law a user chose, its row of the material table, and its stiffness along the fibre in MPa.
pub fn choose(choice: &Choice) -> (Law, [f64; PARAMETERS], f64) {
    match *choice {
        Choice::Charmetant { k_elong_mpa, k_comp_mpa, p_comp, k_dist_mpa, k_sh_mpa, compaction_cap } => (
            Law::Charmetant,
            charmetant::parameters(k_elong_mpa, k_comp_mpa, p_comp, k_dist_mpa, k_sh_mpa, compaction_cap),
            k_elong_mpa,
        ),
        Choice::NeoHookean { young_mpa, poisson } => (
            Law::NeoHookean,
            neo_hookean::parameters(young_mpa, poisson),
            neo_hookean::longitudinal(young_mpa, poisson),
        ),
    }
}

/// Shear modulus of a law at rest, MPa; of yarns the larger one, along or across the fibre.
pub fn shear_modulus(choice: &Choice) -> f64 {
    match *choice {
        // b₂₃ is the shear angle γ, and the energy of small distortion K/8 γ²
        Choice::Charmetant { k_dist_mpa, k_sh_mpa, .. } => k_sh_mpa.max(0.25 * k_dist_mpa),
        Choice::NeoHookean { young_mpa, poisson } => young_mpa / (2.0 * (1.0 + poisson)),
    }
}

/// Determinant of I + H.
#[inline(always)]
pub fn jacobian<L: Lane>(h: &Tensor<L>) -> L {
    let one = L::new(1.0);
    let (a, b, c) = (one + h[0][0], one + h[1][1], one + h[2][2]);
    let x = b * c - h[1][2] * h[2][1];
    let y = h[1][0] * c - h[1][2] * h[2][0];
    let z = h[1][0] * h[2][1] - b * h[2][0];
    a * x - h[0][1] * y + h[0][2] * z
}

/// (I + H) S: the first from the second Piola–Kirchhoff stress.
#[inline(always)]
pub fn add_product<L: Lane>(h: &Tensor<L>, s: &Tensor<L>) -> Tensor<L> {
    let mut p = *s;
    for i in 0..3 {
        for j in 0..3 {
            p[i][j] = h[i][2].fma(s[2][j], h[i][1].fma(s[1][j], h[i][0].fma(s[0][j], s[i][j])));
        }
    }
    p
}
