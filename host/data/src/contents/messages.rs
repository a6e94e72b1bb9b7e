//! Reads the channels of MCAP files, of every topic whose messages can be decoded.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::topic::{Channel, TimeSource, Topic};
use crate::decoder::decoder;
use crate::error::DataError;
use crate::flat_message::{Decoder, FlatMessage};
use crate::mcap_messages::{Event, Messages};
use crate::mcap_rows::TOPIC;

/// What the files hold.
pub(super) struct Bag {
    pub topics: Vec<Topic>,
    pub remarks: Vec<String>,
    pub faults: Vec<String>,
}

/// Number of channels of a topic above which further ones are left out.
const MOST_CHANNELS: usize = 2048;

/// A topic while it is read.
struct Scan {
    topic: Topic,
    decoder: Result<Decoder, String>,
    flat: FlatMessage,
    /// Channel of each value of a message.
    slots: Vec<usize>,
    values: Vec<f64>,
    /// True if the messages carry their own stamp.
    is_stamped: bool,
    /// Place of the time among the values of a sample of the own kind.
    own_time: Option<usize>,
    /// Number of messages that cannot be read, and the reason for the first.
    broken: Option<(u64, u64, String)>,
}

/// First stamp and first log time of all topics.
#[derive(Default)]
struct Origins {
    stamp: Option<(i64, i64)>,
    log: Option<u64>,
}

/// Reads all messages; `advance` takes the bytes read so far.
pub(super) fn messages(
    path: &Path,
    files: &[PathBuf],
    advance: &mut dyn FnMut(u64),
) -> Result<Bag, DataError> {
    let mut reader = Messages::open(files)?;
    let mut scans: Vec<Scan> = Vec::new();
    let mut of_channel: BTreeMap<usize, usize> = BTreeMap::new();
    let mut origins = Origins::default();
    let mut damage = None;
    let mut count = 0u64;
    loop {
        let event = match reader.next_event() {
            Ok(event) => event,
            // What was read before is shown.
            Err(error @ DataError::Mcap { .. }) => {
                damage = Some(error.to_string());
                break;
            }
            Err(error) => return Err(error),
        };
        match event {
            None => break,
            Some(Event::Channel(number, channel)) => {
                let known = scans.iter().position(|s| s.topic.name == channel.topic);
                let at = known.unwrap_or(scans.len());
                if known.is_none() {
                    scans.push(Scan::new(channel));
                }
                of_channel.insert(number, at);
            }
            Some(Event::Message {
                channel,
                log_time,
                data,
            }) => {
                if let Some(scan) = of_channel.get(&channel).and_then(|k| scans.get_mut(*k)) {
                    scan.add(data, log_time, &mut origins);
                }
                count += 1;
                if count.is_multiple_of(4096) {
                    advance(reader.bytes_read());
                }
            }
        }
    }
    let mut bag = Bag {
        topics: Vec::new(),
        remarks: origins.remarks(),
        faults: damage.into_iter().collect(),
    };
    for (file, broken) in reader.broken() {
        let name = if file == path {
            "the file".to_owned()
        } else {
            file.display().to_string()
        };
        bag.faults.push(format!(
            "{name} breaks off at byte {}: {}.",
            broken.at, broken.lost
        ));
    }
    for scan in scans {
        bag.faults.extend(scan.fault());
        bag.topics.push(scan.finish());
    }
    Ok(bag)
}

impl Scan {
    fn new(channel: &crate::channel::Channel) -> Self {
        let decoder = decoder(channel);
        Self {
            topic: Topic {
                name: channel.topic.clone(),
                of: match &channel.schema {
                    Some(schema) => schema.name.clone(),
                    None => channel.encoding.clone(),
                },
                unreadable: decoder.as_ref().err().cloned(),
                ..Topic::default()
            },
            decoder,
            flat: FlatMessage::default(),
            slots: Vec::new(),
            values: Vec::new(),
            is_stamped: false,
            own_time: None,
            broken: None,
        }
    }

