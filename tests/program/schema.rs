//! The schema gives the meaning and range of every field, and the shipped cases conform to it.

use serde_json::Value;
use std::fs;
use std::path::Path;
use tricot::case::Case;
use tricot::case::schema::{self, Shape};
use tricot::case::validate::validate;
use tricot::rigs::read::read;

/// Every schema node below `node`, with its path; fields are flagged.
fn nodes<'a>(node: &'a Value, path: &str, field: bool, found: &mut Vec<(String, &'a Value, bool)>) {
    found.push((path.into(), node, field));
    let children = |keyword: &str| node.get(keyword).and_then(Value::as_object).into_iter().flatten();
    for (name, child) in children("properties") {
        nodes(child, &format!("{path}.{name}"), true, found);
    }
    for (name, child) in children("$defs") {
        nodes(child, name, false, found);
    }
    for keyword in ["oneOf", "anyOf"] {
        for child in node.get(keyword).and_then(Value::as_array).into_iter().flatten() {
            let first = found.len();
            nodes(child, path, false, found);
            // the variant carries the description of its one field
            if child.get("description").is_some() && child.get("required").is_some() {
                found[first..].iter_mut().skip(1).take(1).for_each(|own| own.2 = false);
            }
        }
    }
    if let Some(child) = node.get("items") {
        nodes(child, &format!("{path}[]"), false, found);
    }
}

fn is_number(node: &Value) -> bool {
    let names = |n: &Value| ["number", "integer"].iter().any(|t| n == t);
    node.get("type").is_some_and(|t| names(t) || t.as_array().is_some_and(|a| a.iter().any(names)))
}

#[test]
fn every_field_is_described_and_every_number_has_a_range() {
    for schema in [schema::case(), schema::fabric()] {
        let mut found = vec![];
        nodes(&schema, "", false, &mut found);
        assert!(found.len() > 40);
        for (path, node, field) in found {
            // The variant carries the description of its one field.
            let tag = node.get("type").is_some_and(|t| t == "object") || node.get("$ref").is_some();
            assert!(!field || tag || node.get("description").is_some(), "{path} has no description");
            if is_number(node) {
                let limit = |keyword| node.get(keyword).and_then(Value::as_f64);
                let (low, high) = (limit("minimum"), limit("maximum"));
                assert!(low.is_some() && low < high, "{path}: {low:?} to {high:?}");
            }
            let closed = node.get("additionalProperties") == Some(&Value::Bool(false));
            assert!(node.get("properties").is_none() || closed, "{path} accepts unknown fields");
        }
    }
}

/// The checks read these keywords; any other keyword in the schema would not be checked.
#[test]
fn the_schema_uses_only_keywords_that_are_checked() {
    let known = [
        "$schema",
        "$defs",
        "$ref",
        "title",
        "description",
        "default",
        "format",
        "type",
        "properties",
        "required",
        "additionalProperties",
        "items",
        "minItems",
        "maxItems",
        "minLength",
        "maxLength",
        "minimum",
        "maximum",
        "enum",
        "const",
        "oneOf",
        "anyOf",
    ];
    for schema in [schema::case(), schema::fabric()] {
        let mut found = vec![];
        nodes(&schema, "", false, &mut found);
        for (path, node, _) in found {
            for keyword in node.as_object().unwrap().keys() {
                assert!(known.contains(&keyword.as_str()), "{path}: {keyword}");
            }
        }
    }
}

fn json_files(dir: &str) -> Vec<std::path::PathBuf> {
    let mut files: Vec<_> = fs::read_dir(dir).unwrap().map(|e| e.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|e| e == "json"));
    assert!(!files.is_empty());
    files
}

#[test]
fn shipped_cases_and_fabrics_are_valid() {
    for path in json_files("cases") {
        let loaded = read(&path, &[]).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(loaded.provenance.case, path);
        let value: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        validate(&value, Shape::new(&schema::case())).unwrap();
    }
    for path in json_files("cases/fabrics") {
        let value: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        validate(&value, Shape::new(&schema::fabric())).unwrap();
        let set = format!("fabric=fabrics/{}", path.file_name().unwrap().to_str().unwrap());
        read(Path::new("cases/unit_cell_shear.json"), &[set]).unwrap_or_else(|e| panic!("{e}"));
    }
}

/// The defaults in the schema are those of a case.
#[test]
fn defaults_are_in_the_schema_and_in_range() {
    let loaded = read(Path::new("cases/unit_cell_shear.json"), &["accuracy=null".into()]).unwrap();
    let full = serde_json::to_value(&loaded.case).unwrap();
    let schema = schema::case();
    validate(&full, Shape::new(&schema)).unwrap();
    for name in ["resolution", "effects", "integration", "output"] {
        assert_eq!(schema["properties"][name]["default"], full[name], "{name}");
        assert!(loaded.defaults.iter().any(|(path, _)| path.starts_with(&format!("{name}."))));
    }
}

/// Paths and values of all non-objects.
fn leaves<'a>(value: &'a Value, path: String, found: &mut Vec<(String, &'a Value)>) {
    match value.as_object() {
        Some(fields) => {
            for (name, field) in fields {
                let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
                leaves(field, path, found);
            }
        }
        None => found.push((path, value)),
    }
}

/// An accuracy word sets fields that the case leaves out, and they are listed among its defaults.
#[test]
fn an_accuracy_fills_what_a_case_leaves_out() {
    let cell = |sets: &[&str]| {
        let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
        read(Path::new("cases/unit_cell_shear.json"), &sets)
    };
    let plain = cell(&["accuracy=null"]).unwrap().case;
    for word in ["preview", "paper", "standard", "engineering", "reference"] {
        let loaded = cell(&[&format!("accuracy={word}")]).unwrap();
        let numbers = |case: &Case| (case.resolution.clone(), case.integration.clone(), case.effects.clone());
        assert!(numbers(&loaded.case) != numbers(&plain), "{word}");
        let full = serde_json::to_value(&loaded.case).unwrap();
        validate(&full, Shape::new(&schema::case())).unwrap();
        let fields = loaded.case.accuracy.unwrap().fields();
        let mut stated = Vec::new();
        leaves(&fields, String::new(), &mut stated);
        assert!(!stated.is_empty(), "{word} says something");
        for (path, value) in stated {
            let default = &loaded.defaults.iter().find(|(place, _)| *place == path).expect("it is stated").1;
            let own = full.pointer(&format!("/{}", path.replace('.', "/"))).unwrap();
            assert_eq!(own, default, "{path}");
            assert!(default == value || default.as_f64() == value.as_f64(), "{path}: {default} for {value}");
        }
    }
    let own = cell(&["accuracy=preview", "resolution.finer=2", "integration.dt_max_s=1e-7"]).unwrap().case;
    assert_eq!((own.resolution.finer, own.integration.dt_max_s), (2.0, 1e-7));
    let message = cell(&["accuracy=best"]).unwrap_err().to_string();
    assert!(message.contains("engineering"), "{message}");
}
