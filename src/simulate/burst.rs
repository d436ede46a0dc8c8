//! A burst: several steps in one go, then a look at the distance travelled, and a contact search if the skin is used up.

use super::look::Looked;
use super::{AFFINE_REACH, BURST, CALM, FARTHEST, SPEED_MARGIN, Simulation, WINDOW, largest};
use crate::contact::skin::Shares;
use crate::contact::status;
use crate::error::Result;
use crate::kernel::buffer::Initial;
use crate::kernel::row::Row;
use crate::plan;

impl Simulation {
    /// Runs some steps, then a search if the skin is used up. If `looks`, returns the totals of the last step.
    pub(super) fn burst(&mut self, steps: u64, looks: bool) -> Result<Option<Looked>> {
        self.hold();
        let mut rows = Vec::with_capacity(steps as usize);
        let mut time = self.time;
        let looked_at = self.diagnosed == self.step;
        for step in 0..steps {
            let row = self.row(time, self.dt, self.dt_before);
            // thermal work by the trapezoidal rule; across a look, the tension after it stands for both
            let (back, ahead) = (row.thermal_increment, self.schedule.load(time + self.dt).thermal - row.thermal);
            let first = if step == 0 && looked_at { back } else { 0.5 * back };
            let second = if step + 1 == steps && looks { 0.0 } else { 0.5 * ahead };
            let affine = 2.0 * largest(row.rate) * AFFINE_REACH;
            let searched = if step == 0 && self.is_listed_anew { 1.0 } else { 0.0 };
            let turn = ((self.step + step) % 3) as f64;
            rows.push(Row { affine, searched, turn, thermal_increment: first + second, ..row });
            self.dt_before = self.dt;
            time += self.dt;
        }
        self.is_listed_anew = false;
        let last = rows.len() - usize::from(looks);
        self.backend.run(&self.model.plan.step, &rows[..last]);
        self.time = time;
        self.step += steps;
        if looks {
            self.looked_at_step(rows[last]);
        }
        self.backend.run(&self.model.plan.watch, &rows[..1]);
        self.backend.request(self.model.buffers.status);
        let (looked, status) = if looks {
            let [middle, after, status] = self.receive()?;
            (Some(Looked { middle: middle.scalars(), after: after.scalars() }), status.uints())
        } else {
            let [status] = self.receive()?;
            (None, status.uints())
        };
        self.check_flags(&status)?;
        if let Some(looked) = &looked {
            self.judge(&looked.middle, &status);
        }
        let before = std::mem::replace(&mut self.speed, f64::from(f32::from_bits(status[status::SPEED])));
        let travel = f64::from(f32::from_bits(status[status::TRAVEL]));
        let load = self.load();
        let (stretch, then) = (self.stretch(), self.stretch_at_search);
        let strained = [0, 1].map(|k| (stretch[k] - then[k]).abs()).into_iter().fold(0.0, f64::max);
        let turned = if self.model.active.periodic { (load.angle - self.gradient_at_search.angle).abs() } else { 0.0 };
        let affine = (turned + strained) * AFFINE_REACH;
        let contact = self.scene.effects.contact.as_ref().filter(|_| self.model.active.searches());
        let skin = contact.map_or(f64::INFINITY, |c| c.skin_mm);
        let Shares { used, apart } = Shares::new(self.model.active.periodic);
        let mut left = used * skin - travel - affine;
        let found = self.model.buffers.found.into_iter().flatten();
        let all: usize = found.map(|found| self.model.plan.buffers[found.0].len).sum();
        let pays = self.searched >= all as u64;
        if affine > apart * skin || load.radius > self.gradient_at_search.radius || left < 0.0 && pays {
            self.search_all()?;
            left = used * skin;
        } else if left < 0.0 {
            self.search()?;
            left = used * skin - affine;
        }
        // a float that is too large for an integer becomes the largest one
        let sure = (left.min(FARTHEST) / (SPEED_MARGIN * self.speed * self.dt)) as u64;
        let longer = if self.speed > CALM * before { BURST } else { 2 * self.burst };
        self.burst = longer.min(sure).clamp(BURST, WINDOW);
        Ok(looked)
    }

    /// Runs a step, and asks for its totals in the middle and after it.
    fn looked_at_step(&mut self, row: Row<f64>) {
        self.backend.run(&self.model.plan.step[..self.model.forces], &[row]);
        self.diagnose(row);
        self.backend.run(&self.model.plan.step[self.model.forces..], &[row]);
        self.backend.run(&self.model.collect_motion, &[row]);
        self.backend.request(self.model.totals.buffer);
    }

    /// Activates each prescribed motion when its time comes, by the masks of its nodes.
    pub(super) fn hold(&mut self) {
        let passed = self.schedule.phases().iter().take_while(|phase| self.time >= phase.end * (1.0 - 1e-12)).count();
        let acting = if self.model.acts_after.iter().any(|after| *after > passed) { passed } else { usize::MAX };
        if acting == self.acting {
            return;
        }
        self.acting = acting;
        let Some(buffer) = self.model.buffers.prescribed else { return };
        if let Initial::Uint(all) = &self.model.plan.buffers[buffer.0].initial {
            let mut masked = all.clone();
            for (condition, after) in masked.chunks_exact_mut(2).zip(&self.model.acts_after) {
                condition[1] = if *after <= passed { condition[1] } else { 0 };
            }
            self.backend.set_bytes(buffer, bytemuck::cast_slice(&masked));
            if let Some(partly) = self.model.buffers.partly {
                let masks = plan::masks(&masked, self.scene.mesh.nodes.len());
                self.backend.set_bytes(partly, bytemuck::cast_slice(&masks));
            }
        }
    }
}
