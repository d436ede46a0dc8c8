//! The knobs that trade accuracy for time, as data: one row per point of the study.

use crate::error::{Error, Result};
use serde_json::{Value, json};

/// Change of a field of the case.
#[derive(Debug, Clone, Copy)]
pub enum Change {
    /// This JSON, or text.
    To(&'static str),
    /// A multiple of the old value; whole numbers stay whole.
    Times(f64),
    /// The old value plus a whole number.
    Plus(i64),
}

/// A point of the study: the changes to the case.
///
/// Fields are paths as after `--set`. `loading` and `tightening` stand for the durations of the load steps from the first shear
/// or move on, and of those before; `--threads` and `--backend` are options of `tricot run`;
/// a study on a GPU has a point on the CPU.
#[derive(Debug)]
pub struct Variation {
    pub knob: &'static str,
    pub label: &'static str,
    pub changes: &'static [(&'static str, Change)],
}

use Change::{Plus, Times, To};

const fn variation(knob: &'static str, label: &'static str, changes: &'static [(&'static str, Change)]) -> Variation {
    Variation { knob, label, changes }
}

const FINER: &str = "resolution.finer";
const BEAMS: &str = "resolution.beams_per_lap";
const WARP: &str = "resolution.warp_columns";
const WEFT: &str = "resolution.weft_columns";
const SLICE: &str = "resolution.slice_mm";
const LARGEST_DT: &str = "integration.dt_max_s";
const PRECISION: &str = "integration.precision";
const PERTURBATION: &str = "integration.perturbation_mm";
const MASS: &str = "effects.contact_mass";
const MASS_FACTOR: &str = "effects.contact_mass.factor";
const LEAST_LIMIT: &str = "effects.contact_mass.least_limit_s";
const RATE: &str = "effects.damping.rate_per_s";
const SKIN: &str = "effects.contact.skin_mm";
const PENALTIES: [&str; 4] = [
    "effects.contact.thread_penalty_n_mm2",
    "effects.contact.yarn_penalty_n_mm3",
    "effects.contact.thread_thread_penalty_n_mm2",
    "effects.contact.tie_n_mm",
];

/// Reference for errors: finer, in f64, with half the time step and elements light enough for it, and loaded twice as slowly.
pub const REFERENCE: Variation = variation(
    "reference",
    "reference",
    &[
        (FINER, Times(1.5)),
        (BEAMS, Times(1.35)),
        (PRECISION, To("f64")),
        (LARGEST_DT, Times(0.5)),
        (LEAST_LIMIT, Times(0.5)),
        ("loading", Times(2.0)),
    ],
);

/// The reference on a still finer mesh, which shows whether the reference has converged.
pub const CHECK: Variation = variation(
    "reference",
    "finer reference",
    &[
        (FINER, Times(2.0)),
        (BEAMS, Times(1.35)),
        (PRECISION, To("f64")),
        (LARGEST_DT, Times(0.5)),
        (LEAST_LIMIT, Times(0.5)),
        ("loading", Times(2.0)),
    ],
);

/// Runs that differ from the case by chance: all bodies start up to a micrometre aside.
pub const CHANCE: [Variation; 2] = [
    variation("chance", "a micrometre aside", &[(PERTURBATION, To("1e-3"))]),
    variation("chance", "a micrometre to the other side", &[(PERTURBATION, To("-1e-3"))]),
];

/// Runs whose nodes of threads lie elsewhere, on a mesh as fine as that of the case: loops slip a little earlier or later in each.
pub const PLACES: [Variation; 4] = [
    variation("places of nodes", "two beams less", &[(BEAMS, Plus(-2))]),
    variation("places of nodes", "one beam less", &[(BEAMS, Plus(-1))]),
    variation("places of nodes", "one beam more", &[(BEAMS, Plus(1))]),
    variation("places of nodes", "two beams more", &[(BEAMS, Plus(2))]),
];

