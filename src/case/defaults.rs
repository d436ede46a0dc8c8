//! Values of a case that its user left to defaults.

use serde_json::Value;

/// Path and value of everything in `full` that `written` leaves out, objects field by field.
pub fn used(written: &Value, full: &Value) -> Vec<(String, Value)> {
    let mut found = vec![];
    compare(Some(written), full, &mut vec![], &mut found);
    found
}

fn compare(written: Option<&Value>, full: &Value, path: &mut Vec<String>, found: &mut Vec<(String, Value)>) {
    match (written, full) {
        (_, Value::Object(fields)) => {
            for (name, value) in fields {
                path.push(name.clone());
                compare(written.and_then(|w| w.get(name)), value, path, found);
                path.pop();
            }
        }
        (None, value) => found.push((path.join("."), value.clone())),
        (Some(Value::Array(items)), Value::Array(full)) => {
            for (i, (item, value)) in items.iter().zip(full).enumerate() {
                path.push(i.to_string());
                compare(Some(item), value, path, found);
                path.pop();
            }
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn lists_leaves_that_were_left_out() {
        let written = json!({ "a": { "b": 1 }, "list": [{ "x": 1 }] });
        let full = json!({ "a": { "b": 1.0, "c": null }, "d": { "e": [1, 2] }, "list": [{ "x": 1, "y": true }] });
        let expected =
            [("a.c", Value::Null), ("d.e", json!([1, 2])), ("list.0.y", json!(true))].map(|(p, v)| (p.to_string(), v));
        assert_eq!(used(&written, &full), expected);
    }
}
