//! Differences between two cases: JSON paths with both values.

use serde_json::Value;

/// A path, names and indices joined by dots, and both values there; `None` for an absent value.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference<'a> {
    pub place: String,
    pub values: [Option<&'a Value>; 2],
}

impl Difference<'_> {
    /// Both values as text.
    pub fn texts(&self) -> [String; 2] {
        self.values.map(|value| value.map_or("absent".to_owned(), Value::to_string))
    }
}

/// Every path at which two values differ, in the order of the first value. Paths for which `free` holds may differ.
pub fn differences<'a>(a: &'a Value, b: &'a Value, free: &dyn Fn(&str) -> bool) -> Vec<Difference<'a>> {
    let mut found = Vec::new();
    compare(String::new(), [Some(a), Some(b)], free, &mut found);
    found
}

fn compare<'a>(
    place: String,
    values: [Option<&'a Value>; 2],
    free: &dyn Fn(&str) -> bool,
    found: &mut Vec<Difference<'a>>,
) {
    if values[0] == values[1] || free(&place) {
        return;
    }
    let below = |key: &str| if place.is_empty() { key.to_owned() } else { format!("{place}.{key}") };
    match values {
        [Some(Value::Object(a)), Some(Value::Object(b))] => {
            let keys = a.keys().chain(b.keys().filter(|k| !a.contains_key(*k)));
            keys.for_each(|k| compare(below(k), [a.get(k), b.get(k)], free, found));
        }
        [Some(Value::Array(a)), Some(Value::Array(b))] => {
            let items = 0..a.len().max(b.len());
            items.for_each(|i| compare(below(&i.to_string()), [a.get(i), b.get(i)], free, found));
        }
        _ => found.push(Difference { place, values }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn every_place_is_found_with_both_values() {
        let a = json!({ "x": [1, { "y": 2 }], "z": 1, "only": null });
        let b = json!({ "x": [1, { "y": 3 }, 4], "z": 1 });
        let found: Vec<_> = differences(&a, &b, &|_| false).iter().map(|d| (d.place.clone(), d.texts())).collect();
        let expected = [("x.1.y", ["2", "3"]), ("x.2", ["absent", "4"]), ("only", ["null", "absent"])];
        assert_eq!(found.len(), expected.len());
        for (place, texts) in expected {
            assert!(found.iter().any(|(p, t)| p == place && *t == texts), "{place}: {found:?}");
        }
        assert!(differences(&a, &a, &|_| false).is_empty());
        assert_eq!(differences(&a, &b, &|place| place == "x")[0].place, "only");
    }
}
