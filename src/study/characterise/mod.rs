//! `tricot characterise`: the tests that describe a fabric, one after the other, with one table and one page of what they give.
//!
//! A test that is finished already is not run again, and one that was stopped goes on, so that the same command begins, continues and
//! repeats a characterisation. A test that a guard stops leaves its row, and the others run.

mod page;
mod parts;

use super::difference::value;
use super::results::Results;
use crate::error::{Error, Result};
use crate::output::columns::Columns;
use crate::output::table::{Named, text as number};
use crate::rigs::cell::tension;
use crate::rigs::read::{Loaded, of_fabric};
use crate::run::{self, CASE, Machine};
use parts::{Curve, PARTS, Part};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Angles at which the shear force is stated, degrees.
const ANGLES: [f64; 3] = [15.0, 30.0, 45.0];
/// Largest angle between a stated one and the end of a curve, degrees.
const NEAR: f64 = 1.0;
/// Pressure at which the thickness is stated, MPa: that of a vacuum bag.
const PRESSURE: f64 = 0.1;
/// Least change of the angle over a row, degrees: F_nor is the work over it.
const LEAST: f64 = 0.1;

/// How much time a characterisation takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Preset {
    /// Coarse meshes of the fabric, and no specimen.
    Quick,
    /// The shipped meshes, and a small specimen.
    Full,
}

/// Options of a characterisation.
#[derive(Debug, Clone)]
pub struct Options {
    /// Folder of the tests, the table and the page.
    pub output: PathBuf,
    pub preset: Preset,
    /// Names of the tests to run; empty for all.
    pub only: Vec<String>,
    pub machine: Machine,
    /// Number of threads; `None` for all cores.
    pub threads: Option<usize>,
    pub quiet: bool,
}

/// Result of a characterisation.
#[derive(Debug, Clone)]
pub struct Characterised {
    /// The table as text.
    pub text: String,
    /// Whether the user stopped it.
    pub interrupted: bool,
    /// Whether a guard stopped a test; the table has its words.
    pub stopped: bool,
}

/// A number that a test gives.
#[derive(Debug, Clone, PartialEq)]
struct Given {
    name: String,
    unit: String,
    value: f64,
    /// What was put in, for a property of a constituent.
    put_in: Option<f64>,
}

/// A test that has run.
struct Done {
    part: &'static Part,
    results: Results,
    numbers: Vec<Given>,
    /// Points of its curve, see [`Curve`].
    curve: Vec<[f64; 2]>,
}

/// Runs the tests of a fabric.
///
/// # Errors
/// A fabric or a change that is not valid, an unknown test, or a folder that cannot be used.
pub fn characterise(fabric: &Path, changes: &[String], options: &Options) -> Result<Characterised> {
    let parts = chosen(options)?;
    // every case is checked before the first one runs
    let loaded = parts.iter().map(|part| {
        let (text, own) = part.case(options.preset == Preset::Quick);
        let all: Vec<String> = own.map(String::from).chain(changes.iter().cloned()).collect();
        of_fabric(part.name, text, fabric, &all)
    });
    let loaded: Vec<Loaded> = loaded.collect::<Result<_>>()?;
    std::fs::create_dir_all(&options.output).map_err(|e| Error::file(&options.output, e))?;
    let (mut done, mut stopped, mut interrupted) = (Vec::new(), false, false);
    for (part, loaded) in parts.into_iter().zip(&loaded) {
        let folder = options.output.join(part.name);
        match run_part(loaded, &folder, options) {
            Ok(outcome) => interrupted = outcome,
            Err(Error::Guard(_)) => stopped = true,
            Err(error) => return Err(error),
        }
        done.push(Done::read(part, &folder)?);
        write_table(&done, &options.output.join("characterise.csv"))?;
        page::write(&done, &loaded.case.fabric()?.name, &options.output.join("characterise.html"))?;
        if interrupted {
            break;
        }
    }
    Ok(Characterised { text: text(&done, &options.output), interrupted, stopped })
}

/// The tests that the options ask for.
fn chosen(options: &Options) -> Result<Vec<&'static Part>> {
    let known = || PARTS.iter().map(|part| part.name).collect::<Vec<_>>().join(", ");
    if let Some(unknown) = options.only.iter().find(|name| PARTS.iter().all(|part| part.name != **name)) {
        return Err(Error::case("--only", format!("there is no test `{unknown}`; there are {}", known())));
    }
    let wanted = |part: &&Part| {
        if options.only.is_empty() {
            options.preset == Preset::Full || !part.is_long
        } else {
            options.only.iter().any(|name| name == part.name)
        }
    };
    Ok(PARTS.iter().filter(wanted).collect())
}

/// Runs a test, or the rest of it; whether the user stopped it.
fn run_part(loaded: &Loaded, folder: &Path, options: &Options) -> Result<bool> {
    let run_options = run::Options {
        output: folder.to_path_buf(),
        precision: None,
        threads: options.threads,
        machine: options.machine,
        adapter: String::new(),
        force: false,
        resume: folder.join(CASE).is_file(),
        from: None,
        quiet: options.quiet,
    };
    let outcome = run::run(loaded, &run_options)?;
    run::report(folder, &folder.join("report.html"))?;
    Ok(outcome.interrupted)
}

