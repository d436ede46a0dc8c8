//! A scene with conditions: besides what every scene has, there is the force of the machine.

use crate::error::Result;
use crate::rigs::observer::{Loading, Observer, Seen};
use crate::simulate::Simulation;

/// What moves the conditions.
pub(super) struct Machine;

impl Observer for Machine {
    fn row(&mut self, _: &mut Simulation, seen: &Seen) -> Result<Loading> {
        Ok(Loading { degrees: 0.0, force: seen.machine, normalised: f64::NAN })
    }
}
