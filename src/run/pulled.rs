//! A specimen while it is pulled: the force of the machine, and the shear of its zones beside the theory without slip.

use crate::case::domain::Specimen;
use crate::fabric::specimen::clamped;
use crate::kernel::record::{Record, Recorded};
use crate::measure::shear::{Bias, BiasCurve};
use crate::measure::zones::Means;
use crate::simulate::Simulation;
use serde_json::{Value, json};
use std::fmt::Write as _;

/// Way of the clamp over a row, mm, that counts as none: the last time step of a load step may reach into the next one.
const STILL: f64 = 1e-5;
/// Share of its length by which a specimen is pulled before its kinetic energy is judged: 5 mm of 240 mm.
const SETTLED: f64 = 5.0 / 240.0;
/// Displacements at which the last lines state forces, as shares of the largest one.
const STATED: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

/// What a specimen adds to a run.
pub(super) struct Pulled {
    length: f64,
    /// Theory of three zones, where it holds: yarns at ±45° and room for zone C.
    bias: Option<Bias>,
    curve: Option<BiasCurve>,
    /// Whether each prescribed node is in the clamp that moves.
    moves: Vec<bool>,
    /// Displacement, mm, and work of the clamps, mJ, up to which mean forces are known.
    last: [f64; 2],
    /// Displacement, mm, force of the machine, N, and F_nor, N/mm, at every row of the pull.
    rows: Vec<[f64; 3]>,
    /// Before the pull, and at the last row.
    before: Reading,
    now: Reading,
}

/// The zones at a row: means of the effective angle in A, B and C, rad; slip in C, width and gap of warp and weft there, mm.
#[derive(Debug, Clone, Copy)]
struct Reading {
    angle: [f64; 3],
    slip: f64,
    width: [f64; 2],
    gap: [f64; 2],
}

impl Default for Reading {
    fn default() -> Self {
        Self { angle: [f64::NAN; 3], slip: f64::NAN, width: [f64::NAN; 2], gap: [f64::NAN; 2] }
    }
}

impl Reading {
    fn of(zones: Option<Means>) -> Self {
        let read = |m: Means| Self { angle: m.angle, slip: m.slip[2], width: m.width, gap: m.gap };
        zones.map_or_else(Self::default, read)
    }
}

impl Recorded for Reading {
    fn record(&mut self, record: &mut Record) {
        let Self { angle, slip, width, gap } = self;
        angle.record(record);
        slip.record(record);
        width.record(record);
        gap.record(record);
    }
}

impl Recorded for Pulled {
    fn record(&mut self, record: &mut Record) {
        if let Some(curve) = &mut self.curve {
            curve.record(record);
        }
        self.last.record(record);
        self.rows.record(record);
        self.before.record(record);
        self.now.record(record);
    }
}

/// What the history says about a specimen.
pub(super) struct Row {
    /// Mean effective shear angle in zone C, and that without slip (Eq. 18), rad.
    pub(super) angle: f64,
    pub(super) theory: f64,
    /// Force of the machine, N, and F_nor (Eq. 19 with the effective angle), N/mm.
    pub(super) force: f64,
    pub(super) normalised: f64,
}

impl Pulled {
    pub(super) fn of(specimen: &Specimen, simulation: &Simulation) -> Self {
        let [_, moved] = clamped(specimen, &simulation.mesh);
        let diagonal = (specimen.warp_angle_deg.abs() - 45.0).abs() < 1e-9;
        let bias = Bias::new(specimen.length_mm, specimen.width_mm).ok().filter(|_| diagonal);
        Self {
            length: specimen.length_mm,
            bias,
            curve: bias.map(Bias::curve),
            moves: simulation.prescribed_nodes().iter().map(|node| moved.binary_search(node).is_ok()).collect(),
            last: [0.0; 2],
            rows: Vec::new(),
            before: Reading::default(),
            now: Reading::default(),
        }
    }

    /// Goes on from a state that another run left.
    pub(super) fn start(&mut self, simulation: &Simulation, displacement: f64, zones: Option<Means>) {
        self.before = Reading::of(zones);
        self.last = [if displacement > STILL { displacement } else { 0.0 }, simulation.energies().prescribed];
    }

