//! Numbers in temporary files: data that do not fit into constant memory are kept there between passes.
//!
//! A record is its length in bytes followed by its content, in little-endian byte order.

use std::fs::File;
use std::io::{ErrorKind, Read, Write};

use super::error::PrepareError;

/// Returns the error for a temporary file that cannot be used.
pub fn unusable(e: std::io::Error) -> PrepareError {
    PrepareError::Stopped(format!(
        "The temporary file for prepared rows cannot be used ({e}); make room in the folder for temporary files."
    ))
}

/// Clears a record and reserves the space for its length.
pub fn begin(record: &mut Vec<u8>) {
    record.clear();
    put_count(record, 0);
}

/// Writes a record that was begun with [`begin`].
pub fn write(to: &mut File, record: &mut [u8]) -> std::io::Result<()> {
    let length = record.len() as u64 - 8;
    record[..8].copy_from_slice(&length.to_le_bytes());
    to.write_all(record)
}

/// Reads the next record without its length; returns false at the end of the file.
pub fn read(from: &mut File, record: &mut Vec<u8>) -> std::io::Result<bool> {
    let mut length = [0; 8];
    match from.read_exact(&mut length) {
        Err(e) if e.kind() == ErrorKind::UnexpectedEof => return Ok(false),
        other => other?,
    }
    record.resize(u64::from_le_bytes(length) as usize, 0);
    from.read_exact(record)?;
    Ok(true)
}

/// Appends a count.
pub fn put_count(to: &mut Vec<u8>, count: usize) {
    to.extend_from_slice(&(count as u64).to_le_bytes());
}

/// Appends a list of numbers, its length first.
pub fn put_numbers<'a>(to: &mut Vec<u8>, list: impl ExactSizeIterator<Item = &'a f64>) {
    put_count(to, list.len());
    let start = to.len();
    to.resize(start + 8 * list.len(), 0);
    // In place, eight bytes each: the compiler turns this into a plain copy.
    for (bytes, x) in to[start..].as_chunks_mut::<8>().0.iter_mut().zip(list) {
        *bytes = x.to_le_bytes();
    }
}

/// The unread rest of a record.
pub struct Record<'a>(pub &'a [u8]);

impl Record<'_> {
    /// Returns the next bytes.
    pub fn bytes(&mut self, count: usize) -> std::io::Result<&[u8]> {
        let (head, rest) = self
            .0
            .split_at_checked(count)
            .ok_or(ErrorKind::UnexpectedEof)?;
        self.0 = rest;
        Ok(head)
    }

    /// Returns the next count.
    pub fn count(&mut self) -> std::io::Result<usize> {
        let bytes = self
            .bytes(8)?
            .first_chunk()
            .ok_or(ErrorKind::UnexpectedEof)?;
        Ok(u64::from_le_bytes(*bytes) as usize)
    }

    /// Appends the next list to `to`.
    pub fn numbers(&mut self, to: &mut Vec<f64>) -> std::io::Result<()> {
        let count = self.count()?;
        let bytes = self.bytes(8 * count)?;
        to.extend(
            bytes
                .as_chunks::<8>()
                .0
                .iter()
                .map(|b| f64::from_le_bytes(*b)),
        );
        Ok(())
    }

    /// Returns the next list.
    pub fn list(&mut self) -> std::io::Result<Vec<f64>> {
        let mut list = Vec::new();
        self.numbers(&mut list)?;
        Ok(list)
    }
}
