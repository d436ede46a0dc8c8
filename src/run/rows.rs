//! The rows of a run: at every moment that is written, one row in every table.

use super::session::Run;
use crate::error::Result;
use crate::measure::stitches;
use crate::measure::yarns::{self, Yarn};
use crate::mesh::Ply;
use crate::rigs::observer::{Loading, Seen};

impl Run<'_> {
    /// One row in every table.
    pub(super) fn write_row(&mut self, phase: &str) -> Result<()> {
        let seen = match &self.yarns {
            Some(_) => {
                let frame = self.simulation.frame();
                self.simulation.alive()?;
                let yarns = yarns::measure(self.simulation.mesh(), &frame)?;
                Some((frame, yarns))
            }
            None => None,
        };
        let machine = self.grips.as_mut().map_or(Ok(0.0), |grips| grips.write(&self.simulation))?;
        let yarns = seen.as_ref().map(|(frame, yarns)| (frame, &yarns[..]));
        let loading = self.observer.row(&mut self.simulation, &Seen { phase, yarns, machine })?;
        let Loading { degrees, .. } = loading;
        self.simulation.alive()?;
        self.judge(phase);
        self.write_history(&loading, phase)?;
        let time = self.simulation.time();
        if let Some((_, yarns)) = &seen {
            self.write_yarns(time, degrees, yarns)?;
        }
        if let Some(probes) = &mut self.probes {
            probes.write(&self.simulation, degrees)?;
        }
        if let Some(table) = &mut self.stitches {
            let tensions = self.simulation.tensions();
            self.simulation.alive()?;
            let t = stitches::measure(self.simulation.mesh(), &tensions)?;
            table.numbers(&[
                time,
                degrees,
                t.all.min_n,
                t.all.mean_n,
                t.all.max_n,
                t.all.slack_share,
                t.loops.mean_n,
                t.loops.slack_share,
                t.underlaps.mean_n,
                t.underlaps.slack_share,
            ])?;
        }
        Ok(())
    }

    /// Keeps the worst of what a run is judged by.
    fn judge(&mut self, phase: &str) {
        let s = &self.simulation;
        let (e, h) = (s.energies(), s.health());
        self.worst_balance = self.worst_balance.max(h.balance.abs());
        self.dt_range = [self.dt_range[0].min(s.dt()), self.dt_range[1].max(s.dt())];
        for (largest, now) in self.largest_added.iter_mut().zip(h.added_mass) {
            *largest = largest.max(now);
        }
        if self.observer.is_loaded(s, phase) {
            let ratio = e.kinetic_total / e.internal();
            self.worst_kinetic = Some(self.worst_kinetic.map_or(ratio, |worst| worst.max(ratio)));
        }
    }

    /// History, energies and contacts.
    fn write_history(&mut self, loading: &Loading, phase: &str) -> Result<()> {
        let &Loading { degrees, force, normalised } = loading;
        let s = &self.simulation;
        let (time, displacement) = (s.time(), s.displacement());
        let (e, h) = (s.energies(), s.health());
        self.history.row(&[
            time.into(),
            (s.step() as f64).into(),
            phase.into(),
            s.dt().into(),
            degrees.into(),
            displacement.into(),
            force.into(),
            normalised.into(),
            e.internal().into(),
            e.kinetic_total.into(),
            h.balance.into(),
            h.penetration.into_iter().fold(0.0, f64::max).into(),
            h.min_jacobian.into(),
            (self.retries.guards().len() as f64).into(),
        ])?;
        let numbers: Vec<f64> = [time, degrees].into_iter().chain(e.columns().map(|(_, value)| value)).collect();
        self.energies.numbers(&numbers)?;
        let counts = h.touching.map(f64::from);
        let numbers: Vec<f64> = [&[time, degrees][..], &counts, &h.penetration, &h.added_mass, &[h.dt_limit]].concat();
        self.contacts.numbers(&numbers)
    }

    /// Sizes by ply, and yarn by yarn.
    fn write_yarns(&mut self, time: f64, degrees: f64, yarns: &[Yarn]) -> Result<()> {
        let Some([table, each]) = &mut self.yarns else { return Ok(()) };
        let plies = [Ply::Warp, Ply::Weft].map(|ply| yarns::ply(yarns, ply));
        let means = plies.map(|p| [p.width.mean, p.thickness.mean, p.gap.mean]);
        let spreads = plies.map(|p| [p.width.std, p.thickness.std, p.gap.std]);
        let broadness = plies.map(|p| p.broadness.mean);
        table.numbers(&[&[time, degrees][..], &means.concat(), &spreads.concat(), &broadness].concat())?;
        for yarn in yarns {
            let sizes = yarn.sizes();
            each.row(&[
                time.into(),
                degrees.into(),
                self.simulation.mesh().blocks[yarn.block].name.as_str().into(),
                sizes.width.mean.into(),
                sizes.thickness.mean.into(),
                sizes.gap.mean.into(),
                sizes.broadness.mean.into(),
                sizes.width.min.into(),
                sizes.width.max.into(),
            ])?;
        }
        Ok(())
    }
}
