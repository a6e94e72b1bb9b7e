//! Records of an MCAP file in order, including those in its chunks.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};

use ::mcap::records::op;
use crc32fast::Hasher;

use super::error::DataError;

/// First and last bytes of every MCAP file.
pub(super) const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";

/// Maximum length of a record or decompressed chunk, bytes: a damaged length must not request all memory. Recorders
/// write chunks of 1 to 4 MiB.
const LONGEST_RECORD: u64 = 256 << 20;

/// Operation code and length of a record.
const RECORD_HEADER: usize = 9;

/// Place where a file ends too early.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Break {
    /// Byte after the last complete record.
    pub at: u64,
    /// Description of the loss.
    pub lost: &'static str,
}

/// Reader of single records; memory holds one record or one chunk.
pub(super) struct Records {
    path: PathBuf,
    file: BufReader<File>,
    /// Length of the file.
    length: u64,
    /// True if the file has a proper end.
    has_end: bool,
    /// Bytes read so far.
    at: u64,
    /// Body of the last record outside a chunk.
    body: Vec<u8>,
    /// Decompressed records of the current chunk.
    chunk: Vec<u8>,
    chunk_next: usize,
    /// Byte at which this chunk starts.
    chunk_start: u64,
    /// Check sum of the data section, then of the summary section.
    sum: Hasher,
    in_summary: bool,
    finished: bool,
    broken: Option<Break>,
}

/// Location of a record's body.
enum Body {
    File,
    Chunk(Range<usize>),
}

impl Records {
    /// Opens a file that starts with [`MAGIC`].
    pub(super) fn open(path: &Path) -> Result<Self, DataError> {
        let failed = |source| DataError::Read {
            path: path.into(),
            source,
        };
        let mut file = File::open(path).map_err(failed)?;
        let length = file.metadata().map_err(failed)?.len();
        let mut end = Vec::new();
        if length >= 2 * MAGIC.len() as u64 {
            file.seek(SeekFrom::End(-(MAGIC.len() as i64)))
                .map_err(failed)?;
            file.read_to_end(&mut end).map_err(failed)?;
            file.rewind().map_err(failed)?;
        }
        let mut records = Self {
            path: path.into(),
            file: BufReader::with_capacity(1 << 17, file),
            length,
            has_end: end == MAGIC,
            at: 0,
            body: Vec::new(),
            chunk: Vec::new(),
            chunk_next: 0,
            chunk_start: 0,
            sum: Hasher::new(),
            in_summary: false,
            finished: false,
            broken: None,
        };
        records.fill(MAGIC.len() as u64)?;
        if records.body != MAGIC {
            return Err(records.damaged(0, "no start of MCAP version 0 stands"));
        }
        records.sum.update(&MAGIC);
        Ok(records)
    }

    /// Returns the number of bytes read so far.
    pub(super) fn bytes_read(&self) -> u64 {
        self.at
    }

    /// Returns the place where the file ends too early, after its records were read.
    pub(super) fn broken(&self) -> Option<Break> {
        self.broken
    }

    /// Returns the next record, as operation code and body; `None` at the end, or where the file ends too early.
    pub(super) fn next_record(&mut self) -> Result<Option<(u8, &[u8])>, DataError> {
        Ok(match self.advance()? {
            None => None,
            Some((code, Body::File)) => Some((code, &self.body)),
            Some((code, Body::Chunk(range))) => Some((code, &self.chunk[range])),
        })
    }

    /// Goes to the chunk that begins at a byte, and opens it. The check sum of the data section is not computed then; that of
    /// the chunk is.
    pub(super) fn chunk_at(&mut self, offset: u64) -> Result<(), DataError> {
        let sought = self.file.seek(SeekFrom::Start(offset));
        sought.map_err(|source| self.unreadable(source))?;
        self.fill(RECORD_HEADER as u64)?;
        match record_header(&self.body) {
            Some((op::CHUNK, length)) if length <= self.length.saturating_sub(offset) => {
                self.open_chunk(offset, length, false)
            }
            _ => Err(self.damaged(offset, "no chunk begins where the index says")),
        }
    }

    /// Returns the next record of the open chunk; `None` at its end.
    pub(super) fn next_in_chunk(&mut self) -> Result<Option<(u8, &[u8])>, DataError> {
        Ok(match self.next_of_chunk()? {
            Some((code, Body::Chunk(range))) => Some((code, &self.chunk[range])),
            _ => None,
        })
    }

    fn damaged(&self, at: u64, what: &str) -> DataError {
        DataError::Mcap {
            path: self.path.clone(),
            message: format!(
                "{what} at byte {at}: the MCAP file is damaged; copy it from the recorder again, or let `mcap recover in.mcap -o out.mcap` keep what is whole"
            ),
        }
    }

    /// Reads at most `count` bytes of the file into `self.body`; fewer at its end.
    fn fill(&mut self, count: u64) -> Result<(), DataError> {
        self.body.clear();
        let read = (&mut self.file).take(count).read_to_end(&mut self.body);
        self.at += read.map_err(|source| self.unreadable(source))? as u64;
        Ok(())
    }

