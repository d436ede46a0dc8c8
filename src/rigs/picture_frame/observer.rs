//! Measures a picture frame: forces of the machine and in the clamps, F_nor, and the shear at the crossings.

use super::{CLAMPS, axis};
use crate::case::domain::PictureFrame;
use crate::error::Result;
use crate::kernel::record::{Record, Recorded};
use crate::measure::shear::{CellCurve, frame_displacement, trellis};
use crate::mesh::Ply;
use crate::mesh::frame::Frame;
use crate::output::appended::Appended;
use crate::output::rows;
use crate::output::table::Table;
use crate::rigs::crossings::Crossed;
use crate::rigs::observer::{Loading, Observer, Seen, Tables};
use crate::settings::steps::Step;
use crate::simulate::Simulation;
use glam::DVec2;
use std::f64::consts::FRAC_PI_4;
use std::path::Path;

/// Shear angle above which the kinetic energy is judged, degrees.
const SETTLED_DEG: f64 = 2.0;

/// The observer of a picture frame.
pub(super) struct Framed {
    frame: PictureFrame,
    crossings: Option<Crossed>,
    curve: CellCurve,
    /// Index of each prescribed node of each clamp.
    clamps: [Vec<usize>; 4],
    table: Table<rows::PictureFrame>,
    /// Frame angle, degrees, and F_nor, N/mm, at the last row under load.
    last: Option<[f64; 2]>,
}

impl Framed {
    pub(super) fn of(frame: &PictureFrame, simulation: &Simulation, tables: &Tables) -> Result<Self> {
        let mesh = simulation.mesh();
        let prescribed = simulation.prescribed_nodes();
        let places =
            |clamp| frame.clamped(mesh, clamp).iter().filter_map(|n| prescribed.binary_search(n).ok()).collect();
        Ok(Self {
            frame: frame.clone(),
            crossings: Crossed::of(mesh, DVec2::ONE, None, tables)?,
            curve: CellCurve::of(frame.fabric_mm * frame.fabric_mm),
            clamps: CLAMPS.map(places),
            table: tables.open("frame.csv")?,
            last: None,
        })
    }

    /// Force along the fibres in the clamps of a ply, N per mm of width: the mean of both.
    fn tension(&self, simulation: &Simulation, reactions: &[[f64; 3]], ply: Ply) -> f64 {
        let image = trellis(simulation.load().angle).map(|row| row[axis(ply)]);
        let pull = |clamp: usize| {
            let inwards = self.clamps[clamp].iter().map(|place| reactions[*place]);
            inwards.map(|force| -CLAMPS[clamp].2 * (force[0] * image[0] + force[1] * image[1])).sum::<f64>()
        };
        let own = (0..CLAMPS.len()).filter(|clamp| CLAMPS[*clamp].1 == ply);
        0.5 * own.map(pull).sum::<f64>() / self.frame.fabric_mm
    }
}

impl Observer for Framed {
    fn start(&mut self, simulation: &Simulation, _: &[Step]) -> Result<()> {
        self.curve.start(simulation.load().angle, simulation.energies().prescribed);
        Ok(())
    }

    fn row(&mut self, simulation: &mut Simulation, seen: &Seen) -> Result<Loading> {
        let (time, angle) = (simulation.time(), simulation.load().angle);
        let degrees = angle.to_degrees();
        let middle = 0.5 * (self.curve.angle() + angle);
        let PictureFrame { frame_mm, fabric_mm, .. } = self.frame;
        let normalised = self.curve.push(angle, simulation.energies().prescribed).filter(|_| seen.phase == "shear");
        let normalised = normalised.unwrap_or(f64::NAN);
        let shear = normalised * fabric_mm * fabric_mm / frame_mm;
        let machine = 2.0 * shear * (FRAC_PI_4 - 0.5 * middle).cos();
        if normalised.is_finite() {
            self.last = Some([degrees, normalised]);
        }
        let reactions = simulation.reactions();
        let [warp, weft] = [Ply::Warp, Ply::Weft].map(|ply| self.tension(simulation, &reactions, ply));
        self.table.row(&rows::PictureFrame {
            time_s: time,
            shear_angle_deg: degrees,
            machine_displacement_mm: frame_displacement(angle, frame_mm),
            machine_force_n: machine,
            shear_force_n: shear,
            f_nor_n_per_mm: normalised,
            warp_tension_n_per_mm: warp,
            weft_tension_n_per_mm: weft,
        })?;
        if let (Some(crossed), Some((frame, yarns))) = (&mut self.crossings, seen.yarns) {
            let crossings = crossed.measure(simulation.mesh(), frame, yarns)?;
            crossed.write_row([time, degrees, simulation.displacement()], &crossings, angle)?;
        }
        Ok(Loading { degrees, force: machine, normalised })
    }

    fn frame(&mut self, simulation: &Simulation, frame: &mut Frame, dir: &Path, name: &str) -> Result<()> {
        self.crossings.as_mut().map_or(Ok(()), |crossed| crossed.frame(simulation.mesh(), frame, dir, name))
    }

    fn is_loaded(&self, simulation: &Simulation, phase: &str) -> bool {
        phase == "shear" && simulation.load().angle.to_degrees().abs() > SETTLED_DEG
    }

    fn tables(&mut self) -> Vec<&mut Appended> {
        let crossings = self.crossings.iter_mut().flat_map(Crossed::files);
        std::iter::once(&mut self.table.file).chain(crossings).collect()
    }

    fn record(&mut self, record: &mut Record) {
        let Self { crossings, curve, last, frame: _, clamps: _, table: _ } = self;
        if let Some(crossed) = crossings {
            crossed.maps.record(record);
        }
        curve.record(record);
        last.record(record);
    }

    fn lines(&self, _: &Simulation) -> String {
        self.last.map_or(String::new(), |[degrees, force]| format!("F_nor      {force:.4} N/mm at {degrees:.1}°\n"))
    }
}
