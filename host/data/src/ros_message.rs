//! Reads one joint state from the bytes of a ROS message, or from its JSON.

use serde::Deserialize;

use super::binary_number::BinaryNumber;
use super::ros_layout::{Count, Field, Kind, Part};

/// Binary encoding of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    /// ROS 2: CDR, whose first four bytes name the variant.
    Cdr,
    /// ROS 1: little-endian without gaps.
    Ros1,
    /// The fields of the message as JSON, as bridges to web tools record them.
    Json,
}

/// A joint state as JSON; the parts of the time are named as in ROS 2, by Foxglove or as in ROS 1.
#[derive(Deserialize)]
struct JsonState {
    #[serde(default)]
    header: JsonHeader,
    name: Vec<String>,
    #[serde(default)]
    position: Vec<Option<f64>>,
    #[serde(default)]
    velocity: Vec<Option<f64>>,
    #[serde(default)]
    effort: Vec<Option<f64>>,
}

#[derive(Default, Deserialize)]
struct JsonHeader {
    #[serde(default)]
    stamp: JsonTime,
}

#[derive(Default, Deserialize)]
struct JsonTime {
    #[serde(default, alias = "secs")]
    sec: i64,
    #[serde(default, alias = "nsec", alias = "nsecs")]
    nanosec: u32,
}

/// Returns the encoding of messages by its name in an MCAP file.
pub(super) fn ros_encoding(name: &str) -> Option<Encoding> {
    match name {
        "cdr" => Some(Encoding::Cdr),
        "ros1" => Some(Encoding::Ros1),
        _ => None,
    }
}

/// A joint state; reused from message to message.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct JointSample {
    /// Header stamp, whole seconds and nanoseconds.
    pub seconds: i64,
    pub nanoseconds: i64,
    /// The joined names, and the end of each.
    pub names: Vec<u8>,
    pub ends: Vec<usize>,
    pub position: Vec<f64>,
    pub velocity: Vec<f64>,
    pub effort: Vec<f64>,
}

impl JointSample {
    /// Reads a message.
    ///
    /// # Errors
    /// The reason why it cannot be read, one clause.
    pub(super) fn read(
        &mut self,
        message: &[u8],
        fields: &[Field],
        encoding: Encoding,
    ) -> Result<(), String> {
        (self.seconds, self.nanoseconds) = (0, 0);
        self.names.clear();
        self.ends.clear();
        for list in [&mut self.position, &mut self.velocity, &mut self.effort] {
            list.clear();
        }
        if encoding == Encoding::Json {
            return self.read_json(message);
        }
        let mut cursor = Cursor::new(message, encoding)?;
        self.walk(&mut cursor, fields)
            .ok_or_else(|| "ends in the middle of a field".to_owned())
    }

    fn read_json(&mut self, message: &[u8]) -> Result<(), String> {
        let state: JsonState = serde_json::from_slice(message)
            .map_err(|error| format!("is no joint state in JSON: {error}"))?;
        let JsonTime { sec, nanosec } = state.header.stamp;
        (self.seconds, self.nanoseconds) = (sec, i64::from(nanosec));
        for name in &state.name {
            self.names.extend_from_slice(name.as_bytes());
            self.ends.push(self.names.len());
        }
        let lists = [
            (&mut self.position, state.position),
            (&mut self.velocity, state.velocity),
            (&mut self.effort, state.effort),
        ];
        for (list, values) in lists {
            // JSON has no NaN; writers put null in its place.
            list.extend(values.into_iter().map(|value| value.unwrap_or(f64::NAN)));
        }
        Ok(())
    }

