//! Crossings of warp and weft during a run: means in every row, all of them as a table and a map at every frame.

use crate::case::domain::{Domain, Specimen};
use crate::error::Result;
use crate::measure::crossings::{Crossing, Crossings, angles, slips};
use crate::measure::yarns::{self, Yarn};
use crate::measure::zones::{Means, Strip, Zone};
use crate::mesh::Mesh;
use crate::mesh::frame::{Field, Frame};
use crate::output::table::{CROSSINGS, Cell, SHEAR, Table, ZONES};
use crate::output::{map, vtu};
use std::path::Path;

/// Diagonal of the cell towards which positive shear turns its yarns.
const DIAGONAL: [f64; 2] = [1.0, 1.0];
/// Means over a zone leave out what is closer to its border than this share of the width of the specimen.
pub(super) const MARGIN: f64 = 0.1;

/// The strip between the clamps of a specimen.
pub(super) fn strip(specimen: &Specimen) -> Strip {
    Strip { centre: [0.0; 2], axis: [1.0, 0.0], length: specimen.length_mm, width: specimen.width_mm }
}

/// The crossings of a scene with their files.
pub(super) struct Crossed {
    crossings: Crossings,
    /// Of a specimen.
    zones: Option<Zones>,
    /// `shear.csv` and `crossings.csv`.
    pub(super) tables: [Table; 2],
    /// Times, s, and maps.
    pub(super) maps: Vec<(f64, String)>,
}

/// Zone of each crossing: of every one, and of those well inside.
struct Zones {
    all: Vec<Zone>,
    core: Vec<Option<Zone>>,
}

impl Zones {
    fn of(specimen: &Specimen, strip: &Strip, mesh: &Mesh, crossings: &Crossings) -> Self {
        let yarns = |warp: usize, weft: usize| [warp, weft].map(|b| [mesh.blocks[b].fibre[0], mesh.blocks[b].fibre[1]]);
        let places = || crossings.pairs.iter().map(|p| (p.reference, yarns(p.warp, p.weft)));
        let margin = MARGIN * specimen.width_mm;
        Self {
            all: places().map(|(at, yarns)| strip.zone(at, yarns)).collect(),
            core: places().map(|(at, yarns)| strip.core(at, yarns, margin)).collect(),
        }
    }
}

impl Crossed {
    /// Opens the tables of a scene; `None` if it has no crossings.
    pub(super) fn of(
        domain: &Domain,
        mesh: &Mesh,
        table: impl Fn(&str, &[&str]) -> Result<Table>,
    ) -> Result<Option<Self>> {
        let specimen = match domain {
            Domain::Specimen(s) => Some((s, strip(s))),
            _ => None,
        };
        let crossings = Crossings::of(mesh, specimen.as_ref().map_or(DIAGONAL, |(_, strip)| strip.axis));
        if crossings.pairs.is_empty() {
            return Ok(None);
        }
        let zones = specimen.map(|(specimen, strip)| Zones::of(specimen, &strip, mesh, &crossings));
        let shear = [SHEAR, if zones.is_some() { ZONES } else { &[] }].concat();
        let tables = [table("shear.csv", &shear)?, table("crossings.csv", CROSSINGS)?];
        Ok(Some(Self { crossings, zones, tables, maps: Vec::new() }))
    }

    pub(super) fn measure(&self, mesh: &Mesh, frame: &Frame, yarns: &[Yarn]) -> Result<Vec<Crossing>> {
        self.crossings.measure(mesh, frame, yarns)
    }

    /// Means over the zones of a specimen.
    pub(super) fn means(&self, crossings: &[Crossing]) -> Option<Means> {
        self.zones.as_ref().map(|zones| Means::of(crossings, &zones.core))
    }

