//! `--set path=value`: changes to a case from the command line.

use super::schema::Shape;
use super::{parse, suggest, validate::brief};
use crate::error::{Error, Result};
use serde_json::{Map, Value};

/// One change.
#[derive(Debug, Clone, PartialEq)]
pub struct Override {
    /// The user's text, shortened for messages.
    pub text: String,
    /// Names and list indices, joined by dots.
    pub path: String,
    /// JSON, or the text itself if it is not JSON.
    pub value: Value,
}

impl Override {
    /// Reads `path=value`.
    pub fn read(text: &str) -> Result<Self> {
        let shown: String = text.chars().filter(|c| !c.is_control()).take(80).collect();
        let Some((path, value)) = text.split_once('=') else {
            let message = "no `=`: write PATH=VALUE, such as steps.0.hold.time_s=1e-3";
            return Err(Error::case(format!("--set {shown}"), message));
        };
        let value = parse::parse(value).unwrap_or_else(|_| value.into());
        Ok(Self { text: shown, path: path.trim().into(), value })
    }

    /// Applies the change. Objects that the case leaves out are created along the path. Names must exist in the schema, list
    /// entries in the case.
    pub fn apply(&self, case: &mut Value, schema: &Value) -> Result<()> {
        let names: Vec<&str> = self.path.split('.').collect();
        let mut forms = Shape::new(schema).forms();
        let mut here = case;
        for (depth, name) in names.iter().enumerate() {
            let parent = names[..depth].join(".");
            (here, forms) = match here {
                Value::Array(items) => (self.entry(items, name, &parent)?, items_of(&forms)),
                Value::Object(fields) => {
                    let Some(field) = forms.iter().find_map(|form| form.field(name)) else {
                        let allowed = suggest::advice(name, forms.iter().flat_map(Shape::names));
                        return Err(self.error(format!("no `{name}` {}; {allowed}", inside(&parent))));
                    };
                    let last = depth + 1 == names.len();
                    (self.field(fields, name, field, last)?, field.forms())
                }
                other => {
                    let advice = if other.is_null() { ": set it to {} to turn it on" } else { "" };
                    return Err(self.error(format!("`{parent}` is {}, without fields{advice}", brief(other))));
                }
            };
        }
        *here = self.value.clone();
        Ok(())
    }

    fn entry<'a>(&self, items: &'a mut [Value], name: &str, parent: &str) -> Result<&'a mut Value> {
        let count = items.len();
        let entry = name.parse::<usize>().ok().and_then(|i| items.get_mut(i));
        entry
            .ok_or_else(|| self.error(format!("no entry `{name}` in the list `{parent}`, which holds {count}, from 0")))
    }

    fn field<'a>(
        &self,
        fields: &'a mut Map<String, Value>,
        name: &str,
        shape: Shape,
        last: bool,
    ) -> Result<&'a mut Value> {
        if !fields.contains_key(name) {
            if !last && !shape.forms().iter().any(|form| form.types().contains(&"object")) {
                return Err(self.error(format!("`{name}` is not an object of the case: set `{name}` as a whole")));
            }
            fields.insert(name.into(), Value::Object(Map::new()));
        }
        fields.get_mut(name).ok_or_else(|| self.error(format!("no `{name}`")))
    }

    fn error(&self, message: String) -> Error {
        Error::case(format!("--set {}", self.text), message)
    }
}

fn items_of<'a>(forms: &[Shape<'a>]) -> Vec<Shape<'a>> {
    forms.iter().filter_map(Shape::items).flat_map(|item| item.forms()).collect()
}

fn inside(parent: &str) -> String {
    if parent.is_empty() { "in a case".into() } else { format!("in `{parent}`") }
}
