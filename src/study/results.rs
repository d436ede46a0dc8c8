//! The results of a run as curves: measures over the shear angle of a cell or the displacement of a clamp.

use super::difference::Curve;
use crate::case::parse;
use crate::error::{Error, Result};
use crate::output::columns::Columns;
use crate::run::CASE;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Abscissa of the curves: the first load steps of a kind, or time if there are none of either.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// Absolute shear angle of a cell, degrees.
    Angle,
    /// Displacement of a clamp, mm.
    Displacement,
    /// s.
    Time,
}

impl Axis {
    /// Name with unit.
    pub fn name(self) -> &'static str {
        match self {
            Axis::Angle => "shear angle, degrees",
            Axis::Displacement => "displacement, mm",
            Axis::Time => "time, s",
        }
    }

    /// Column of the history, and the load steps that count.
    fn column(self) -> (&'static str, Option<&'static str>) {
        match self {
            Axis::Angle => ("shear_angle_deg", Some("shear")),
            Axis::Displacement => ("displacement_mm", Some("move")),
            Axis::Time => ("time_s", None),
        }
    }
}

/// One of the tables of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Source {
    History,
    Yarns,
    Stitches,
    Shear,
}

/// A column of a table that runs are compared by.
#[derive(Debug, PartialEq, Eq)]
pub struct Measure {
    pub name: &'static str,
    pub unit: &'static str,
    source: Source,
    column: &'static str,
    /// The axes over which it is a curve.
    over: &'static [Axis],
    /// Whether it is a mean over the row: it then belongs between this row and the previous one.
    of_row: bool,
    /// Whether it changes sign with the shear angle.
    odd: bool,
}

/// A value at the end of a row.
const fn at_row(name: &'static str, unit: &'static str, source: Source, column: &'static str) -> Measure {
    let over = &[Axis::Angle, Axis::Displacement, Axis::Time];
    Measure { name, unit, source, column, over, of_row: false, odd: false }
}

/// Measures by which runs are compared; a scene has some of them. The first one that it has is its force.
pub const MEASURES: &[Measure] = &[
    Measure {
        over: &[Axis::Angle],
        of_row: true,
        odd: true,
        ..at_row("F_nor", "N/mm", Source::History, "f_nor_n_per_mm")
    },
    Measure { over: &[Axis::Displacement], of_row: true, ..at_row("force", "N", Source::History, "force_n") },
    at_row("warp width", "mm", Source::Yarns, "warp_width_mm"),
    at_row("weft width", "mm", Source::Yarns, "weft_width_mm"),
    at_row("warp gap", "mm", Source::Yarns, "warp_gap_mm"),
    at_row("weft gap", "mm", Source::Yarns, "weft_gap_mm"),
    at_row("warp thickness", "mm", Source::Yarns, "warp_thickness_mm"),
    at_row("weft thickness", "mm", Source::Yarns, "weft_thickness_mm"),
    at_row("stitch tension", "N", Source::Stitches, "tension_mean_n"),
    Measure {
        over: &[Axis::Angle],
        odd: true,
        ..at_row("effective angle", "degrees", Source::Shear, "effective_angle_mean_deg")
    },
    Measure { over: &[Axis::Displacement], ..at_row("effective angle", "degrees", Source::Shear, "zone_c_angle_deg") },
];

/// A folder of results, read.
#[derive(Debug, Clone)]
pub struct Results {
    pub folder: PathBuf,
    /// The case that was run, with all defaults.
    pub case: Value,
    /// Null while the run goes on.
    pub summary: Value,
    history: Columns,
    yarns: Option<Columns>,
    stitches: Option<Columns>,
    shear: Option<Columns>,
}

impl Results {
    /// Reads the tables of a run.
    ///
    /// # Errors
    /// A folder without a run, or a file that cannot be read.
    pub fn read(folder: &Path) -> Result<Self> {
        let present = |name: &str| Some(folder.join(name)).filter(|path| path.is_file());
        let history = present("history.csv")
            .ok_or_else(|| Error::file(folder, "no history.csv in this folder: give the folder of a run"))?;
        let table = |name: &str| present(name).map(|path| Columns::read(&path)).transpose();
        Ok(Self {
            folder: folder.to_path_buf(),
            case: parse::file(&folder.join(CASE))?,
            summary: present("summary.json").map_or(Ok(Value::Null), |path| parse::file(&path))?,
            history: Columns::read(&history)?,
            yarns: table("yarns.csv")?,
            stitches: table("stitches.csv")?,
            shear: table("shear.csv")?,
        })
    }

    /// A number in the summary; NaN if absent.
    pub fn number(&self, name: &str) -> f64 {
        self.summary[name].as_f64().unwrap_or(f64::NAN)
    }

    /// How the run ended.
    pub fn verdict(&self) -> &str {
        self.summary["verdict"].as_str().unwrap_or("not finished")
    }

    /// Abscissa of its curves.
    pub fn axis(&self) -> Axis {
        let phases = self.history.texts("phase");
        let loaded = |axis: &Axis| axis.column().1.is_some_and(|phase| phases.contains(&phase));
        [Axis::Angle, Axis::Displacement].into_iter().find(loaded).unwrap_or(Axis::Time)
    }

    /// The curve of a measure until the load first turns back; empty if the run has none.
    pub fn curve(&self, measure: &Measure) -> Curve {
        let axis = self.axis();
        let table = match measure.source {
            Source::History => Some(&self.history),
            Source::Yarns => self.yarns.as_ref(),
            Source::Stitches => self.stitches.as_ref(),
            Source::Shear => self.shear.as_ref(),
        };
        let Some(table) = table.filter(|_| measure.over.contains(&axis)) else { return Curve::new() };
        let (column, phase) = axis.column();
        let (mut curve, mut last) = (Curve::new(), f64::NAN);
        let rows = self.history.numbers(column).into_iter().zip(table.numbers(measure.column));
        for ((x, y), at) in rows.zip(self.history.texts("phase")) {
            if phase.is_some_and(|phase| phase != at) {
                continue;
            }
            let (place, before) = (x.abs(), last);
            if place < before {
                break;
            }
            last = place;
            let place = if measure.of_row { 0.5 * (before + place) } else { place };
            let rises = curve.last().is_none_or(|[x, _]| place > *x);
            if place.is_finite() && y.is_finite() && rises {
                curve.push([place, if measure.odd && x < 0.0 { -y } else { y }]);
            }
        }
        curve
    }
}