/// All points, the long ones last.
pub const VARIATIONS: &[Variation] = &[
    variation("accuracy", "preview", &[("accuracy", To("preview"))]),
    variation("accuracy", "standard", &[("accuracy", To("standard"))]),
    variation("accuracy", "engineering", &[("accuracy", To("engineering"))]),
    variation("mesh", "mesh × 0.5", &[(FINER, Times(0.5))]),
    variation("mesh", "mesh × 0.7", &[(FINER, Times(0.7))]),
    variation("columns", "columns × 0.5", &[(WARP, Times(0.5)), (WEFT, Times(0.5))]),
    variation("columns", "columns × 1.5", &[(WARP, Times(1.5)), (WEFT, Times(1.5))]),
    variation("layers", "1 layer", &[("resolution.layers", To("1"))]),
    variation("layers", "3 layers", &[("resolution.layers", To("3"))]),
    variation("slices", "slices × 0.5", &[(SLICE, Times(2.0))]),
    variation("slices", "slices × 1.5", &[(SLICE, Times(2.0 / 3.0))]),
    variation("beams", "beams × 0.6", &[(BEAMS, Times(0.6))]),
    variation("beams", "beams × 1.5", &[(BEAMS, Times(1.5))]),
    variation("beams", "beams × 2", &[(BEAMS, Times(2.0))]),
    variation("time step", "time step × 0.5", &[(LARGEST_DT, Times(0.5)), (LEAST_LIMIT, Times(0.5))]),
    variation("time step", "time step × 1.5", &[(LARGEST_DT, Times(1.5)), (LEAST_LIMIT, Times(1.5))]),
    variation("least limit", "true elements", &[(LEAST_LIMIT, To("0"))]),
    variation("least limit", "heavier elements", &[(LARGEST_DT, Times(2.0)), (LEAST_LIMIT, To("2.3e-6"))]),
    variation("fibre lines", "β × 0.5", &[("effects.fibre_lines.beta", Times(0.5))]),
    variation("fibre lines", "β × 2", &[("effects.fibre_lines.beta", Times(2.0))]),
    variation("contact mass", "contact mass × 0.5", &[(MASS_FACTOR, Times(0.5))]),
    variation("contact mass", "contact mass × 2", &[(MASS_FACTOR, Times(2.0))]),
    variation("mass floor", "no mass floor", &[("effects.mass_floor", To("0"))]),
    variation("mass floor", "mass floor 1", &[("effects.mass_floor", To("1"))]),
    variation("loading", "loading × 0.25", &[("loading", Times(0.25))]),
    variation("loading", "loading × 0.5", &[("loading", Times(0.5))]),
    variation("loading", "loading × 2", &[("loading", Times(2.0))]),
    variation("tightening", "tightening × 0.5", &[("tightening", Times(0.5))]),
    variation("damping", "damping × 0.5", &[(RATE, Times(0.5))]),
    variation("damping", "damping × 2", &[(RATE, Times(2.0))]),
    variation(
        "contact stiffness",
        "penalties × 0.5",
        &[
            (PENALTIES[0], Times(0.5)),
            (PENALTIES[1], Times(0.5)),
            (PENALTIES[2], Times(0.5)),
            (PENALTIES[3], Times(0.5)),
        ],
    ),
    variation(
        "contact stiffness",
        "penalties × 2",
        &[
            (PENALTIES[0], Times(2.0)),
            (PENALTIES[1], Times(2.0)),
            (PENALTIES[2], Times(2.0)),
            (PENALTIES[3], Times(2.0)),
        ],
    ),
    variation("search interval", "skin × 0.5", &[(SKIN, Times(0.5))]),
    variation("search interval", "skin × 2", &[(SKIN, Times(2.0))]),
    variation("threads", "1 thread", &[("--threads", To("1"))]),
    variation("backend", "CPU", &[("--backend", To("cpu"))]),
    variation("integration", "1 point", &[("integration.hexahedra", To("reduced"))]),
    variation("precision", "f64", &[(PRECISION, To("f64"))]),
    variation("mesh", "mesh × 1.4", &[(FINER, Times(1.4))]),
    variation("contact mass", "no contact mass", &[(MASS, To("null"))]),
    variation("accuracy", "reference quality", &[("accuracy", To("reference"))]),
    variation("fibre lines", "no fibre lines", &[("effects.fibre_lines", To("null")), (MASS, To("null"))]),
];

/// A variation as command-line options.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Flags {
    /// `--set`.
    pub sets: Vec<String>,
    pub threads: Option<usize>,
    /// `--backend cpu`.
    pub cpu: bool,
}

impl Variation {
    /// The flags that apply it to a case with all defaults, whose loading begins after `phases` load steps; `None` if they change
    /// nothing or the case has no such field.
    pub fn flags(&self, case: &Value, phases: usize) -> Option<Flags> {
        let mut flags = Flags::default();
        for (field, change) in self.changes {
            match (*field, change) {
                ("--threads", To(count)) => flags.threads = count.parse().ok(),
                ("--backend", To(name)) => flags.cpu = *name == "cpu",
                _ => {
                    for path in places(field, case, phases) {
                        let old = case.pointer(&format!("/{}", path.replace('.', "/")))?;
                        if let Some(new) = change.of(old)? {
                            flags.sets.push(format!("{path}={new}"));
                        }
                    }
                }
            }
        }
        (flags != Flags::default()).then_some(flags)
    }
}

