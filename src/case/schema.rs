//! JSON Schema of a case and of a fabric file. Every range that [`super::conform`] checks is written here, by way of the
//! attributes on the types, and nowhere else.

use super::{Case, fabric::Fabric};
use schemars::schema_for;
use serde_json::Value;

/// Schema of a case.
pub fn case() -> Value {
    schema_for!(Case).to_value()
}

/// Schema of a fabric file.
pub fn fabric() -> Value {
    schema_for!(Fabric).to_value()
}

/// A schema as indented JSON, as `tricot schema` prints it.
pub fn text(schema: &Value) -> String {
    format!("{schema:#}")
}

/// A place in a schema, for walking along it.
#[derive(Clone, Copy)]
pub struct Shape<'a> {
    root: &'a Value,
    node: &'a Value,
}

impl<'a> Shape<'a> {
    /// The top of a schema.
    pub fn new(root: &'a Value) -> Self {
        Self { root, node: root }
    }

    /// A keyword of this place, such as `minimum`.
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

    /// The forms a value may take here: references followed, alternatives flattened.
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
