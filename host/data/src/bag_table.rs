//! Messages in an SQLite file of rosbag2.

use std::collections::{BTreeMap, VecDeque};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use rusqlite::types::ValueRef;

use super::channel::{Channel, Schema};
use super::error::DataError;
use super::foreign::ForeignFormat;
use super::sqlite::Database;

/// Bytes of messages that are read at once; one message may be longer.
const AT_ONCE: usize = 1 << 18;

/// Columns of a message.
const MESSAGE: [&str; 3] = ["topic_id", "timestamp", "data"];

/// Reader of the messages, in the order in which they were stored.
pub(super) struct BagTable {
    path: PathBuf,
    database: Database,
    /// Topics by their number in the file.
    channels: BTreeMap<i64, Channel>,
    /// Messages that are read and not yet lent; `None` is a row without topic, time or data.
    waiting: VecDeque<Option<Stored>>,
    /// The message that is lent.
    lent: Option<Stored>,
    /// Identifier of the last row read.
    last: i64,
    /// Bytes of messages so far.
    bytes: u64,
}

/// A message: number of its topic in the file, time, ns, and data.
pub(super) struct Stored {
    pub topic: i64,
    pub time: u64,
    pub data: Vec<u8>,
}

impl BagTable {
    /// Opens a file.
    ///
    /// # Errors
    /// [`DataError::Foreign`]: the tables of rosbag2 are not there.
    pub(super) fn open(path: &Path) -> Result<Self, DataError> {
        let database = Database::open(path)?;
        let has = |table: &str, names: [&str; 3]| {
            let Some(columns) = database.columns(table)? else {
                return Ok(false);
            };
            match names.iter().all(|name| columns.iter().any(|c| c == name)) {
                true => Ok(true),
                false => Err(DataError::Bag {
                    path: path.into(),
                    message: format!(
                        "table `{table}` has no columns {}; give a bag of rosbag2",
                        names.join(", ")
                    ),
                }),
            }
        };
        let topic = ["name", "type", "serialization_format"];
        if !has("topics", topic)? || !has("messages", MESSAGE)? {
            return Err(DataError::Foreign {
                path: path.into(),
                format: ForeignFormat::Sqlite,
            });
        }
        let definition = ["topic_type", "encoding", "encoded_message_definition"];
        let definitions = match has("message_definitions", definition)? {
            true => texts(&database, "message_definitions", definition)?,
            false => Vec::new(),
        };
        let named = texts(&database, "topics", topic)?;
        let channel = |(id, [topic, of, encoding]): (i64, [String; 3])| {
            let own = definitions.iter().find(|(_, [name, ..])| *name == of);
            let schema = Schema {
                name: of,
                encoding: own.map_or_else(String::new, |(_, [_, encoding, _])| encoding.clone()),
                text: own.map_or_else(String::new, |(_, [.., text])| text.clone()),
            };
            let schema = Some(schema);
            (
                id,
                Channel {
                    topic,
                    encoding,
                    schema,
                },
            )
        };
        let channels = named.into_iter().map(channel).collect();
        Ok(Self {
            path: path.into(),
            database,
            channels,
            waiting: VecDeque::new(),
            lent: None,
            last: i64::MIN,
            bytes: 0,
        })
    }

    /// Returns the topics by their number in the file.
    pub(super) fn channels(&self) -> &BTreeMap<i64, Channel> {
        &self.channels
    }

    /// Returns the number of bytes of messages so far.
    pub(super) fn bytes_read(&self) -> u64 {
        self.bytes
    }

    /// Reads the next message; `None` behind the last one.
    pub(super) fn next_message(&mut self) -> Result<Option<&Stored>, DataError> {
        if self.waiting.is_empty() {
            self.fill()?;
        }
        let Some(next) = self.waiting.pop_front() else {
            return Ok(None);
        };
        if next.is_none() {
            return Err(DataError::Bag {
                path: self.path.clone(),
                message: "a row of table `messages` has no topic, time or data; record it again"
                    .to_owned(),
            });
        }
        self.lent = next;
        let lent = self.lent.as_ref();
        self.bytes += lent.map_or(0, |own| own.data.len() as u64);
        Ok(lent)
    }

    /// Reads some messages.
    fn fill(&mut self) -> Result<(), DataError> {
        let mut bytes = 0;
        let behind = self.last;
        let (waiting, last) = (&mut self.waiting, &mut self.last);
        (self.database).rows_behind(behind, "messages", MESSAGE, |id, row| {
            *last = id;
            let message = stored(row);
            // Each message takes some memory of its own.
            bytes += size_of::<Stored>() + message.as_ref().map_or(0, |own| own.data.len());
            waiting.push_back(message);
            match bytes < AT_ONCE {
                true => ControlFlow::Continue(()),
                false => ControlFlow::Break(()),
            }
        })
    }
}

fn stored([topic, time, data]: [ValueRef<'_>; 3]) -> Option<Stored> {
    Some(Stored {
        topic: topic.as_i64().ok()?,
        time: u64::try_from(time.as_i64().ok()?).ok()?,
        data: data.as_bytes().ok()?.to_vec(),
    })
}

/// Returns three text columns of a table, with the identifiers of the rows.
fn texts(
    database: &Database,
    table: &str,
    columns: [&str; 3],
) -> Result<Vec<(i64, [String; 3])>, DataError> {
    let mut found = Vec::new();
    database.rows_behind(i64::MIN, table, columns, |id, row| {
        let text = |value: ValueRef<'_>| {
            let bytes = value.as_bytes().unwrap_or_default();
            String::from_utf8_lossy(bytes).into_owned()
        };
        found.push((id, row.map(text)));
        ControlFlow::Continue(())
    })?;
    Ok(found)
}