    /// Returns the names in order.
    pub(super) fn names(&self) -> impl Iterator<Item = &[u8]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts
            .zip(&self.ends)
            .map(|(start, end)| self.names.get(start..*end).unwrap_or_default())
    }

    /// Reads the fields; returns `None` if the message is too short.
    fn walk(&mut self, cursor: &mut Cursor, fields: &[Field]) -> Option<()> {
        for field in fields {
            let count = match field.count {
                Count::One => 1,
                Count::Fixed(count) => count,
                Count::Counted => cursor.count()?,
            };
            // Every element takes at least one byte; a damaged count must not loop forever.
            if count > cursor.left() {
                return None;
            }
            match &field.kind {
                Kind::Number(number) if field.part == Part::None => cursor.pass(*number, count)?,
                Kind::Number(number) => {
                    for _ in 0..count {
                        let value = cursor.number(*number)?;
                        self.keep(field.part, value);
                    }
                }
                Kind::Text => {
                    for _ in 0..count {
                        let text = cursor.text()?;
                        if field.part == Part::Name {
                            self.names.extend_from_slice(text);
                            self.ends.push(self.names.len());
                        }
                    }
                }
                Kind::Nested(inner) => {
                    for _ in 0..count {
                        self.walk(cursor, inner)?;
                    }
                }
            }
        }
        Some(())
    }

    fn keep(&mut self, part: Part, value: f64) {
        match part {
            // Whole numbers below 2³² are exact.
            Part::Seconds => self.seconds = value as i64,
            Part::Nanoseconds => self.nanoseconds = value as i64,
            Part::Position => self.position.push(value),
            Part::Velocity => self.velocity.push(value),
            Part::Effort => self.effort.push(value),
            Part::None | Part::Header | Part::Name => {}
        }
    }
}

/// A position in a message.
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    is_big_endian: bool,
    /// Largest alignment, bytes.
    alignment: usize,
    encoding: Encoding,
}

impl<'a> Cursor<'a> {
    pub(super) fn new(message: &'a [u8], encoding: Encoding) -> Result<Self, String> {
        let cursor = |bytes, is_big_endian, alignment| Self {
            bytes,
            at: 0,
            is_big_endian,
            alignment,
            encoding,
        };
        if encoding == Encoding::Ros1 {
            return Ok(cursor(message, false, 1));
        }
        let (Some(kind), Some(bytes)) = (message.first_chunk::<2>(), message.get(4..)) else {
            return Err("is shorter than the four bytes that CDR begins with".into());
        };
        match kind {
            [0, 0] => Ok(cursor(bytes, true, 8)),
            [0, 1] => Ok(cursor(bytes, false, 8)),
            // Version 2 aligns to four bytes at most.
            [0, 6] => Ok(cursor(bytes, true, 4)),
            [0, 7] => Ok(cursor(bytes, false, 4)),
            [a, b] => Err(format!(
                "is in a form of CDR that cannot be read (0x{a:02x}{b:02x}; plain CDR is 0x0000, 0x0001, 0x0006 and 0x0007)"
            )),
        }
    }

    pub(super) fn left(&self) -> usize {
        self.bytes.len().saturating_sub(self.at)
    }

    fn align(&mut self, size: usize) {
        self.at = self.at.next_multiple_of(size.min(self.alignment).max(1));
    }

    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let end = self.at.checked_add(count)?;
        let taken = self.bytes.get(self.at..end)?;
        self.at = end;
        Some(taken)
    }

    pub(super) fn pass(&mut self, number: BinaryNumber, count: usize) -> Option<()> {
        if count > 0 {
            self.align(number.size());
            self.take(number.size().checked_mul(count)?)?;
        }
        Some(())
    }

    pub(super) fn number(&mut self, number: BinaryNumber) -> Option<f64> {
        let size = number.size();
        self.align(size);
        let is_big_endian = self.is_big_endian;
        Some(number.value(self.take(size)?, is_big_endian))
    }

    pub(super) fn count(&mut self) -> Option<usize> {
        Some(self.number(BinaryNumber::Unsigned(4))? as usize)
    }

    pub(super) fn text(&mut self) -> Option<&'a [u8]> {
        let count = self.count()?;
        let text = self.take(count)?;
        // CDR counts the terminating zero.
        Some(match (self.encoding, text.split_last()) {
            (Encoding::Cdr, Some((0, text))) => text,
            _ => text,
        })
    }
}
