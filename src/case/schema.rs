//! JSON Schema of a case and of a fabric file. Attributes on the types are the only source of the ranges that [`super::validate`]
//! checks.

use super::{Case, fabric::Fabric};
use schemars::schema_for;
use serde_json::{Map, Value, json};

/// Field in which a file may name its schema, for editors.
pub const SCHEMA: &str = "$schema";

/// Schema of a case.
pub fn case() -> Value {
    let mut schema = schema_for!(Case).to_value();
    name_schema(&mut schema["properties"]);
    name_schema(&mut schema["$defs"]["Fabric"]["properties"]);
    schema
}

/// Schema of a fabric file.
pub fn fabric() -> Value {
    let mut schema = schema_for!(Fabric).to_value();
    name_schema(&mut schema["properties"]);
    schema
}

fn name_schema(fields: &mut Value) {
    let what = "Location of the schema of this file, for editors; a run ignores it.";
    fields[SCHEMA] = json!({ "description": what, "type": "string" });
}

/// A schema as indented JSON, as `tricot schema` prints it. Alternatives with one field each, of different names, become one
/// object with exactly one of these fields. An editor can then name the wrong field; for alternatives it only reports that none
/// fits.
pub fn text(schema: &Value) -> String {
    let mut schema = schema.clone();
    merge(&mut schema);
    format!("{schema:#}")
}

fn merge(node: &mut Value) {
    match node {
        Value::Object(fields) => fields.values_mut().for_each(merge),
        Value::Array(items) => items.iter_mut().for_each(merge),
        _ => {}
    }
    let Some(forms) = node.get("oneOf").and_then(Value::as_array) else { return };
    let tag = |form: &Value| {
        let name = form["required"].as_array().filter(|names| names.len() == 1)?[0].as_str()?;
        let mut field = form["properties"].as_object().filter(|fields| fields.len() == 1)?.get(name)?.clone();
        // what the alternative means
        if let (Some(fields), Some(meaning)) = (field.as_object_mut(), form.get("description")) {
            fields.entry("description").or_insert_with(|| meaning.clone());
        }
        Some((name.to_owned(), field))
    };
    let Some(fields) = forms.iter().map(tag).collect::<Option<Map<String, Value>>>() else { return };
    let Some(merged) = node.as_object_mut() else { return };
    merged.remove("oneOf");
    merged.insert("type".into(), json!("object"));
    merged.insert("properties".into(), Value::Object(fields));
    for (limit, value) in
        [("minProperties", json!(1)), ("maxProperties", json!(1)), ("additionalProperties", json!(false))]
    {
        merged.insert(limit.into(), value);
    }
}

/// A node of a schema, for traversal.
#[derive(Clone, Copy)]
pub struct Shape<'a> {
    root: &'a Value,
    node: &'a Value,
}

impl<'a> Shape<'a> {
    /// The root of a schema.
    pub fn new(root: &'a Value) -> Self {
        Self { root, node: root }
    }

    /// A keyword of this node, such as `minimum`.
    pub fn get(&self, keyword: &str) -> Option<&'a Value> {
        self.node.get(keyword)
    }

    /// The first sentence of the description, without its full stop.
    pub fn description(&self) -> &'a str {
        let text = self.get("description").and_then(Value::as_str).unwrap_or_default();
        // "Eq. 14" does not end a sentence, ". Default" does.
        let ends = |i: &usize| text[i + 1..].trim_start().starts_with(|c: char| c.is_uppercase());
        let end = text.match_indices(". ").chain(text.match_indices(".\n")).map(|(i, _)| i).filter(ends).min();
        text[..end.unwrap_or(text.len())].trim_end_matches('.')
    }

    /// The forms a value may take here, with references resolved and alternatives flattened.
    pub fn forms(&self) -> Vec<Shape<'a>> {
        let at = |node| Shape { root: self.root, node };
        if let Some(pointer) = self.get("$ref").and_then(Value::as_str).and_then(|r| r.strip_prefix('#')) {
            return self.root.pointer(pointer).map(|node| at(node).forms()).unwrap_or_default();
        }
        match self.get("oneOf").or(self.get("anyOf")).and_then(Value::as_array) {
            Some(forms) => forms.iter().flat_map(|node| at(node).forms()).collect(),
            None => vec![*self],
        }
    }

    /// Names of JSON types allowed by this form.
    pub fn types(&self) -> Vec<&'a str> {
        match self.get("type") {
            Some(Value::String(one)) => vec![one],
            Some(Value::Array(many)) => many.iter().filter_map(Value::as_str).collect(),
            _ => vec![],
        }
    }

    /// Names of the fields of this form.
    pub fn names(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        self.get("properties").and_then(Value::as_object).into_iter().flat_map(|p| p.keys().map(String::as_str))
    }

    /// A field of this form.
    pub fn field(&self, name: &str) -> Option<Shape<'a>> {
        let node = self.get("properties")?.get(name)?;
        Some(Shape { root: self.root, node })
    }

    /// The form of every entry of a list.
    pub fn items(&self) -> Option<Shape<'a>> {
        Some(Shape { root: self.root, node: self.get("items")? })
    }

    /// Names of the fields that must be given.
    pub fn required(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        self.get("required").and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_str)
    }
}
