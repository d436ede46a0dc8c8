//! Crossings of warp and weft during a run: means in every row, a table and a map of all crossings at every frame, and the maps
//! of the report.

use super::bias_extension::zones::{Means, Strip, Zone};
use super::observer::Tables;
use crate::error::Result;
use crate::measure::crossings::{Crossing, Crossings, angles, slips};
use crate::measure::yarns::{self, Yarn};
use crate::mesh::Mesh;
use crate::mesh::frame::{Field, Frame};
use crate::output::appended::Appended;
use crate::output::chart;
use crate::output::page::Page;
use crate::output::results::{Results, short};
use crate::output::rows;
use crate::output::table::{Table, text};
use crate::output::{map, vtu};
use glam::{DVec2, DVec3, Vec3Swizzles};
use std::path::Path;

/// Zone means exclude crossings closer to the zone border than this share of the specimen width.
pub(super) const MARGIN: f64 = 0.1;
/// Share of the values at each end that the common colour range of several maps ignores: gaps at the edges of a specimen are
/// not real gaps.
const OUTER: f64 = 0.02;

/// The crossings of a scene and their output files.
pub(super) struct Crossed {
    crossings: Crossings,
    shear: Shear,
    /// `crossings.csv`.
    each: Table<rows::Crossing>,
    /// Times, s, and maps.
    pub(super) maps: Vec<(f64, String)>,
}

/// `shear.csv`; a specimen adds the columns of the zones.
enum Shear {
    Whole(Table<rows::Shear>),
    Zoned(Zones, Table<(rows::Shear, rows::Zones)>),
}

/// Zone of every crossing, and zone of the crossings well inside a zone.
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
    /// Opens the tables of a scene; `None` if it has no crossings. Positive shear turns the yarns towards `diagonal`. Zones
    /// exist for the strip between the clamps of a specimen.
    pub(super) fn of(mesh: &Mesh, diagonal: DVec2, strip: Option<Strip>, tables: &Tables) -> Result<Option<Self>> {
        let crossings = Crossings::of(mesh, diagonal);
        if crossings.pairs.is_empty() {
            return Ok(None);
        }
        let shear = match strip {
            Some(strip) => Shear::Zoned(Zones::of(&strip, mesh, &crossings), tables.open("shear.csv")?),
            None => Shear::Whole(tables.open("shear.csv")?),
        };
        Ok(Some(Self { crossings, shear, each: tables.open("crossings.csv")?, maps: Vec::new() }))
    }

    /// Files of the tables.
    pub(super) fn files(&mut self) -> [&mut Appended; 2] {
        let shear = match &mut self.shear {
            Shear::Whole(table) => &mut table.file,
            Shear::Zoned(_, table) => &mut table.file,
        };
        [shear, &mut self.each.file]
    }

    /// Zones of a specimen.
    fn zones(&self) -> Option<&Zones> {
        match &self.shear {
            Shear::Whole(_) => None,
            Shear::Zoned(zones, _) => Some(zones),
        }
    }

    pub(super) fn measure(&self, mesh: &Mesh, frame: &Frame, yarns: &[Yarn]) -> Result<Vec<Crossing>> {
        self.crossings.measure(mesh, frame, yarns)
    }

    /// Means over the zones of a specimen.
    pub(super) fn means(&self, crossings: &[Crossing]) -> Option<Means> {
        self.zones().map(|zones| Means::of(crossings, &zones.core))
    }

    /// Writes the means over all crossings and over each zone. `state` is time, shear angle in degrees, and displacement;
    /// `theory` is the no-slip angle of zone C, rad.
    pub(super) fn write_row(&mut self, state: [f64; 3], crossings: &[Crossing], theory: f64) -> Result<()> {
        let (angle, slip) = (angles(crossings.iter()), slips(crossings.iter()));
        let row = rows::Shear {
            time_s: state[0],
            shear_angle_deg: state[1],
            displacement_mm: state[2],
            effective_angle_mean_deg: angle.mean.to_degrees(),
            effective_angle_std_deg: angle.std.to_degrees(),
            effective_angle_min_deg: angle.min.to_degrees(),
            effective_angle_max_deg: angle.max.to_degrees(),
            slip_mean_mm: slip.mean,
            slip_max_mm: slip.max,
        };
        match &mut self.shear {
            Shear::Whole(table) => table.row(&row),
            Shear::Zoned(zones, table) => table.row(&(row, by_zone(&Means::of(crossings, &zones.core), theory))),
        }
    }

    /// Processes all crossings of a frame: derived fields of the hexahedra, rows of the table, and a map in the results folder.
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
            let [warp_direction_deg, weft_direction_deg] = c.direction.map(f64::to_degrees);
            self.each.row(&rows::Crossing {
                time_s: frame.time,
                shear_angle_deg: angle,
                displacement_mm: frame.displacement_mm,
                zone: self.zones().map_or("none", |zones| zones.all[i].name()).into(),
                warp: mesh.blocks[pair.warp].name.clone(),
                weft: mesh.blocks[pair.weft].name.clone(),
                reference_x_mm: pair.reference.x,
                reference_y_mm: pair.reference.y,
                x_mm: c.position.x,
                y_mm: c.position.y,
                z_mm: c.position.z,
                effective_angle_deg: c.angle.to_degrees(),
                warp_direction_deg,
                weft_direction_deg,
                slip_x_mm: c.slip.x,
                slip_y_mm: c.slip.y,
                warp_width_mm: c.width[0],
                weft_width_mm: c.width[1],
                warp_gap_mm: c.gap[0],
                weft_gap_mm: c.gap[1],
            })?;
        }
        // yarns that cross no longer are not on the map
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
        if let Some(zones) = self.zones() {
            fields.push(field("zone", &|i| f64::from(zones.all[i] as u8)));
        }
        map::write(&points, &fields, &dir.join(&file))?;
        self.maps.push((frame.time, file));
        vtu::write_collection(&dir.join("crossings.pvd"), &self.maps)
    }
}

