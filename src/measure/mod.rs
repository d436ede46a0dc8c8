//! Measures of a deformed state: yarn sizes, crossings of the plies, stitch tension, and the relations between shear angle and
//! force. Measures return plain values and write nothing.

pub mod crossings;
mod outline;
pub mod shear;
pub mod stitches;
pub mod yarns;

/// Mean, extremes and standard deviation of some samples; all NaN when there are none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    pub mean: f64,
    pub min: f64,
    pub max: f64,
    /// Standard deviation of the samples themselves (divided by their number).
    pub std: f64,
}

impl Spread {
    /// Spread of equally weighted samples; NaN samples are ignored.
    pub fn of(samples: impl Iterator<Item = f64> + Clone) -> Self {
        let samples = samples.filter(|v| !v.is_nan());
        let count = samples.clone().count() as f64;
        let mean = samples.clone().sum::<f64>() / count;
        Self {
            mean,
            min: samples.clone().fold(f64::NAN, f64::min),
            max: samples.clone().fold(f64::NAN, f64::max),
            std: (samples.map(|v| (v - mean) * (v - mean)).sum::<f64>() / count).sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Spread;

    #[test]
    fn spread_of_known_samples() {
        let s = Spread::of([2.0, 4.0, f64::NAN, 6.0].into_iter());
        assert_eq!((s.mean, s.min, s.max), (4.0, 2.0, 6.0));
        assert!((s.std - (8.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        assert!(Spread::of(std::iter::empty()).mean.is_nan());
    }
}
