//! Notes of `check` on cases that are valid nevertheless.

use crate::common::{bare, block, coarse_cell, loaded, neo_hookean, with};
use serde_json::{Value, json};
use tricot::run::check;

/// A fabric has its thermal strain for every case; `check` notes a case that does not tighten it.
#[test]
fn a_stitch_that_is_not_tightened_is_noted() {
    let hold = |steps: Value| check(&loaded(&with(coarse_cell(), &[("/steps", steps)])), false).unwrap();
    let noted = hold(json!([{ "hold": { "time_s": 1e-5 } }]));
    assert!(noted.contains("note       the stitch stays loose") && noted.contains("-0.15"), "{noted}");
    assert!(!hold(json!([{ "pretension": { "time_s": 1e-5 } }])).contains("note "));
}

/// Fully integrated hexahedra of a nearly incompressible solid lock; hexahedra with one Gauss point do not.
#[test]
fn volumetric_locking_is_noted() {
    let bar = |poisson: f64, hexahedra: &str| {
        let body = block("bar", [8, 1, 1], [[0.0; 3], [8.0, 1.0, 1.0]], 1e-9, neo_hookean(100.0, poisson));
        let blocks = ("/domain/mesh/blocks", json!([body]));
        loaded(&with(bare(), &[blocks, ("/integration", json!({ "hexahedra": hexahedra }))]))
    };
    let noted = check(&bar(0.49, "full"), false).unwrap();
    assert!(noted.contains("note       bar can hardly change its volume") && noted.contains("to reduced"), "{noted}");
    for other in [bar(0.49, "reduced"), bar(0.3, "full")] {
        assert!(!check(&other, false).unwrap().contains("note "));
    }
}
