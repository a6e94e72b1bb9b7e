//! One JSON object of numbers per sample.

use serde::de::{DeserializeSeed, Deserializer, IgnoredAny, MapAccess, Visitor};

/// Keys of the first message; all messages are read by them.
#[derive(Debug, Default)]
pub(super) struct JsonSamples {
    names: Vec<String>,
}

impl JsonSamples {
    /// Reads the keys of the first message.
    ///
    /// # Errors
    /// Its fault, one clause.
    pub(super) fn new(message: &[u8]) -> Result<Self, String> {
        Ok(Self {
            names: keys(message)?,
        })
    }

    pub(super) fn names(&self) -> &[String] {
        &self.names
    }

    /// Reads a message into `values`, one per key of the first; a value that is not a number becomes NaN.
    ///
    /// # Errors
    /// The difference to the first message, one clause.
    pub(super) fn read(&self, message: &[u8], values: &mut [f64]) -> Result<(), String> {
        if self.fill(message, values) {
            return Ok(());
        }
        // Second attempt without NaN and Infinity, which are not JSON.
        let plain = without_nan(message);
        if plain.is_some_and(|m| self.fill(&m, values)) {
            return Ok(());
        }
        Err(self.difference(&keys(message)?))
    }

    /// Fills `values`; returns false if the message cannot be read.
    fn fill(&self, message: &[u8], values: &mut [f64]) -> bool {
        values.fill(f64::NAN);
        let mut found = 0;
        let seed = Fields {
            names: &self.names,
            values,
            found: &mut found,
        };
        let mut parser = serde_json::Deserializer::from_slice(message);
        let read = seed.deserialize(&mut parser).and_then(|()| parser.end());
        read.is_ok() && found == self.names.len()
    }

    /// Describes how these keys differ from those of the first message.
    fn difference(&self, keys: &[String]) -> String {
        let quoted = |names: Vec<&String>| {
            let shown = names
                .iter()
                .take(6)
                .map(|n| format!("`{}`", n.escape_debug()));
            let more = if names.len() > 6 { ", …" } else { "" };
            shown.collect::<Vec<_>>().join(", ") + more
        };
        let missing: Vec<&String> = self.names.iter().filter(|n| !keys.contains(n)).collect();
        let extra: Vec<&String> = keys.iter().filter(|n| !self.names.contains(n)).collect();
        let twice: Vec<&String> = keys
            .iter()
            .enumerate()
            .filter(|(k, n)| keys[..*k].contains(n))
            .map(|(_, n)| n)
            .collect();
        let mut parts = Vec::new();
        for (names, what) in [
            (missing, "has no key"),
            (extra, "has a key that message 1 has not:"),
            (twice, "has a key twice:"),
        ] {
            if !names.is_empty() {
                parts.push(format!("{what} {}", quoted(names)));
            }
        }
        if parts.is_empty() {
            parts.push("holds a number that cannot be read".to_owned());
        }
        format!(
            "{}; every message must have the keys of the first",
            parts.join(" and ")
        )
    }
}

/// Returns the value of a key as written in the message.
pub(super) fn written(message: &[u8], name: &str) -> String {
    let plain = without_nan(message);
    let value = serde_json::from_slice(plain.as_deref().unwrap_or(message));
    let value: Option<serde_json::Value> = value.ok();
    let value = value.as_ref().and_then(|v| v.get(name));
    let text = match value {
        None => return "nothing".to_owned(),
        Some(serde_json::Value::Null) => {
            return bare_word(message, name).unwrap_or("null").to_owned();
        }
        Some(value) => value.to_string(),
    };
    let short: String = text.chars().take(40).collect();
    if short.len() < text.len() {
        short + "…"
    } else {
        short
    }
}

/// Words for values that are not numbers; not JSON, but some writers use them. The longest comes first.
const NOT_NUMBERS: [&str; 3] = ["-Infinity", "Infinity", "NaN"];

/// Returns the word of [`NOT_NUMBERS`] that follows a key.
fn bare_word(message: &[u8], name: &str) -> Option<&'static str> {
    let text = std::str::from_utf8(message).ok()?;
    let key = serde_json::Value::from(name).to_string();
    let behind = text.split_once(&key)?.1.trim_start();
    let value = behind.strip_prefix(':')?.trim_start();
    NOT_NUMBERS.into_iter().find(|word| value.starts_with(word))
}

/// Returns the message with `null` for NaN and Infinity outside strings; `None` if it contains none.
pub(super) fn without_nan(message: &[u8]) -> Option<Vec<u8>> {
    let mut plain = Vec::with_capacity(message.len());
    let (mut quoted, mut changed) = (false, false);
    let mut rest = message;
    while let Some(&byte) = rest.first() {
        let word = NOT_NUMBERS
            .iter()
            .find(|word| !quoted && rest.starts_with(word.as_bytes()));
        if let Some(word) = word {
            plain.extend_from_slice(b"null");
            rest = &rest[word.len()..];
            changed = true;
            continue;
        }
        // A character after a backslash does not end a string.
        let count = if quoted && byte == b'\\' { 2 } else { 1 };
        quoted ^= byte == b'"';
        let (taken, behind) = rest.split_at(count.min(rest.len()));
        plain.extend_from_slice(taken);
        rest = behind;
    }
    changed.then_some(plain)
}

