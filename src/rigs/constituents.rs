//! Tests of the constituents of a fabric: straight pieces of its thread and of its yarns, and properties evaluated as an experimenter
//! evaluates them, beside those that were put in.

use super::observer::{Loading, Observer, Seen};
use crate::case::Case;
use crate::case::domain::{OnePly, Resolution};
use crate::case::fabric::{Stitch, Yarn};
use crate::case::provenance::Provenance;
use crate::error::Result;
use crate::fabric::section::Section;
use crate::fabric::{quantised, stitch};
use crate::kernel::record::{Record, Recorded};
use crate::mesh::{Block, Mesh, Part, Ply, quality};
use crate::output::page::Page;
use crate::output::results::Results;
use crate::scene::Motion;
use crate::settings::steps::Step;
use crate::simulate::Simulation;
use serde_json::{Value, json};

/// Field of the summary that holds the [`Property`].
const PROPERTY: &str = "property";

/// A straight piece of the thread along x, from node to node.
pub(super) fn thread(stitch: &Stitch, from: f64, length: f64, elements: usize) -> Mesh {
    let at = |i: usize| [quantised(from + length * i as f64 / elements as f64), 0.0, 0.0];
    let nodes = (0..=elements).map(at).collect();
    let piece = stitch::thread(stitch, "thread".into(), 0, None, vec![(Part::Free, 0.0); elements]);
    Mesh { nodes, threads: vec![piece], ..Mesh::default() }
}

/// The yarn of a ply, and hexahedra across it.
pub(super) fn yarn_of(case: &Case, ply: OnePly) -> Result<(&Yarn, usize)> {
    let (fabric, resolution) = (case.fabric()?, case.resolution.refined());
    Ok(match ply {
        OnePly::Warp => (&fabric.warp, resolution.warp_columns),
        OnePly::Weft => (&fabric.weft, resolution.weft_columns),
    })
}

/// The mesh resolution of a case with the fields that a yarn of a ply uses at their defaults; also its slices unless their number is
/// `fixed`.
pub(super) fn resolution_of(case: &Case, ply: OnePly, fixed: bool) -> Resolution {
    let Resolution { warp_columns, weft_columns, layers, slice_mm, finer, .. } = Resolution::default();
    let own = case.resolution.clone();
    let own = match ply {
        OnePly::Warp => Resolution { warp_columns, ..own },
        OnePly::Weft => Resolution { weft_columns, ..own },
    };
    let slice_mm = if fixed { own.slice_mm } else { slice_mm };
    Resolution { layers, slice_mm, finer, ..own }
}

/// Area of the section of a yarn, mm², and the thickness of a rectangle of the same width and area, mm.
pub(super) fn rectangle(yarn: &Yarn) -> [f64; 2] {
    let section = Section { width: yarn.width_mm, thickness: yarn.thickness_mm, truncation: yarn.truncation };
    [section.area(), section.area() / yarn.width_mm]
}

/// A straight piece of a yarn with a rectangular section about the origin: length along x, width along y, thickness along z, mm, and
/// the hexahedra along each. Its fibres run along x.
pub(super) fn yarn(yarn: &Yarn, size: [f64; 3], [slices, columns, layers]: [usize; 3]) -> Mesh {
    let place = |i: usize, count: usize, size: f64| quantised((i as f64 / count as f64 - 0.5) * size);
    let mut mesh = Mesh::default();
    for layer in 0..=layers {
        for column in 0..=columns {
            let [y, z] = [place(column, columns, size[1]), place(layer, layers, size[2])];
            mesh.nodes.extend((0..=slices).map(|slice| [place(slice, slices, size[0]), y, z]));
        }
    }
    let [area, _] = rectangle(yarn);
    mesh.blocks.push(Block {
        name: "yarn".into(),
        ply: Ply::Free,
        first: 0,
        slices,
        columns,
        layers,
        wrap: None,
        fibre: [1.0, 0.0, 0.0],
        density: yarn.areal_mass_g_m2 * quality::TONNES_PER_MM2 * yarn.pitch_mm / area,
        material: yarn.material.clone(),
        velocity: [0.0; 3],
    });
    mesh
}

/// A grip on all components of some nodes, which moves by a distance along x.
pub(super) fn grip(name: &str, nodes: Vec<usize>, displacement: f64) -> Motion {
    Motion {
        name: name.into(),
        nodes,
        components: [true; 3],
        displacement: [displacement, 0.0, 0.0],
        ..Motion::default()
    }
}

/// Refuses load steps that only a piece of fabric has, and a pull, given at a path of the case, that moves nothing.
pub(super) fn steps(case: &Case, path: &str, displacement: f64, provenance: &Provenance) -> Result<()> {
    super::check::steps(case, provenance, |step| match step {
        Step::Shear { .. } => Some("shear needs a periodic cell: use domain.cell, or move the grip"),
        Step::Stretch { .. } => Some("only a cell has a stretch of its own: move the grip"),
        Step::Pretension { .. } => Some("nothing is stitched here that could tighten: remove it"),
        _ => None,
    })?;
    if displacement == 0.0 {
        return Err(provenance.error(path, "is 0, so that nothing is loaded: give a displacement"));
    }
    if case.steps.iter().all(|step| !matches!(step, Step::Move { .. })) {
        return Err(provenance.error(path, "is never applied: add a move step"));
    }
    Ok(())
}

