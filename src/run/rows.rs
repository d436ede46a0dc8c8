//! The rows of a run: one row in every table at each output time.

use super::session::Run;
use crate::error::Result;
use crate::measure::stitches;
use crate::measure::yarns::{self, Yarn};
use crate::mesh::Ply;
use crate::output::rows::{self, Contacts, History, Stitches};
use crate::rigs::observer::{Loading, Seen};

impl Run<'_> {
    /// Writes one row to every table.
    pub(super) fn write_row(&mut self, phase: &str) -> Result<()> {
        self.simulation.bring_row();
        let seen = match &self.yarns {
            Some(_) => {
                let frame = self.simulation.shape();
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
            table.row(&Stitches {
                time_s: time,
                shear_angle_deg: degrees,
                tension_min_n: t.all.min_n,
                tension_mean_n: t.all.mean_n,
                tension_max_n: t.all.max_n,
                slack_share: t.all.slack_share,
                loop_tension_mean_n: t.loops.mean_n,
                loop_slack_share: t.loops.slack_share,
                underlap_tension_mean_n: t.underlaps.mean_n,
                underlap_slack_share: t.underlaps.slack_share,
            })?;
        }
        Ok(())
    }

    /// Updates the worst values of the quality measures of a run.
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

    /// Writes history, energies and contacts.
    fn write_history(&mut self, loading: &Loading, phase: &str) -> Result<()> {
        let &Loading { degrees, force, normalised } = loading;
        let s = &self.simulation;
        let time = s.time();
        let (e, h) = (s.energies(), s.health());
        self.history.row(&History {
            time_s: time,
            step: s.step(),
            phase: phase.into(),
            dt_s: s.dt(),
            shear_angle_deg: degrees,
            displacement_mm: s.displacement(),
            force_n: force,
            f_nor_n_per_mm: normalised,
            e_internal_mj: e.internal(),
            e_kinetic_mj: e.kinetic_total,
            e_balance_error: h.balance,
            max_penetration_mm: h.penetration.into_iter().fold(0.0, f64::max),
            min_jacobian: h.min_jacobian,
            retries: self.retries.guards().len(),
        })?;
        self.energies.numbers([time, degrees].into_iter().chain(e.columns().map(|(_, value)| value)))?;
        self.contacts.row(&Contacts {
            time_s: time,
            shear_angle_deg: degrees,
            thread_nodes_on_yarns: h.touching[0],
            yarn_nodes_on_yarns: h.touching[1],
            beams_on_beams: h.touching[2],
            thread_yarn_penetration_mm: h.penetration[0],
            yarn_yarn_penetration_mm: h.penetration[1],
            thread_thread_penetration_mm: h.penetration[2],
            added_mass_yarns: h.added_mass[0],
            added_mass_threads: h.added_mass[1],
            dt_limit_s: h.dt_limit,
        })
    }

    /// Writes yarn sizes by ply and by yarn.
    fn write_yarns(&mut self, time: f64, degrees: f64, yarns: &[Yarn]) -> Result<()> {
        let Some((plies, each)) = &mut self.yarns else { return Ok(()) };
        let [warp, weft] = [Ply::Warp, Ply::Weft].map(|ply| yarns::ply(yarns, ply));
        plies.row(&rows::Yarns {
            time_s: time,
            shear_angle_deg: degrees,
            warp_width_mm: warp.width.mean,
            warp_thickness_mm: warp.thickness.mean,
            warp_gap_mm: warp.gap.mean,
            weft_width_mm: weft.width.mean,
            weft_thickness_mm: weft.thickness.mean,
            weft_gap_mm: weft.gap.mean,
            warp_width_std_mm: warp.width.std,
            warp_thickness_std_mm: warp.thickness.std,
            warp_gap_std_mm: warp.gap.std,
            weft_width_std_mm: weft.width.std,
            weft_thickness_std_mm: weft.thickness.std,
            weft_gap_std_mm: weft.gap.std,
            warp_broadness_mm: warp.broadness.mean,
            weft_broadness_mm: weft.broadness.mean,
        })?;
        for yarn in yarns {
            let sizes = yarn.sizes();
            each.row(&rows::Yarn {
                time_s: time,
                shear_angle_deg: degrees,
                yarn: self.simulation.mesh().blocks[yarn.block].name.clone(),
                width_mm: sizes.width.mean,
                thickness_mm: sizes.thickness.mean,
                gap_mm: sizes.gap.mean,
                broadness_mm: sizes.broadness.mean,
                width_min_mm: sizes.width.min,
                width_max_mm: sizes.width.max,
            })?;
        }
        Ok(())
    }
}
