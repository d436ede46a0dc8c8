//! The curves of a cell in a report.

use crate::error::Result;
use crate::output::page::Page;
use crate::output::results::Results;

pub(super) fn curves(results: &Results, page: &mut Page) -> Result<()> {
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
    } else {
        let caption = "Of the grips on their largest displacement; each of them is in reactions.csv.";
        results.chart(page, history, &axis, ["Force", "N"], &[("force_n", "force")], caption);
    }
    if let Some(shear) = results.other("shear.csv")? {
        let angles = [
            ("effective_angle_mean_deg", "mean"),
            ("effective_angle_min_deg", "smallest"),
            ("effective_angle_max_deg", "largest"),
        ];
        let caption = "Between the mid-lines at the crossings of warp and weft.";
        results.chart(page, &shear, &axis, ["Effective shear angle", "degrees"], &angles, caption);
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
