//! Observer of an inline scene: it adds the machine force to the common measures.

use crate::error::Result;
use crate::rigs::observer::{Loading, Observer, Seen};
use crate::simulate::Simulation;

/// The observer of a scene with conditions.
pub(super) struct Machine;

impl Observer for Machine {
    fn row(&mut self, _: &mut Simulation, seen: &Seen) -> Result<Loading> {
        Ok(Loading { degrees: 0.0, force: seen.machine, normalised: f64::NAN })
    }
}
