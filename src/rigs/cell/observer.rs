//! Measures a cell during shear: F_nor, homogenised stress, membrane forces, crossings and yarn sizes.

use crate::case::fabric::Fabric;
use crate::error::Result;
use crate::kernel::record::{Record, Recorded};
use crate::measure::shear::{self, CellCurve};
use crate::measure::yarns::{self, Yarn};
use crate::mesh::Ply;
use crate::mesh::frame::Frame;
use crate::output::appended::Appended;
use crate::output::rows::Stress;
use crate::output::table::Table;
use crate::rigs::crossings::Crossed;
use crate::rigs::observer::{Loading, Observer, Seen, Tables};
use crate::settings::steps::Step;
use crate::simulate::Simulation;
use glam::DVec2;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;

/// Shear angle above which the kinetic energy is judged, degrees.
const SETTLED_DEG: f64 = 2.0;
/// Diagonal of the cell towards which positive shear turns the yarns.
const DIAGONAL: DVec2 = DVec2::ONE;
/// Angles at which the closing lines state F_nor, degrees, and their tolerance.
const STATED_DEG: [f64; 5] = [5.0, 15.0, 25.0, 35.0, 45.0];
const NEAR_DEG: f64 = 1.0;

/// The cell observer.
pub(in crate::rigs) struct Sheared {
    /// Reference area, mm².
    area: f64,
    force: CellCurve,
    stress: Table<Stress>,
    crossings: Option<Crossed>,
    /// Sizes of warp and weft in the real fabric, for the closing lines.
    measured: [String; 2],
    /// Shear angle, degrees, and F_nor, N/mm, at every row of shear.
    curve: Vec<(f64, f64)>,
    /// Squared errors of the membrane forces along x and y, (N/mm)², summed over the rows of shear, and the number of rows.
    missed: [f64; 3],
    /// Yarn sizes before shear.
    settled: Option<Means>,
    /// Step and yarn sizes of the last row, if that is before shear.
    latest: Option<(u64, Means)>,
}

/// Mean width, thickness and gap of warp and weft, mm.
type Means = [[f64; 3]; 2];

impl Sheared {
    pub(in crate::rigs) fn of(fabric: &Fabric, simulation: &Simulation, tables: &Tables) -> Result<Self> {
        let mesh = simulation.mesh();
        let measured = |yarn: &crate::case::fabric::Yarn| {
            let measured = yarn.measured.as_ref();
            measured.map_or(String::new(), |m| format!(" ({} {})", m.by, m.texts().join(" / ")))
        };
        Ok(Self {
            area: mesh.period.map_or(f64::NAN, |[x, y]| x * y),
            force: CellCurve::new(mesh),
            stress: tables.open("stress.csv")?,
            crossings: Crossed::of(mesh, DIAGONAL, None, tables)?,
            measured: [&fabric.warp, &fabric.weft].map(measured),
            curve: Vec::new(),
            missed: [0.0; 3],
            settled: None,
            latest: None,
        })
    }

    /// F_nor, N/mm: the mean over the row, or from V P̄ while the angle is constant.
    fn force(&mut self, simulation: &Simulation, stress: [[f64; 3]; 3]) -> f64 {
        let angle = simulation.load().angle;
        let still = || shear::normalised_force(in_plane(stress), angle, simulation.stretch(), self.area);
        self.force.push(angle, simulation.energies().external).unwrap_or_else(still)
    }

    /// Yarn sizes before shear, for the closing lines.
    fn settle(&mut self, simulation: &Simulation) -> Result<()> {
        let frame = simulation.shape();
        simulation.alive()?;
        let yarns = yarns::measure(simulation.mesh(), &frame)?;
        self.settled = Some(means(&yarns));
        Ok(())
    }

    /// Root-mean-square error of the membrane force along x or y over the rows of shear, N/mm; `None` without a target.
    fn missed(&self, simulation: &Simulation, axis: usize) -> Option<f64> {
        let rows = self.missed[2];
        let driven = simulation.fibres()[axis].error.is_some() && rows > 0.0;
        driven.then(|| libm::sqrt(self.missed[axis] / rows))
    }

    /// F_nor at the reported angles.
    fn forces(&self) -> Vec<String> {
        // loading only: unloading follows another curve
        let mut furthest = 0.0f64;
        let is_new = |(angle, _): &&(f64, f64)| {
            let is_new = angle.abs() >= furthest;
            furthest = furthest.max(angle.abs());
            is_new
        };
        let out: Vec<&(f64, f64)> = self.curve.iter().filter(is_new).collect();
        let at = |angle: f64| {
            let near = out.iter().filter(|(a, _)| (a.abs() - angle).abs() <= NEAR_DEG).map(|(_, f)| *f);
            let (sum, count) = near.fold((0.0, 0), |(s, n), f| (s + f, n + 1));
            (count > 0).then(|| format!("{:.4} at {angle}°", sum / f64::from(count)))
        };
        STATED_DEG.into_iter().filter_map(at).collect()
    }
}

impl Observer for Sheared {
    fn start(&mut self, simulation: &Simulation, behind: &[Step]) -> Result<()> {
        self.force.start(simulation.load().angle, simulation.energies().external);
        if behind.iter().any(|step| matches!(step, Step::Shear { .. })) {
            return Ok(());
        }
        self.settle(simulation)
    }

