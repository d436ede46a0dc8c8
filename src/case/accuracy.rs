//! `"accuracy"`: one word for many numerical choices, which trade time for accuracy.
//!
//! Each word stands for fields of a case. Fields that the case sets itself stay as they are, so a word can serve as a starting
//! point.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// Numerical choices by name. `tricot study accuracy` measures the error and the time of each for a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Accuracy {
    /// A first look: half the columns (`resolution.warp_columns` 9, `resolution.weft_columns` 4), half the slices
    /// (`resolution.slice_mm` 0.606), and the beams and steps of `engineering`.
    Preview,
    /// The mesh of the paper (Zheng et al.), 480 beams in the shipped cell: `resolution.beams_per_lap` 60.
    Paper,
    /// For daily work, as in the shipped cell: steps up to 1.5 µs (`integration.dt_max_s` 1.5e-6) with elements made heavy enough
    /// for them (`effects.contact_mass.least_limit_s` 2.3e-6). With 2e-6, cells with slices of 0.17 and 0.19 mm explode.
    Standard,
    /// For results: `resolution.beams_per_lap` 120, and the steps of `standard`.
    Engineering,
    /// Reference for the others: `resolution.finer` 1.5, `resolution.beams_per_lap` 90, `integration.precision` f64,
    /// `integration.dt_max_s` 2.5e-7.
    Reference,
}

impl Accuracy {
    /// The fields of a case that the word stands for.
    pub fn fields(self) -> Value {
        match self {
            Self::Preview => {
                let mut fields = json!({ "resolution": { "warp_columns": 9, "weft_columns": 4, "slice_mm": 0.606 } });
                fill(&mut fields, &Self::Engineering.fields());
                fields
            }
            Self::Paper => json!({ "resolution": { "beams_per_lap": 60 } }),
            Self::Standard => json!({
                "integration": { "dt_max_s": 1.5e-6 },
                "effects": { "contact_mass": { "least_limit_s": 2.3e-6 } }
            }),
            Self::Engineering => {
                let mut fields = json!({ "resolution": { "beams_per_lap": 120 } });
                fill(&mut fields, &Self::Standard.fields());
                fields
            }
            Self::Reference => json!({
                "resolution": { "finer": 1.5, "beams_per_lap": 90 },
                "integration": { "precision": "f64", "dt_max_s": 2.5e-7 }
            }),
        }
    }

    /// The accuracy word of a case in JSON.
    pub fn of(case: &Value) -> Option<Self> {
        case.get("accuracy").and_then(|word| serde_json::from_value(word.clone()).ok()).flatten()
    }
}

/// Adds the fields that `given` leaves out.
pub fn fill(given: &mut Value, fields: &Value) {
    let (Value::Object(given), Value::Object(fields)) = (given, fields) else { return };
    for (name, field) in fields {
        match given.get_mut(name) {
            Some(own) => fill(own, field),
            None => {
                given.insert(name.clone(), field.clone());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_given_stays() {
        let mut case = json!({ "resolution": { "finer": 2 }, "integration": null });
        fill(&mut case, &Accuracy::Reference.fields());
        let expected = json!({ "resolution": { "finer": 2, "beams_per_lap": 90 }, "integration": null });
        assert_eq!(case, expected);
    }

    #[test]
    fn words_are_read() {
        assert_eq!(Accuracy::of(&json!({ "accuracy": "preview" })), Some(Accuracy::Preview));
        assert_eq!(Accuracy::of(&json!({ "accuracy": null })), None);
        assert_eq!(Accuracy::of(&json!({})), None);
    }
}
