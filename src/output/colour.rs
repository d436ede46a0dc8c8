//! Colours: linear RGB from perceptual coordinates, the colour map of fields, and the colours of bodies.
//!
//! OKLab after B. Ottosson (2020), <https://bottosson.github.io/posts/oklab/>. The map rises evenly in lightness from violet
//! over blue and green to yellow, so that equal steps of a field look equal, also in greyscale print.

use glam::Vec3;
use std::sync::LazyLock;

/// Linear RGB, 0 to 1.
pub type Rgb = Vec3;

/// Linear RGB of a lightness (0 to 1), chroma (about 0 to 0.2) and hue in degrees, clipped to the gamut of a screen.
pub fn oklch(lightness: f32, chroma: f32, hue_deg: f32) -> Rgb {
    let (s, c) = hue_deg.to_radians().sin_cos();
    let (a, b) = (chroma * c, chroma * s);
    let l = (lightness + 0.396_337_78 * a + 0.215_803_76 * b).powi(3);
    let m = (lightness - 0.105_561_346 * a - 0.063_854_17 * b).powi(3);
    let s = (lightness - 0.089_484_18 * a - 1.291_485_5 * b).powi(3);
    let rgb = Rgb::new(
        4.076_741_7 * l - 3.307_711_6 * m + 0.230_969_93 * s,
        -1.268_438 * l + 2.609_757_4 * m - 0.341_319_4 * s,
        -0.004_196_086 * l - 0.703_418_6 * m + 1.707_614_7 * s,
    );
    rgb.clamp(Rgb::ZERO, Rgb::ONE)
}

/// Colour of a field value at a share of its range; ends are clamped, NaN is grey.
pub fn map(share: f32) -> Rgb {
    if share.is_nan() {
        return oklch(0.78, 0.0, 0.0);
    }
    let t = share.clamp(0.0, 1.0);
    oklch(0.30 + 0.61 * t, 0.115 + 0.06 * (2.0 * t - 1.0).powi(2) * t, 300.0 - 192.0 * t)
}

/// Number of equal steps of a linear value from 0 to 1 that differ in their bytes at most by one.
const STEPS: u16 = u16::MAX;

/// The byte in sRGB encoding at every step.
static BYTES: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let byte = |step: u16| {
        let v = f32::from(step) / f32::from(STEPS);
        let v = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
        (v * 255.0).round() as u8
    };
    (0..=STEPS).map(byte).collect()
});

/// Bytes of a linear colour in sRGB encoding.
pub fn encode(colour: Rgb) -> [u8; 3] {
    let bytes = &*BYTES;
    colour.to_array().map(|v| bytes[(v.clamp(0.0, 1.0) * f32::from(STEPS) + 0.5) as usize])
}

/// Colour of warp yarns: dark carbon.
pub fn warp() -> Rgb {
    oklch(0.43, 0.028, 255.0)
}

/// Colour of weft yarns: carbon, a step lighter and bluer.
pub fn weft() -> Rgb {
    oklch(0.58, 0.042, 235.0)
}

/// Colour of blocks that belong to no ply.
pub fn free() -> Rgb {
    oklch(0.62, 0.05, 170.0)
}

/// Colour of threads: amber.
pub fn thread() -> Rgb {
    oklch(0.80, 0.150, 70.0)
}

/// Colour of bodies without a field value.
pub fn plain() -> Rgb {
    oklch(0.86, 0.004, 250.0)
}

/// Colour of the paper.
pub fn background() -> Rgb {
    oklch(0.985, 0.003, 90.0)
}

/// Colour of the letters.
pub fn ink() -> Rgb {
    oklch(0.25, 0.01, 260.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// OKLab lightness of linear RGB.
    fn lightness(colour: Rgb) -> f32 {
        let [r, g, b] = colour.to_array();
        let l = (0.412_221_46 * r + 0.536_332_55 * g + 0.051_445_995 * b).cbrt();
        let m = (0.211_903_5 * r + 0.680_699_5 * g + 0.107_396_96 * b).cbrt();
        let s = (0.088_302_46 * r + 0.281_718_85 * g + 0.629_978_7 * b).cbrt();
        0.210_454_26 * l + 0.793_617_8 * m - 0.004_072_047 * s
    }

    #[test]
    fn the_map_rises_evenly() {
        let steps: Vec<f32> = (0..=16).map(|i| lightness(map(i as f32 / 16.0))).collect();
        for pair in steps.windows(2) {
            let rise = (pair[1] - pair[0]) * 16.0;
            assert!(rise > 0.4 && rise < 0.85, "{rise} in {steps:?}");
        }
    }

    #[test]
    fn white_and_ends() {
        assert_eq!(encode(oklch(1.0, 0.0, 0.0)), [255, 255, 255]);
        assert_eq!(encode(Rgb::ZERO), [0, 0, 0]);
        assert_eq!(encode(Rgb::new(-1.0, 2.0, f32::NAN)), [0, 255, 0]);
        // the middle byte, by the formula of sRGB
        assert_eq!(encode(Rgb::splat(((128.0_f32 / 255.0 + 0.055) / 1.055).powf(2.4))), [128; 3]);
        assert_eq!(map(-1.0), map(0.0));
        assert_eq!(map(f32::NAN), oklch(0.78, 0.0, 0.0));
    }
}
