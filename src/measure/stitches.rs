//! Stitch tension: axial forces of loops and underlaps, and their slack share.

use crate::error::{Error, Result};
use crate::mesh::{Mesh, Part, Thread};
use glam::{DVec2, DVec3, Vec3Swizzles};

/// Axial force below which a beam counts as slack, N.
pub const SLACK_BELOW_N: f64 = 0.02;

/// Shares at which [`Tension::quantiles_n`] are taken.
pub const QUANTILES: [f64; 5] = [0.05, 0.25, 0.5, 0.75, 0.95];

/// Axial force over a length of thread, every beam weighted by its reference length. All NaN if there is no beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tension {
    /// Reference length, mm.
    pub length_mm: f64,
    pub min_n: f64,
    pub mean_n: f64,
    pub max_n: f64,
    /// Smallest forces not exceeded over at least the shares [`QUANTILES`] of the length, N.
    pub quantiles_n: [f64; 5],
    /// Share of the length with a force below [`SLACK_BELOW_N`]; compression is slack.
    pub slack_share: f64,
}

/// Tension of all threads, and of each part of the lap. Threads of inline meshes count only in `all`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stitches {
    pub all: Tension,
    pub loops: Tension,
    pub underlaps: Tension,
}

/// A loop or an underlap: consecutive beams of one part of a lap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leg {
    pub part: Part,
    /// Midpoint of its ends, and the vector between them, in the reference state, mm.
    pub middle: DVec2,
    pub chord: DVec2,
    /// Mean axial force, weighted by reference length, N; compression is negative.
    pub force_n: f64,
}

impl Leg {
    /// Whether it bears load: its mean force is at least [`SLACK_BELOW_N`].
    pub fn taut(&self) -> bool {
        self.force_n >= SLACK_BELOW_N
    }
}

/// Loops and underlaps of all threads from the axial force of every beam, N. A leg that contains the seam of a closed thread
/// counts as two.
pub fn legs(mesh: &Mesh, forces: &[f64]) -> Result<Vec<Leg>> {
    checked(mesh, forces)?;
    let mut legs = Vec::new();
    let mut first = 0;
    for thread in &mesh.threads {
        let part = |i: usize| thread.parts.get(i).copied().unwrap_or(Part::Free);
        let mut start = 0;
        for end in 1..=thread.beams() {
            if end < thread.beams() && part(end) == part(start) {
                continue;
            }
            let (mut length, mut sum) = (0.0, 0.0);
            for i in start..end {
                let own = beam_length(mesh, thread, i);
                length += own;
                sum += own * forces[first + i];
            }
            let ends = [thread.beam(start)[0], thread.beam(end - 1)[1]];
            let [from, to] = ends.map(|seen| DVec3::from(mesh.position(seen)).xy());
            legs.push(Leg { part: part(start), middle: 0.5 * (from + to), chord: to - from, force_n: sum / length });
            start = end;
        }
        first += thread.beams();
    }
    Ok(legs)
}

/// Reference length of a beam, mm.
fn beam_length(mesh: &Mesh, thread: &Thread, beam: usize) -> f64 {
    let [a, b] = thread.beam(beam).map(|seen| DVec3::from(mesh.position(seen)));
    a.distance(b)
}

/// An error unless every beam has a force that is not NaN.
fn checked(mesh: &Mesh, forces: &[f64]) -> Result<()> {
    if forces.len() != mesh.beams() {
        let message = format!("{} values where the mesh has {} beams", forces.len(), mesh.beams());
        return Err(Error::geometry("axial forces", message));
    }
    let mut beams = mesh.threads.iter().flat_map(|t| (0..t.beams()).map(move |i| (t, i)));
    match beams.nth(forces.iter().position(|f| f.is_nan()).unwrap_or(usize::MAX)) {
        Some((thread, i)) => {
            Err(Error::geometry(format!("thread {}, beam {i}", thread.name), "its axial force is not a number"))
        }
        None => Ok(()),
    }
}

/// Tensions from the axial force of every beam, N, threads in order.
pub fn measure(mesh: &Mesh, forces: &[f64]) -> Result<Stitches> {
    checked(mesh, forces)?;
    let mut samples = Vec::with_capacity(forces.len());
    let beams = mesh.threads.iter().flat_map(|t| (0..t.beams()).map(move |i| (t, i)));
    for ((thread, i), &force) in beams.zip(forces) {
        let part = thread.parts.get(i).copied().unwrap_or(Part::Free);
        samples.push((force, beam_length(mesh, thread, i), part));
    }
    samples.sort_by(|a, b| a.0.total_cmp(&b.0));
    let of = |wanted: Option<Part>| {
        Tension::of(
            samples.iter().filter(|s| wanted.is_none_or(|p| p == s.2)).map(|&(force, length, _)| (force, length)),
        )
    };
    Ok(Stitches { all: of(None), loops: of(Some(Part::Loop)), underlaps: of(Some(Part::Underlap)) })
}