    /// Means over all crossings, and over those of each zone; `state` is time, shear angle in degrees, and displacement,
    /// `theory` the angle of zone C without slip, rad.
    pub(super) fn write_row(&mut self, state: [f64; 3], crossings: &[Crossing], theory: f64) -> Result<()> {
        let (angle, slip) = (angles(crossings.iter()), slips(crossings.iter()));
        let degrees = [angle.mean, angle.std, angle.min, angle.max].map(f64::to_degrees);
        let mut numbers = [&state[..], &degrees, &[slip.mean, slip.max]].concat();
        if let Some(m) = self.means(crossings) {
            numbers.push(theory.to_degrees());
            numbers.extend([m.angle, m.angle_std].concat().into_iter().map(f64::to_degrees));
            numbers.extend([&m.slip[..], &m.width, &m.gap, &m.broadness].concat());
            numbers.extend(m.direction.map(f64::to_degrees));
        }
        self.tables[0].numbers(&numbers)
    }

    /// Every crossing of a frame, which gains the fields of hexahedra that follow from them.
    pub(super) fn see(&self, mesh: &Mesh, frame: &mut Frame) -> Result<Vec<Crossing>> {
        let yarns = yarns::measure(mesh, frame)?;
        let crossings = self.crossings.measure(mesh, frame, &yarns)?;
        let field = |name: &str, value: &dyn Fn(&Crossing) -> f64| {
            let values = self.crossings.along_yarns(mesh, &crossings, value);
            Field { name: name.into(), components: 1, values }
        };
        let fields =
            [field("effective_angle_deg", &|c| c.angle.to_degrees()), field("ply_slip_mm", &Crossing::slipped)];
        frame.hex_fields.extend(fields);
        Ok(crossings)
    }

    /// Every crossing: rows of the table, and a map in the folder of results.
    pub(super) fn write_frame(
        &mut self,
        mesh: &Mesh,
        frame: &Frame,
        crossings: &[Crossing],
        dir: &Path,
        file: String,
    ) -> Result<()> {
        let angle = self.means(crossings).map_or(frame.angle_deg, |means| means.angle[2].to_degrees());
        for (i, (pair, c)) in self.crossings.pairs.iter().zip(crossings).enumerate() {
            let head = [frame.time, angle, frame.displacement_mm].map(Cell::from);
            let zone = self.zones.as_ref().map_or("none", |zones| zones.all[i].name());
            let names = [pair.warp, pair.weft].map(|block| mesh.blocks[block].name.as_str().into());
            let degrees = [c.angle, c.direction[0], c.direction[1]].map(f64::to_degrees);
            let numbers = [&pair.reference[..], &c.position, &degrees, &c.slip, &c.width, &c.gap].concat();
            let cells = head.into_iter().chain([zone.into()]).chain(names);
            self.tables[1].row(&cells.chain(numbers.into_iter().map(Into::into)).collect::<Vec<_>>())?;
        }
        // yarns that cross no longer have no place on a map
        let there: Vec<usize> = (0..crossings.len()).filter(|&i| crossings[i].angle.is_finite()).collect();
        let points: Vec<[f64; 3]> = there.iter().map(|&i| crossings[i].position).collect();
        let field = |name: &str, value: &dyn Fn(usize) -> f64| Field {
            name: name.into(),
            components: 1,
            values: there.iter().map(|&i| value(i)).collect(),
        };
        let mut fields = vec![
            field("effective_angle_deg", &|i| crossings[i].angle.to_degrees()),
            field("warp_direction_deg", &|i| crossings[i].direction[0].to_degrees()),
            field("weft_direction_deg", &|i| crossings[i].direction[1].to_degrees()),
            field("slip_mm", &|i| crossings[i].slipped()),
            field("warp_gap_mm", &|i| crossings[i].gap[0]),
            field("weft_gap_mm", &|i| crossings[i].gap[1]),
            field("warp_width_mm", &|i| crossings[i].width[0]),
            field("weft_width_mm", &|i| crossings[i].width[1]),
        ];
        if let Some(zones) = &self.zones {
            fields.push(field("zone", &|i| f64::from(zones.all[i] as u8)));
        }
        map::write(&points, &fields, &dir.join(&file))?;
        self.maps.push((frame.time, file));
        vtu::write_collection(&dir.join("crossings.pvd"), &self.maps)
    }
}
