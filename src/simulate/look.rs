//! A look at energies and limits at the end of a window of steps: the balance, the guards, and the next time step.

use super::{FIRST_SHARE, FIRST_TIME, NOISE, Simulation};
use crate::contact::status;
use crate::dynamics::time_step;
use crate::error::Result;
use crate::kernel::row::Row;

/// Totals in the middle of the last step of a window, between its forces and its motion, and after it.
pub(super) struct Looked {
    pub(super) middle: Vec<f64>,
    pub(super) after: Vec<f64>,
}

impl Simulation {
    /// Energies, limits and guards after a window of `steps` from time `from` to `to`.
    pub(super) fn look(&mut self, Looked { middle, after }: &Looked, steps: u64, from: f64, to: f64) -> Result<()> {
        self.add_work(middle, after);
        self.add_contact(middle);
        self.add_stress(middle, steps, from, to);
        self.set_state(middle, after);
        let e = &self.energies;
        let flow = [e.thermal, e.radius, e.external, e.prescribed, e.gravity].iter().map(|w| w.abs()).sum::<f64>();
        self.largest_flow = self.largest_flow.max(flow + self.start_energy.abs()).max(e.output());
        let error = e.output() - self.start_energy - e.input();
        self.health.balance = error / self.largest_flow.max(NOISE);
        let is_off = self.health.balance.abs() > 0.5 * self.scene.integration.energy_tolerance;
        self.half_off = is_off.then(|| self.half_off.unwrap_or(self.step));
        self.guards()?;
        self.choose_dt();
        Ok(())
    }

    /// Runs the stages for energies and limits, and asks for the totals.
    pub(super) fn diagnose(&mut self, row: Row<f64>) {
        self.backend.run(&self.model.plan.diagnose, &[row]);
        self.backend.run(&self.model.plan.collect, &[row]);
        self.backend.request(self.model.totals.buffer);
    }

    /// The health of the scene by its totals and status.
    pub(super) fn judge(&mut self, totals: &[f64], status: &[u32]) {
        let places = &self.model.totals;
        let (worst, node) = places.stiffness.of(totals);
        let contact = f64::from(f32::from_bits(status[status::CONTACT_RATE]));
        self.health.dt_limit = time_step::limit(worst + contact);
        self.health.limiting_node = node;
        (self.health.min_jacobian, self.health.worst_hex) = places.jacobian.map_or((1.0, 0), |largest| {
            let (negative, place) = largest.of(totals);
            (-negative, self.model.hex_at[place])
        });
        self.health.penetration = status::penetration(status);
        let steps = (self.step - self.diagnosed).max(1) as u32;
        self.diagnosed = self.step;
        self.health.touching = status::TOUCHING.map(|p| status[p] / steps);
        self.health.added_mass = std::array::from_fn(|kind| {
            let by_contact = places.added[kind].map_or(0.0, |added| added.of(totals, 0));
            let [truly, floor] = self.model.whole_mass[kind];
            if truly > 0.0 { (floor + by_contact) / truly } else { 0.0 }
        });
        self.backend.clear_part(self.model.buffers.status, status::SINCE_LOOK);
    }

    pub(super) fn choose_dt(&mut self) {
        let integration = &self.scene.integration;
        if let Some(dt) = integration.dt_s {
            self.dt = self.share * dt;
            return;
        }
        let settled = FIRST_SHARE + (1.0 - FIRST_SHARE) * (self.time / FIRST_TIME).min(1.0);
        let aim = (integration.safety * self.health.dt_limit).min(integration.dt_max_s) * settled * self.share;
        // increase gradually, decrease at once
        self.dt = if self.step == 0 { aim } else { aim.min(1.05 * self.dt) };
    }
}
