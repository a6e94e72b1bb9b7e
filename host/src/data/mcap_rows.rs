//! MCAP: one JSON message per sample on `/joint/state`, read record by record.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use ::mcap::McapError;
use ::mcap::records::{Record, op};
use ::mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use serde::de::{DeserializeSeed, Deserializer, IgnoredAny, MapAccess, Visitor};

use super::columns::Layout;
use super::error::DataError;

/// Topic of the joint samples.
pub(super) const TOPIC: &str = "/joint/state";

/// First bytes of every MCAP file.
pub(super) const MAGIC: [u8; 5] = *b"\x89MCAP";

/// Longest record that is read: a damaged length must not ask for all memory.
const LONGEST_RECORD: usize = 16 << 20;

/// Rows of an MCAP file in the order of the file.
pub(super) struct McapRows {
    path: PathBuf,
    file: BufReader<File>,
    reader: LinearReader,
    /// Topics by channel, with their message encoding.
    channels: BTreeMap<u16, (String, String)>,
    message: Vec<u8>,
    number: u64,
    bytes: u64,
    /// Column names in the order of the first message.
    names: Vec<String>,
    /// Whether `message` holds the first message, read for its names.
    waiting: bool,
}

impl McapRows {
    /// Opens the file and takes the column names from the first message.
    pub(super) fn open(path: &Path) -> Result<(Self, Vec<String>), DataError> {
        let file = File::open(path).map_err(|source| DataError::Read {
            path: path.into(),
            source,
        })?;
        let options = LinearReaderOptions::default()
            .with_validate_chunk_crcs(true)
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true)
            .with_record_length_limit(LONGEST_RECORD);
        let mut rows = Self {
            path: path.into(),
            file: BufReader::with_capacity(1 << 17, file),
            reader: LinearReader::new_with_options(options),
            channels: BTreeMap::new(),
            message: Vec::new(),
            number: 0,
            bytes: 0,
            names: Vec::new(),
            waiting: false,
        };
        if !rows.next_message()? {
            let topics: Vec<&str> = rows.channels.values().map(|(t, _)| t.as_str()).collect();
            let there = if topics.is_empty() {
                "it has no channel".to_owned()
            } else {
                format!("its topics are {}", topics.join(", "))
            };
            return Err(rows.error(format!("there is no message on topic {TOPIC}; {there}, and a recording has one JSON message per sample on {TOPIC}")));
        }
        let mut parser = serde_json::Deserializer::from_slice(&rows.message);
        rows.names = parser
            .deserialize_map(Names)
            .map_err(|e| rows.error(format!("message 1 on {TOPIC} is not a JSON object of numbers ({e}); a sample looks like {{\"t\":0.0,\"q1\":0.1,\"tau1\":2.5}}")))?;
        rows.waiting = true;
        let names = rows.names.clone();
        Ok((rows, names))
    }

    pub(super) fn bytes_read(&self) -> u64 {
        self.bytes
    }

    fn error(&self, message: String) -> DataError {
        DataError::Mcap {
            path: self.path.clone(),
            message,
        }
    }

    fn damaged(&self, error: &McapError) -> DataError {
        let said = error.to_string();
        let said = said
            .lines()
            .next()
            .unwrap_or_default()
            .trim_end_matches('.');
        self.error(format!("the MCAP file is damaged or was cut off near byte {} ({said}); record it again or recover it with the mcap tool", self.bytes))
    }

    /// Puts the next message of the topic into `self.message`; false at the end of the file.
    fn next_message(&mut self) -> Result<bool, DataError> {
        loop {
            let event = match self.reader.next_event() {
                None => return Ok(false),
                Some(Err(e)) => return Err(self.damaged(&e)),
                Some(Ok(event)) => event,
            };
            match event {
                LinearReadEvent::ReadRequest(wanted) => {
                    // What the reader asks for stems from the file: never more than a buffer at once.
                    let wanted = wanted.min(1 << 16);
                    let read = self
                        .file
                        .read(self.reader.insert(wanted))
                        .map_err(|source| DataError::Read {
                            path: self.path.clone(),
                            source,
                        })?;
                    self.reader.notify_read(read);
                    self.bytes += read as u64;
                }
                LinearReadEvent::Record { data, opcode } => {
                    if !matches!(opcode, op::CHANNEL | op::MESSAGE) {
                        continue;
                    }
                    match ::mcap::parse_record(opcode, data) {
                        Ok(Record::Channel(c)) => {
                            self.channels.insert(c.id, (c.topic, c.message_encoding));
                        }
                        Ok(Record::Message { header, data }) => {
                            match self.channels.get(&header.channel_id) {
                                Some((topic, encoding)) if topic == TOPIC => {
                                    if encoding != "json" {
                                        let message = format!(
                                            "the messages on {TOPIC} are encoded as \"{encoding}\", but only \"json\" can be read; export the recording as JSON or CSV"
                                        );
                                        return Err(self.error(message));
                                    }
                                    self.message.clear();
                                    self.message.extend_from_slice(&data);
                                    self.number += 1;
                                    return Ok(true);
                                }
                                _ => {}
                            }
                        }
                        Ok(_) => {}
                        Err(e) => return Err(self.damaged(&e)),
                    }
                }
            }
        }
    }

    /// Reads the next message into `values`, one per column; gives its number, or none at the end.
    pub(super) fn next_row(
        &mut self,
        layout: &Layout,
        values: &mut [f64],
    ) -> Result<Option<u64>, DataError> {
        if !std::mem::take(&mut self.waiting) && !self.next_message()? {
            return Ok(None);
        }
        values.fill(f64::NAN);
        let mut found = 0;
        let seed = Fields {
            names: &self.names,
            values,
            found: &mut found,
        };
        let mut parser = serde_json::Deserializer::from_slice(&self.message);
        let read = seed.deserialize(&mut parser).and_then(|()| parser.end());
        if let Err(e) = read {
            return Err(self.error(format!("message {} on {TOPIC} is not like the first ({e}); every message must be a JSON object with the same keys", self.number)));
        }
        if found != layout.columns.len() {
            return Err(DataError::FieldCount {
                path: self.path.clone(),
                line: self.number,
                found,
                expected: layout.columns.len(),
                hint: "every message must have the keys of the first".into(),
            });
        }
        for (value, column) in values.iter().zip(&layout.columns) {
            if column.strict && !value.is_finite() {
                return Err(DataError::NotANumber {
                    path: self.path.clone(),
                    line: self.number,
                    column: column.name.clone(),
                    found: "no number".into(),
                });
            }
        }
        Ok(Some(self.number))
    }
}

/// The keys of an object in their order.
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

/// Fills `values` by name; keys nearly always come in the order of the first message.
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

/// Index of a key among the names.
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

/// A number; anything else (JSON has no NaN: null, text) counts as NaN, and the column decides.
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
