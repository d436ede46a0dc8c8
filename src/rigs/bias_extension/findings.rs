//! Findings of a bias-extension test, as sentences with numbers: shear zones, the lag of the effective angle behind the no-slip
//! theory, widths and gaps, sliding at the free edges, and the load-bearing stitches.

use super::strip;
use super::zones::Zone;
use crate::case::Case;
use crate::case::domain::Specimen;
use crate::error::{Error, Result};
use crate::fabric;
use crate::measure::stitches::{Leg, SLACK_BELOW_N, legs};
use crate::mesh::{Mesh, Part, Ply};
use crate::output::results::Results;
use crate::output::rows::{Crossing, Shear, Zones};
use crate::output::vtu_read;
use crate::rigs::crossings::MARGIN;
use glam::{DVec2, DVec3, Vec3Swizzles};

/// Angles of Eq. 18 at which the effective angle is reported, degrees.
const STATED_DEG: [f64; 5] = [10.0, 20.0, 25.0, 30.0, 45.0];
/// Number of frames of the pull whose stitches are counted, including the last.
const FRAMES: usize = 4;

/// Sentences about the pull; empty before the pull begins.
///
/// # Errors
/// A file of the run that cannot be read.
pub(super) fn findings(specimen: &Specimen, case: &Case, results: &Results) -> Result<Vec<String>> {
    let Some(table) = results.other("shear.csv")? else { return Ok(Vec::new()) };
    let (shear, zones): (Vec<Shear>, Vec<Zones>) = (table.rows()?, table.rows()?);
    let phases = results.history.texts("phase");
    let rows: Vec<usize> = (0..phases.len().min(shear.len())).filter(|r| phases[*r] == "move").collect();
    let (Some(&first), Some(&last)) = (rows.first(), rows.last()) else { return Ok(Vec::new()) };
    let pull = Pull { before: first.saturating_sub(1), rows, last, shear, zones };
    let sentences = [
        pull.zones(),
        pull.lag(),
        pull.widths("warp", |z| z.zone_c_warp_width_mm),
        pull.widths("weft", |z| z.zone_c_weft_width_mm),
        pull.gaps("warp", |z| z.zone_c_warp_gap_mm),
        pull.gaps("weft", |z| z.zone_c_weft_gap_mm),
    ];
    let mut found: Vec<String> = sentences.into_iter().flatten().collect();
    found.extend(edges(specimen, results)?);
    found.extend(stitches(specimen, case, results)?);
    Ok(found)
}

/// Slip at the free edges compared with slip inside, at the last frame.
fn edges(specimen: &Specimen, results: &Results) -> Result<Option<String>> {
    let Some(table) = results.other("crossings.csv")? else { return Ok(None) };
    let crossings: Vec<Crossing> = table.rows()?;
    let Some(last) = crossings.last() else { return Ok(None) };
    let width = specimen.width_mm;
    let mean = |zone: &str, edge: bool| -> String {
        let own = crossings.iter().filter(|c| {
            let at_edge = c.reference_y_mm.abs() > (0.5 - MARGIN) * width;
            c.time_s == last.time_s && c.zone == zone && at_edge == edge
        });
        let slips = own.map(|c| c.slip_x_mm.hypot(c.slip_y_mm));
        let slips: Vec<f64> = slips.filter(|slip| slip.is_finite()).collect();
        match slips.len() {
            0 => "none".into(),
            count => format!("{:.3}", slips.iter().sum::<f64>() / count as f64),
        }
    };
    let each = ["A", "B", "C"].map(|zone| format!("{zone} {} / {}", mean(zone, true), mean(zone, false)));
    let margin = MARGIN * width;
    Ok(Some(format!(
        "Slip of the plies within {margin:.0} mm of the free edges / farther inside, mm: {}",
        each.join(", ")
    )))
}

/// Load-bearing stitches of zone C at some frames of the pull.
fn stitches(specimen: &Specimen, case: &Case, results: &Results) -> Result<Vec<String>> {
    let mesh = fabric::specimen::build(case, case.fabric()?, specimen)?;
    let collection = results.dir.join("run.pvd");
    if mesh.threads.is_empty() || !collection.is_file() {
        return Ok(Vec::new());
    }
    let strip = strip(specimen);
    let yarns = [Ply::Warp, Ply::Weft].map(|ply| direction(&mesh, ply));
    let mut frames = Vec::new();
    for path in vtu_read::read_collection(&collection)? {
        let frame = vtu_read::read(&path, &mesh)?;
        if frame.displacement_mm > 0.0 {
            frames.push((path, frame));
        }
    }
    let Some(last) = frames.len().checked_sub(1) else { return Ok(Vec::new()) };
    let count = FRAMES.min(frames.len());
    let chosen = (1..=count).map(|k| &frames[last * k / count]);
    chosen
        .map(|(path, frame)| {
            let tension = frame.beam_fields.iter().find(|f| f.name == "tension_n");
            let tension = tension.ok_or_else(|| Error::file(path, "holds no tension_n"))?;
            let legs = legs(&mesh, &tension.values)?;
            let inside: Vec<&Leg> = legs.iter().filter(|l| strip.zone(l.middle, yarns) == Zone::C).collect();
            Ok(format!("Stitches of zone C at {:.2} mm: {}", frame.displacement_mm, carried(&inside)))
        })
        .collect()
}

