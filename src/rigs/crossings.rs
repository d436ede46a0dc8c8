//! Crossings of warp and weft during a run: means in every row, all of them as a table and a map at every frame, and as maps in the
//! report.

use super::observer::Tables;
use crate::error::Result;
use crate::measure::crossings::{Crossing, Crossings, angles, slips};
use crate::measure::yarns::{self, Yarn};
use crate::measure::zones::{Means, Strip, Zone};
use crate::mesh::Mesh;
use crate::mesh::frame::{Field, Frame};
use crate::output::chart;
use crate::output::page::Page;
use crate::output::results::{Results, short};
use crate::output::table::{CROSSINGS, Cell, SHEAR, Table, ZONES};
use crate::output::{map, vtu};
use glam::{DVec2, DVec3, Vec3Swizzles};
use std::path::Path;

/// Means over a zone leave out what is closer to its border than this share of the width of the specimen.
pub(super) const MARGIN: f64 = 0.1;
/// Share of the values at each end that the colours of several maps leave out: gaps at the edges of a specimen are no gaps.
const OUTER: f64 = 0.02;

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
    fn of(strip: &Strip, mesh: &Mesh, crossings: &Crossings) -> Self {
        let yarns = |warp: usize, weft: usize| [warp, weft].map(|b| DVec3::from(mesh.blocks[b].fibre).xy());
        let places = || crossings.pairs.iter().map(|p| (p.reference, yarns(p.warp, p.weft)));
        let margin = MARGIN * strip.width;
        Self {
            all: places().map(|(at, yarns)| strip.zone(at, yarns)).collect(),
            core: places().map(|(at, yarns)| strip.core(at, yarns, margin)).collect(),
        }
    }
}

impl Crossed {
    /// Opens the tables of a scene; `None` if it has no crossings. Positive shear turns yarns towards `diagonal`; the strip between
    /// the clamps of a specimen has zones.
    pub(super) fn of(mesh: &Mesh, diagonal: DVec2, strip: Option<Strip>, tables: &Tables) -> Result<Option<Self>> {
        let crossings = Crossings::of(mesh, diagonal);
        if crossings.pairs.is_empty() {
            return Ok(None);
        }
        let zones = strip.map(|strip| Zones::of(&strip, mesh, &crossings));
        let shear = [SHEAR, if zones.is_some() { ZONES } else { &[] }].concat();
        let tables = [tables.open("shear.csv", &shear)?, tables.open("crossings.csv", CROSSINGS)?];
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

    /// Every crossing of a frame: fields of hexahedra that follow from them, rows of the table, and a map in the folder of results.
    pub(super) fn frame(&mut self, mesh: &Mesh, frame: &mut Frame, dir: &Path, name: &str) -> Result<()> {
        let yarns = yarns::measure(mesh, frame)?;
        let crossings = self.crossings.measure(mesh, frame, &yarns)?;
        let field = |name: &str, value: &dyn Fn(&Crossing) -> f64| {
            let values = self.crossings.along_yarns(mesh, &crossings, value);
            Field { name: name.into(), components: 1, values }
        };
        let fields =
            [field("effective_angle_deg", &|c| c.angle.to_degrees()), field("ply_slip_mm", &Crossing::slipped)];
        frame.hex_fields.extend(fields);
        self.write_frame(mesh, frame, &crossings, dir, format!("frames/{name}.vtp"))
    }

    fn write_frame(
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
            let (reference, position, slip) = (pair.reference.to_array(), c.position.to_array(), c.slip.to_array());
            let numbers = [&reference[..], &position, &degrees, &slip, &c.width, &c.gap].concat();
            let cells = head.into_iter().chain([zone.into()]).chain(names);
            self.tables[1].row(&cells.chain(numbers.into_iter().map(Into::into)).collect::<Vec<_>>())?;
        }
        // yarns that cross no longer have no place on a map
        let there: Vec<usize> = (0..crossings.len()).filter(|&i| crossings[i].angle.is_finite()).collect();
        let points: Vec<[f64; 3]> = there.iter().map(|&i| crossings[i].position.to_array()).collect();
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

/// Maps of the crossings in a report: at the last of the loaded frames, or at some of them, evenly chosen, in colours of one range.
pub(super) fn maps(results: &Results, page: &mut Page, most: usize) -> Result<()> {
    let Some(table) = results.other("crossings.csv")?.filter(|t| !t.is_empty()) else { return Ok(()) };
    let times = table.texts("time_s");
    let mut frames = times.clone();
    frames.dedup();
    let several = most > 1;
    let displacements = table.numbers("displacement_mm");
    let place = |time: &str| times.iter().position(|t| *t == time).map_or(f64::NAN, |row| displacements[row]);
    if several {
        frames.retain(|time| place(time) > 0.0);
    }
    if frames.is_empty() {
        frames.push(times[times.len() - 1]);
    }
    let (count, last) = (most.min(frames.len()), frames.len() - 1);
    let chosen: Vec<&str> = (1..=count).map(|k| frames[last * k / count]).collect();
    let (x, y) = (table.numbers("x_mm"), table.numbers("y_mm"));
    page.heading(if several { "Crossings while the specimen is pulled" } else { "Crossings at the last frame" });
    page.raw("<div class=\"charts\">");
    let maps = [
        ("effective_angle_deg", "effective shear angle, degrees"),
        ("warp_gap_mm", "gap of the warp, mm"),
        ("weft_gap_mm", "gap of the weft, mm"),
    ];
    for (column, name) in maps {
        let values = table.numbers(column);
        let range = if several { middle(chosen.iter().flat_map(|time| at(&times, time, &values))) } else { None };
        for time in &chosen {
            let points: Vec<[f64; 3]> = at(&times, time, &x)
                .zip(at(&times, time, &y))
                .zip(at(&times, time, &values))
                .map(|((x, y), v)| [x, y, v])
                .collect();
            let shown = points.iter().filter(|p| p.iter().all(|v| v.is_finite())).count();
            let mut caption = format!("{shown} crossings at t = {} s", short(time));
            if several {
                caption += &format!(", d = {:.2} mm; colours as in the other maps of this size", place(time));
            }
            if let Some(svg) = chart::map(name, &points, range) {
                page.figure(name, &svg, &caption);
            }
        }
    }
    page.raw("</div>");
    Ok(())
}

/// Values of the rows at a time.
fn at<'a>(times: &'a [&str], time: &'a str, values: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
    values.iter().zip(times).filter(move |(_, t)| **t == time).map(|(v, _)| *v)
}

/// Range of values without the outermost at both ends; `None` if there is none.
fn middle(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let mut values: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    let outer = (OUTER * last as f64) as usize;
    Some([values[outer], values[last - outer]])
}
