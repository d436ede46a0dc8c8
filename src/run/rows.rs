//! The rows of a run: at every moment that is written, one row in every table.

use super::Run;
use crate::error::Result;
use crate::measure::crossings::Crossing;
use crate::measure::yarns::{self, Yarn};
use crate::measure::{shear, stitches};
use crate::mesh::Ply;

/// Angle after which the kinetic energy of shear is judged, degrees.
const SETTLED_DEG: f64 = 2.0;
/// Columns of `stress.csv`: components of V P̄/A₀, then stretches and membrane forces along the fibre directions x and y.
pub(super) const STRESS: [&str; 15] = [
    "time_s",
    "shear_angle_deg",
    "p_xx_n_per_mm",
    "p_xy_n_per_mm",
    "p_xz_n_per_mm",
    "p_yx_n_per_mm",
    "p_yy_n_per_mm",
    "p_yz_n_per_mm",
    "p_zx_n_per_mm",
    "p_zy_n_per_mm",
    "p_zz_n_per_mm",
    "weft_stretch",
    "warp_stretch",
    "weft_membrane_n_per_mm",
    "warp_membrane_n_per_mm",
];

/// Angle and forces of a row of the history.
struct Loading {
    /// Shear angle, degrees: prescribed for a cell, mean effective angle of zone C for a specimen.
    degrees: f64,
    /// Angle of zone C without slip, rad.
    theory: f64,
    /// N.
    force: f64,
    /// F_nor, N/mm.
    normalised: f64,
}

impl Run<'_> {
    /// One row in every table.
    pub(super) fn write_row(&mut self, phase: &str) -> Result<()> {
        let (yarns, crossings) = self.see()?;
        let displacement = self.simulation.displacement();
        let machine = self.grips.as_mut().map_or(Ok(0.0), |grips| grips.write(&self.simulation))?;
        let loading = self.loading(&crossings, displacement, machine, phase);
        let Loading { degrees, theory, .. } = loading;
        self.simulation.alive()?;
        self.judge(phase);
        self.write_history(&loading, displacement, phase)?;
        let time = self.simulation.time();
        if let Some(crossed) = &mut self.crossings {
            crossed.write_row([time, degrees, displacement], &crossings, theory)?;
        }
        self.write_yarns(time, degrees, &yarns)?;
        if let Some(probes) = &mut self.probes {
            probes.write(&self.simulation, degrees)?;
        }
        if let Some(table) = &mut self.stitches {
            let tensions = self.simulation.tensions();
            self.simulation.alive()?;
            let t = stitches::measure(&self.simulation.mesh, &tensions)?;
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

    /// Yarns and their crossings, if the scene has both plies.
    pub(super) fn see(&self) -> Result<(Vec<Yarn>, Vec<Crossing>)> {
        if self.yarns.is_none() {
            return Ok((Vec::new(), Vec::new()));
        }
        let s = &self.simulation;
        let frame = s.frame();
        s.alive()?;
        let yarns = yarns::measure(&s.mesh, &frame)?;
        let crossings = self.crossings.as_ref().map(|c| c.measure(&s.mesh, &frame, &yarns)).transpose()?;
        Ok((yarns, crossings.unwrap_or_default()))
    }

    /// Angle and forces, by the kind of scene.
    fn loading(&mut self, crossings: &[Crossing], displacement: f64, machine: f64, phase: &str) -> Loading {
        if let Some(pulled) = &mut self.pulled {
            let zones = self.crossings.as_ref().and_then(|c| c.means(crossings));
            let row = pulled.row(&self.simulation, displacement, zones, phase == "move");
            let (degrees, theory) = (row.angle.to_degrees(), row.theory);
            return Loading { degrees, theory, force: row.force, normalised: row.normalised };
        }
        let degrees = self.simulation.load().angle.to_degrees();
        Loading { degrees, theory: f64::NAN, force: machine, normalised: f64::NAN }
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
        let sheared = match &self.pulled {
            Some(pulled) => phase == "move" && pulled.settled(),
            None => phase == "shear" && s.load().angle.to_degrees().abs() > SETTLED_DEG,
        };
        if sheared {
            let ratio = e.kinetic_total / e.internal();
            self.worst_kinetic = Some(self.worst_kinetic.map_or(ratio, |worst| worst.max(ratio)));
        }
    }

    /// History, energies, stress and contacts.
    fn write_history(&mut self, loading: &Loading, displacement: f64, phase: &str) -> Result<()> {
        let &Loading { degrees, force, mut normalised, .. } = loading;
        let time = self.simulation.time();
        if let Some(area) = self.simulation.mesh.period.map(|[x, y]| x * y) {
            let stress = self.simulation.take_stress().unwrap_or_default();
            // a mean over the row belongs to its middle
            let middle = 0.5 * (self.last_shear[0] + self.simulation.load().angle);
            normalised = self.cell_force(stress, area);
            if phase == "shear" {
                self.curve.push((degrees, normalised));
                for (sum, fibres) in self.missed.iter_mut().zip(self.simulation.fibres()) {
                    *sum += fibres.error.map_or(0.0, |error| error * error);
                }
                self.missed[2] += 1.0;
            }
            if let Some(table) = &mut self.stress {
                let stretches = self.simulation.stretch();
                let membrane = shear::membrane_forces(in_plane(stress), middle, area);
                let numbers = [time, degrees].into_iter().chain(stress.concat().into_iter().map(|p| p / area));
                table.numbers(&numbers.chain(stretches).chain(membrane).collect::<Vec<_>>())?;
            }
        }
        let s = &self.simulation;
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

    /// F_nor of a periodic cell from V P̄, N/mm.
    fn cell_force(&mut self, stress: [[f64; 3]; 3], area: f64) -> f64 {
        let (angle, work) = (self.simulation.load().angle, self.simulation.energies().external);
        let [before, done] = std::mem::replace(&mut self.last_shear, [angle, work]);
        let turned = libm::sin(angle) - libm::sin(before);
        if turned.abs() > 1e-9 {
            // the mean over the row: ∫ A₀ F_nor cos γ dγ is the external work
            return (work - done) / (area * turned);
        }
        shear::normalised_force(in_plane(stress), angle, self.simulation.stretch(), area)
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
                self.simulation.mesh.blocks[yarn.block].name.as_str().into(),
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

/// The components in the plane.
fn in_plane(stress: [[f64; 3]; 3]) -> [[f64; 2]; 2] {
    [0, 1].map(|i| [stress[i][0], stress[i][1]])
}