    fn unreadable(&self, source: std::io::Error) -> DataError {
        DataError::Read {
            path: self.path.clone(),
            source,
        }
    }

    /// Skips bytes of the file, but adds them to the check sum.
    fn pass_over(&mut self, mut count: u64) -> Result<(), DataError> {
        while count > 0 {
            let bytes = self.file.fill_buf().map_err(|source| DataError::Read {
                path: self.path.clone(),
                source,
            })?;
            let used = bytes
                .len()
                .min(usize::try_from(count).unwrap_or(usize::MAX));
            if used == 0 {
                break;
            }
            self.sum.update(&bytes[..used]);
            self.file.consume(used);
            self.at += used as u64;
            count -= used as u64;
        }
        Ok(())
    }

    fn advance(&mut self) -> Result<Option<(u8, Body)>, DataError> {
        loop {
            if let Some(record) = self.next_of_chunk()? {
                return Ok(Some(record));
            }
            if self.finished {
                return Ok(None);
            }
            let start = self.at;
            self.fill(RECORD_HEADER as u64)?;
            let Some((code, length)) = record_header(&self.body) else {
                return self.break_off(start).map(|()| None);
            };
            let header: [u8; RECORD_HEADER] = std::array::from_fn(|k| self.body[k]);
            let fits = length <= self.length.saturating_sub(self.at);
            // A file system that lost the last blocks fills them with zeros.
            if code == 0 || (!fits && (self.has_end || code != op::CHUNK)) {
                return self.break_off(start).map(|()| None);
            }
            match code {
                op::DATA_END => self.end_of_data(start, length)?,
                op::FOOTER => self.end_of_summary(start, length, header)?,
                op::CHUNK => {
                    self.sum.update(&header);
                    self.open_chunk(start, length, !fits)?;
                }
                op::SCHEMA | op::CHANNEL | op::MESSAGE if length <= LONGEST_RECORD => {
                    self.sum.update(&header);
                    self.fill(length)?;
                    self.sum.update(&self.body);
                    return Ok(Some((code, Body::File)));
                }
                _ => {
                    self.sum.update(&header);
                    self.pass_over(length)?;
                }
            }
        }
    }

    /// Handles a missing record: the file ends too early or, if it has a proper end, is damaged.
    fn break_off(&mut self, at: u64) -> Result<(), DataError> {
        if self.has_end {
            return Err(self.damaged(at, "no record begins"));
        }
        self.finished = true;
        self.broken = Some(Break {
            at,
            lost: if self.in_summary {
                "only the index at the end of the file is missing"
            } else {
                "later samples are lost"
            },
        });
        Ok(())
    }

    fn end_of_data(&mut self, start: u64, length: u64) -> Result<(), DataError> {
        self.fill(length.min(LONGEST_RECORD))?;
        let found = std::mem::take(&mut self.sum).finalize();
        let Some(saved) = u32_at(&self.body, 0) else {
            return Err(self.damaged(start, "the record of the data's end is too short"));
        };
        if saved != 0 && saved != found {
            return Err(self.damaged(start, "the check sum of the data section is wrong"));
        }
        self.in_summary = true;
        Ok(())
    }

    fn end_of_summary(
        &mut self,
        start: u64,
        length: u64,
        header: [u8; RECORD_HEADER],
    ) -> Result<(), DataError> {
        self.fill(length.min(LONGEST_RECORD))?;
        let (Some(saved), Some(places)) = (u32_at(&self.body, 16), self.body.get(..16)) else {
            return Err(self.damaged(start, "the last record is too short"));
        };
        self.sum.update(&header);
        self.sum.update(places);
        let found = std::mem::take(&mut self.sum).finalize();
        if saved != 0 && saved != found && self.in_summary {
            return Err(self.damaged(start, "the check sum of the index is wrong"));
        }
        self.finished = true;
        if !self.has_end {
            self.in_summary = true;
            return self.break_off(self.at);
        }
        Ok(())
    }