    fn row(&mut self, simulation: &mut Simulation, seen: &Seen) -> Result<Loading> {
        let time = simulation.time();
        let degrees = simulation.load().angle.to_degrees();
        let stress = simulation.take_stress().unwrap_or_default();
        // a row mean belongs to the middle of the row
        let middle = 0.5 * (self.force.angle() + simulation.load().angle);
        let normalised = self.force(simulation, stress);
        if seen.phase == "shear" {
            self.curve.push((degrees, normalised));
            for (sum, fibres) in self.missed.iter_mut().zip(simulation.fibres()) {
                *sum += fibres.error.map_or(0.0, |error| error * error);
            }
            self.missed[2] += 1.0;
        }
        let yarns = seen.yarns.filter(|_| seen.phase != "shear");
        self.latest = yarns.map(|(_, yarns)| (simulation.step(), means(yarns)));
        let [weft_stretch, warp_stretch] = simulation.stretch();
        let [weft_membrane, warp_membrane] = shear::membrane_forces(in_plane(stress), middle, self.area);
        let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = stress.map(|row| row.map(|p| p / self.area));
        self.stress.row(&Stress {
            time_s: time,
            shear_angle_deg: degrees,
            p_xx_n_per_mm: xx,
            p_xy_n_per_mm: xy,
            p_xz_n_per_mm: xz,
            p_yx_n_per_mm: yx,
            p_yy_n_per_mm: yy,
            p_yz_n_per_mm: yz,
            p_zx_n_per_mm: zx,
            p_zy_n_per_mm: zy,
            p_zz_n_per_mm: zz,
            weft_stretch,
            warp_stretch,
            weft_membrane_n_per_mm: weft_membrane,
            warp_membrane_n_per_mm: warp_membrane,
        })?;
        if let (Some(crossed), Some((frame, yarns))) = (&mut self.crossings, seen.yarns) {
            let crossings = crossed.measure(simulation.mesh(), frame, yarns)?;
            crossed.write_row([time, degrees, simulation.displacement()], &crossings, f64::NAN)?;
        }
        Ok(Loading { degrees, force: seen.machine, normalised })
    }

    fn end_of_step(&mut self, simulation: &Simulation, step: &Step) -> Result<()> {
        if matches!(step, Step::Shear { .. }) {
            return Ok(());
        }
        match self.latest {
            Some((step, means)) if step == simulation.step() => {
                self.settled = Some(means);
                Ok(())
            }
            _ => self.settle(simulation),
        }
    }

    fn frame(&mut self, simulation: &Simulation, frame: &mut Frame, dir: &Path, name: &str) -> Result<()> {
        self.crossings.as_mut().map_or(Ok(()), |crossed| crossed.frame(simulation.mesh(), frame, dir, name))
    }

    fn is_loaded(&self, simulation: &Simulation, phase: &str) -> bool {
        phase == "shear" && simulation.load().angle.to_degrees().abs() > SETTLED_DEG
    }

    fn tables(&mut self) -> Vec<&mut Appended> {
        let crossings = self.crossings.iter_mut().flat_map(Crossed::files);
        std::iter::once(&mut self.stress.file).chain(crossings).collect()
    }

    fn record(&mut self, record: &mut Record) {
        let Self { crossings, force, curve, missed, settled, area: _, stress: _, measured: _, latest: _ } = self;
        if let Some(crossed) = crossings {
            crossed.maps.record(record);
        }
        curve.record(record);
        force.record(record);
        missed.record(record);
        settled.record(record);
    }

    /// Stretch and membrane force along the fibres of each ply.
    fn summary(&self, simulation: &Simulation) -> Vec<(&'static str, Value)> {
        let [weft, warp] = [0, 1].map(|axis| {
            let fibres = simulation.fibres()[axis];
            json!({
                "stretch": fibres.stretch,
                "membrane_n_per_mm": fibres.force,
                "error_in_shear_n_per_mm": self.missed(simulation, axis),
            })
        });
        vec![("fibres", json!({ "warp": warp, "weft": weft }))]
    }

    fn lines(&self, simulation: &Simulation) -> String {
        let mut t = String::new();
        // writing to a String does not fail
        for ((name, measured), [width, thickness, gap]) in
            ["warp", "weft"].into_iter().zip(&self.measured).zip(self.settled.into_iter().flatten())
        {
            let _ = writeln!(
                t,
                "{name}       width / thickness / gap {width:.2} / {thickness:.2} / {gap:.2} mm before shear{measured}"
            );
        }
        let forces = self.forces();
        if !forces.is_empty() {
            let _ = writeln!(t, "F_nor      {} N/mm (mean over ±{NEAR_DEG}°)", forces.join(", "));
        }
        let [weft, warp] = simulation.fibres();
        let misses = [1, 0].map(|axis| self.missed(simulation, axis));
        let missed = if misses.iter().any(Option::is_some) {
            let [warp, weft] = misses.map(|miss| miss.map_or("–".into(), |miss| format!("{miss:.4}")));
            format!("; off its aim by {warp} / {weft} (rms in shear)")
        } else {
            String::new()
        };
        let _ = writeln!(
            t,
            "fibres     warp / weft {:+.3} / {:+.3} % longer, membrane force {:.3} / {:.3} N/mm at the end{missed}",
            100.0 * (warp.stretch - 1.0),
            100.0 * (weft.stretch - 1.0),
            warp.force,
            weft.force
        );
        t
    }
}

fn means(yarns: &[Yarn]) -> Means {
    let means = |p: yarns::Sizes| [p.width.mean, p.thickness.mean, p.gap.mean];
    [Ply::Warp, Ply::Weft].map(|ply| means(yarns::ply(yarns, ply)))
}

/// The in-plane components.
fn in_plane(stress: [[f64; 3]; 3]) -> [[f64; 2]; 2] {
    [0, 1].map(|i| [stress[i][0], stress[i][1]])
}
