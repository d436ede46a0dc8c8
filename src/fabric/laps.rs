//! Number of beams in each lap of the stitch.
//!
//! If all laps were divided alike, the nodes of all loops would lie at the same places, and all loops would slip at the same
//! moment. Two consecutive laps form a pair: one has more beams than the mean, the other as many fewer, so every thread keeps its
//! total. The difference follows a low-discrepancy sequence over pairs and threads.

use super::stitch::Path;
use crate::case::domain::Resolution;
use crate::mesh::Part;

/// Steps of the sequence from pair to pair and from thread to thread: irrational numbers that fractions approximate badly, so
/// that no two of many terms are close.
const STEPS: [f64; 2] = [0.618_033_988_749_895, 0.754_877_666_246_693];

/// Divisions of a lap into every number of beams in use.
pub struct Laps {
    spread: i64,
    /// From the fewest beams to the most.
    divisions: Vec<Vec<Beam>>,
}

/// Arc lengths of both ends of a beam on the path of its lap, and its part.
pub type Beam = ([f64; 2], Part);

impl Laps {
    pub fn new(path: &Path, resolution: &Resolution, radius: f64) -> Self {
        let (mean, spread) = (resolution.beams_per_lap, resolution.lap_spread());
        let divisions = (mean - spread..=mean + spread).map(|beams| path.beams(beams, radius)).collect();
        Self { spread: spread as i64, divisions }
    }

    /// The beams of a lap with the mean number of beams.
    pub fn mean(&self) -> &[Beam] {
        self.with(0)
    }

    /// The beams of the lap of a thread in a course; an even course and the next one form a pair.
    pub fn lap(&self, thread: i64, course: i64) -> &[Beam] {
        self.with(more(self.spread, thread, course))
    }

    fn with(&self, more: i64) -> &[Beam] {
        &self.divisions[(self.spread + more) as usize]
    }
}

/// Beams of a lap beyond the mean: at most `spread`, and never 0 unless `spread` is.
fn more(spread: i64, thread: i64, course: i64) -> i64 {
    if spread == 0 {
        return 0;
    }
    let [pairs, threads] = STEPS;
    let term = pairs * course.div_euclid(2) as f64 + threads * thread as f64;
    let more = 1 + ((term - term.floor()) * spread as f64) as i64;
    // signs change from lap to lap and from thread to thread
    if (thread + course) % 2 == 0 { more } else { -more }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn laps_differ_from_their_neighbours_and_keep_their_sum() {
        for spread in 1..8 {
            let laps = |thread: i64| (-20..20).map(move |course| more(spread, thread, course));
            for thread in -5..5 {
                assert_eq!(laps(thread).sum::<i64>(), 0);
                assert!(laps(thread).all(|more| more != 0 && more.abs() <= spread));
                assert!(laps(thread).zip(laps(thread).skip(1)).all(|(a, b)| a != b));
                assert!(laps(thread).zip(laps(thread + 1)).all(|(a, b)| a != b));
            }
        }
    }

    #[test]
    fn every_number_of_beams_is_as_frequent() {
        let laps: Vec<i64> = (0..30).flat_map(|thread| (0..40).map(move |course| more(3, thread, course))).collect();
        for wanted in [-3, -2, -1, 1, 2, 3] {
            let share = laps.iter().filter(|more| **more == wanted).count() as f64 / laps.len() as f64;
            assert!((share - 1.0 / 6.0).abs() < 0.01, "{wanted}: {share}");
        }
        assert!((0..40).all(|course| more(0, 1, course) == 0));
    }
}