    /// Reads and decompresses a chunk, or its first part if the file ends inside it.
    fn open_chunk(&mut self, start: u64, length: u64, cut: bool) -> Result<(), DataError> {
        if length > LONGEST_RECORD && !cut {
            return Err(self.too_long(start));
        }
        self.fill(length.min(LONGEST_RECORD))?;
        self.sum.update(&self.body);
        self.chunk_start = start;
        self.chunk.clear();
        self.chunk_next = 0;
        if cut {
            self.finished = true;
            self.broken = Some(Break {
                at: start,
                lost: "later samples are lost, and the last ones that are read have no check sum",
            });
        }
        let Some(header) = ChunkHeader::parse(&self.body) else {
            return if cut {
                Ok(())
            } else {
                Err(self.damaged(start, "the chunk has no whole header"))
            };
        };
        if header.size > LONGEST_RECORD {
            return Err(self.too_long(start));
        }
        let records = self.body.get(header.records.clone());
        let Some(records) = records.or_else(|| {
            let from_start = self.body.get(header.records.start..);
            from_start.filter(|_| cut)
        }) else {
            return Err(self.damaged(start, "the chunk is shorter than its header says"));
        };
        let whole = match header.compression.as_str() {
            "" => {
                self.chunk.extend_from_slice(records);
                true
            }
            "zstd" => zstd(records, header.size, &mut self.chunk),
            "lz4" => lz4(records, header.size, &mut self.chunk),
            other => {
                return Err(DataError::Mcap {
                    path: self.path.clone(),
                    message: format!(
                        "the chunk at byte {start} is compressed by \"{}\", but chunks can be compressed by zstd or lz4 only; run `mcap compress --compression zstd in.mcap -o out.mcap`",
                        other.escape_debug()
                    ),
                });
            }
        };
        if cut {
            return Ok(());
        }
        if !whole || self.chunk.len() as u64 != header.size {
            return Err(self.damaged(start, "the chunk cannot be decompressed"));
        }
        if header.sum != 0 && crc32fast::hash(&self.chunk) != header.sum {
            return Err(self.damaged(start, "the chunk's check sum is wrong"));
        }
        Ok(())
    }

    fn too_long(&self, start: u64) -> DataError {
        DataError::Mcap {
            path: self.path.clone(),
            message: format!(
                "the chunk at byte {start} is longer than {} MiB; write the file anew with smaller chunks (`mcap compress --chunk-size 4194304 in.mcap -o out.mcap`)",
                LONGEST_RECORD >> 20
            ),
        }
    }

    fn next_of_chunk(&mut self) -> Result<Option<(u8, Body)>, DataError> {
        let rest = &self.chunk[self.chunk_next..];
        if rest.is_empty() {
            return Ok(None);
        }
        let record = record_header(rest).and_then(|(code, length)| {
            let start = self.chunk_next + RECORD_HEADER;
            let end = start.checked_add(usize::try_from(length).ok()?)?;
            (end <= self.chunk.len()).then_some((code, start..end))
        });
        match record {
            Some((code, range)) => {
                self.chunk_next = range.end;
                Ok(Some((code, Body::Chunk(range))))
            }
            // The file ends inside this chunk.
            None if self.broken.is_some() => {
                self.chunk_next = self.chunk.len();
                Ok(None)
            }
            None => Err(self.damaged(self.chunk_start, "the chunk ends in the middle of a record")),
        }
    }
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    let bytes = bytes.get(at..)?.first_chunk()?;
    Some(u32::from_le_bytes(*bytes))
}

fn u64_at(bytes: &[u8], at: usize) -> Option<u64> {
    let bytes = bytes.get(at..)?.first_chunk()?;
    Some(u64::from_le_bytes(*bytes))
}

fn record_header(bytes: &[u8]) -> Option<(u8, u64)> {
    Some((*bytes.first()?, u64_at(bytes, 1)?))
}

/// Header of a chunk.
struct ChunkHeader {
    /// Decompressed length, bytes.
    size: u64,
    /// Check sum of the decompressed records; 0 if there is none.
    sum: u32,
    compression: String,
    /// Position of the records in the chunk's body.
    records: Range<usize>,
}

impl ChunkHeader {
    /// Reads start and end time, decompressed size, check sum, compression and compressed size; `None` for a short
    /// body.
    fn parse(body: &[u8]) -> Option<Self> {
        let name = u32_at(body, 28)? as usize;
        let behind = 32usize.checked_add(name)?;
        let compression = String::from_utf8_lossy(body.get(32..behind)?).into_owned();
        let compressed = usize::try_from(u64_at(body, behind)?).ok()?;
        Some(Self {
            size: u64_at(body, 16)?,
            sum: u32_at(body, 24)?,
            compression,
            records: behind + 8..(behind + 8).checked_add(compressed)?,
        })
    }
}

/// Decompresses frames until `size` bytes are in `out`. Returns false if the frames are damaged or incomplete; `out`
/// then holds the bytes before the error.
fn zstd(mut frames: &[u8], size: u64, out: &mut Vec<u8>) -> bool {
    while !frames.is_empty() && (out.len() as u64) < size {
        let Ok(mut decoder) = ruzstd::decoding::StreamingDecoder::new(&mut frames) else {
            return false;
        };
        // One byte more than expected, so that a longer chunk is detected.
        let room = size + 1 - out.len() as u64;
        if (&mut decoder).take(room).read_to_end(out).is_err() {
            return false;
        }
    }
    true
}

/// Does the same as [`zstd`] for lz4.
fn lz4(frames: &[u8], size: u64, out: &mut Vec<u8>) -> bool {
    let decoder = lz4_flex::frame::FrameDecoder::new(frames);
    decoder.take(size + 1).read_to_end(out).is_ok()
}