impl Done {
    fn read(part: &'static Part, folder: &Path) -> Result<Self> {
        let results = Results::read(folder)?;
        let (mut numbers, mut curve) = (Vec::new(), Vec::new());
        let given = |name: String, unit: &str, value| Given { name, unit: unit.into(), value, put_in: None };
        match part.curve {
            Curve::Property => {
                let property = &results.summary["property"];
                let [symbol, unit] =
                    ["symbol", "unit"].map(|name| property[name].as_str().unwrap_or_default().to_owned());
                let [evaluated, put_in] = ["evaluated", "given"].map(|name| property[name].as_f64());
                numbers.extend(evaluated.map(|value| Given { name: symbol, unit, value, put_in }));
            }
            Curve::Shear => {
                curve = sheared(&Columns::read(&folder.join("history.csv"))?);
                // up to the largest angle, from where the load turns back
                let farthest = (0..curve.len()).max_by(|a, b| curve[*a][0].total_cmp(&curve[*b][0]));
                let turn = farthest.map_or(0, |last| last + 1);
                let end = curve[..turn].last().map_or(0.0, |[angle, _]| *angle);
                for angle in ANGLES.into_iter().filter(|angle| *angle <= end + NEAR) {
                    numbers.push(given(format!("F_nor at {angle}°"), "N/mm", value(&curve[..turn], angle.min(end))));
                }
            }
            Curve::Compaction => {
                let [thickness, share] = compacted(folder)?;
                for (name, unit, points) in [("thickness", "mm", &thickness), ("fibre volume fraction", "–", &share)]
                {
                    if points.last().is_some_and(|[end, _]| *end >= PRESSURE) {
                        numbers.push(given(format!("{name} at {PRESSURE} MPa"), unit, value(points, PRESSURE)));
                    }
                }
                curve = thickness.into_iter().map(|[pressure, thickness]| [thickness, pressure]).collect();
            }
            Curve::Tension { of_warp } => {
                let stress = Columns::read(&folder.join("stress.csv"))?;
                let ply = if of_warp { "warp" } else { "weft" };
                curve = tension(&stress, ply);
                let far = curve.iter().copied().max_by(|a, b| a[0].total_cmp(&b[0]));
                numbers.extend(
                    far.map(|[strain, force]| given(format!("membrane force at {strain:.2} %"), "N/mm", force)),
                );
            }
        }
        Ok(Self { part, results, numbers, curve })
    }
}

/// F_nor, N/mm, over the size of the shear angle, degrees, while the fabric is sheared; positive along the angle. F_nor is a mean
/// over its row, and belongs to the middle.
fn sheared(history: &Columns) -> Vec<[f64; 2]> {
    let (angles, forces) = (history.numbers("shear_angle_deg"), history.numbers("f_nor_n_per_mm"));
    let phases = history.texts("phase");
    let loaded = (1..angles.len()).filter(|row| matches!(phases[*row], "shear" | "move"));
    let loaded = loaded.filter(|row| (angles[*row] - angles[row - 1]).abs() >= LEAST);
    let points = loaded.map(|row| {
        let middle = 0.5 * (angles[row - 1] + angles[row]);
        [middle.abs(), if middle < 0.0 { -forces[row] } else { forces[row] }]
    });
    points.filter(|[_, force]| force.is_finite()).collect()
}

/// Thickness, mm, and fibre volume fraction of a fabric over the pressure of the plates, MPa, while they come together.
fn compacted(folder: &Path) -> Result<[Vec<[f64; 2]>; 2]> {
    let (plates, history) = (Columns::read(&folder.join("plates.csv"))?, Columns::read(&folder.join("history.csv"))?);
    let (phases, pressure) = (history.texts("phase"), plates.numbers("upper_pressure_mpa"));
    Ok(["thickness_mm", "fibre_volume_fraction"].map(|column| {
        let rows = pressure.iter().zip(plates.numbers(column)).zip(&phases);
        rows.filter(|((p, _), phase)| **phase == "move" && **p > 0.0).map(|((p, of), _)| [*p, of]).collect()
    }))
}

fn write_table(done: &[Done], path: &Path) -> Result<()> {
    let names = ["test", "verdict", "quantity", "value", "unit", "put_in", "wall_s"].map(String::from);
    let mut table = Named::create(path, &names)?;
    for Done { part, results, numbers, .. } in done {
        let row = |given: Option<&Given>| {
            let Some(Given { name, unit, value, put_in }) = given else { return [""; 4].map(String::from) };
            [name.clone(), number(*value), unit.clone(), put_in.map_or(String::new(), number)]
        };
        let ends = [part.name.to_owned(), results.verdict().to_owned()];
        let rows: Vec<_> =
            if numbers.is_empty() { vec![row(None)] } else { numbers.iter().map(|n| row(Some(n))).collect() };
        for cells in rows {
            table.row(&[&ends[..], &cells, &[number(results.number("wall_s"))]].concat())?;
        }
    }
    Ok(())
}

/// The table for the terminal.
fn text(done: &[Done], output: &Path) -> String {
    let mut t = String::new();
    for Done { part, results, numbers, .. } in done {
        // writing to a String does not fail
        let _ = writeln!(t, "{:16} {}, {:.1} s", part.name, results.verdict(), results.number("wall_s"));
        for Given { name, unit, value, put_in } in numbers {
            let put_in = put_in.map_or(String::new(), |put_in| format!(" ({put_in:.4e} put in)"));
            let _ = writeln!(t, "{:16} {name} = {value:.4e} {unit}{put_in}", "");
        }
    }
    let _ = write!(t, "results          {0}/characterise.csv, {0}/characterise.html", output.display());
    t
}
