//! The heavy elastica: an inextensible rod of bending stiffness B and weight per length ω, clamped horizontally at one end.
//!
//! With ψ the angle below the horizontal at the arc length s from the clamp, moments balance as B ψ″ = −ω (l − s) cos ψ, with ψ(0) = 0
//! and ψ′(l) = 0. The shape depends on ω l³/B alone.

use libm::{atan2, cos, pow, sin, tan};

/// Steps of the integration along the rod.
const STEPS: usize = 400;
/// Curvatures that are tried for one below the solution.
const GUESSES: usize = 32;
/// Relative width of an interval that is narrow enough, and turns until then at most.
const CLOSE: f64 = 1e-13;
const TURNS: usize = 100;
/// Decimal logarithms of the loads ω l³/B among which a rod is looked for: from next to straight to next to hanging.
const LOADS: [f64; 2] = [-5.0, 2.7];

/// The rod integrated from a curvature at the clamp, in units of its length: curvature at the free end, and the angle of the chord.
fn integrated(load: f64, curvature: f64) -> [f64; 2] {
    let step = 1.0 / STEPS as f64;
    let slope = |s: f64, [angle, curvature, _, _]: [f64; 4]| {
        [curvature, -load * (1.0 - s) * cos(angle), cos(angle), sin(angle)]
    };
    let ahead = |y: [f64; 4], k: [f64; 4], h: f64| [0, 1, 2, 3].map(|i| y[i] + h * k[i]);
    let mut y = [0.0, curvature, 0.0, 0.0];
    for i in 0..STEPS {
        let s = i as f64 * step;
        let a = slope(s, y);
        let b = slope(s + 0.5 * step, ahead(y, a, 0.5 * step));
        let c = slope(s + 0.5 * step, ahead(y, b, 0.5 * step));
        let d = slope(s + step, ahead(y, c, step));
        y = [0, 1, 2, 3].map(|i| y[i] + step / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]));
    }
    [y[1], atan2(y[3], y[2])]
}

/// Where a function changes its sign between two places, by the Illinois variant of false position.
fn root([mut low, mut high]: [f64; 2], function: impl Fn(f64) -> f64) -> f64 {
    let (mut below, mut above) = (function(low), function(high));
    for _ in 0..TURNS {
        let middle = (low * above - high * below) / (above - below);
        let value = function(middle);
        if value == 0.0 || (high - low).abs() <= CLOSE * (high.abs() + low.abs()) {
            return middle;
        }
        if value * above < 0.0 {
            (low, below) = (high, above);
        } else {
            below *= 0.5;
        }
        (high, above) = (middle, value);
    }
    high
}

/// Curvature at the clamp, in units of the length, for a load ω l³/B.
fn clamp_curvature(load: f64) -> f64 {
    // a rod that stays straight has the largest; with far too small a one, a flexible rod turns over
    let most = 0.5 * load;
    let free = |curvature: f64| integrated(load, curvature)[0];
    let low = (1..GUESSES).map(|i| most * (1.0 - i as f64 / GUESSES as f64)).find(|guess| free(*guess) < 0.0);
    root([low.unwrap_or(0.0), most], free)
}

/// Angle of the chord below the horizontal for a load ω l³/B.
pub fn chord_angle(load: f64) -> f64 {
    integrated(load, clamp_curvature(load))[1]
}

/// Bending stiffness of a rod of length `length` (mm) and weight `weight` (N/mm) whose chord has an angle, N·mm²; `None` for a rod
/// that is straight or hangs.
pub fn stiffness(angle: f64, length: f64, weight: f64) -> Option<f64> {
    let chord = |load: f64| chord_angle(pow(10.0, load));
    if !(chord(LOADS[0])..chord(LOADS[1])).contains(&angle) {
        return None;
    }
    let load = root(LOADS, |load| chord(load) - angle);
    Some(weight * length * length * length / pow(10.0, load))
}

/// Bending stiffness by Eq. 9 of Zheng et al., after Peirce, N·mm².
pub fn peirce(angle: f64, length: f64, weight: f64) -> f64 {
    weight * length * length * length * cos(0.5 * angle) / (8.0 * tan(angle))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stiff rod has the deflection ω l⁴/(8 B) of a beam.
    #[test]
    fn a_stiff_rod_bends_as_a_beam() {
        let load = 1e-3;
        let angle = chord_angle(load);
        assert!((angle / (load / 8.0) - 1.0).abs() < 1e-5);
        assert!((peirce(angle, 1.0, load) - 1.0).abs() < 1e-5, "and Eq. 9 is exact");
    }

    /// Moments balance at the clamp: B ψ′(0) is the weight times the distance of its centre.
    #[test]
    fn moments_balance_at_the_clamp() {
        for load in [0.5, 5.0, 50.0] {
            let curvature = clamp_curvature(load);
            // the centre of weight by the same integration: the moment is load · ∫ x ds
            let steps = 4000;
            let step = 1.0 / f64::from(steps);
            let (mut angle, mut slope, mut x, mut moment) = (0.0, curvature, 0.0, 0.0);
            for i in 0..steps {
                let s = (f64::from(i) + 0.5) * step;
                let middle = angle + 0.5 * step * slope;
                moment += load * step * (x + 0.5 * step * cos(middle));
                x += step * cos(middle);
                let change = -load * (1.0 - s) * cos(middle);
                angle += step * (slope + 0.5 * step * change);
                slope += step * change;
            }
            assert!((moment / curvature - 1.0).abs() < 1e-3, "{load}: {moment} {curvature}");
        }
    }

    #[test]
    fn a_rod_that_is_straight_or_hangs_tells_nothing() {
        assert_eq!([0.0, 1e-9, 1.57].map(|angle| stiffness(angle, 10.0, 1e-6)), [None; 3]);
    }

    #[test]
    fn the_stiffness_comes_back() {
        let (bending, weight) = (5.6e-4, 4.26e-7);
        for length in [8.0, 22.0, 60.0] {
            let angle = chord_angle(weight * length * length * length / bending);
            assert!((stiffness(angle, length, weight).unwrap() / bending - 1.0).abs() < 1e-9);
        }
    }
}
