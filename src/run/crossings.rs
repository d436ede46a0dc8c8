//! Crossings of warp and weft during a run: means in every row, all of them as a table and a map at every frame.

use crate::error::Result;
use crate::measure::crossings::{Crossing, Crossings, angles, slips};
use crate::measure::yarns::{self, Yarn};
use crate::mesh::Mesh;
use crate::mesh::frame::{Field, Frame};
use crate::output::table::{CROSSINGS, SHEAR, Table};
use crate::output::{map, vtu};
use std::path::Path;

/// Diagonal of the cell towards which positive shear turns its yarns.
const DIAGONAL: [f64; 2] = [1.0, 1.0];

/// The crossings of a scene with their files.
pub(super) struct Crossed {
    crossings: Crossings,
    /// `shear.csv` and `crossings.csv`.
    pub(super) tables: [Table; 2],
    /// Times, s, and maps.
    pub(super) maps: Vec<(f64, String)>,
}

impl Crossed {
    /// Opens the tables of a scene; `None` if it has no crossings.
    pub(super) fn of(mesh: &Mesh, table: impl Fn(&str, &[&str]) -> Result<Table>) -> Result<Option<Self>> {
        let crossings = Crossings::of(mesh, DIAGONAL);
        if crossings.pairs.is_empty() {
            return Ok(None);
        }
        let tables = [table("shear.csv", SHEAR)?, table("crossings.csv", CROSSINGS)?];
        Ok(Some(Self { crossings, tables, maps: Vec::new() }))
    }

    /// Means over all crossings.
    pub(super) fn write_row(&mut self, mesh: &Mesh, frame: &Frame, yarns: &[Yarn], displacement: f64) -> Result<()> {
        let crossings = self.crossings.measure(mesh, frame, yarns)?;
        let (angle, slip) = (angles(crossings.iter()), slips(crossings.iter()));
        let degrees = [angle.mean, angle.std, angle.min, angle.max].map(f64::to_degrees);
        let state = [frame.time, frame.angle_deg, displacement];
        self.tables[0].numbers(&[&state[..], &degrees, &[slip.mean, slip.max]].concat())
    }

    /// Every crossing: rows of the table, and a map in the folder of results.
    pub(super) fn write_frame(&mut self, mesh: &Mesh, frame: &Frame, dir: &Path, file: String) -> Result<()> {
        let yarns = yarns::measure(mesh, frame)?;
        let crossings = self.crossings.measure(mesh, frame, &yarns)?;
        for (pair, c) in self.crossings.pairs.iter().zip(&crossings) {
            let head = [frame.time.into(), frame.angle_deg.into()];
            let names = [pair.warp, pair.weft].map(|block| mesh.blocks[block].name.as_str().into());
            let numbers =
                [&pair.reference[..], &c.position, &[c.angle.to_degrees()], &c.slip, &c.width, &c.gap].concat();
            let cells = head.into_iter().chain(names).chain(numbers.into_iter().map(Into::into));
            self.tables[1].row(&cells.collect::<Vec<_>>())?;
        }
        // yarns that cross no longer have no place on a map
        let there: Vec<&Crossing> = crossings.iter().filter(|c| c.angle.is_finite()).collect();
        let points: Vec<[f64; 3]> = there.iter().map(|c| c.position).collect();
        let field = |name: &str, value: fn(&Crossing) -> f64| Field {
            name: name.into(),
            components: 1,
            values: there.iter().map(|c| value(c)).collect(),
        };
        let fields = [
            field("effective_angle_deg", |c| c.angle.to_degrees()),
            field("slip_mm", Crossing::slipped),
            field("warp_gap_mm", |c| c.gap[0]),
            field("weft_gap_mm", |c| c.gap[1]),
            field("warp_width_mm", |c| c.width[0]),
            field("weft_width_mm", |c| c.width[1]),
        ];
        map::write(&points, &fields, &dir.join(&file))?;
        self.maps.push((frame.time, file));
        vtu::write_collection(&dir.join("crossings.pvd"), &self.maps)
    }
}
