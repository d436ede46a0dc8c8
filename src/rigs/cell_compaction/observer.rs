//! Measures a cell between plates: what the cell itself is measured by, and the pressure of the plates.

use crate::case::fabric::Fabric;
use crate::error::Result;
use crate::kernel::record::{Record, Recorded};
use crate::mesh::frame::Frame;
use crate::mesh::quality::{TONNES_PER_MM2, TONNES_PER_MM3};
use crate::output::appended::Appended;
use crate::output::rows::Plates;
use crate::output::table::Table;
use crate::rigs::cell::Sheared;
use crate::rigs::observer::{Loading, Observer, Seen, Tables};
use crate::settings::steps::Step;
use crate::simulate::Simulation;
use serde_json::{Value, json};
use std::path::Path;

/// The observer of a compacted cell.
pub(super) struct Compacted {
    cell: Sheared,
    /// Volume of the fibres per area of the fabric at the start, mm.
    fibres: f64,
    /// Reference area of the cell, mm².
    area: f64,
    /// Distance of the plates at the start, mm.
    apart: f64,
    table: Table<Plates>,
    /// Thickness, mm, pressure, MPa, and fibre volume fraction at the last row under load.
    last: Option<[f64; 3]>,
}

impl Compacted {
    pub(super) fn of(fabric: &Fabric, density: f64, simulation: &Simulation, tables: &Tables) -> Result<Self> {
        let mesh = simulation.mesh();
        let masses = [&fabric.warp, &fabric.weft].map(|yarn| yarn.areal_mass_g_m2 * TONNES_PER_MM2);
        Ok(Self {
            cell: Sheared::of(fabric, simulation, tables)?,
            fibres: masses.iter().sum::<f64>() / (density * TONNES_PER_MM3),
            area: mesh.period.map_or(f64::NAN, |[x, y]| x * y),
            apart: mesh.tools[1].at_mm[2] - mesh.tools[0].at_mm[2],
            table: tables.open("plates.csv")?,
            last: None,
        })
    }
}

impl Observer for Compacted {
    fn start(&mut self, simulation: &Simulation, behind: &[Step]) -> Result<()> {
        self.cell.start(simulation, behind)
    }

    fn row(&mut self, simulation: &mut Simulation, seen: &Seen) -> Result<Loading> {
        let loading = self.cell.row(simulation, seen)?;
        let [lower, upper] = [0, 1].map(|plate| simulation.tools()[plate]);
        let thickness = self.apart + upper.displacement[2] - lower.displacement[2];
        let [x, y] = simulation.stretch();
        let spread = x * y * libm::cos(simulation.load().angle);
        let [lower, upper] = [-lower.force[2], upper.force[2]].map(|force| force / (self.area * spread));
        let share = self.fibres / (thickness * spread);
        if seen.phase == "move" {
            self.last = Some([thickness, upper, share]);
        }
        self.table.row(&Plates {
            time_s: simulation.time(),
            shear_angle_deg: loading.degrees,
            thickness_mm: thickness,
            upper_pressure_mpa: upper,
            lower_pressure_mpa: lower,
            fibre_volume_fraction: share,
        })?;
        Ok(loading)
    }

    fn end_of_step(&mut self, simulation: &Simulation, step: &Step) -> Result<()> {
        self.cell.end_of_step(simulation, step)
    }

    fn frame(&mut self, simulation: &Simulation, frame: &mut Frame, dir: &Path, name: &str) -> Result<()> {
        self.cell.frame(simulation, frame, dir, name)
    }

    fn is_loaded(&self, simulation: &Simulation, phase: &str) -> bool {
        phase == "move" && simulation.load().motion.abs() > 0.5 || self.cell.is_loaded(simulation, phase)
    }

    fn tables(&mut self) -> Vec<&mut Appended> {
        let Self { cell, table, .. } = self;
        cell.tables().into_iter().chain([&mut table.file]).collect()
    }

    fn record(&mut self, record: &mut Record) {
        let Self { cell, last, fibres: _, area: _, apart: _, table: _ } = self;
        cell.record(record);
        last.record(record);
    }

    fn summary(&self, simulation: &Simulation) -> Vec<(&'static str, Value)> {
        let compacted = self.last.map(|[thickness, pressure, share]| {
            let value = json!({ "thickness_mm": thickness, "pressure_mpa": pressure, "fibre_volume_fraction": share });
            ("compaction", value)
        });
        self.cell.summary(simulation).into_iter().chain(compacted).collect()
    }

    fn lines(&self, simulation: &Simulation) -> String {
        let compacted = self.last.map_or(String::new(), |[thickness, pressure, share]| {
            format!("plates     {thickness:.4} mm apart, {pressure:.4} MPa, fibre volume fraction {share:.3}\n")
        });
        self.cell.lines(simulation) + &compacted
    }
}
