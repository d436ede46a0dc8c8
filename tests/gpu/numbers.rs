//! How the numbers of two backends are compared.

/// Slots of so many numbers, with what their first one is behind them: gaps, mm, of all slots, then marks and signs. What is left
/// in the slots is forces.
pub(super) fn split(mut slots: Vec<f64>, size: usize) -> Vec<f64> {
    let first: Vec<f64> = slots.iter().copied().step_by(size).collect();
    slots.iter_mut().step_by(size).for_each(|force| *force = force.max(0.0));
    let mark = |x: &f64| x.signum();
    slots.extend(first.iter().map(|x| x.min(0.0)).chain(first.iter().map(mark)));
    slots
}

/// Sorts the entries of lists of equal capacity.
pub(super) fn sorted(mut lists: Vec<f64>, counts: &[u32]) -> Vec<f64> {
    let room = lists.len() / counts.len();
    for (list, count) in lists.chunks_exact_mut(room).zip(counts) {
        list[..room.min(*count as usize)].sort_unstable_by(f64::total_cmp);
    }
    lists
}

/// Whether two numbers are the same; NaN equals itself, as in the bounds of empty lanes.
pub(super) fn same(a: f64, b: f64) -> bool {
    a == b || a.is_nan() && b.is_nan()
}

/// Largest difference of numbers over the largest number; differences below `quanta` count as none.
pub(super) fn difference(pairs: &[(f64, f64)], quanta: f64) -> f64 {
    let largest = pairs.iter().map(|(_, x)| x.abs()).filter(|x| x.is_finite()).fold(0.0, f64::max);
    let differing = pairs.iter().filter(|(a, b)| !same(*a, *b) && !((a - b).abs() <= quanta));
    let errors = differing.map(|(a, b)| (a - b).abs() / largest);
    errors.fold(0.0, |worst, error| if error.is_nan() { f64::INFINITY } else { worst.max(error) })
}

/// Mean of the squares of the differences of numbers from exact ones, where these are finite.
pub(super) fn mean_square(pairs: &[(f64, f64)]) -> f64 {
    let squares = pairs.iter().filter(|(_, e)| e.is_finite()).map(|(x, e)| (x - e).powi(2));
    let sum: f64 = squares.clone().sum();
    if sum.is_nan() { f64::INFINITY } else { sum / squares.count().max(1) as f64 }
}