    /// A row; `pulls` in the load steps in which the clamp moves.
    ///
    /// The force is the mean over the row, ∫F dd / ∫dd: the clamp that is held does no work, so the work of prescribed
    /// motion is that of the machine. While the clamp stands still, it is the force at the end of the row.
    pub(super) fn row(&mut self, simulation: &Simulation, displacement: f64, zones: Option<Means>, pulls: bool) -> Row {
        let work = simulation.energies().prescribed;
        let [from, done] = self.last;
        let way = displacement - from;
        self.last = [if way.abs() > STILL { displacement } else { from }, work];
        let force = if way.abs() > STILL {
            (work - done) / way
        } else {
            let reactions = simulation.reactions();
            let moved = reactions.iter().zip(&self.moves).filter(|(_, moves)| **moves);
            -moved.map(|(force, _)| force[0]).sum::<f64>()
        };
        self.now = Reading::of(zones);
        let angle = self.now.angle[2];
        let mut normalised = f64::NAN;
        if pulls {
            normalised = self.curve.as_mut().map_or(f64::NAN, |curve| curve.push(angle, force));
            self.rows.push([displacement, force, normalised]);
        } else if self.rows.is_empty() {
            self.before = self.now;
        }
        Row { angle, theory: self.theory(displacement), force, normalised }
    }

    /// Whether the specimen has been pulled so far that its kinetic energy is judged.
    pub(super) fn settled(&self) -> bool {
        self.last[0] > SETTLED * self.length
    }

    /// Angle of zone C without slip, rad; NaN where no theory holds.
    fn theory(&self, displacement: f64) -> f64 {
        self.bias.map_or(f64::NAN, |bias| bias.angle(displacement))
    }

    /// Rows of the pull nearest to some displacements.
    fn stated(&self) -> Vec<[f64; 3]> {
        let end = self.rows.last().map_or(0.0, |row| row[0]);
        let off = |row: &[f64; 3], share: f64| (row[0] - share * end).abs();
        let near = |share: &f64| self.rows.iter().min_by(|a, b| off(a, *share).total_cmp(&off(b, *share))).copied();
        let mut rows: Vec<_> = STATED.iter().filter_map(near).collect();
        rows.dedup();
        rows
    }

    /// For programs.
    pub(super) fn summary(&self) -> Value {
        let reading = |r: &Reading| {
            json!({
                "zone_angles_deg": r.angle.map(f64::to_degrees),
                "zone_c_slip_mm": r.slip,
                "zone_c_width_mm": r.width,
                "zone_c_gap_mm": r.gap,
            })
        };
        json!({
            "displacement_mm": self.last[0],
            "theory_angle_deg": self.theory(self.last[0]).to_degrees(),
            "before": reading(&self.before),
            "now": reading(&self.now),
            "largest_force_n": self.rows.iter().map(|row| row[1]).fold(f64::NAN, f64::max),
            "curve": self.stated().iter().map(|[displacement, force, normalised]| {
                json!({ "displacement_mm": displacement, "force_n": force, "f_nor_n_per_mm": normalised })
            }).collect::<Vec<_>>(),
        })
    }

    /// Three lines for a person.
    pub(super) fn lines(&self) -> String {
        let mut t = String::new();
        let forces: Vec<String> = self
            .stated()
            .iter()
            .map(|[displacement, force, normalised]| {
                let shear = if normalised.is_nan() { String::new() } else { format!(" (F_nor {normalised:.4} N/mm)") };
                format!("{force:.3} N{shear} at {displacement:.2} mm")
            })
            .collect();
        let forces = if forces.is_empty() { "not pulled".into() } else { forces.join(", ") };
        let [a, b, c] = self.now.angle.map(f64::to_degrees);
        let theory = match self.theory(self.last[0]) {
            angle if angle.is_nan() => String::new(),
            angle => format!(", {:.2}° in C without slip (Eq. 18)", angle.to_degrees()),
        };
        let sizes = |r: &Reading, ply: usize| format!("{:.2} / {:.2}", r.width[ply], r.gap[ply]);
        let [warp, weft] =
            [0, 1].map(|ply| format!("{} mm, before {}", sizes(&self.now, ply), sizes(&self.before, ply)));
        // writing to a String does not fail
        let _ = writeln!(t, "force      {forces}");
        let zones = [("A", a), ("B", b), ("C", c)].into_iter().filter(|(_, angle)| !angle.is_nan());
        let zones: Vec<String> = zones.map(|(zone, angle)| format!("{zone} {angle:.2}°")).collect();
        // other yarns than those at ±45° have no zones of shear
        if self.bias.is_none() || zones.is_empty() {
            return t;
        }
        let _ = writeln!(t, "zones      sheared by {} at {:.2} mm{theory}", zones.join(", "), self.last[0]);
        if c.is_nan() {
            return t;
        }
        let _ = writeln!(t, "zone C     width / gap of warp {warp}; of weft {weft}; slip {:.3} mm", self.now.slip);
        t
    }
}
