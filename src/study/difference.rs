//! Differences of curves: they are averaged over windows of their common range, then compared as a whole.
//!
//! Contact makes curves jitter from row to row, and runs write rows at different abscissas. Curves are therefore linear between
//! their points, and their means over windows are compared.

/// Half width of a window over the common range: ±2° for a shear to 50°.
const HALF: f64 = 0.04;
/// Windows over a range; neighbours overlap by half.
const WINDOWS: usize = 24;

/// A curve: points of abscissa and value, the abscissa rising.
pub type Curve = Vec<[f64; 2]>;

/// Relative differences between two curves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// ‖a − b‖ / ‖b‖ over all windows: large values count most.
    pub l2: f64,
    /// Root mean square of a/b − 1: every window counts the same.
    pub rms: f64,
}

/// Difference of two curves over their common range; `None` if there is none.
pub fn difference(a: &[[f64; 2]], b: &[[f64; 2]]) -> Option<Difference> {
    let means = smoothed(&[a, b])?;
    Some(Difference { l2: relative_l2(&means[0], &means[1]), rms: relative_rms(&means[0], &means[1]) })
}

/// Means of curves over the same windows of their common range; `None` if there is none.
pub fn smoothed(curves: &[&[[f64; 2]]]) -> Option<Vec<Vec<f64>>> {
    let [low, high] = common(curves)?;
    let half = HALF * (high - low);
    let step = (high - low - 2.0 * half) / (WINDOWS - 1) as f64;
    let centres: Vec<f64> = (0..WINDOWS).map(|i| low + half + step * i as f64).collect();
    Some(curves.iter().map(|curve| averaged(curve, &centres, half)).collect())
}

/// The common range of the abscissas; `None` if there is none.
pub fn common(curves: &[&[[f64; 2]]]) -> Option<[f64; 2]> {
    let mut range = [f64::NEG_INFINITY, f64::INFINITY];
    for curve in curves {
        let (first, last) = (curve.first()?[0], curve.last()?[0]);
        range = [range[0].max(first), range[1].min(last)];
    }
    (range[0] < range[1] && range[1].is_finite()).then_some(range)
}

/// Means of a curve within `half` of every centre, as far as the curve reaches; NaN beyond it.
fn averaged(curve: &[[f64; 2]], centres: &[f64], half: f64) -> Vec<f64> {
    let mut integral = vec![0.0];
    for pair in curve.windows(2) {
        let [[x0, y0], [x1, y1]] = [pair[0], pair[1]];
        integral.push(integral[integral.len() - 1] + 0.5 * (y0 + y1) * (x1 - x0));
    }
    let Some(([first, _], [last, _])) = curve.first().zip(curve.last()) else { return vec![f64::NAN; centres.len()] };
    let until = |x: f64| {
        let next = curve.partition_point(|p| p[0] < x).clamp(1, curve.len() - 1);
        let [x0, y0] = curve[next - 1];
        integral[next - 1] + 0.5 * (y0 + between(curve, next, x)) * (x - x0)
    };
    let mean = |centre: &f64| {
        let (low, high) = ((centre - half).max(*first), (centre + half).min(*last));
        if low < high { (until(high) - until(low)) / (high - low) } else { f64::NAN }
    };
    centres.iter().map(mean).collect()
}

/// Value of a curve at an abscissa within its range; NaN outside.
pub fn value(curve: &[[f64; 2]], x: f64) -> f64 {
    match curve.iter().position(|p| p[0] >= x) {
        Some(0) if curve[0][0] == x => curve[0][1],
        Some(0) | None => f64::NAN,
        Some(next) => between(curve, next, x),
    }
}

/// Value on the line to point `next` from the one before it.
fn between(curve: &[[f64; 2]], next: usize, x: f64) -> f64 {
    let [[x0, y0], [x1, y1]] = [curve[next - 1], curve[next]];
    y0 + (y1 - y0) * (x - x0) / (x1 - x0)
}

/// ‖a − b‖ / ‖b‖.
pub fn relative_l2(a: &[f64], b: &[f64]) -> f64 {
    let (apart, size) = a.iter().zip(b).fold((0.0, 0.0), |(d, s), (a, b)| (d + (a - b) * (a - b), s + b * b));
    if apart == 0.0 { 0.0 } else { libm::sqrt(apart / size) }
}

