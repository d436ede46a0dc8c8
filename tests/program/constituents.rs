//! Tests of the constituents: the program evaluates them as an experimenter would, and recovers what was put in.

use crate::common::program::balanced;
use serde_json::{Value, json};
use tricot::settings::integration::Precision;

/// The summary of a shipped case with changes, in a precision.
fn summary(case: &str, sets: &[&str], precision: Precision) -> Value {
    let (_, summary) = balanced(case, &[sets, &["output.pictures=false"]].concat(), precision);
    println!("{case} {sets:?} {precision:?}: {}", summary["property"]);
    summary
}

/// The property as evaluated over the one put in, less 1.
fn error(summary: &Value) -> f64 {
    let [evaluated, given] = ["evaluated", "given"].map(|name| summary["property"][name].as_f64().unwrap());
    evaluated / given - 1.0
}

/// F = E A ΔL/L holds exactly; what is left is inertia.
#[test]
fn a_pulled_thread_gives_its_modulus() {
    for precision in [Precision::F32, Precision::F64] {
        let summary = summary("thread_tension", &[], precision);
        assert_eq!(summary["property"]["given"], json!(350.0));
        assert!(error(&summary).abs() < 5e-4, "{}", error(&summary));
    }
}

/// The bent thread is a heavy elastica: the error falls with the square of the beams. Eq. 9 overestimates the stiffness.
#[test]
fn a_bent_thread_gives_its_bending_stiffness() {
    let at = |elements: &str, precision| {
        let elements = format!("domain.cantilever.elements={elements}");
        summary("cantilever", &[&elements, "output.rows_per_step=10"], precision)
    };
    let [coarse, middle, fine] = ["11", "22", "44"].map(|elements| at(elements, Precision::F32));
    let [coarse, middle, last] = [&coarse, &middle, &fine].map(error);
    println!("{coarse} {middle} {last}");
    assert!((3.0..5.0).contains(&(coarse / middle)) && (3.0..5.0).contains(&(middle / last)));
    assert!(last.abs() < 2e-3);
    assert!((error(&at("44", Precision::F64)) - last).abs() < 1e-3);
    let by_equation = fine["bending_by_eq_9_n_mm2"].as_f64().unwrap() / fine["property"]["evaluated"].as_f64().unwrap();
    assert!((1.04..1.08).contains(&by_equation), "{by_equation}");
}

/// The free ends of the fibres carry less, by the same force in a yarn of any length: the difference of two lengths gives K_sh.
#[test]
fn a_sheared_yarn_gives_its_shear_stiffness() {
    for precision in [Precision::F32, Precision::F64] {
        let at = |length: f64| {
            let length_mm = format!("domain.yarn_shear.length_mm={length}");
            let summary = summary("yarn_shear", &[&length_mm, "output.rows_per_step=10"], precision);
            assert_eq!(summary["property"]["given"], json!(2.2));
            (1.0 + error(&summary)) * length
        };
        let [short, long] = [60.0, 120.0].map(at);
        let whole = (long - short) / 60.0 - 1.0;
        println!("{precision:?}: {whole:.2e} by two lengths, {:.2e} by one", long / 120.0 - 1.0);
        assert!(whole.abs() < 5e-3, "{whole}");
        assert!(long < 120.0 && short < 60.0, "free ends do not stiffen");
    }
}

/// The law gives the pressure of a homogeneous state in closed form: a yarn in a die, and one whose sides are free, return K_comp.
#[test]
fn a_compacted_yarn_gives_its_compaction_stiffness() {
    for (sides, precision) in [("held", Precision::F32), ("held", Precision::F64), ("free", Precision::F32)] {
        for thickness in [0.26, 0.2] {
            let sets = [
                format!("domain.yarn_compaction.sides={sides}"),
                format!("domain.yarn_compaction.thickness_mm={thickness}"),
            ];
            let summary = summary("yarn_compaction", &[&sets[0], &sets[1], "output.rows_per_step=10"], precision);
            assert_eq!(summary["property"]["given"], json!(1.25));
            assert!(error(&summary).abs() < 5e-3, "{sides} {thickness}: {}", error(&summary));
        }
    }
}
