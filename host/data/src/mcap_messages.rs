//! Messages of MCAP and SQLite files with their channels; the files of a bag are read one after the other.

use std::collections::{BTreeMap, VecDeque};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use ::mcap::records::{Record, op};

use super::bag_table::BagTable;
use super::channel::{Channel, Schema};
use super::error::DataError;
use super::mcap_index::disorder;
use super::mcap_records::{Break, Records};
use super::mcap_sorted::SortedRecords;
use super::remark::Remark;
use super::sqlite;

/// Returns a remark for each file of a recording that ends too early, after these messages with the last at this time, s.
pub(super) fn cut_off(
    recording: &Path,
    broken: Vec<(PathBuf, Break)>,
    (messages, until): (u64, f64),
) -> Vec<Remark> {
    let remark = |(file, broken): (PathBuf, Break)| Remark::CutOff {
        file: (file.file_name())
            .filter(|_| file != recording)
            .map(|name| name.to_string_lossy().into_owned()),
        at: broken.at,
        messages,
        until,
        lost: broken.lost,
    };
    broken.into_iter().map(remark).collect()
}

/// The next part of a file.
pub(super) enum Event<'a> {
    /// A channel begins; its messages have this number.
    Channel(usize, &'a Channel),
    /// A message of a channel that began before.
    Message {
        /// Number of the channel.
        channel: usize,
        /// Time at which the recorder logged it, ns.
        log_time: u64,
        data: &'a [u8],
    },
}

/// Reader of one or more files.
pub(super) struct Messages {
    path: PathBuf,
    file: OneFile,
    /// Channels of this file that were not returned yet.
    waiting: VecDeque<usize>,
    /// Files that are not read yet.
    rest: VecDeque<PathBuf>,
    /// Bytes of the files that were read.
    before: u64,
    schemas: BTreeMap<u16, Schema>,
    /// Number of each channel of this file, by its number in MCAP.
    numbers: BTreeMap<u16, usize>,
    /// The same by its number in SQLite.
    stored: BTreeMap<i64, usize>,
    channels: Vec<Channel>,
    data: Vec<u8>,
    /// Files that end too early, other than the current one.
    broken: Vec<(PathBuf, Break)>,
}

/// The file that is read.
enum OneFile {
    Mcap(Box<Records>),
    Sorted(Box<SortedRecords>),
    Sqlite(Box<BagTable>),
}

impl OneFile {
    /// Opens a file by its first bytes.
    fn open(path: &Path) -> Result<Self, DataError> {
        let mut start = Vec::new();
        let file = File::open(path).map_err(|source| DataError::Read {
            path: path.into(),
            source,
        })?;
        let read = file
            .take(sqlite::MAGIC.len() as u64)
            .read_to_end(&mut start);
        Ok(match read.is_ok() && start == sqlite::MAGIC {
            true => Self::Sqlite(Box::new(BagTable::open(path)?)),
            false => match disorder(path) {
                Some(index) => Self::Sorted(Box::new(SortedRecords::open(path, index)?)),
                None => Self::Mcap(Box::new(Records::open(path)?)),
            },
        })
    }

    fn bytes_read(&self) -> u64 {
        match self {
            Self::Mcap(records) => records.bytes_read(),
            Self::Sorted(records) => records.bytes_read(),
            Self::Sqlite(table) => table.bytes_read(),
        }
    }

    fn broken(&self) -> Option<Break> {
        match self {
            Self::Mcap(records) => records.broken(),
            Self::Sorted(_) | Self::Sqlite(_) => None,
        }
    }
}

/// What a record holds, before its data is lent.
enum Found {
    Nothing,
    Channel(usize),
    Message(usize, u64),
}

impl Messages {
    /// Opens files that start with [`super::mcap_records::MAGIC`], in this order.
    pub(super) fn open(files: &[PathBuf]) -> Result<Self, DataError> {
        let mut rest: VecDeque<PathBuf> = files.iter().cloned().collect();
        let path = rest.pop_front().unwrap_or_default();
        let mut messages = Self {
            file: OneFile::open(&path)?,
            waiting: VecDeque::new(),
            path,
            rest,
            before: 0,
            schemas: BTreeMap::new(),
            numbers: BTreeMap::new(),
            stored: BTreeMap::new(),
            channels: Vec::new(),
            data: Vec::new(),
            broken: Vec::new(),
        };
        messages.begin();
        Ok(messages)
    }

