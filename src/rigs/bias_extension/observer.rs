//! Measures a specimen during the pull: machine force, and shear of its zones compared with the no-slip theory.

use super::clamps::clamped;
use super::strip;
use super::theory::{Bias, BiasCurve};
use super::zones::Means;
use crate::case::domain::Specimen;
use crate::error::Result;
use crate::kernel::record::{Record, Recorded};
use crate::measure::yarns;
use crate::mesh::frame::Frame;
use crate::output::appended::Appended;
use crate::rigs::crossings::Crossed;
use crate::rigs::observer::{Loading, Observer, Seen, Tables};
use crate::settings::steps::Step;
use crate::simulate::Simulation;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;

/// Clamp travel per row below which the clamp counts as at rest, mm: the last time step of a load step may overlap the next one.
const STILL: f64 = 1e-5;
/// Elongation, as a share of the specimen length, above which the kinetic energy is judged: 5 mm of 240 mm.
const SETTLED: f64 = 5.0 / 240.0;
/// Displacements at which the closing lines state forces, as shares of the largest displacement.
const STATED: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

/// The bias-extension observer.
pub(super) struct Pulled {
    crossings: Option<Crossed>,
    length: f64,
    /// The three-zone theory, where it applies: yarns at ±45° and room for zone C.
    bias: Option<Bias>,
    curve: Option<BiasCurve>,
    /// Whether each prescribed node belongs to the moving clamp.
    moves: Vec<bool>,
    /// Clamp displacement, mm, and work, mJ, up to which mean forces are known.
    last: [f64; 2],
    /// Displacement, mm, machine force, N, and F_nor, N/mm, at every row of the pull.
    rows: Vec<[f64; 3]>,
    /// Readings before the pull and at the last row.
    before: Reading,
    now: Reading,
}

/// Readings of the zones at a row: mean effective angle in A, B and C, rad; in zone C, slip and the width and gap of warp and
/// weft, mm.
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

impl Pulled {
    pub(super) fn of(specimen: &Specimen, simulation: &Simulation, tables: &Tables) -> Result<Self> {
        let [_, moved] = clamped(specimen, simulation.mesh());
        let diagonal = (specimen.warp_angle_deg.abs() - 45.0).abs() < 1e-9;
        let bias = Bias::new(specimen.length_mm, specimen.width_mm).ok().filter(|_| diagonal);
        let strip = strip(specimen);
        Ok(Self {
            crossings: Crossed::of(simulation.mesh(), strip.axis, Some(strip), tables)?,
            length: specimen.length_mm,
            bias,
            curve: bias.map(Bias::curve),
            moves: simulation.prescribed_nodes().iter().map(|node| moved.binary_search(node).is_ok()).collect(),
            last: [0.0; 2],
            rows: Vec::new(),
            before: Reading::default(),
            now: Reading::default(),
        })
    }

    /// Machine force, N.
    ///
    /// The force is the mean over the row, ∫F dd / ∫dd. The fixed clamp does no work, so the work of prescribed motion is the
    /// machine's work. While the clamp stands still, it is the force at the end of the row.
    fn force(&mut self, simulation: &Simulation) -> f64 {
        let (displacement, work) = (simulation.displacement(), simulation.energies().prescribed);
        let [from, done] = self.last;
        let way = displacement - from;
        self.last = [if way.abs() > STILL { displacement } else { from }, work];
        if way.abs() > STILL {
            return (work - done) / way;
        }
        let reactions = simulation.reactions();
        let moved = reactions.iter().zip(&self.moves).filter(|(_, moves)| **moves);
        -moved.map(|(force, _)| force[0]).sum::<f64>()
    }

    /// No-slip angle of zone C, rad; NaN where the theory does not apply.
    fn theory(&self, displacement: f64) -> f64 {
        self.bias.map_or(f64::NAN, |bias| bias.angle(displacement))
    }

    /// Rows of the pull nearest to the given displacements.
    fn stated(&self) -> Vec<[f64; 3]> {
        let end = self.rows.last().map_or(0.0, |row| row[0]);
        let off = |row: &[f64; 3], share: f64| (row[0] - share * end).abs();
        let near = |share: &f64| self.rows.iter().min_by(|a, b| off(a, *share).total_cmp(&off(b, *share))).copied();
        let mut rows: Vec<_> = STATED.iter().filter_map(near).collect();
        rows.dedup();
        rows
    }

    /// Fields of the summary.
    fn for_programs(&self) -> Value {
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

    /// Three closing lines for the user.
    fn for_a_person(&self) -> String {
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
        // shear zones exist only for yarns at ±45°
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

impl Observer for Pulled {
    fn start(&mut self, simulation: &Simulation, _: &[Step]) -> Result<()> {
        let displacement = simulation.displacement();
        if let Some(crossed) = &self.crossings {
            let frame = simulation.shape();
            simulation.alive()?;
            let yarns = yarns::measure(simulation.mesh(), &frame)?;
            self.before = Reading::of(crossed.means(&crossed.measure(simulation.mesh(), &frame, &yarns)?));
        }
        self.last = [if displacement > STILL { displacement } else { 0.0 }, simulation.energies().prescribed];
        Ok(())
    }

    fn row(&mut self, simulation: &mut Simulation, seen: &Seen) -> Result<Loading> {
        let displacement = simulation.displacement();
        let force = self.force(simulation);
        let seen_crossings = match (&self.crossings, seen.yarns) {
            (Some(crossed), Some((frame, yarns))) => Some(crossed.measure(simulation.mesh(), frame, yarns)?),
            _ => None,
        };
        let means = self.crossings.as_ref().zip(seen_crossings.as_ref());
        self.now = Reading::of(means.and_then(|(crossed, crossings)| crossed.means(crossings)));
        let angle = self.now.angle[2];
        let mut normalised = f64::NAN;
        if seen.phase == "move" {
            normalised = self.curve.as_mut().map_or(f64::NAN, |curve| curve.push(angle, force));
            self.rows.push([displacement, force, normalised]);
        } else if self.rows.is_empty() {
            self.before = self.now;
        }
        let (degrees, theory) = (angle.to_degrees(), self.theory(displacement));
        if let Some((crossed, crossings)) = self.crossings.as_mut().zip(seen_crossings) {
            crossed.write_row([simulation.time(), degrees, displacement], &crossings, theory)?;
        }
        Ok(Loading { degrees, force, normalised })
    }

    fn frame(&mut self, simulation: &Simulation, frame: &mut Frame, dir: &Path, name: &str) -> Result<()> {
        self.crossings.as_mut().map_or(Ok(()), |crossed| crossed.frame(simulation.mesh(), frame, dir, name))
    }

    fn is_loaded(&self, _: &Simulation, phase: &str) -> bool {
        phase == "move" && self.last[0] > SETTLED * self.length
    }

    fn tables(&mut self) -> Vec<&mut Appended> {
        self.crossings.iter_mut().flat_map(Crossed::files).collect()
    }

    fn record(&mut self, record: &mut Record) {
        let Self { crossings, length: _, bias: _, curve, moves: _, last, rows, before, now } = self;
        if let Some(crossed) = crossings {
            crossed.maps.record(record);
        }
        if let Some(curve) = curve {
            curve.record(record);
        }
        last.record(record);
        rows.record(record);
        before.record(record);
        now.record(record);
    }

    fn summary(&self, _: &Simulation) -> Vec<(&'static str, Value)> {
        vec![("specimen", self.for_programs())]
    }

    fn lines(&self, _: &Simulation) -> String {
        self.for_a_person()
    }
}
