//! Strict JSON parser: unique names in each object, no comments, no NaN, a limit on size and depth.

use crate::error::{Error, Result};
use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Number, Value};
use std::fmt;
use std::io::Read;
use std::path::Path;

/// Largest file that is read, bytes.
pub const MAX_BYTES: u64 = 64 << 20;

/// Reads and parses a JSON file. A file that cannot be opened is [`Error::File`]; text that is not JSON is [`Error::Case`].
pub fn file(path: &Path) -> Result<Value> {
    let bytes = read(path).map_err(|message| Error::file(path, message))?;
    let place = path.display();
    let text = std::str::from_utf8(&bytes).map_err(|e| {
        let message = format!("not UTF-8 text at byte {}: save the file as UTF-8", e.valid_up_to());
        Error::case(place.to_string(), message)
    })?;
    // Windows editors put a byte order mark in front.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    if text.trim().is_empty() {
        return Err(Error::case(place.to_string(), "the file is empty"));
    }
    parse(text).map_err(|e| {
        let place = format!("{place}: line {}, column {}", e.line(), e.column());
        Error::case(place, explain(&e, text))
    })
}

/// Parses JSON text. Names that occur twice in an object are an error; nesting is limited to 127 levels.
pub fn parse(text: &str) -> serde_json::Result<Value> {
    serde_json::from_str::<Strict>(text).map(|strict| strict.0)
}

fn read(path: &Path) -> std::result::Result<Vec<u8>, String> {
    let metadata = std::fs::metadata(path).map_err(|e| reason(&e))?;
    if !metadata.is_file() {
        return Err("is not a file".into());
    }
    if metadata.len() > MAX_BYTES {
        return Err(format!("is larger than {} MiB, is this a case or a fabric?", MAX_BYTES >> 20));
    }
    let file = std::fs::File::open(path).map_err(|e| reason(&e))?;
    let mut bytes = Vec::new();
    file.take(MAX_BYTES).read_to_end(&mut bytes).map_err(|e| reason(&e))?;
    Ok(bytes)
}

/// Message of the operating system, without its error number.
pub fn reason(error: &std::io::Error) -> String {
    match error.kind() {
        std::io::ErrorKind::NotFound => "no such file".into(),
        _ => error.to_string(),
    }
}

/// The parser's message without the position, with a hint for the most frequent mistakes.
fn explain(error: &serde_json::Error, text: &str) -> String {
    let message = error.to_string();
    let position = format!(" at line {} column {}", error.line(), error.column());
    let message = message.strip_suffix(&position).unwrap_or(&message);
    let line = text.lines().nth(error.line().saturating_sub(1)).unwrap_or_default();
    // columns count bytes; the column may be any byte of a multi-byte character
    let before = error.column().saturating_sub(1).min(line.len());
    let rest = &line[(0..=before).rev().find(|at| line.is_char_boundary(*at)).unwrap_or(0)..];
    if let Some(odd) = rest.chars().next().filter(|c| !c.is_ascii()) {
        return format!("{message}: {}", name(odd));
    }
    let hint = if error.is_eof() {
        ": the file ends too early, is it complete?"
    } else if rest.starts_with(['/', '#']) {
        ": JSON has no comments"
    } else if message == "key must be a string" && rest.starts_with(|c: char| c.is_ascii_digit()) {
        ": decimals are written with a point"
    } else if ["NaN", "nan", "aN", "Infinity", "inf", "-Inf", "Inf"].iter().any(|word| rest.starts_with(word)) {
        ": NaN and infinity are not numbers"
    } else if rest.starts_with('\'') {
        ": JSON puts text in double quotes"
    } else {
        ""
    };
    format!("{message}{hint}")
}

/// Describes a character that JSON does not allow outside text, and what to do.
fn name(odd: char) -> String {
    let code = u32::from(odd);
    match odd {
        '\u{a0}' | '\u{202f}' | '\u{2007}' => format!("there is a no-break space (U+{code:04X}), write a plain one"),
        '\u{feff}' | '\u{200b}'..='\u{200f}' | '\u{2060}' => {
            format!("there is an invisible character (U+{code:04X}), remove it")
        }
        '\u{2018}'..='\u{201f}' | '«' | '»' | '‹' | '›' => {
            format!("{odd} (U+{code:04X}) is a typographic quotation mark, write \"")
        }
        '\u{2010}'..='\u{2015}' | '\u{2212}' => format!("{odd} (U+{code:04X}) is no minus of JSON, write -"),
        _ => format!("{odd:?} (U+{code:04X}) has no place outside text in quotes"),
    }
}

