//! Checks a JSON value against the types and ranges of the schema, and describes the first fault for a user.

use super::schema::Shape;
use super::suggest;
use serde_json::{Map, Value};

/// A fault and its path: names and indices joined by dots.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    pub path: String,
    pub message: String,
}

/// The first fault of `value`, if any.
pub fn validate(value: &Value, shape: Shape) -> Result<(), Fault> {
    at(value, shape, &mut Vec::new())
}

fn at(value: &Value, shape: Shape, path: &mut Vec<String>) -> Result<(), Fault> {
    let forms = shape.forms();
    let fitting: Vec<Shape> = forms.iter().copied().filter(|form| fits(value, form)).collect();
    let Some(&form) = fitting.first() else {
        let found = if value.is_null() { "null".into() } else { format!("{} is {}", brief(value), kind(value)) };
        return fault(path, format!("{found}, expected {}{}", expected(&forms), meaning(shape)));
    };
    match value {
        Value::Object(fields) if fitting.len() > 1 => tagged(fields, &fitting, path),
        Value::Object(fields) => object(fields, form, path),
        Value::Array(items) => list(items, form, shape, path),
        Value::String(text) => string(text, shape, &fitting, path),
        Value::Number(number) => {
            let limit = |keyword| form.get(keyword).and_then(Value::as_f64);
            let (low, high) = (limit("minimum"), limit("maximum"));
            let number = number.as_f64().unwrap_or(f64::NAN);
            if low.is_none_or(|low| number >= low) && high.is_none_or(|high| number <= high) {
                return Ok(());
            }
            let range = match (form.get("minimum"), form.get("maximum")) {
                (Some(low), Some(high)) => format!("{} to {}", plain(low), plain(high)),
                (Some(low), None) => format!("at least {}", plain(low)),
                (_, high) => format!("at most {}", high.map(plain).unwrap_or_default()),
            };
            fault(path, format!("{value} is out of range, give {range}{}", meaning(shape)))
        }
        Value::Bool(_) | Value::Null => Ok(()),
    }
}

/// An object of one field, whose name selects the variant.
fn tagged(fields: &Map<String, Value>, forms: &[Shape], path: &mut Vec<String>) -> Result<(), Fault> {
    let tags: Vec<&str> = forms.iter().flat_map(Shape::names).collect();
    if fields.len() != 1 {
        let found = match fields.len() {
            0 => "nothing".into(),
            _ => fields.keys().map(|k| format!("`{}`", cut(k))).collect::<Vec<_>>().join(", "),
        };
        return fault(path, format!("expected one field, its name one of {}; found {}", tags.join(", "), cut(&found)));
    }
    match fields.keys().next().and_then(|name| forms.iter().find(|form| form.field(name).is_some())) {
        Some(&form) => object(fields, form, path),
        None => unknown(fields.keys().next().map_or("", String::as_str), tags, path),
    }
}

fn object(fields: &Map<String, Value>, form: Shape, path: &mut Vec<String>) -> Result<(), Fault> {
    for (name, value) in fields {
        let Some(field) = form.field(name) else {
            return unknown(name, form.names().collect(), path);
        };
        path.push(name.clone());
        at(value, field, path)?;
        path.pop();
    }
    match form.required().find(|name| !fields.contains_key(*name)) {
        Some(name) => {
            let what = form.field(name).map(meaning).unwrap_or_default();
            fault(path, format!("`{name}` is missing{what}"))
        }
        None => Ok(()),
    }
}

fn list(items: &[Value], form: Shape, shape: Shape, path: &mut Vec<String>) -> Result<(), Fault> {
    let limit = |keyword| form.get(keyword).and_then(Value::as_u64).map(|n| n as usize);
    let (low, high) = (limit("minItems").unwrap_or(0), limit("maxItems").unwrap_or(usize::MAX));
    if !(low..=high).contains(&items.len()) {
        let range = match (low, high) {
            _ if low == high => low.to_string(),
            (_, usize::MAX) => format!("at least {low}"),
            _ => format!("{low} to {high}"),
        };
        return fault(path, format!("a list of length {}, expected length {range}{}", items.len(), meaning(shape)));
    }
    let Some(item) = form.items() else { return Ok(()) };
    for (i, value) in items.iter().enumerate() {
        path.push(i.to_string());
        at(value, item, path)?;
        path.pop();
    }
    Ok(())
}

fn string(text: &str, shape: Shape, forms: &[Shape], path: &[String]) -> Result<(), Fault> {
    let mut allowed: Vec<&str> = vec![];
    for form in forms {
        let many = form.get("enum").and_then(Value::as_array).into_iter().flatten();
        allowed.extend(many.chain(form.get("const")).filter_map(Value::as_str));
    }
    if !allowed.is_empty() && !allowed.contains(&text) {
        return fault(path, format!("\"{}\" is unknown; {}", cut(text), suggest::advice(text, allowed)));
    }
    let limit = |keyword, none| forms[0].get(keyword).and_then(Value::as_u64).map_or(none, |n| n as usize);
    let (low, high) = (limit("minLength", 0), limit("maxLength", usize::MAX));
    let length = text.chars().count();
    if (low..=high).contains(&length) {
        return Ok(());
    }
    fault(path, format!("text of {length} characters, expected {low} to {high}{}", meaning(shape)))
}

fn unknown(name: &str, allowed: Vec<&str>, path: &[String]) -> Result<(), Fault> {
    let mut path = path.to_vec();
    path.push(cut(name));
    fault(&path, format!("unknown field; {}", suggest::advice(name, allowed)))
}

fn fault<T>(path: &[String], message: String) -> Result<T, Fault> {
    Err(Fault { path: path.join("."), message })
}

fn fits(value: &Value, form: &Shape) -> bool {
    form.types().into_iter().any(|name| match name {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "integer" => value.is_i64() || value.is_u64(),
        "number" => value.is_number(),
        "string" => value.is_string(),
        "array" => value.is_array(),
        _ => value.is_object(),
    })
}

fn kind(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "a truth value",
        Value::Number(n) if n.is_f64() => "a number with a decimal point or exponent",
        Value::Number(_) => "a number",
        Value::String(_) => "text",
        Value::Array(_) => "a list",
        Value::Object(_) => "an object",
    }
}

fn expected(forms: &[Shape]) -> String {
    let mut names: Vec<&str> = vec![];
    for name in forms.iter().flat_map(Shape::types) {
        let name = match name {
            "boolean" => "true or false",
            "integer" => "a whole number",
            "number" => "a number",
            "string" => "text",
            "array" => "a list",
            "object" => "an object",
            other => other,
        };
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names.join(" or ")
}

/// ` (what the field means)`.
fn meaning(shape: Shape) -> String {
    match shape.description() {
        "" => String::new(),
        text => format!(" ({})", text.split_whitespace().collect::<Vec<_>>().join(" ")),
    }
}

/// A limit without a needless `.0`.
fn plain(limit: &Value) -> String {
    let text = limit.to_string();
    text.strip_suffix(".0").unwrap_or(&text).to_string()
}

/// A value as JSON, shortened.
pub fn brief(value: &Value) -> String {
    match value {
        Value::Array(items) if items.len() > 6 => format!("[{} entries]", items.len()),
        Value::Object(fields) if fields.len() > 2 => format!("{{{} fields}}", fields.len()),
        other => cut(&other.to_string()),
    }
}

fn cut(text: &str) -> String {
    let printable: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).take(61).collect();
    match printable.char_indices().nth(60) {
        Some((end, _)) => format!("{}…", &printable[..end]),
        None => printable,
    }
}
