//! Tension of the stitch: how hard its loops and underlaps pull, and which share of it is slack.

use crate::error::{Error, Result};
use crate::mesh::{Mesh, Part};

/// Axial force below which a beam counts as slack, N.
pub const SLACK_BELOW_N: f64 = 0.02;

/// Shares at which [`Tension::quantiles_n`] are taken.
pub const QUANTILES: [f64; 5] = [0.05, 0.25, 0.5, 0.75, 0.95];

/// Axial force over some length of thread, every beam weighted by its reference length. All NaN if there is no beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tension {
    /// Reference length, mm.
    pub length_mm: f64,
    pub min_n: f64,
    pub mean_n: f64,
    pub max_n: f64,
    /// Smallest forces that are not exceeded over at least the shares [`QUANTILES`] of the length, N.
    pub quantiles_n: [f64; 5],
    /// Share of the length with a force below [`SLACK_BELOW_N`]; compression is slack.
    pub slack_share: f64,
}

/// Tension of all threads, and by part of the lap. Threads of inline meshes count only in `all`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stitches {
    pub all: Tension,
    pub loops: Tension,
    pub underlaps: Tension,
}

/// Tensions from the axial force of every beam, N, threads in order.
pub fn measure(mesh: &Mesh, forces: &[f64]) -> Result<Stitches> {
    if forces.len() != mesh.beams() {
        let message = format!("{} values where the mesh has {} beams", forces.len(), mesh.beams());
        return Err(Error::geometry("axial forces", message));
    }
    let mut samples = Vec::with_capacity(forces.len());
    let beams = mesh.threads.iter().flat_map(|t| (0..t.beams()).map(move |i| (t, i)));
    for ((thread, i), &force) in beams.zip(forces) {
        if force.is_nan() {
            return Err(Error::geometry(
                format!("thread {}, beam {i}", thread.name),
                "its axial force is not a number",
            ));
        }
        let [a, b] = thread.beam(i).map(|seen| mesh.position(seen));
        let length = (0..3).map(|k| (b[k] - a[k]).powi(2)).sum::<f64>().sqrt();
        let part = thread.parts.get(i).copied().unwrap_or(Part::Free);
        samples.push((force, length, part));
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
    /// From (force, length), forces rising.
    fn of(sorted: impl Iterator<Item = (f64, f64)> + Clone) -> Self {
        let length_mm: f64 = sorted.clone().map(|(_, l)| l).sum();
        let quantile = |share: f64| {
            let mut below = 0.0;
            // A rounding margin, so that half of two equal beams is the first of them.
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
    use crate::mesh::Thread;

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
    fn wrong_input_is_named() {
        assert!(measure(&mesh(), &[0.0; 3]).unwrap_err().to_string().contains("4 beams"));
        let message = measure(&mesh(), &[0.0, f64::NAN, 0.0, 0.0]).unwrap_err().to_string();
        assert!(message.contains("stitch") && message.contains('1'), "{message}");
        assert!(measure(&Mesh::default(), &[]).unwrap().all.mean_n.is_nan());
    }
}
