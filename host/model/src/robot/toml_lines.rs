//! Lines of TOML: numbers, lists, texts and tables, each with a comment.

use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Returns the shortest form that reads back to the same number, always with a point or an exponent.
pub(super) fn float(value: f64) -> String {
    format!("{value:?}")
}

/// Returns a list of numbers in brackets.
pub(super) fn list(values: &[f64]) -> String {
    let items: Vec<String> = values.iter().map(|v| float(*v)).collect();
    format!("[{}]", items.join(", "))
}

/// Returns text as a TOML string.
pub(super) fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// Writes one key with its value and a comment.
pub(super) fn line(out: &mut String, key: &str, value: &str, comment: &str) {
    let assignment = format!("{key} = {value}");
    // Writing to a String cannot fail.
    let _ = writeln!(out, "{assignment:<40} # {comment}");
}

/// Returns an inline table of numbers by name.
pub(super) fn table(values: &BTreeMap<String, f64>) -> String {
    let key = |name: &str| {
        let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        if !name.is_empty() && name.chars().all(bare) {
            name.to_owned()
        } else {
            quoted_key(name)
        }
    };
    let items: Vec<String> = values
        .iter()
        .map(|(name, v)| format!("{} = {}", key(name), float(*v)))
        .collect();
    format!("{{ {} }}", items.join(", "))
}

/// Returns a name as a basic TOML string on one line.
fn quoted_key(name: &str) -> String {
    let mut text = String::from("\"");
    for c in name.chars() {
        match c {
            '"' | '\\' => {
                text.push('\\');
                text.push(c);
            }
            c if c.is_control() => {
                let _ = write!(text, "\\u{:04X}", u32::from(c));
            }
            c => text.push(c),
        }
    }
    text.push('"');
    text
}

/// Writes a number if there is one.
pub(super) fn optional(out: &mut String, key: &str, value: Option<f64>, comment: &str) {
    if let Some(v) = value {
        line(out, key, &float(v), comment);
    }
}
