//! The output files of a run, and charts of their columns.

use super::chart::{self, Curve};
use super::columns::Columns;
use super::page::Page;
use crate::error::Result;
use serde_json::Value;
use std::path::Path;

/// The output files of a run.
pub struct Results<'a> {
    pub dir: &'a Path,
    pub history: Columns,
    /// Null for an unfinished run.
    pub summary: Value,
    pub case: Value,
}

/// The abscissa of curves.
#[derive(Debug, Clone, Copy)]
pub struct Axis {
    pub label: &'static str,
    /// Column, factor, and the name of the load steps that count; `None` for all load steps.
    pub column: &'static str,
    pub factor: f64,
    pub phase: Option<&'static str>,
}

pub const OVER_ANGLE: Axis =
    Axis { label: "shear angle γ, degrees", column: "shear_angle_deg", factor: 1.0, phase: Some("shear") };
pub const OVER_DISPLACEMENT: Axis =
    Axis { label: "displacement, mm", column: "displacement_mm", factor: 1.0, phase: Some("move") };
pub const OVER_TIME: Axis = Axis { label: "time, ms", column: "time_s", factor: 1e3, phase: None };

impl Axis {
    /// Whether it is the shear angle.
    pub fn is_angle(&self) -> bool {
        self.column == OVER_ANGLE.column
    }
}

impl Results<'_> {
    /// A number of the summary.
    pub fn number(&self, name: &str) -> f64 {
        self.summary[name].as_f64().unwrap_or(f64::NAN)
    }

    /// Another table of the run, if it exists.
    pub fn other(&self, name: &str) -> Result<Option<Columns>> {
        let path = self.dir.join(name);
        path.is_file().then(|| Columns::read(&path)).transpose()
    }

    /// The abscissa: shear angle or displacement if a load step prescribes it, else time.
    pub fn axis(&self) -> Axis {
        let phases = self.history.texts("phase");
        [OVER_ANGLE, OVER_DISPLACEMENT]
            .into_iter()
            .find(|a| a.phase.is_some_and(|p| phases.contains(&p)))
            .unwrap_or(OVER_TIME)
    }

    /// Points of a column, for a table with one row per history row.
    pub fn points(&self, table: &Columns, axis: &Axis, column: &str) -> Vec<[f64; 2]> {
        let phases = self.history.texts("phase");
        let xs = self.history.numbers(axis.column);
        let rows = xs.into_iter().zip(table.numbers(column)).zip(phases);
        let rows = rows.filter(|(_, phase)| axis.phase.is_none_or(|p| p == *phase));
        rows.map(|((x, y), _)| [x * axis.factor, y]).collect()
    }

    /// A chart of columns, for a table with one row per history row: title and unit, columns with their names.
    pub fn chart(
        &self,
        page: &mut Page,
        table: &Columns,
        axis: &Axis,
        [title, unit]: [&str; 2],
        columns: &[(&str, &str)],
        caption: &str,
    ) {
        let spread = |column: &str| {
            let points = spread_of(column).map_or_else(Vec::new, |column| self.points(table, axis, &column));
            points.iter().map(|p| p[1]).collect()
        };
        let curve = columns.iter().map(|(column, name)| Curve {
            name,
            points: self.points(table, axis, column),
            spread: spread(column),
        });
        let curves: Vec<Curve> = curve.collect();
        if let Some(svg) = chart::curves([axis.label, unit], &curves) {
            page.figure(&format!("{title}, {unit}"), &svg, caption);
        }
    }
}

/// Column of the standard deviation that belongs to a column of means: `warp_gap_std_mm` to `warp_gap_mm`.
fn spread_of(column: &str) -> Option<String> {
    let (name, unit) = column.rsplit_once('_')?;
    Some(format!("{}_std_{unit}", name.strip_suffix("_mean").unwrap_or(name)))
}

/// A table cell rounded to five digits.
pub fn short(cell: &str) -> String {
    match cell.parse::<f64>() {
        Ok(0.0) => "0".into(),
        Ok(x) if !x.is_finite() => "–".into(),
        Ok(x) if (1e-3..1e5).contains(&x.abs()) => {
            let digits = (4 - x.abs().log10().floor() as i32).max(0) as usize;
            format!("{x:.digits$}")
        }
        Ok(x) => format!("{x:.4e}"),
        Err(_) => cell.into(),
    }
}
