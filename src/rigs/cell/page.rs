//! The curves of a cell in a report.

use crate::error::Result;
use crate::output::chart::{self, Curve};
use crate::output::columns::Columns;
use crate::output::page::Page;
use crate::output::results::{Axis, Results};

/// Membrane force along the fibres of a ply, N/mm, over their strain, %, in every row.
pub fn tension(stress: &Columns, ply: &str) -> Vec<[f64; 2]> {
    let [stretches, forces] = ["stretch", "membrane_n_per_mm"].map(|column| stress.numbers(&format!("{ply}_{column}")));
    stretches.into_iter().zip(forces).map(|(stretch, force)| [100.0 * (stretch - 1.0), force]).collect()
}

/// The tension of each ply while the cell is stretched.
fn tensions(results: &Results, stress: &Columns, page: &mut Page) {
    let phases = results.history.texts("phase");
    let curve = |ply: &'static str| {
        let rows = tension(stress, ply).into_iter().zip(&phases);
        let points = rows.filter(|(_, phase)| **phase == "stretch").map(|(point, _)| point).collect();
        Curve { name: ply, points, spread: Vec::new() }
    };
    if let Some(svg) = chart::curves(["strain, %", "N/mm"], &["warp", "weft"].map(curve)) {
        let caption = "Along the fibres of each ply, per width of the fabric across them, while it is stretched.";
        page.figure("Tension of the fabric, N/mm", &svg, caption);
    }
}

/// The shear at the crossings.
pub(in crate::rigs) fn effective_angles(results: &Results, shear: &Columns, axis: &Axis, page: &mut Page) {
    let angles = [
        ("effective_angle_mean_deg", "mean"),
        ("effective_angle_min_deg", "smallest"),
        ("effective_angle_max_deg", "largest"),
    ];
    let caption = "Between the mid-lines at the crossings of warp and weft.";
    results.chart(page, shear, axis, ["Effective shear angle", "degrees"], &angles, caption);
}

pub(in crate::rigs) fn curves(results: &Results, page: &mut Page) -> Result<()> {
    let (axis, history) = (results.axis(), &results.history);
    if axis.is_angle() {
        let force = [("f_nor_n_per_mm", "F_nor")];
        let caption = "External work per area and angle over cos γ, mean over each row.";
        results.chart(page, history, &axis, ["Shear force", "N/mm"], &force, caption);
        if let Some(stress) = results.other("stress.csv")? {
            let fibres = [("warp_membrane_n_per_mm", "warp"), ("weft_membrane_n_per_mm", "weft")];
            let caption = "Along the fibres, per width of the fabric across them.";
            results.chart(page, &stress, &axis, ["Membrane force", "N/mm"], &fibres, caption);
        }
    } else if let Some(stress) = results.other("stress.csv")? {
        tensions(results, &stress, page);
    }
    if let Some(shear) = results.other("shear.csv")? {
        effective_angles(results, &shear, &axis, page);
        let slips = [("slip_mean_mm", "mean"), ("slip_max_mm", "largest")];
        let caption = "Between the material points of both yarns at a crossing.";
        results.chart(page, &shear, &axis, ["Slip of the plies", "mm"], &slips, caption);
    }
    if let Some(yarns) = results.other("yarns.csv")? {
        for (size, title) in [("gap", "Gaps"), ("width", "Widths")] {
            let [warp, weft] = ["warp", "weft"].map(|ply| format!("{ply}_{size}_mm"));
            let columns = [(warp.as_str(), "warp"), (&weft, "weft")];
            results.chart(page, &yarns, &axis, [title, "mm"], &columns, "Means over all stations.");
        }
    }
    Ok(())
}