/// Columns of the zones; `theory` is the no-slip angle of zone C, rad.
fn by_zone(means: &Means, theory: f64) -> rows::Zones {
    let [angle, spread] = [means.angle, means.angle_std].map(|zones| zones.map(f64::to_degrees));
    let direction = means.direction.map(f64::to_degrees);
    rows::Zones {
        theory_angle_deg: theory.to_degrees(),
        zone_a_angle_deg: angle[0],
        zone_b_angle_deg: angle[1],
        zone_c_angle_deg: angle[2],
        zone_a_angle_std_deg: spread[0],
        zone_b_angle_std_deg: spread[1],
        zone_c_angle_std_deg: spread[2],
        zone_a_slip_mm: means.slip[0],
        zone_b_slip_mm: means.slip[1],
        zone_c_slip_mm: means.slip[2],
        zone_c_warp_width_mm: means.width[0],
        zone_c_weft_width_mm: means.width[1],
        zone_c_warp_gap_mm: means.gap[0],
        zone_c_weft_gap_mm: means.gap[1],
        zone_c_warp_broadness_mm: means.broadness[0],
        zone_c_weft_broadness_mm: means.broadness[1],
        zone_c_warp_direction_deg: direction[0],
        zone_c_weft_direction_deg: direction[1],
    }
}

/// Maps of the crossings in a report, at the last loaded frame or at evenly spaced frames, with a common colour range.
pub(super) fn maps(results: &Results, page: &mut Page, most: usize) -> Result<()> {
    let Some(table) = results.other("crossings.csv")?.filter(|t| !t.is_empty()) else { return Ok(()) };
    let crossings: Vec<rows::Crossing> = table.rows()?;
    let several = most > 1;
    let all = || crossings.chunk_by(|a, b| a.time_s == b.time_s);
    let mut frames: Vec<_> = all().filter(|frame| !several || frame[0].displacement_mm > 0.0).collect();
    if frames.is_empty() {
        frames.extend(all().last());
    }
    let (count, last) = (most.min(frames.len()), frames.len() - 1);
    let chosen: Vec<_> = (1..=count).map(|k| frames[last * k / count]).collect();
    page.heading(if several { "Crossings while the specimen is pulled" } else { "Crossings at the last frame" });
    page.raw("<div class=\"charts\">");
    type Value = fn(&rows::Crossing) -> f64;
    let maps: [(Value, &str); 3] = [
        (|c| c.effective_angle_deg, "effective shear angle, degrees"),
        (|c| c.warp_gap_mm, "gap of the warp, mm"),
        (|c| c.weft_gap_mm, "gap of the weft, mm"),
    ];
    for (value, name) in maps {
        let range = if several { middle(chosen.iter().copied().flatten().map(value)) } else { None };
        for frame in &chosen {
            let points: Vec<[f64; 3]> = frame.iter().map(|c| [c.x_mm, c.y_mm, value(c)]).collect();
            let shown = points.iter().filter(|p| p.iter().all(|v| v.is_finite())).count();
            let mut caption = format!("{shown} crossings at t = {} s", short(&text(frame[0].time_s)));
            if several {
                let place = frame[0].displacement_mm;
                caption += &format!(", d = {place:.2} mm; colours as in the other maps of this size");
            }
            if let Some(svg) = chart::map(name, &points, range) {
                page.figure(name, &svg, &caption);
            }
        }
    }
    page.raw("</div>");
    Ok(())
}

/// Range of values without the outliers at both ends; `None` if empty.
fn middle(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let mut values: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    let outer = (OUTER * last as f64) as usize;
    Some([values[outer], values[last - outer]])
}
