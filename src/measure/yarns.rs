//! Width, thickness, gap and broadness of yarns in their deformed state, all in mm.
//!
//! Stations are the slice boundaries of a yarn: all of them for a closed yarn, all except the two cut ends for an open one. At
//! a station, with the nodes of its section and their mean c:
//! - t is the in-plane direction (x, y) of the deformed centreline, from the previous to the next section; n is t turned by +90°;
//! - width is the extent of the nodes along n;
//! - thickness is the largest distance in z between the top and the bottom node of a column;
//! - gap is the distance along n from the outermost node on the +n side to the facing edge of the next yarn of the same ply.
//!   The edge of a yarn is the chain of its outermost nodes; periodic images up to two cells away are included. A negative gap
//!   means that the two overlap in the plane, by at most half the width. NaN means that there is no next yarn;
//! - broadness is width plus gap.
//!
//! Without shear an undeformed ply has the broadness p (its pitch); under trellis shear without slip it is p cos γ.

use super::Spread;
use super::outline::{self, Outline};
use crate::error::Result;
use crate::mesh::frame::Frame;
use crate::mesh::{Block, Mesh, Ply};

/// Sizes of one yarn at its stations, mm.
#[derive(Debug, Clone)]
pub struct Yarn {
    /// Index of the block.
    pub block: usize,
    pub ply: Ply,
    pub width: Vec<f64>,
    pub thickness: Vec<f64>,
    pub gap: Vec<f64>,
    pub broadness: Vec<f64>,
}

/// Spreads over some stations, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sizes {
    pub width: Spread,
    pub thickness: Spread,
    pub gap: Spread,
    pub broadness: Spread,
}

impl Yarn {
    /// Spread over the stations of this yarn.
    pub fn sizes(&self) -> Sizes {
        Sizes::of([self].into_iter())
    }
}

impl Sizes {
    /// Spread over all stations of the given yarns.
    fn of<'a>(yarns: impl Iterator<Item = &'a Yarn> + Clone) -> Self {
        let spread =
            |values: fn(&Yarn) -> &Vec<f64>| Spread::of(yarns.clone().flat_map(move |y| values(y).iter().copied()));
        Self {
            width: spread(|y| &y.width),
            thickness: spread(|y| &y.thickness),
            gap: spread(|y| &y.gap),
            broadness: spread(|y| &y.broadness),
        }
    }
}

/// Spread over every station of every yarn of a ply; all NaN if it has no yarns.
pub fn ply(yarns: &[Yarn], ply: Ply) -> Sizes {
    Sizes::of(yarns.iter().filter(move |y| y.ply == ply))
}

/// Sizes of every yarn, blocks in order.
pub fn measure(mesh: &Mesh, frame: &Frame) -> Result<Vec<Yarn>> {
    frame.check(mesh)?;
    let outlines: Vec<Outline> = mesh.blocks.iter().map(|b| Outline::of(mesh, frame, b)).collect();
    let shifts = outline::shifts(mesh, frame);
    let yarn = |(index, block): (usize, &Block)| {
        let outline = &outlines[index];
        let neighbours = outline::neighbours(mesh, &outlines, &shifts, index);
        let stations = if block.wrap.is_some() { 0..block.slices } else { 1..block.slices };
        let (width, gap): (Vec<f64>, Vec<f64>) =
            stations.clone().map(|s| (outline.width(s), outline.gap(s, &neighbours))).unzip();
        Yarn {
            block: index,
            ply: block.ply,
            thickness: stations.map(|s| thickness(mesh, frame, block, s)).collect(),
            broadness: width.iter().zip(&gap).map(|(w, g)| w + g).collect(),
            width,
            gap,
        }
    };
    Ok(mesh.blocks.iter().enumerate().map(yarn).collect())
}

fn thickness(mesh: &Mesh, frame: &Frame, block: &Block, station: usize) -> f64 {
    let height = |column, layer| frame.position(mesh, block.node(station, column, layer))[2];
    (0..=block.columns).map(|c| (height(c, block.layers) - height(c, 0)).abs()).fold(f64::NAN, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::shear::trellis;
    use crate::mesh::sample;

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-12
    }

    #[test]
    fn straight_yarns_have_their_nominal_sizes() {
        let mesh = sample::plies();
        let yarns = measure(&mesh, &sample::frame(&mesh, [[1.0, 0.0], [0.0, 1.0]])).unwrap();
        for (which, width, pitch) in [(Ply::Warp, 4.59, 5.0), (Ply::Weft, 2.08, 2.5)] {
            let sizes = ply(&yarns, which);
            assert!(close(sizes.width.min, width) && close(sizes.width.max, width));
            assert!(close(sizes.thickness.mean, 0.38));
            assert!(close(sizes.gap.min, pitch - width) && close(sizes.gap.max, pitch - width), "{:?}", sizes.gap);
            assert!(close(sizes.broadness.mean, pitch) && sizes.broadness.std < 1e-12);
        }
        assert!(yarns.iter().all(|y| y.width.len() == mesh.blocks[y.block].slices));
    }

    #[test]
    fn rigid_motion_changes_nothing() {
        let mesh = sample::plies();
        let (s, c) = 0.7_f64.sin_cos();
        let mut frame = sample::frame(&mesh, [[c, -s], [s, c]]);
        frame.positions.iter_mut().for_each(|p| *p = [p[0] + 3.0, p[1] - 8.0, p[2] + 1.0]);
        let sizes = ply(&measure(&mesh, &frame).unwrap(), Ply::Warp);
        assert!(close(sizes.width.mean, 4.59) && close(sizes.gap.max, 0.41) && close(sizes.thickness.mean, 0.38));
    }

    #[test]
    fn trellis_shear_without_slip_gives_pitch_times_cosine() {
        let mesh = sample::plies();
        for degrees in [-50.0_f64, -15.0, 20.0, 60.0] {
            let angle = degrees.to_radians();
            let yarns = measure(&mesh, &sample::frame(&mesh, trellis(angle))).unwrap();
            for (which, width, pitch) in [(Ply::Warp, 4.59, 5.0), (Ply::Weft, 2.08, 2.5)] {
                let sizes = ply(&yarns, which);
                assert!(
                    close(sizes.broadness.min, pitch * angle.cos()) && close(sizes.broadness.max, pitch * angle.cos())
                );
                assert!(close(sizes.width.mean, width * angle.cos()));
            }
        }
    }

    #[test]
    fn without_neighbours_there_is_no_gap() {
        let mut mesh = sample::plies();
        mesh.period = None;
        mesh.blocks.truncate(1);
        mesh.blocks[0].wrap = None;
        mesh.blocks[0].slices -= 1;
        let yarns = measure(&mesh, &sample::frame(&mesh, [[1.0, 0.0], [0.0, 1.0]])).unwrap();
        assert_eq!(yarns[0].width.len(), mesh.blocks[0].slices - 1);
        assert!(yarns[0].sizes().gap.mean.is_nan() && yarns[0].sizes().broadness.mean.is_nan());
    }

    #[test]
    fn a_frame_of_another_mesh_is_refused() {
        let mesh = sample::plies();
        assert!(measure(&mesh, &Frame::default()).unwrap_err().to_string().contains("positions"));
    }
}
