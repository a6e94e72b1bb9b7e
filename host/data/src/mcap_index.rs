//! Index of an MCAP file: the times of its chunks, from which the order of reading follows.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use ::mcap::records::op;

use super::mcap_records::MAGIC;

/// Length of the footer: code, length, places of two sections, and a check sum.
const FOOTER: u64 = 1 + 8 + 20;

/// Longest summary section that is read, bytes: an index has some hundred bytes for each chunk.
const LONGEST: u64 = 64 << 20;

/// Times and place of a chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Span {
    /// Log time of the first and the last message, ns.
    pub start: u64,
    pub end: u64,
    /// Byte at which the chunk begins.
    pub offset: u64,
}

/// A record: its code and body.
pub(super) type Stored = (u8, Vec<u8>);

/// Index of a file whose chunks are not in the order of time.
#[derive(Debug, Default)]
pub(super) struct Disorder {
    /// The chunks in the order of their first messages.
    pub spans: Vec<Span>,
    /// Definitions and channels, repeated in the summary.
    pub head: Vec<Stored>,
}

/// Returns the index of a file whose chunks overlap in time or stand in another order; `None` for other files, and for those
/// without a whole index.
pub(super) fn disorder(path: &Path) -> Option<Disorder> {
    let mut file = File::open(path).ok()?;
    let length = file.metadata().ok()?.len();
    let tail = FOOTER + MAGIC.len() as u64;
    let at = length.checked_sub(tail)?;
    let mut footer = vec![0; tail as usize];
    file.seek(SeekFrom::Start(at)).ok()?;
    file.read_exact(&mut footer).ok()?;
    if footer.first() != Some(&op::FOOTER) || !footer.ends_with(&MAGIC) {
        return None;
    }
    let start = u64_at(&footer, 9).filter(|start| *start > 0)?;
    let size = at.checked_sub(start).filter(|size| *size <= LONGEST)?;
    let mut summary = vec![0; usize::try_from(size).ok()?];
    file.seek(SeekFrom::Start(start)).ok()?;
    file.read_exact(&mut summary).ok()?;
    let mut found = Disorder::default();
    let mut rest = summary.as_slice();
    while let (Some(code), Some(length)) = (rest.first(), u64_at(rest, 1)) {
        let end = usize::try_from(length).ok()?.checked_add(9)?;
        let body = rest.get(9..end)?;
        match *code {
            op::SCHEMA | op::CHANNEL => found.head.push((*code, body.to_vec())),
            op::CHUNK_INDEX => found.spans.push(Span {
                start: u64_at(body, 0)?,
                end: u64_at(body, 8)?,
                offset: u64_at(body, 16)?,
            }),
            _ => {}
        }
        rest = rest.get(end..)?;
    }
    let has_channels = found.head.iter().any(|(code, _)| *code == op::CHANNEL);
    let is_sorted = found
        .spans
        .windows(2)
        .all(|pair| pair[0].end <= pair[1].start);
    // Chunks of one file stand behind each other, so a sorted index is that of a sorted file.
    let is_in_place = found.spans.is_sorted_by_key(|span| span.offset);
    if !has_channels || (is_sorted && is_in_place) {
        return None;
    }
    found.spans.sort_by_key(|span| (span.start, span.offset));
    Some(found)
}

fn u64_at(bytes: &[u8], at: usize) -> Option<u64> {
    Some(u64::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}
