//! Findings of a study: errors, times, and the points that no other one beats.

use super::points::{Point, Ran, Role};
use crate::error::Result;
use crate::study::difference::{Curve, Difference, by_chance, difference, smoothed, spread};
use crate::study::results::{MEASURES, Measure, Results};
use std::path::PathBuf;

/// A completed point.
pub struct Row {
    pub point: Point,
    pub ran: Ran,
    pub results: Option<Results>,
    /// Time over the mean time of the case and its chance variants; NaN if it did not finish.
    pub time: f64,
    /// Differences from the reference and from the case itself, by measure; `None` if it did not finish.
    pub errors: Vec<Option<Difference>>,
    pub changes: Vec<Option<Difference>>,
    /// Whether no other point is both faster and better in the first measure.
    pub front: bool,
}

/// A study, as far as it is complete.
pub struct Findings {
    pub measures: Vec<&'static Measure>,
    /// Relative L2 difference of two runs of the case by chance, by measure.
    pub chance: Vec<f64>,
    /// Difference of runs on meshes of equal fineness with nodes at other places: no error is known better.
    pub places: Vec<f64>,
    pub rows: Vec<Row>,
}

impl Findings {
    /// From points with their runs and folders, the case itself first.
    ///
    /// # Errors
    /// Results that cannot be read.
    pub(super) fn of(points: &[(Point, Ran, PathBuf)]) -> Result<Self> {
        let mut rows = Vec::new();
        for (point, ran, folder) in points {
            let results = ran.finished().then(|| Results::read(folder)).transpose()?;
            let (point, ran) = (point.clone(), ran.clone());
            rows.push(Row { point, ran, results, time: f64::NAN, errors: vec![], changes: vec![], front: false });
        }
        let of = |role: Role| rows.iter().find(|row| row.point.role == role).and_then(|row| row.results.as_ref());
        let default = of(Role::Default);
        let has = |measure: &&Measure| default.is_some_and(|results| !results.curve(measure).is_empty());
        let measures: Vec<&'static Measure> = MEASURES.iter().filter(has).collect();
        let curves = |results: Option<&Results>| -> Vec<Curve> {
            measures.iter().map(|m| results.map_or_else(Curve::new, |results| results.curve(m))).collect()
        };
        let (reference, itself) = (curves(of(Role::Reference)), curves(default));
        let scatter = |belongs: &dyn Fn(&Row) -> bool| -> Vec<f64> {
            let runs = rows.iter().filter(|row| belongs(row)).filter_map(|row| row.results.as_ref());
            let runs: Vec<Vec<Curve>> = runs.map(|results| curves(Some(results))).collect();
            let apart = |k: usize| {
                let curves: Vec<&[[f64; 2]]> = runs.iter().map(|curves| curves[k].as_slice()).collect();
                smoothed(&curves).map_or(f64::NAN, |means| by_chance(spread(&means), means.len()))
            };
            (0..measures.len()).map(apart).collect()
        };
        let chance = scatter(&Row::is_alike);
        let places = scatter(&|row| matches!(row.point.role, Role::Default | Role::Places));
        let places = places.into_iter().zip(&chance).map(|(places, chance)| places.max(*chance)).collect();
        let from = |own: &[Curve], other: &[Curve]| own.iter().zip(other).map(|(a, b)| difference(a, b)).collect();
        let compared: Vec<[Vec<Option<Difference>>; 2]> = rows
            .iter()
            .map(|row| {
                let own = curves(row.results.as_ref());
                [from(&own, &reference), from(&own, &itself)]
            })
            .collect();
        let alike = rows.iter().filter(|row| row.is_alike() && row.ran.finished());
        let unit = Ran::mean(&alike.map(|row| &row.ran).collect::<Vec<_>>());
        for (row, [errors, changes]) in rows.iter_mut().zip(compared) {
            (row.errors, row.changes) = (errors, changes);
            row.time = unit.as_ref().map_or(f64::NAN, |unit| row.ran.over(unit));
        }
        let mut findings = Self { measures, chance, places, rows };
        for row in findings.front() {
            findings.rows[row].front = true;
        }
        Ok(findings)
    }

    /// Error of a row in a measure, and whether it exceeds the effect of node positions; a smaller error is only known to be no
    /// larger than that effect.
    pub fn claim(&self, row: &Row, measure: usize) -> Option<(f64, bool)> {
        let error = row.errors.get(measure).copied().flatten()?.l2;
        Some(bounded(error, self.places[measure]))
    }

    /// Difference of a row from the case itself, and whether it is above chance.
    pub fn effect(&self, row: &Row, measure: usize) -> Option<(f64, bool)> {
        let change = row.changes.get(measure).copied().flatten()?.l2;
        Some(bounded(change, self.chance[measure]))
    }

    /// Rows that no other one beats in time and in the first measure, the fastest first.
    fn front(&self) -> Vec<usize> {
        let mut candidates: Vec<(usize, f64, f64)> = Vec::new();
        for (number, row) in self.rows.iter().enumerate() {
            if let Some((error, _)) = self.claim(row, 0).filter(|_| row.is_offer() && row.time.is_finite()) {
                candidates.push((number, row.time, error));
            }
        }
        candidates.sort_by(|a, b| a.1.total_cmp(&b.1));
        let mut least = f64::INFINITY;
        candidates.retain(|(.., error)| {
            let better = *error < least;
            least = least.min(*error);
            better
        });
        candidates.into_iter().map(|(number, ..)| number).collect()
    }

    /// Smallest and largest time of the case and its chance variants, over their mean.
    pub fn repeated(&self) -> [f64; 2] {
        let alike = self.rows.iter().filter(|row| row.is_alike());
        alike.map(|row| row.time).fold([f64::NAN; 2], |[low, high], time| [low.min(time), high.max(time)])
    }

    /// The row of a role.
    pub fn row(&self, role: Role) -> Option<&Row> {
        self.rows.iter().find(|row| row.point.role == role)
    }
}

impl Row {
    /// Whether a user may choose it.
    pub fn is_offer(&self) -> bool {
        matches!(self.point.role, Role::Default | Role::Turned)
    }

    /// Whether it is the case itself or a chance variant.
    fn is_alike(&self) -> bool {
        matches!(self.point.role, Role::Default | Role::Chance)
    }

    /// A number in its summary; NaN if absent.
    pub fn number(&self, name: &str) -> f64 {
        self.results.as_ref().map_or(f64::NAN, |results| results.number(name))
    }
}

/// The larger of an error and its floor, and whether the error exceeds the floor.
fn bounded(error: f64, chance: f64) -> (f64, bool) {
    if error < chance { (chance, false) } else { (error, true) }
}
