//! Chosen channels of one topic, message by message.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::clock::{Clock, UNWANTED};
use super::decoder::decoder;
use super::error::DataError;
use super::flat_message::{Decoder, FlatMessage};
use super::mcap_messages::{Event, Messages};
use super::mcap_records::Break;

/// Nanoseconds of one second.
const SECOND: i128 = 1_000_000_000;

/// Returns a time in seconds and nanoseconds as one whole number of nanoseconds.
pub(super) fn in_nanoseconds((seconds, nanoseconds): (i64, i64)) -> i128 {
    i128::from(seconds) * SECOND + i128::from(nanoseconds)
}

/// Reader of channels of one topic.
pub(super) struct FlatRows {
    path: PathBuf,
    topic: String,
    messages: Messages,
    /// Decoder of each channel of the file that belongs to the topic.
    decoders: BTreeMap<usize, Decoder>,
    /// Channels in the order of the values.
    wanted: Vec<String>,
    /// Place of each of them in a message.
    slots: Vec<usize>,
    flat: FlatMessage,
    /// Values of the last message.
    pub values: Vec<f64>,
    /// Number of the last message on the topic, from 1.
    pub number: u64,
    /// Time of the last message, ns.
    pub time: i128,
    /// True if the time of a message is its header stamp, otherwise its log time.
    pub is_stamped: bool,
    /// Why it is not, if it is not.
    pub why_logged: &'static str,
    clock: Clock,
}

impl FlatRows {
    /// Opens the files of a recording for the channels `wanted` of a topic. Its time is the header stamp if the first message
    /// has one and `clock` is that of the stamps, otherwise the log time.
    pub(super) fn open(
        path: &Path,
        files: &[PathBuf],
        topic: &str,
        wanted: Vec<String>,
        clock: Clock,
    ) -> Result<Self, DataError> {
        Ok(Self {
            path: path.into(),
            topic: topic.to_owned(),
            messages: Messages::open(files)?,
            decoders: BTreeMap::new(),
            slots: Vec::new(),
            flat: FlatMessage::default(),
            values: vec![f64::NAN; wanted.len()],
            wanted,
            number: 0,
            time: 0,
            is_stamped: true,
            why_logged: "",
            clock,
        })
    }

    /// Returns the topic.
    pub(super) fn topic(&self) -> &str {
        &self.topic
    }

    pub(super) fn bytes_read(&self) -> u64 {
        self.messages.bytes_read()
    }

    /// Returns the places where files end too early, so far.
    pub(super) fn broken(&self) -> Vec<(PathBuf, Break)> {
        self.messages.broken()
    }

    fn error(&self, message: String) -> DataError {
        DataError::Mcap {
            path: self.path.clone(),
            message,
        }
    }

    /// Reads the next message of the topic; returns its time in ns, or `None` at the end.
    pub(super) fn next_time(&mut self) -> Result<Option<i128>, DataError> {
        loop {
            match self.messages.next_event()? {
                None => return Ok(None),
                Some(Event::Channel(number, channel)) if channel.topic == self.topic => {
                    match decoder(channel) {
                        Ok(decoder) => self.decoders.insert(number, decoder),
                        Err(why) => {
                            let topic = &self.topic;
                            return Err(self.error(format!("topic {topic} cannot be read: {why}")));
                        }
                    };
                }
                Some(Event::Channel(..)) => {}
                Some(Event::Message {
                    channel,
                    log_time,
                    data,
                }) => {
                    let Some(decoder) = self.decoders.get(&channel) else {
                        continue;
                    };
                    self.number += 1;
                    let read = self.flat.read(data, decoder);
                    self.time = self.take(read, log_time)?;
                    return Ok(Some(self.time));
                }
            }
        }
    }

    /// Takes the values of a message; returns its time.
    fn take(&mut self, read: Result<bool, String>, log_time: u64) -> Result<i128, DataError> {
        let (number, topic) = (self.number, &self.topic);
        let is_new =
            read.map_err(|why| self.error(format!("message {number} on {topic} {why}")))?;
        if is_new || self.slots.is_empty() {
            self.slots.clear();
            for name in &self.wanted {
                let Some(slot) = self.flat.names.iter().position(|own| own == name) else {
                    return Err(self.error(format!(
                        "message {number} on {topic} has no channel {name}; it has {}",
                        super::columns::shown(&self.flat.names)
                    )));
                };
                self.slots.push(slot);
            }
        }
        for (value, slot) in self.values.iter_mut().zip(&self.slots) {
            *value = self.flat.values.get(*slot).copied().unwrap_or(f64::NAN);
        }
        let stamp = self.flat.stamp.filter(|stamp| *stamp != (0, 0));
        if number == 1 {
            self.is_stamped = stamp.is_some() && self.clock == Clock::Stamp;
            self.why_logged = match self.flat.stamp {
                None => "is missing",
                Some((0, 0)) => "is zero",
                Some(_) => UNWANTED,
            };
        }
        match (self.is_stamped, stamp) {
            (true, Some(stamp)) => Ok(in_nanoseconds(stamp)),
            (true, None) => Err(self.error(format!(
                "message {number} on {topic} has no header stamp, but the first one has; record it again with a driver that stamps every message"
            ))),
            (false, _) => Ok(i128::from(log_time)),
        }
    }
}