impl Tension {
    /// From (force, length) pairs in increasing order of force.
    fn of(sorted: impl Iterator<Item = (f64, f64)> + Clone) -> Self {
        let length_mm: f64 = sorted.clone().map(|(_, l)| l).sum();
        let quantile = |share: f64| {
            let mut below = 0.0;
            // Rounding margin: half the length of two equal beams is the first beam.
            let wanted = share * length_mm * (1.0 - 1e-12);
            sorted.clone().find(|(_, l)| {
                below += l;
                below >= wanted
            })
        };
        Self {
            length_mm,
            min_n: sorted.clone().next().map_or(f64::NAN, |(f, _)| f),
            mean_n: sorted.clone().map(|(f, l)| f * l).sum::<f64>() / length_mm,
            max_n: sorted.clone().last().map_or(f64::NAN, |(f, _)| f),
            quantiles_n: QUANTILES.map(|q| quantile(q).map_or(f64::NAN, |(f, _)| f)),
            slack_share: sorted.clone().filter(|(f, _)| *f < SLACK_BELOW_N).fold(0.0, |sum, (_, l)| sum + l)
                / length_mm,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A closed thread of four beams with lengths 1, 2, 3 and 4 mm along x.
    fn mesh() -> Mesh {
        Mesh {
            nodes: [0.0, 1.0, 3.0, 6.0].map(|x| [x, 0.0, 0.0]).to_vec(),
            period: Some([10.0, 5.0]),
            threads: vec![Thread {
                name: "stitch".into(),
                first: 0,
                count: 4,
                wrap: Some([1, 0]),
                radius: 0.1,
                axial: 11.0,
                bending: 0.0,
                rest_curvature: 1.0,
                linear_density: 1e-11,
                thermal_strain: 0.0,
                velocity: [0.0; 3],
                parts: vec![Part::Loop, Part::Loop, Part::Underlap, Part::Underlap],
                excess: vec![0.0; 4],
            }],
            ..Mesh::default()
        }
    }

    #[test]
    fn weights_are_lengths_and_the_closing_beam_counts() {
        let s = measure(&mesh(), &[0.4, -0.1, 0.01, 0.3]).unwrap();
        assert_eq!(s.all.length_mm, 10.0);
        assert!((s.all.mean_n - 0.143).abs() < 1e-15);
        assert_eq!((s.all.min_n, s.all.max_n), (-0.1, 0.4));
        assert_eq!(s.all.quantiles_n, [-0.1, 0.01, 0.01, 0.3, 0.4]);
        assert_eq!(s.all.slack_share, 0.5);
        assert_eq!((s.loops.length_mm, s.underlaps.length_mm), (3.0, 7.0));
        assert!((s.underlaps.slack_share - 3.0 / 7.0).abs() < 1e-15);
    }

    #[test]
    fn a_leg_is_a_run_of_beams_of_one_part() {
        let found = legs(&mesh(), &[0.4, -0.1, 0.01, 0.3]).unwrap();
        assert_eq!(found.iter().map(|l| l.part).collect::<Vec<_>>(), [Part::Loop, Part::Underlap]);
        assert_eq!((found[0].middle, found[0].chord), (DVec2::new(1.5, 0.0), DVec2::new(3.0, 0.0)));
        assert!((found[0].force_n - 0.2 / 3.0).abs() < 1e-15 && found[0].taut());
        assert!((found[1].force_n - 1.23 / 7.0).abs() < 1e-15);
        assert!(!legs(&mesh(), &[0.0, 0.02, 0.0, 0.0]).unwrap()[0].taut());
    }

    #[test]
    fn wrong_input_is_named() {
        assert!(measure(&mesh(), &[0.0; 3]).unwrap_err().to_string().contains("4 beams"));
        let message = measure(&mesh(), &[0.0, f64::NAN, 0.0, 0.0]).unwrap_err().to_string();
        assert!(message.contains("stitch") && message.contains('1'), "{message}");
        assert!(measure(&Mesh::default(), &[]).unwrap().all.mean_n.is_nan());
    }
}
