//! Records of an MCAP file whose chunks are not in the order of time, sorted by log time.
//!
//! Memory holds the chunks that overlap in time, and no others.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};
use std::path::Path;

use ::mcap::records::op;

use super::error::DataError;
use super::mcap_index::{Disorder, Span, Stored};
use super::mcap_records::Records;

/// Place of the log time in the body of a message: behind channel and number.
const LOG_TIME: std::ops::Range<usize> = 6..14;

/// Reader in the order of log time. Equal times keep the order of their chunks and of the file.
pub(super) struct SortedRecords {
    records: Records,
    spans: VecDeque<Span>,
    /// Definitions and channels that were not returned yet.
    waiting: VecDeque<Stored>,
    /// Log time, number in the order of reading, and body of messages.
    messages: BinaryHeap<Reverse<(u64, u64, Vec<u8>)>>,
    count: u64,
    last: Stored,
}

impl SortedRecords {
    /// Opens a file with this index.
    pub(super) fn open(path: &Path, index: Disorder) -> Result<Self, DataError> {
        Ok(Self {
            records: Records::open(path)?,
            spans: index.spans.into(),
            waiting: index.head.into(),
            messages: BinaryHeap::new(),
            count: 0,
            last: (0, Vec::new()),
        })
    }

    /// Returns the number of bytes read so far.
    pub(super) fn bytes_read(&self) -> u64 {
        self.records.bytes_read()
    }

    /// Returns the next record, as operation code and body; `None` at the end.
    pub(super) fn next_record(&mut self) -> Result<Option<(u8, &[u8])>, DataError> {
        loop {
            if let Some(stored) = self.waiting.pop_front() {
                self.last = stored;
                break;
            }
            let bound = self.spans.front().map_or(u64::MAX, |span| span.start);
            let is_due = |Reverse((time, ..)): &Reverse<(u64, u64, Vec<u8>)>| {
                *time < bound || self.spans.is_empty()
            };
            if self.messages.peek().is_some_and(is_due)
                && let Some(Reverse((.., body))) = self.messages.pop()
            {
                self.last = (op::MESSAGE, body);
                break;
            }
            let Some(span) = self.spans.pop_front() else {
                return Ok(None);
            };
            self.take_chunk(span.offset)?;
        }
        Ok(Some((self.last.0, &self.last.1)))
    }

    fn take_chunk(&mut self, offset: u64) -> Result<(), DataError> {
        self.records.chunk_at(offset)?;
        while let Some((code, body)) = self.records.next_in_chunk()? {
            match code {
                op::MESSAGE => {
                    let time = body.get(LOG_TIME).and_then(|b| b.first_chunk());
                    let time = time.map_or(0, |b| u64::from_le_bytes(*b));
                    self.count += 1;
                    (self.messages).push(Reverse((time, self.count, body.to_vec())));
                }
                op::SCHEMA | op::CHANNEL => self.waiting.push_back((code, body.to_vec())),
                _ => {}
            }
        }
        Ok(())
    }
}