/// Refuses a mesh resolution that differs from the defaults outside the fields that a rig uses, which are set to their defaults in
/// `unused`.
pub(super) fn unused(case: &Case, unused: &Resolution, what: &str, provenance: &Provenance) -> Result<()> {
    let default = Resolution::default();
    let fields = [
        ("warp_columns", unused.warp_columns == default.warp_columns),
        ("weft_columns", unused.weft_columns == default.weft_columns),
        ("layers", unused.layers == default.layers),
        ("slice_mm", unused.slice_mm == default.slice_mm),
        ("beams_per_lap", unused.beams_per_lap == default.beams_per_lap),
        ("lap_variation", unused.lap_variation == default.lap_variation),
        ("finer", unused.finer == default.finer),
    ];
    match fields.into_iter().find(|(_, is_default)| !is_default) {
        Some((name, _)) => {
            let cause = if case.accuracy.is_some() { "remove it, or the accuracy that sets it" } else { "remove it" };
            let message = format!("has no effect on {what}: {cause}");
            Err(provenance.error(&format!("resolution.{name}"), message))
        }
        None => Ok(()),
    }
}

/// A property as evaluated from a test, beside the one that was put in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Property {
    /// Symbol, unit, and the formula by which it is evaluated.
    pub symbol: &'static str,
    pub unit: &'static str,
    pub by: &'static str,
    pub evaluated: f64,
    pub given: f64,
}

impl Property {
    /// As a field of the summary.
    pub fn summary(&self) -> (&'static str, Value) {
        let &Self { symbol, unit, by, evaluated, given } = self;
        (PROPERTY, json!({ "symbol": symbol, "unit": unit, "by": by, "evaluated": evaluated, "given": given }))
    }

    /// As a closing line.
    pub fn line(&self) -> String {
        let &Self { symbol, unit, by, evaluated, given } = self;
        let off = 100.0 * (evaluated / given - 1.0);
        format!("{symbol:10} {evaluated:.4e} {unit} by {by}; {given:.4e} {unit} put in ({off:+.2} %)\n")
    }
}

/// The sentence about a property in a report, from the summary of its run.
pub(super) fn section(results: &Results, page: &mut Page) -> Vec<String> {
    let property = &results.summary[PROPERTY];
    let [Some(evaluated), Some(given)] = ["evaluated", "given"].map(|name| property[name].as_f64()) else {
        return Vec::new();
    };
    let [symbol, unit, by] = ["symbol", "unit", "by"].map(|name| property[name].as_str().unwrap_or_default());
    let off = 100.0 * (evaluated / given - 1.0);
    let found = format!("{symbol} = {evaluated:.4e} {unit} by {by}, {off:+.2} % from the {given:.4e} {unit} put in.");
    page.heading("What the test gives");
    page.list("findings", std::slice::from_ref(&found));
    vec![found]
}

/// The chart of the force over the displacement of a grip.
pub(super) fn force(results: &Results, page: &mut Page, caption: &str) {
    results.chart(page, &results.history, &results.axis(), ["Force", "N"], &[("force_n", "force")], caption);
}

/// Evaluates a stiffness from the slope of force over displacement while a grip moves.
pub(super) struct Pull {
    /// Name of the property and the stiffness of the piece, N/mm, for a property of one.
    property: Property,
    per_property: f64,
    /// Displacement, mm, and force, N.
    curve: Vec<(f64, f64)>,
}

impl Pull {
    /// Of a property whose value times `per_property` is the stiffness of the piece.
    pub fn new(property: Property, per_property: f64) -> Self {
        Self { property, per_property, curve: Vec::new() }
    }

    /// The property by the slope of the least squares through the origin; `None` before the grip has moved.
    fn property(&self) -> Option<Property> {
        let (work, square) = self.curve.iter().fold((0.0, 0.0), |(w, s), (d, f)| (w + d * f, s + d * d));
        (square > 0.0).then_some(Property { evaluated: work / square / self.per_property, ..self.property })
    }
}

impl Observer for Pull {
    fn row(&mut self, simulation: &mut Simulation, seen: &Seen) -> Result<Loading> {
        if seen.phase == "move" {
            self.curve.push((simulation.displacement(), seen.machine));
        }
        Ok(Loading { degrees: 0.0, force: seen.machine, normalised: f64::NAN })
    }

    fn is_loaded(&self, simulation: &Simulation, phase: &str) -> bool {
        phase == "move" && simulation.load().motion.abs() > 0.1
    }

    fn record(&mut self, record: &mut Record) {
        let Self { property: _, per_property: _, curve } = self;
        curve.record(record);
    }

    fn summary(&self, _: &Simulation) -> Vec<(&'static str, Value)> {
        self.property().map(|property| property.summary()).into_iter().collect()
    }

    fn lines(&self, _: &Simulation) -> String {
        self.property().map_or(String::new(), |property| property.line())
    }
}
