//! Reads a case file and command-line overrides into a typed case with every number checked.

use super::tools;
use crate::case::accuracy::{Accuracy, fill};
use crate::case::overrides::Override;
use crate::case::provenance::Provenance;
use crate::case::schema::{self, Shape};
use crate::case::validate::validate;
use crate::case::{Case, check, defaults, parse};
use crate::error::{Error, Result};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// A case that has been read and checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Loaded {
    /// The case, with its fabric inline.
    pub case: Case,
    /// JSON path and value of everything not written in the case: defaults, and values implied by the requested accuracy.
    pub defaults: Vec<(String, Value)>,
    /// Sources of the parts, so that errors name their file.
    pub provenance: Provenance,
}

/// Reads a case file, loads the fabric file it names (relative to the case), applies `path=value` overrides in order, and
/// performs all checks that need no mesh.
pub fn read(path: &Path, overrides: &[String]) -> Result<Loaded> {
    overridden(parse::file(path)?, Provenance { case: path.into(), ..Provenance::default() }, overrides)
}

/// Applies overrides to a case, loads the fabric file that it names, if any, and checks it.
fn overridden(mut value: Value, mut provenance: Provenance, overrides: &[String]) -> Result<Loaded> {
    let schema = schema::case();
    for text in overrides {
        let set = Override::read(text)?;
        if set.path == "fabric" {
            provenance.fabric = None;
        } else if set.path.starts_with("fabric.") {
            inline_fabric(&mut value, &mut provenance)?;
        }
        set.apply(&mut value, &schema)?;
        provenance.overrides.push(set);
    }
    inline_fabric(&mut value, &mut provenance)?;
    tools::inline(&mut value, &provenance)?;
    checked(value, provenance, &schema)
}

/// Reads a case from a text with a fabric from a file in place of its own, and applies the overrides; `name` stands for its file in
/// messages.
///
/// # Errors
/// As of [`read`].
pub fn of_fabric(name: &str, case: &str, fabric: &Path, overrides: &[String]) -> Result<Loaded> {
    let provenance = Provenance { case: name.into(), fabric: Some(fabric.into()), ..Provenance::default() };
    let mut value = parse::parse(case).map_err(|fault| provenance.error("", fault.to_string()))?;
    value["fabric"] = parse::file(fabric)?;
    overridden(value, provenance, overrides)
}

/// Checks a JSON value with inline fabric as if it were a case file.
///
/// # Errors
/// The first fault, by its JSON path.
pub fn read_value(value: Value) -> Result<Case> {
    checked(value, Provenance { case: "case".into(), ..Provenance::default() }, &schema::case())
        .map(|loaded| loaded.case)
}

/// The typed case of a value with all overrides applied.
fn checked(mut value: Value, provenance: Provenance, schema: &Value) -> Result<Loaded> {
    if ["domain", "steps"].iter().all(|name| value.get(name).is_none()) && value.get("stitch").is_some() {
        let message = "this is a fabric, not a case: give a case that names it in its field `fabric`";
        return Err(provenance.error("", message));
    }
    validate(&value, Shape::new(schema)).map_err(|fault| provenance.error(&fault.path, fault.message))?;
    for place in ["", "/fabric"] {
        if let Some(fields) = value.pointer_mut(place).and_then(Value::as_object_mut) {
            fields.remove(schema::SCHEMA);
        }
    }
    let written = value.clone();
    if let Some(accuracy) = Accuracy::of(&value) {
        fill(&mut value, &accuracy.fields());
    }
    let case: Case = serde_path_to_error::deserialize(&value)
        .map_err(|e| provenance.error(&e.path().to_string(), e.inner().to_string()))?;
    check::check(&case, &provenance)?;
    super::of(&case.domain).check(&case, &provenance)?;
    let full = serde_json::to_value(&case).map_err(|e| provenance.error("", e.to_string()))?;
    let defaults = defaults::used(&written, &full);
    Ok(Loaded { case, defaults, provenance })
}

/// Replaces the name of a fabric file by its content.
fn inline_fabric(value: &mut Value, provenance: &mut Provenance) -> Result<()> {
    let Some(Value::String(name)) = value.get("fabric") else { return Ok(()) };
    let file: PathBuf = provenance.case.parent().unwrap_or(Path::new("")).join(name);
    let fabric = parse::file(&file).map_err(|error| match error {
        Error::File { path, source } => {
            let message = format!("the fabric file {} cannot be read: {source}", path.display());
            provenance.error("fabric", message)
        }
        other => other,
    })?;
    value["fabric"] = fabric;
    provenance.fabric = Some(file);
    Ok(())
}
