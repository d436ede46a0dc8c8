//! Measures the bent thread at every row.

use super::elastica::{peirce, stiffness};
use crate::case::Case;
use crate::case::domain;
use crate::error::Result;
use crate::kernel::record::{Record, Recorded};
use crate::mesh::quality::TONNES_PER_MM_OF_TEX;
use crate::output::appended::Appended;
use crate::output::rows::Cantilever;
use crate::output::table::Table;
use crate::rigs::constituents::Property;
use crate::rigs::observer::{Loading, Observer, Seen, Tables};
use crate::simulate::Simulation;
use serde_json::{Value, json};
use std::fmt::Write as _;

/// The observer of a cantilever.
pub(super) struct Bent {
    /// Overhanging length, mm, and weight per length, N/mm.
    length: f64,
    weight: f64,
    /// Bending stiffness that was put in, N·mm².
    given: f64,
    table: Table<Cantilever>,
    /// Bending stiffness by Eq. 9 and by the elastica at the last row, N·mm².
    last: Option<[f64; 2]>,
}

impl Bent {
    pub(super) fn of(rig: &domain::Cantilever, case: &Case, tables: &Tables) -> Result<Self> {
        let stitch = &case.fabric()?.stitch;
        let [_, fall, _] = case.effects.gravity_mm_s2.unwrap_or_default();
        Ok(Self {
            length: rig.length_mm,
            weight: -fall * stitch.linear_density_tex * TONNES_PER_MM_OF_TEX,
            given: stitch.bending_n_mm2,
            table: tables.open("cantilever.csv")?,
            last: None,
        })
    }

    fn property(&self) -> Option<Property> {
        let [_, evaluated] = self.last?;
        Some(Property { symbol: "G_s", unit: "N mm²", by: "the heavy elastica", evaluated, given: self.given })
    }
}

impl Observer for Bent {
    fn row(&mut self, simulation: &mut Simulation, seen: &Seen) -> Result<Loading> {
        let positions = simulation.shape().positions;
        simulation.alive()?;
        // the clamp holds the first beam by its middle
        let clamp = [0, 1].map(|k| 0.5 * (positions[0][k] + positions[1][k]));
        let tip = positions[positions.len() - 1];
        let [along, down] = [tip[0] - clamp[0], clamp[1] - tip[1]];
        let angle = libm::atan2(down, along);
        let by_elastica = stiffness(angle, self.length, self.weight);
        self.last = by_elastica.map(|by_elastica| [peirce(angle, self.length, self.weight), by_elastica]);
        let [by_equation, by_elastica] = self.last.unwrap_or([f64::NAN; 2]);
        self.table.row(&Cantilever {
            time_s: simulation.time(),
            tip_along_mm: along,
            tip_down_mm: down,
            chord_angle_deg: angle.to_degrees(),
            bending_eq_9_n_mm2: by_equation,
            bending_elastica_n_mm2: by_elastica,
        })?;
        Ok(Loading { degrees: 0.0, force: seen.machine, normalised: f64::NAN })
    }

    fn tables(&mut self) -> Vec<&mut Appended> {
        vec![&mut self.table.file]
    }

    fn record(&mut self, record: &mut Record) {
        self.last.record(record);
    }

    fn summary(&self, _: &Simulation) -> Vec<(&'static str, Value)> {
        let by_equation = self.last.map(|[by_equation, _]| ("bending_by_eq_9_n_mm2", json!(by_equation)));
        self.property().map(|property| property.summary()).into_iter().chain(by_equation).collect()
    }

    fn lines(&self, _: &Simulation) -> String {
        let mut t = self.property().map_or(String::new(), |property| property.line());
        if let Some([by_equation, by_elastica]) = self.last {
            let off = 100.0 * (by_equation / by_elastica - 1.0);
            // writing to a String does not fail
            let _ = writeln!(t, "Eq. 9      {by_equation:.4e} N mm² ({off:+.1} % from the elastica)");
        }
        t
    }
}