    /// Takes the channels that stand at the start of the file.
    fn begin(&mut self) {
        let OneFile::Sqlite(table) = &self.file else {
            return;
        };
        for (id, channel) in table.channels() {
            self.waiting.push_back(self.channels.len());
            self.stored.insert(*id, self.channels.len());
            self.channels.push(channel.clone());
        }
    }

    /// Returns the number of bytes read so far.
    pub(super) fn bytes_read(&self) -> u64 {
        self.before + self.file.bytes_read()
    }

    /// Returns the places where files end too early, so far.
    pub(super) fn broken(&self) -> Vec<(PathBuf, Break)> {
        let own = self.file.broken().map(|b| (self.path.clone(), b));
        self.broken.iter().cloned().chain(own).collect()
    }

    /// Returns the next channel or message; `None` behind the last one.
    pub(super) fn next_event(&mut self) -> Result<Option<Event<'_>>, DataError> {
        loop {
            match self.advance()? {
                None => return Ok(None),
                Some(Found::Nothing) => {}
                Some(Found::Channel(number)) => {
                    return Ok(Some(Event::Channel(number, &self.channels[number])));
                }
                Some(Found::Message(channel, log_time)) => {
                    let data = &self.data;
                    return Ok(Some(Event::Message {
                        channel,
                        log_time,
                        data,
                    }));
                }
            }
        }
    }

    fn advance(&mut self) -> Result<Option<Found>, DataError> {
        if let Some(number) = self.waiting.pop_front() {
            return Ok(Some(Found::Channel(number)));
        }
        let record = match &mut self.file {
            OneFile::Mcap(records) => records.next_record()?,
            OneFile::Sorted(records) => records.next_record()?,
            OneFile::Sqlite(table) => {
                return match table.next_message()? {
                    None => self.next_file(),
                    Some(message) => Ok(Some(match self.stored.get(&message.topic) {
                        None => Found::Nothing,
                        Some(channel) => {
                            self.data.clear();
                            self.data.extend_from_slice(&message.data);
                            Found::Message(*channel, message.time)
                        }
                    })),
                };
            }
        };
        let Some((code, body)) = record else {
            return self.next_file();
        };
        if !matches!(code, op::SCHEMA | op::CHANNEL | op::MESSAGE) {
            return Ok(Some(Found::Nothing));
        }
        Ok(Some(match ::mcap::parse_record(code, body) {
            Ok(Record::Schema { header, data }) => {
                let schema = Schema {
                    name: header.name,
                    encoding: header.encoding,
                    text: String::from_utf8_lossy(&data).into_owned(),
                };
                self.schemas.insert(header.id, schema);
                Found::Nothing
            }
            Ok(Record::Channel(channel)) => {
                let number = self.channels.len();
                // A channel is repeated in the chunks and in the summary of a file.
                if self.numbers.contains_key(&channel.id) {
                    return Ok(Some(Found::Nothing));
                }
                self.numbers.insert(channel.id, number);
                self.channels.push(Channel {
                    topic: channel.topic,
                    encoding: channel.message_encoding,
                    schema: self.schemas.get(&channel.schema_id).cloned(),
                });
                Found::Channel(number)
            }
            Ok(Record::Message { header, data }) => match self.numbers.get(&header.channel_id) {
                None => Found::Nothing,
                Some(channel) => {
                    self.data.clear();
                    self.data.extend_from_slice(&data);
                    Found::Message(*channel, header.log_time)
                }
            },
            Ok(_) => Found::Nothing,
            Err(e) => {
                let message = e.to_string();
                let message = message.lines().next().unwrap_or_default().to_owned();
                return Err(DataError::Mcap {
                    path: self.path.clone(),
                    message: format!(
                        "the MCAP file is damaged before byte {} ({}); copy it from the recorder again",
                        self.file.bytes_read(),
                        message.trim_end_matches('.')
                    ),
                });
            }
        }))
    }

    /// Goes on with the next file, whose channels have numbers of their own.
    fn next_file(&mut self) -> Result<Option<Found>, DataError> {
        let Some(path) = self.rest.pop_front() else {
            return Ok(None);
        };
        let next = OneFile::open(&path)?;
        self.before += self.file.bytes_read();
        self.broken
            .extend(self.file.broken().map(|b| (self.path.clone(), b)));
        self.file = next;
        self.path = path;
        self.schemas.clear();
        self.numbers.clear();
        self.stored.clear();
        self.begin();
        Ok(Some(Found::Nothing))
    }
}