/// Returns the keys of a message in order.
fn keys(message: &[u8]) -> Result<Vec<String>, String> {
    let plain = without_nan(message);
    let mut parser = serde_json::Deserializer::from_slice(plain.as_deref().unwrap_or(message));
    let read = parser.deserialize_map(Names).and_then(|names| {
        parser.end()?;
        Ok(names)
    });
    read.map_err(|e| format!("is no JSON object of numbers ({e})"))
}

/// Visitor for the keys of an object in order.
struct Names;

impl<'de> Visitor<'de> for Names {
    type Value = Vec<String>;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("an object of numbers")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let mut names = Vec::new();
        while let Some((name, IgnoredAny)) = map.next_entry::<String, IgnoredAny>()? {
            names.push(name);
        }
        Ok(names)
    }
}

/// Visitor that fills `values` by name; keys nearly always have the order of the first message.
struct Fields<'a> {
    names: &'a [String],
    values: &'a mut [f64],
    found: &'a mut usize,
}

impl<'de> DeserializeSeed<'de> for Fields<'_> {
    type Value = ();
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for Fields<'_> {
    type Value = ();

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("an object of numbers")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        while let Some(index) = map.next_key_seed(Key {
            names: self.names,
            next: *self.found,
        })? {
            let value: Number = map.next_value()?;
            if let Some(slot) = self.values.get_mut(index) {
                *slot = value.0;
            }
            *self.found += 1;
        }
        Ok(())
    }
}

/// Visitor for the index of a key among the names.
struct Key<'a> {
    names: &'a [String],
    next: usize,
}

impl<'de> DeserializeSeed<'de> for Key<'_> {
    type Value = usize;
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<usize, D::Error> {
        deserializer.deserialize_str(self)
    }
}

impl Visitor<'_> for Key<'_> {
    type Value = usize;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a key of the first message")
    }

    fn visit_str<E: serde::de::Error>(self, key: &str) -> Result<usize, E> {
        if self.names.get(self.next).is_some_and(|n| n == key) {
            return Ok(self.next);
        }
        let index = self.names.iter().position(|n| n == key);
        index.ok_or_else(|| E::custom(format!("unknown key `{key}`")))
    }
}

/// A number; other values (null, text) count as NaN, and the column decides whether NaN is allowed.
#[derive(serde::Deserialize)]
#[serde(from = "Maybe")]
struct Number(f64);

#[derive(serde::Deserialize)]
#[serde(untagged)]
enum Maybe {
    Number(f64),
    Other(IgnoredAny),
}

impl From<Maybe> for Number {
    fn from(value: Maybe) -> Self {
        match value {
            Maybe::Number(v) => Self(v),
            Maybe::Other(_) => Self(f64::NAN),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn samples() -> JsonSamples {
        JsonSamples::new(br#"{"t":0,"i1":NaN,"note":1}"#).unwrap()
    }

    #[test]
    fn words_that_are_no_json_are_numbers_that_are_none() {
        let samples = samples();
        assert_eq!(samples.names(), ["t", "i1", "note"]);
        let mut values = [0.0; 3];
        for (word, shown) in [
            ("NaN", "NaN"),
            ("-Infinity", "-Infinity"),
            ("Infinity", "Infinity"),
            ("null", "null"),
            ("\"x NaN\"", "\"x NaN\""),
            ("[1]", "[1]"),
        ] {
            let message = format!("{{\"note\": 2, \"i1\": {word}, \"t\": 1}}");
            samples.read(message.as_bytes(), &mut values).unwrap();
            assert!(values[0] == 1.0 && values[1].is_nan() && values[2] == 2.0);
            assert_eq!(written(message.as_bytes(), "i1"), shown);
        }
    }

    #[test]
    fn a_message_unlike_the_first_says_what_differs() {
        let samples = samples();
        let mut values = [0.0; 3];
        for (message, words) in [
            (r#"{"t":1,"note":1}"#, "has no key `i1`"),
            (
                r#"{"t":1,"i1":1,"note":1,"on":1}"#,
                "message 1 has not: `on`",
            ),
            (
                r#"{"t":1,"i2":1,"note":1}"#,
                "`i1` and has a key that message 1 has not: `i2`",
            ),
            (r#"{"t":1,"i1":1,"i1":2,"note":1}"#, "twice: `i1`"),
            (r#"{"t":1,"i1":1,"note":"#, "no JSON object"),
            (r#"[1,2,3]"#, "no JSON object"),
            (r#"{"t":1,"i1":1,"note":1} {}"#, "no JSON object"),
        ] {
            let error = samples.read(message.as_bytes(), &mut values).unwrap_err();
            assert!(error.contains(words), "{message}: {error}");
        }
    }
}
