//! A cell of the shipped fabric, built without a case file: pretensioned, then sheared to 10° with its fibres held.

use serde_json::{Value, json};
use tricot::prelude::*;

fn main() -> std::result::Result<(), Box<dyn std::error::Error>> {
    let fabric: Value = serde_json::from_str(include_str!("../cases/fabrics/px35.json"))?;
    let case = read_value(json!({
        "title": "a coarse cell",
        "fabric": fabric,
        "domain": { "cell": { "warps": 2, "wefts": 4 } },
        "resolution": { "warp_columns": 8, "weft_columns": 4, "slice_mm": 0.6, "beams_per_lap": 40 },
        "steps": [{ "pretension": { "time_s": 1e-3 } }, { "shear": { "angle_deg": 10, "time_s": 4e-3 } }]
    }))?;
    let mut cell = Simulation::new(scene(&case)?, BackendConfig::default())?;
    let mut curve = CellCurve::new(&cell.scene.mesh);
    for row in 0..=10 {
        cell.advance(1e-3 + 4e-4 * f64::from(row), |_| false)?;
        if let Some(force) = curve.push(cell.load().angle, cell.energies().external) {
            println!("{:4.1}°  F_nor {force:.4} N/mm", cell.load().angle.to_degrees());
        }
    }
    Ok(())
}
