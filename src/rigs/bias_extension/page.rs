//! The curves of a specimen in a report, and its zones compared with the theory.

use crate::error::Result;
use crate::output::chart::{self, Curve};
use crate::output::page::Page;
use crate::output::results::{Axis, Results, short};

/// Number of rows of the table that compares the zones with the theory.
const COMPARED: usize = 8;
const OVER_EFFECTIVE: Axis = Axis {
    label: "effective shear angle in zone C, degrees",
    column: "shear_angle_deg",
    factor: 1.0,
    phase: Some("move"),
};

pub(super) fn curves(results: &Results, page: &mut Page) -> Result<()> {
    let (axis, history) = (results.axis(), &results.history);
    let caption = "Of the clamp that moves, along the pull, mean over each row.";
    results.chart(page, history, &axis, ["Force of the machine", "N"], &[("force_n", "force")], caption);
    // F_nor is undefined where the angle falls back for a moment: the curve continues after it
    let known = |p: &[f64; 2]| p[1].is_finite();
    let points = results.points(history, &OVER_EFFECTIVE, "f_nor_n_per_mm").into_iter().filter(known).collect();
    if let Some(svg) =
        chart::curves([OVER_EFFECTIVE.label, "N/mm"], &[Curve { name: "F_nor", points, spread: Vec::new() }])
    {
        let caption =
            "Eq. 19 with the effective angle: it presumes zones sheared by nothing, half and all of that angle.";
        page.figure("Shear force, N/mm", &svg, caption);
    }
    let Some(shear) = results.other("shear.csv")? else { return Ok(()) };
    let angles = [("zone_c_angle_deg", "effective"), ("theory_angle_deg", "without slip (Eq. 18)")];
    let caption = "Mean over the crossings well inside zone C, beside the theory of yarns that do not slide.";
    results.chart(page, &shear, &axis, ["Shear angle in zone C", "degrees"], &angles, caption);
    let zones = [("zone_a_angle_deg", "A"), ("zone_b_angle_deg", "B"), ("zone_c_angle_deg", "C")];
    let caption = "Effective angles. Without slip, A has none and B half of that in C.";
    results.chart(page, &shear, &axis, ["Shear angle by zone", "degrees"], &zones, caption);
    let slips = [("zone_a_slip_mm", "A"), ("zone_b_slip_mm", "B"), ("zone_c_slip_mm", "C"), ("slip_max_mm", "largest")];
    let caption = "Between the material points of both yarns at a crossing: means by zone, and the largest of all.";
    results.chart(page, &shear, &axis, ["Slip of the plies", "mm"], &slips, caption);
    for (size, title) in
        [("gap", "Gaps in zone C"), ("width", "Widths in zone C"), ("broadness", "Broadness in zone C")]
    {
        let [warp, weft] = ["warp", "weft"].map(|ply| format!("zone_c_{ply}_{size}_mm"));
        let columns = [(warp.as_str(), "warp"), (&weft, "weft")];
        results.chart(page, &shear, &OVER_EFFECTIVE, [title, "mm"], &columns, "Means over the crossings well inside.");
    }
    Ok(())
}

/// Zones compared with the theory, at evenly spaced rows of the pull.
pub(super) fn zones(results: &Results, page: &mut Page) -> Result<()> {
    let Some(shear) = results.other("shear.csv")? else { return Ok(()) };
    let phases = results.history.texts("phase");
    let rows: Vec<usize> = (0..phases.len().min(shear.len())).filter(|r| phases[*r] == "move").collect();
    let Some(last) = rows.len().checked_sub(1) else { return Ok(()) };
    let columns = [
        "displacement_mm",
        "theory_angle_deg",
        "zone_c_angle_deg",
        "zone_c_angle_std_deg",
        "zone_b_angle_deg",
        "zone_a_angle_deg",
        "zone_c_slip_mm",
    ];
    let cells = columns.map(|column| shear.texts(column));
    let count = COMPARED.min(rows.len());
    let body: Vec<Vec<String>> =
        (1..=count).map(|k| cells.iter().map(|column| short(column[rows[last * k / count]])).collect()).collect();
    page.heading("Zones beside the theory");
    page.table(&["displacement, mm", "Eq. 18, °", "C, °", "± in C, °", "B, °", "A, °", "slip in C, mm"], &body);
    page.paragraph(
        "soft",
        "Effective angles, means over the crossings well inside each zone. Without slip, C follows Eq. 18.",
    );
    Ok(())
}