/// Root mean square of a/b − 1.
fn relative_rms(a: &[f64], b: &[f64]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| if a == b { 0.0 } else { (a / b - 1.0) * (a / b - 1.0) });
    libm::sqrt(squares.sum::<f64>() / a.len() as f64)
}

/// Mean of lists of equal length, entry by entry.
fn mean(lists: &[Vec<f64>]) -> Vec<f64> {
    let entries = 0..lists.first().map_or(0, Vec::len);
    entries.map(|i| lists.iter().map(|list| list[i]).sum::<f64>() / lists.len() as f64).collect()
}

/// Scatter of runs that should agree: root mean square of their L2 distances from their mean. NaN for fewer than two.
pub fn spread(lists: &[Vec<f64>]) -> f64 {
    if lists.len() < 2 {
        return f64::NAN;
    }
    let centre = mean(lists);
    let squares: f64 = lists.iter().map(|list| relative_l2(list, &centre).powi(2)).sum();
    libm::sqrt(squares / lists.len() as f64)
}

/// Difference of two runs by chance, from the [`spread`] of `count` runs: its variance is twice the one that the spread
/// estimates.
pub fn by_chance(spread: f64, count: usize) -> f64 {
    let count = count as f64;
    spread * libm::sqrt(2.0 * count / (count - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A curve sampled at uneven places from `low` to `high`.
    fn sampled(count: usize, [low, high]: [f64; 2], law: impl Fn(f64) -> f64) -> Curve {
        let place = |i: usize| low + (high - low) * (i as f64 / (count - 1) as f64).powf(1.3);
        (0..count).map(|i| [place(i), law(place(i))]).collect()
    }

    #[test]
    fn means_of_lines_are_exact_wherever_they_are_sampled() {
        let line = sampled(7, [0.0, 50.0], |x| 3.0 * x - 1.0);
        for (mean, centre) in averaged(&line, &[2.0, 10.0, 31.7, 48.0], 2.0).iter().zip([2.0, 10.0, 31.7, 48.0]) {
            assert!((mean - (3.0 * centre - 1.0)).abs() < 1e-12, "{mean} at {centre}");
        }
        // a window that reaches beyond the end is cut there
        assert!((averaged(&line, &[50.0], 2.0)[0] - (3.0 * 49.0 - 1.0)).abs() < 1e-12);
        assert!(averaged(&line, &[60.0], 2.0)[0].is_nan() && averaged(&[], &[1.0], 2.0)[0].is_nan());
        assert!((value(&line, 20.0) - 59.0).abs() < 1e-12 && value(&line, 51.0).is_nan());
    }

    #[test]
    fn differences_do_not_depend_on_sampling_and_measure_what_they_say() {
        let law = |x: f64| 0.01 * x * x;
        let (coarse, fine) = (sampled(60, [0.0, 50.0], law), sampled(400, [0.5, 50.0], law));
        let same = difference(&coarse, &fine).unwrap();
        assert!(same.l2 < 1e-3 && same.rms < 0.02, "{same:?}");
        let larger = difference(&sampled(400, [0.0, 40.0], |x| 1.1 * law(x)), &fine).unwrap();
        assert!((larger.l2 - 0.1).abs() < 1e-4 && (larger.rms - 0.1).abs() < 1e-4, "{larger:?}");
        // an offset at small values counts little in one measure and much in the other
        let offset = difference(&sampled(400, [0.5, 50.0], |x| law(x) + 0.1), &fine).unwrap();
        assert!(offset.l2 < 0.02 && offset.rms > 0.1, "{offset:?}");
        assert!(difference(&sampled(9, [60.0, 70.0], law), &fine).is_none());
        assert!(difference(&[], &fine).is_none());
    }

    #[test]
    fn spread_of_two_runs_is_half_of_their_distance() {
        let lists = [vec![1.01, 2.02], vec![0.99, 1.98]];
        let spread = spread(&lists);
        assert!((spread - 0.01).abs() < 1e-12, "{spread}");
        assert!((by_chance(spread, 2) - 0.02).abs() < 1e-12);
        assert!(super::spread(&lists[..1]).is_nan());
    }
}