/// A JSON value whose objects have unique names.
struct Strict(Value);

impl<'de> Deserialize<'de> for Strict {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        deserializer.deserialize_any(StrictVisitor).map(Strict)
    }
}

struct StrictVisitor;

impl<'de> Visitor<'de> for StrictVisitor {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("JSON")
    }
    fn visit_unit<E>(self) -> std::result::Result<Value, E> {
        Ok(Value::Null)
    }
    fn visit_bool<E>(self, v: bool) -> std::result::Result<Value, E> {
        Ok(v.into())
    }
    fn visit_i64<E>(self, v: i64) -> std::result::Result<Value, E> {
        Ok(v.into())
    }
    fn visit_u64<E>(self, v: u64) -> std::result::Result<Value, E> {
        Ok(v.into())
    }
    fn visit_f64<E: serde::de::Error>(self, v: f64) -> std::result::Result<Value, E> {
        Number::from_f64(v).map(Value::Number).ok_or_else(|| E::custom("number out of range"))
    }
    fn visit_str<E>(self, v: &str) -> std::result::Result<Value, E> {
        Ok(v.into())
    }
    fn visit_string<E>(self, v: String) -> std::result::Result<Value, E> {
        Ok(v.into())
    }
    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> std::result::Result<Value, A::Error> {
        let mut items = Vec::new();
        while let Some(Strict(item)) = seq.next_element()? {
            items.push(item);
        }
        Ok(Value::Array(items))
    }
    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> std::result::Result<Value, A::Error> {
        let mut fields = Map::new();
        while let Some(name) = map.next_key::<String>()? {
            if fields.contains_key(&name) {
                return Err(serde::de::Error::custom(format!("`{name}` is given twice")));
            }
            let Strict(value) = map.next_value()?;
            fields.insert(name, value);
        }
        Ok(Value::Object(fields))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn reads_values_as_serde_json_does() {
        let text = r#"{ "a": [1, -2, 3.5, 18446744073709551615], "b": { "c": null, "d": true }, "é": "\u00e9" }"#;
        assert_eq!(parse(text).unwrap(), serde_json::from_str::<Value>(text).unwrap());
    }

    #[test]
    fn refuses_names_given_twice_at_any_depth() {
        assert!(parse(r#"{ "a": [{ "b": 1, "b": 1 }] }"#).unwrap_err().to_string().starts_with("`b` is given twice"));
    }

    #[test]
    fn accepts_a_byte_order_mark_and_refuses_huge_files() {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join("case.json");
        std::fs::write(&path, "\u{feff}{}").unwrap();
        assert_eq!(file(&path).unwrap(), json!({}));
        std::fs::File::create(&path).unwrap().set_len(MAX_BYTES + 1).unwrap();
        assert!(file(&path).unwrap_err().to_string().ends_with("larger than 64 MiB, is this a case or a fabric?"));
    }

    #[test]
    fn names_characters_that_are_not_of_json() {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join("case.json");
        for (text, word) in [
            ("{ \"é\": 1,\n\u{a0}\"b\": 2 }", "no-break space (U+00A0)"),
            ("{ \u{201c}a\u{201d}: 1 }", "typographic quotation mark"),
            ("{ \"é\": \u{2212}1 }", "no minus of JSON"),
            ("{ \"a\": 1\u{200b} }", "invisible character (U+200B)"),
            ("{ \"a\": π }", "U+03C0"),
        ] {
            std::fs::write(&path, text).unwrap();
            let message = file(&path).unwrap_err().to_string();
            assert!(message.contains(word), "{message}");
        }
    }

    #[test]
    fn numbers_are_read_to_the_last_bit() {
        // known numbers that fast parsers miss by one bit
        for text in ["0.30000000000000004", "1.1125369292536007e-308", "5e-324", "0.1234567890123456789"] {
            let exact: f64 = text.parse().unwrap();
            assert_eq!(parse(text).unwrap().as_f64().unwrap().to_bits(), exact.to_bits(), "{text}");
        }
    }
}
