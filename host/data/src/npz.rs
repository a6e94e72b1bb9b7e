//! NumPy archives (`.npz`): a zip archive of arrays.
//!
//! Formats: "NEP 1 — A Simple File Format for NumPy Arrays"; ".ZIP File Format Specification" 6.3 (PKWARE). Left out: archives
//! above 4 GiB, structured and complex arrays, objects and text, which are passed over.

use super::array::Array;
use super::binary_number::BinaryNumber;

/// Longest array, bytes after decompression.
const LONGEST: usize = 4 << 30;

/// Reads the arrays of an archive; arrays that hold no numbers are named in the second list.
///
/// # Errors
/// What is damaged or not supported, one clause.
pub(super) fn arrays(file: &[u8]) -> Result<(Vec<Array>, Vec<String>), String> {
    let mut arrays = Vec::new();
    let mut others = Vec::new();
    for entry in entries(file)? {
        let Some(name) = entry.name.strip_suffix(".npy") else {
            others.push(entry.name);
            continue;
        };
        let bytes = entry.read(file).ok_or_else(|| {
            format!(
                "entry {} of the archive is damaged",
                entry.name.escape_debug()
            )
        })?;
        match array(name, &bytes)? {
            Some(array) => arrays.push(array),
            None => others.push(name.to_owned()),
        }
    }
    Ok((arrays, others))
}

/// A file in the archive.
struct Entry {
    name: String,
    is_deflated: bool,
    packed: usize,
    size: usize,
    sum: u32,
    /// Byte at which its own header begins.
    offset: usize,
}

impl Entry {
    fn read(&self, file: &[u8]) -> Option<Vec<u8>> {
        let header = file.get(self.offset..)?;
        if !header.starts_with(b"PK\x03\x04") || self.size > LONGEST {
            return None;
        }
        let start = 30 + usize::from(u16_at(header, 26)?) + usize::from(u16_at(header, 28)?);
        let packed = header.get(start..start.checked_add(self.packed)?)?;
        let bytes = match self.is_deflated {
            false => packed.to_vec(),
            true => miniz_oxide::inflate::decompress_to_vec_with_limit(packed, self.size).ok()?,
        };
        (crc32fast::hash(&bytes) == self.sum).then_some(bytes)
    }
}

/// Reads the directory at the end of the archive.
fn entries(file: &[u8]) -> Result<Vec<Entry>, String> {
    let damaged = || "the NumPy archive is cut off or damaged; copy it again".to_owned();
    // The end record has 22 bytes and a comment of at most 64 KiB.
    let from = file.len().saturating_sub(22 + (1 << 16));
    let tail = &file[from..];
    let end = tail
        .windows(4)
        .rposition(|w| w == b"PK\x05\x06")
        .ok_or_else(damaged)?;
    let end = &tail[end..];
    let parts = (u16_at(end, 10), u32_at(end, 16));
    let (Some(count), Some(at)) = parts else {
        return Err(damaged());
    };
    if count == u16::MAX || at == u32::MAX {
        return Err("archives above 4 GiB cannot be read; write fewer rows into one file".into());
    }
    let mut rest = file.get(at as usize..).ok_or_else(damaged)?;
    let mut entries = Vec::new();
    for _ in 0..count {
        let (entry, length) = entry(rest).ok_or_else(damaged)?;
        let entry = entry?;
        entries.push(entry);
        rest = rest.get(length..).ok_or_else(damaged)?;
    }
    Ok(entries)
}

/// Reads one entry of the directory and its length.
fn entry(bytes: &[u8]) -> Option<(Result<Entry, String>, usize)> {
    if !bytes.starts_with(b"PK\x01\x02") {
        return None;
    }
    let lengths = [28, 30, 32].map(|at| u16_at(bytes, at).map(usize::from));
    let [Some(name), Some(extra), Some(comment)] = lengths else {
        return None;
    };
    let text = String::from_utf8_lossy(bytes.get(46..46 + name)?).into_owned();
    let (packed, size) = (u32_at(bytes, 20)?, u32_at(bytes, 24)?);
    let method = u16_at(bytes, 10)?;
    let own = if packed == u32::MAX || size == u32::MAX {
        Err(format!(
            "array {text} is larger than 4 GiB, which cannot be read"
        ))
    } else if method != 0 && method != 8 {
        Err(format!(
            "entry {text} is compressed by method {method}; write it with numpy.savez"
        ))
    } else {
        Ok(Entry {
            name: text,
            is_deflated: method == 8,
            packed: packed as usize,
            size: size as usize,
            sum: u32_at(bytes, 16)?,
            offset: u32_at(bytes, 42)? as usize,
        })
    };
    Some((own, 46 + name + extra + comment))
}

/// Reads an array; `None` if it holds no numbers.
fn array(name: &str, bytes: &[u8]) -> Result<Option<Array>, String> {
    let damaged = || format!("array {name} is damaged");
    if !bytes.starts_with(b"\x93NUMPY") {
        return Err(damaged());
    }
    let (length, start) = match bytes.get(6) {
        Some(1) => (u16_at(bytes, 8).map(usize::from), 10),
        _ => (u32_at(bytes, 8).map(|n| n as usize), 12),
    };
    let end = length
        .and_then(|n| n.checked_add(start))
        .ok_or_else(damaged)?;
    let header = bytes.get(start..end).ok_or_else(damaged)?;
    let header = String::from_utf8_lossy(header);
    let Some((of, is_big_endian)) = value(&header, "descr").and_then(kind) else {
        return Ok(None);
    };
    let is_by_column = value(&header, "fortran_order").is_some_and(|v| v.starts_with("True"));
    let shape = value(&header, "shape").ok_or_else(damaged)?;
    let shape = shape
        .trim_start_matches('(')
        .split(')')
        .next()
        .unwrap_or_default();
    let shape: Vec<usize> = (shape.split(',').map(str::trim).filter(|s| !s.is_empty()))
        .map(|s| s.parse().map_err(|_| damaged()))
        .collect::<Result<_, _>>()?;
    let count = shape.iter().try_fold(1usize, |n, k| n.checked_mul(*k));
    let values = of.values(&bytes[end..], is_big_endian);
    if count != Some(values.len()) {
        return Err(damaged());
    }
    let values = match shape.as_slice() {
        // The first index is to run fastest.
        [rows, columns] if !is_by_column => {
            let at = |k: usize| values[(k % rows) * columns + k / rows];
            (0..values.len()).map(at).collect()
        }
        _ => values,
    };
    Ok(Some(Array {
        name: name.to_owned(),
        shape,
        values,
    }))
}

/// Returns the text behind a key of the header, which is a Python dictionary.
fn value<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let behind = header.split_once(&format!("'{key}':"))?.1;
    Some(behind.trim_start())
}

/// Returns the type that `descr` states, and whether it is big-endian.
fn kind(descr: &str) -> Option<(BinaryNumber, bool)> {
    let text = descr.strip_prefix('\'')?.split('\'').next()?;
    let (order, rest) = text.split_at_checked(1)?;
    let (letter, size) = rest.split_at_checked(1)?;
    let size: u8 = size.parse().ok()?;
    let is_whole = [1, 2, 4, 8].contains(&size);
    let of = match letter {
        "f" if size == 4 || size == 8 => BinaryNumber::Float(size),
        "i" if is_whole => BinaryNumber::Signed(size),
        "u" | "b" if is_whole => BinaryNumber::Unsigned(size),
        _ => return None,
    };
    Some((of, order == ">"))
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}
