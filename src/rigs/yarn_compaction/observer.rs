//! Measures the compacted yarn at every row.

use super::side;
use crate::case::fabric::Yarn;
use crate::error::Result;
use crate::kernel::record::{Record, Recorded};
use crate::mesh::Mesh;
use crate::mesh::quality::{TONNES_PER_MM2, TONNES_PER_MM3};
use crate::output::appended::Appended;
use crate::output::rows::Compaction;
use crate::output::table::Table;
use crate::rigs::constituents::Property;
use crate::rigs::observer::{Loading, Observer, Seen, Tables};
use crate::settings::material::Material;
use crate::simulate::Simulation;
use serde_json::Value;

/// The observer of a compacted yarn.
pub(super) struct Pressed {
    material: Material,
    /// Area of the fibres in the section, mm².
    fibres: f64,
    /// Length, width and thickness at the start, mm.
    size: [f64; 3],
    /// Nodes of the lowest and highest plane along each axis.
    sides: [[Vec<usize>; 2]; 3],
    table: Table<Compaction>,
    /// Compaction stiffness at the last row under load, MPa.
    last: Option<f64>,
}

impl Pressed {
    pub(super) fn of(yarn: &Yarn, density: f64, mesh: &Mesh, tables: &Tables) -> Result<Self> {
        let sides = [0, 1, 2].map(|axis| [-1.0, 1.0].map(|end| side(mesh, axis, end)));
        let size = [0, 1, 2].map(|axis| mesh.nodes[sides[axis][1][0]][axis] - mesh.nodes[sides[axis][0][0]][axis]);
        Ok(Self {
            material: yarn.material.clone(),
            fibres: yarn.areal_mass_g_m2 * TONNES_PER_MM2 * yarn.pitch_mm / (density * TONNES_PER_MM3),
            size,
            sides,
            table: tables.open("compaction.csv")?,
            last: None,
        })
    }

    /// K_comp by which the law gives a force over the initial area, MPa, at logarithms of the stretches of width and thickness.
    fn stiffness(&self, nominal: f64, across: f64, through: f64) -> Option<f64> {
        let Material::Charmetant { p_comp, k_dist_mpa, .. } = self.material else { return None };
        let compaction = -0.5 * (across + through);
        let of_compaction = nominal * libm::exp(through) - 0.25 * k_dist_mpa * (across - through);
        (compaction > 0.0).then(|| of_compaction / (0.5 * p_comp * libm::pow(compaction, p_comp - 1.0)))
    }
}

impl Observer for Pressed {
    fn row(&mut self, simulation: &mut Simulation, seen: &Seen) -> Result<Loading> {
        let positions = simulation.shape().positions;
        simulation.alive()?;
        let mean = |nodes: &[usize], axis: usize| {
            nodes.iter().map(|node| positions[*node][axis]).sum::<f64>() / nodes.len() as f64
        };
        let now = [0, 1, 2].map(|axis| mean(&self.sides[axis][1], axis) - mean(&self.sides[axis][0], axis));
        let [across, through] = [1, 2].map(|axis| libm::log(now[axis] / self.size[axis]));
        let stiffness = self.stiffness(seen.machine / (self.size[0] * self.size[1]), across, through);
        self.last = stiffness.filter(|_| seen.phase == "move").or(self.last);
        self.table.row(&Compaction {
            time_s: simulation.time(),
            thickness_mm: now[2],
            width_mm: now[1],
            pressure_mpa: seen.machine / (now[0] * now[1]),
            fibre_volume_fraction: self.fibres / (now[1] * now[2]),
            k_comp_mpa: stiffness.unwrap_or(f64::NAN),
        })?;
        Ok(Loading { degrees: 0.0, force: seen.machine, normalised: f64::NAN })
    }

    fn is_loaded(&self, simulation: &Simulation, phase: &str) -> bool {
        phase == "move" && simulation.load().motion.abs() > 0.1
    }

    fn tables(&mut self) -> Vec<&mut Appended> {
        vec![&mut self.table.file]
    }

    fn record(&mut self, record: &mut Record) {
        self.last.record(record);
    }

    fn summary(&self, _: &Simulation) -> Vec<(&'static str, Value)> {
        self.property().map(|property| property.summary()).into_iter().collect()
    }

    fn lines(&self, _: &Simulation) -> String {
        self.property().map_or(String::new(), |property| property.line())
    }
}

impl Pressed {
    fn property(&self) -> Option<Property> {
        let Material::Charmetant { k_comp_mpa: given, .. } = self.material else { return None };
        Some(Property { symbol: "K_comp", unit: "MPa", by: "the pressure at the end", evaluated: self.last?, given })
    }
}