    fn add(&mut self, message: &[u8], log_time: u64, origins: &mut Origins) {
        let number = self.topic.rows + 1;
        let read = match &self.decoder {
            Ok(decoder) => self.flat.read(message, decoder),
            Err(_) => Ok(false),
        };
        let is_read = match read {
            Ok(is_new) => {
                if is_new {
                    self.find_slots();
                }
                true
            }
            Err(why) => {
                let broken = self.broken.get_or_insert((0, number, why));
                broken.0 += 1;
                false
            }
        };
        if number == 1 {
            self.is_stamped = is_read && self.flat.stamp.is_some_and(|stamp| stamp != (0, 0));
            self.topic.time.source = match (self.own_time, self.is_stamped) {
                (Some(_), _) => TimeSource::Key,
                (None, true) => TimeSource::HeaderStamp,
                (None, false) => TimeSource::LogTime,
            };
        }
        let own_time = (self.own_time.filter(|_| is_read)).and_then(|k| self.flat.values.get(k));
        let t = match (self.is_stamped, is_read) {
            _ if self.own_time.is_some() => own_time.copied().unwrap_or(f64::NAN),
            (true, true) => origins.of_stamp(self.flat.stamp.unwrap_or_default()),
            (true, false) => f64::NAN,
            _ => origins.of_log(log_time),
        };
        self.values.fill(f64::NAN);
        if is_read && self.decoder.is_ok() {
            for (slot, value) in self.slots.iter().zip(&self.flat.values) {
                if let Some(place) = self.values.get_mut(*slot) {
                    *place = *value;
                }
            }
        }
        self.topic.add(t, &self.values);
    }

    /// Finds the channel of each value; adds channels that are new.
    fn find_slots(&mut self) {
        let channels = &mut self.topic.channels;
        let mut known: BTreeMap<String, usize> = (channels.iter().enumerate())
            .map(|(k, channel)| (channel.name.clone(), k))
            .collect();
        self.slots.clear();
        // A sample of the own kind has its time in it.
        let is_own = self.topic.name == TOPIC;
        self.own_time = (self.flat.names.iter().position(|name| name == "t")).filter(|_| is_own);
        for (name, stem) in self.flat.names.iter().zip(&self.flat.stems) {
            let slot = known.get(name).copied().unwrap_or(channels.len());
            if slot == channels.len() && slot < MOST_CHANNELS {
                known.insert(name.clone(), slot);
                channels.push(Channel::of_message(name.clone(), stem, self.topic.rows));
            }
            self.slots.push(slot);
        }
        self.values.resize(channels.len(), f64::NAN);
    }

    fn fault(&self) -> Option<String> {
        let (count, first, why) = self.broken.as_ref()?;
        Some(format!(
            "{count} messages on {} cannot be read; the first is message {first}, which {why}.",
            self.topic.name
        ))
    }

    fn finish(mut self) -> Topic {
        self.topic.time.finish();
        self.topic
    }
}

impl Origins {
    fn of_stamp(&mut self, stamp: (i64, i64)) -> f64 {
        let origin = *self.stamp.get_or_insert(stamp);
        stamp.0.wrapping_sub(origin.0) as f64 + (stamp.1 - origin.1) as f64 * 1e-9
    }

    fn of_log(&mut self, time: u64) -> f64 {
        let origin = *self.log.get_or_insert(time);
        // Exact before the division: differences of a recording are below 2⁵³ ns, which is 104 days.
        (i128::from(time) - i128::from(origin)) as f64 * 1e-9
    }

    fn remarks(&self) -> Vec<String> {
        let stamp = self.stamp.map(|(seconds, nanoseconds)| {
            format!("header stamps are counted from {seconds}.{nanoseconds:09} s, the first one.")
        });
        let log = self.log.map(|ns| {
            let (seconds, rest) = (ns / 1_000_000_000, ns % 1_000_000_000);
            format!("log times are counted from {seconds}.{rest:09} s, the first one.")
        });
        stamp.into_iter().chain(log).collect()
    }
}
