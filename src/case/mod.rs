//! User input: a typed and checked JSON case.

pub mod accuracy;
pub mod check;
pub mod defaults;
pub mod differences;
pub mod domain;
pub mod expect;
pub mod fabric;
pub mod output;
pub mod overrides;
pub mod parse;
pub mod provenance;
pub mod schema;
pub mod suggest;
pub mod validate;

use crate::error::{Error, Result};
use crate::settings::effects::Effects;
use crate::settings::integration::Integration;
use crate::settings::steps::Step;
use accuracy::Accuracy;
use domain::{Domain, Resolution};
use expect::Expect;
use fabric::Fabric;
use output::Output;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// A case: one run of `tricot`. Units: mm, N, s, tonne, MPa.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Case {
    /// One line for reports.
    #[schemars(length(min = 1, max = 200))]
    pub title: String,
    /// The fabric, inline or as the path of a file relative to the case. Needed by every domain but an inline mesh.
    #[serde(default)]
    pub fabric: Option<FabricSource>,
    /// The piece of fabric.
    pub domain: Domain,
    /// Accuracy bought with time: a word that sets numerical fields which the case leaves out. `null` (the default) keeps their
    /// own defaults.
    #[serde(default)]
    pub accuracy: Option<Accuracy>,
    /// Mesh resolution.
    #[serde(default)]
    pub resolution: Resolution,
    /// Effects, with their numerical parameters.
    #[serde(default)]
    pub effects: Effects,
    /// Load steps.
    #[schemars(length(min = 1, max = 1000))]
    pub steps: Vec<Step>,
    /// Time integration, and integration over hexahedra.
    #[serde(default)]
    pub integration: Integration,
    /// What is written.
    #[serde(default)]
    pub output: Output,
    /// Expected results, for scenes that test the solver; a run ignores them. Default null.
    #[serde(default)]
    pub expect: Option<Expect>,
}

/// A fabric, or where to find it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum FabricSource {
    /// Path of a fabric file, relative to the case file.
    File(PathBuf),
    /// The fabric itself.
    Inline(Box<Fabric>),
}

impl Case {
    /// The fabric, already read from its file if the case names one.
    ///
    /// # Errors
    /// A case without a fabric.
    pub fn fabric(&self) -> Result<&Fabric> {
        match &self.fabric {
            Some(FabricSource::Inline(fabric)) => Ok(fabric),
            Some(FabricSource::File(path)) => {
                Err(Error::case("fabric", format!("{} has not been read: give the fabric itself", path.display())))
            }
            None => Err(Error::case("fabric", "is missing: give a fabric file or the fabric itself")),
        }
    }
}
