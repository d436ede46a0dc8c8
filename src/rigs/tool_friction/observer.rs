//! The friction of a fabric on a plate.

use crate::error::Result;
use crate::kernel::record::{Record, Recorded};
use crate::rigs::constituents::Property;
use crate::rigs::observer::{Loading, Observer, Seen};
use crate::simulate::Simulation;
use serde_json::Value;

/// Amplitude from which on the forces count: by then the fabric is pressed and slides everywhere.
const PRESSED: f64 = 0.8;

/// The observer of a sliding plate.
pub(super) struct Slid {
    given: f64,
    /// Forces along and across the plate, N, summed over the rows that count.
    sums: [f64; 2],
}

impl Slid {
    pub(super) fn of(given: f64) -> Self {
        Self { given, sums: [0.0; 2] }
    }

    fn property(&self) -> Option<Property> {
        let ([along, across], given) = (self.sums, self.given);
        let by = "the forces on the plate";
        (across > 0.0).then(|| Property { symbol: "μ", unit: "–", by, evaluated: along / across, given })
    }
}

impl Observer for Slid {
    fn row(&mut self, simulation: &mut Simulation, seen: &Seen) -> Result<Loading> {
        let [x, _, z] = simulation.tools()[0].force;
        if seen.phase == "move" && simulation.load().motion >= PRESSED {
            self.sums = [self.sums[0] - x, self.sums[1] - z];
        }
        Ok(Loading { degrees: 0.0, force: -x, normalised: f64::NAN })
    }

    fn is_loaded(&self, simulation: &Simulation, phase: &str) -> bool {
        phase == "move" && simulation.load().motion >= PRESSED
    }

    fn record(&mut self, record: &mut Record) {
        let Self { given: _, sums } = self;
        sums.record(record);
    }

    fn summary(&self, _: &Simulation) -> Vec<(&'static str, Value)> {
        self.property().map(|property| property.summary()).into_iter().collect()
    }

    fn lines(&self, _: &Simulation) -> String {
        self.property().map_or(String::new(), |property| property.line())
    }
}