impl Change {
    /// The new value as after `--set`; `Some(None)` if it equals the old one, `None` if the old one is not a number.
    fn of(&self, old: &Value) -> Option<Option<String>> {
        let new = match self {
            To(text) => serde_json::from_str(text).unwrap_or_else(|_| json!(text)),
            Times(factor) if old.is_u64() => json!((old.as_f64()? * factor).round().max(1.0) as u64),
            Plus(more) => json!(old.as_u64()?.checked_add_signed(*more)?),
            // digits beyond the sixth would be rounding noise
            Times(factor) => json!(format!("{:.5e}", old.as_f64()? * factor).parse::<f64>().ok()?),
        };
        let same = *old == new || old.as_f64().is_some_and(|old| new.as_f64() == Some(old));
        Some((!same).then(|| new.as_str().map_or_else(|| new.to_string(), str::to_owned)))
    }
}

/// Paths that a field of a variation stands for.
fn places(field: &str, case: &Value, phases: usize) -> Vec<String> {
    let steps = case["steps"].as_array().map_or(&[][..], Vec::as_slice);
    let wanted = match field {
        "tightening" => 0..phases,
        "loading" => phases..steps.len(),
        _ => return vec![field.to_owned()],
    };
    let kinds = |n: usize| steps[n].as_object().into_iter().flatten().map(|(kind, _)| kind);
    wanted.flat_map(|n| kinds(n).map(move |kind| format!("steps.{n}.{kind}.time_s"))).collect()
}

/// The variations whose knob or label holds one of some words; all without words.
///
/// # Errors
/// A word that matches nothing.
pub fn chosen(words: &[String]) -> Result<Vec<&'static Variation>> {
    let fits = |variation: &Variation, word: &str| {
        let word = word.to_lowercase();
        variation.knob.to_lowercase().contains(&word) || variation.label.to_lowercase().contains(&word)
    };
    let all = || VARIATIONS.iter().chain([&CHECK]);
    if let Some(word) = words.iter().find(|word| !all().any(|variation| fits(variation, word))) {
        let mut knobs: Vec<&str> = all().map(|variation| variation.knob).collect();
        knobs.dedup();
        knobs.sort_unstable();
        knobs.dedup();
        let message = format!("no point has this in its name; knobs are {}", knobs.join(", "));
        return Err(Error::case(format!("--points {word}"), message));
    }
    Ok(all().filter(|variation| words.is_empty() || words.iter().any(|word| fits(variation, word))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn case() -> Value {
        json!({
            "accuracy": null,
            "resolution": { "layers": 2, "finer": 1.0, "beams_per_lap": 60 },
            "effects": { "damping": null },
            "steps": [{ "pretension": { "time_s": 0.003 } }, { "shear": { "angle_deg": 50.0, "time_s": 0.01 } }]
        })
    }

    fn sets(changes: &'static [(&'static str, Change)]) -> Option<Vec<String>> {
        variation("", "", changes).flags(&case(), 1).map(|flags| flags.sets)
    }

    #[test]
    fn turns_become_overrides() {
        assert_eq!(sets(&[(BEAMS, Times(1.35))]).unwrap(), ["resolution.beams_per_lap=81"]);
        assert_eq!(sets(&[(BEAMS, Plus(-2))]).unwrap(), ["resolution.beams_per_lap=58"]);
        assert_eq!(sets(&[(BEAMS, Plus(-61))]), None, "less than none");
        assert_eq!(sets(&[("loading", Times(2.0))]).unwrap(), ["steps.1.shear.time_s=0.02"]);
        assert_eq!(sets(&[("tightening", Times(0.5))]).unwrap(), ["steps.0.pretension.time_s=0.0015"]);
        assert_eq!(sets(&[("accuracy", To("preview"))]).unwrap(), ["accuracy=preview"]);
        assert_eq!(sets(&[("resolution.layers", To("2"))]), None, "nothing changes");
        assert_eq!(sets(&[(RATE, Times(2.0))]), None, "no damping to change");
        assert_eq!(sets(&[(FINER, To("1")), (BEAMS, To("90"))]).unwrap(), ["resolution.beams_per_lap=90"]);
        assert_eq!(variation("", "", &[("--threads", To("1"))]).flags(&case(), 1).unwrap().threads, Some(1));
    }

    #[test]
    fn labels_are_their_own_and_words_choose() {
        let all: Vec<&Variation> = chosen(&[]).unwrap();
        assert!(all.len() >= 30);
        let labels: BTreeSet<&str> = all.iter().map(|t| t.label).chain([REFERENCE.label]).collect();
        assert_eq!(labels.len(), all.len() + 1);
        assert!(chosen(&["beams".into()]).unwrap().iter().all(|variation| variation.knob == "beams"));
        assert!(chosen(&["screws".into()]).unwrap_err().to_string().contains("search interval"));
    }
}