/// Number, mean tension and taut share of the legs, by kind.
fn carried(legs: &[&Leg]) -> String {
    let share = |name: &str, own: &dyn Fn(&Leg) -> bool| {
        let own: Vec<_> = legs.iter().filter(|l| own(l)).collect();
        let share = |count: usize| 100.0 * count as f64 / own.len() as f64;
        let mean = own.iter().map(|l| l.force_n).sum::<f64>() / own.len() as f64;
        let taut = share(own.iter().filter(|l| l.taut()).count());
        format!("{} {name} {mean:.3} N, {taut:.0} % taut", own.len())
    };
    let along = |l: &Leg| l.chord.x.abs() > l.chord.y.abs();
    [
        share("loops", &|l| l.part == Part::Loop),
        share("underlaps along the pull", &|l| l.part == Part::Underlap && along(l)),
        share("underlaps across it", &|l| l.part == Part::Underlap && !along(l)),
    ]
    .join("; ")
        + &format!(" (from {SLACK_BELOW_N} N)")
}

/// In-plane fibre direction of a ply.
fn direction(mesh: &Mesh, ply: Ply) -> DVec2 {
    mesh.blocks.iter().find(|b| b.ply == ply).map_or(DVec2::NAN, |b| DVec3::from(b.fibre).xy())
}

/// Table rows of the pull.
struct Pull {
    shear: Vec<Shear>,
    zones: Vec<Zones>,
    rows: Vec<usize>,
    /// The last row before the pull, and the last row.
    before: usize,
    last: usize,
}

impl Pull {
    /// `None`, as for the other findings, if no crossing lies well inside a zone.
    fn zones(&self) -> Option<String> {
        let zones = &self.zones[self.last];
        let [a, b, c] = [zones.zone_a_angle_deg, zones.zone_b_angle_deg, zones.zone_c_angle_deg];
        let (way, theory) = (self.shear[self.last].displacement_mm, zones.theory_angle_deg);
        let known = [a, b, c, theory].iter().all(|angle| angle.is_finite());
        known.then(|| format!(
            "Zones A / B / C have sheared by {a:.1} / {b:.1} / {c:.1}° at {way:.2} mm ({:.2} and {:.2} of C); without slip none, \
             half and all of {theory:.1}° (Eq. 18)",
            a / c,
            b / c
        ))
    }

    /// The effective angle of zone C compared with Eq. 18.
    fn lag(&self) -> Option<String> {
        let stated = STATED_DEG.iter().filter_map(|stated| {
            let zones = self.rows.iter().map(|row| &self.zones[*row]).find(|z| z.theory_angle_deg >= *stated)?;
            Some(format!("{:.1} at {:.1}°", zones.zone_c_angle_deg, zones.theory_angle_deg))
        });
        let stated: Vec<String> = stated.collect();
        (!stated.is_empty()).then(|| format!("Effective angle in zone C where Eq. 18 has more: {}", stated.join(", ")))
    }

    fn widths(&self, ply: &str, width: fn(&Zones) -> f64) -> Option<String> {
        let width: Vec<f64> = self.zones.iter().map(width).collect();
        let mut narrowest = width[self.before];
        let mut rise = 0.0f64;
        for &row in &self.rows {
            narrowest = narrowest.min(width[row]);
            rise = rise.max(width[row] - narrowest);
        }
        let known = width[self.before].is_finite() && width[self.last].is_finite();
        known.then(|| format!(
            "Width of the {ply} in zone C: {:.3} mm before, {:.3} mm at the end; no row is more than {rise:.3} mm above an earlier one",
            width[self.before], width[self.last]
        ))
    }

    fn gaps(&self, ply: &str, gap: fn(&Zones) -> f64) -> Option<String> {
        let gap: Vec<f64> = self.zones.iter().map(gap).collect();
        let widest = self.rows.iter().copied().max_by(|&a, &b| gap[a].total_cmp(&gap[b])).unwrap_or(self.last);
        let known = [gap[self.before], gap[widest], gap[self.last]].iter().all(|gap| gap.is_finite());
        known.then(|| {
            format!(
                "Gap of the {ply} in zone C: {:.3} mm before, largest {:.3} mm at {:.1}°, {:.3} mm at the end",
                gap[self.before], gap[widest], self.zones[widest].zone_c_angle_deg, gap[self.last]
            )
        })
    }
}
