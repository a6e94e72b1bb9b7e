//! MATLAB files of version 5 to 7.2 (`save` with `-v6` or `-v7`, `scipy.io.savemat`).
//!
//! Format: "MAT-File Format" (MathWorks, R2019b), level 5. Fields of a structure of one element are read as arrays of their
//! own. Left out: cells, text, sparse and imaginary numbers, and structures in structures, which are passed over.

use super::array::Array;
use super::binary_number::BinaryNumber;

/// First bytes of the file.
pub(super) const MAGIC: &[u8] = b"MATLAB 5.0 MAT-file";

/// Longest variable, bytes after decompression.
const LONGEST: usize = 2 << 30;

/// Types of data elements.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;

/// Classes of arrays.
const STRUCTURE: u8 = 2;

/// Reads the arrays of a file; variables that hold no numbers are named in the second list.
///
/// # Errors
/// What is damaged, one clause.
pub(super) fn arrays(file: &[u8]) -> Result<(Vec<Array>, Vec<String>), String> {
    let damaged = || "the MATLAB file is cut off or damaged; copy it again".to_owned();
    let is_big_endian = file.get(126..128) == Some(b"MI");
    let mut found = (Vec::new(), Vec::new());
    let mut reader = Elements {
        rest: file.get(128..).ok_or_else(damaged)?,
        is_big_endian,
    };
    while !reader.rest.is_empty() {
        let (kind, body) = reader.next().ok_or_else(damaged)?;
        if kind == COMPRESSED {
            let whole = miniz_oxide::inflate::decompress_to_vec_zlib_with_limit(body, LONGEST);
            let whole = whole.map_err(|_| damaged())?;
            let mut inner = Elements {
                rest: &whole,
                is_big_endian,
            };
            let (kind, body) = inner.next().ok_or_else(damaged)?;
            if kind == MATRIX {
                matrix(body, is_big_endian, None, &mut found).ok_or_else(damaged)?;
            }
        } else if kind == MATRIX {
            matrix(body, is_big_endian, None, &mut found).ok_or_else(damaged)?;
        }
    }
    Ok(found)
}

/// Data elements one behind the other.
struct Elements<'a> {
    rest: &'a [u8],
    is_big_endian: bool,
}

impl<'a> Elements<'a> {
    fn whole(&self, at: usize) -> Option<u32> {
        let bytes = *self.rest.get(at..)?.first_chunk()?;
        Some(match self.is_big_endian {
            true => u32::from_be_bytes(bytes),
            false => u32::from_le_bytes(bytes),
        })
    }

    /// Returns type and data of the next element.
    fn next(&mut self) -> Option<(u32, &'a [u8])> {
        let kind = self.whole(0)?;
        // Up to four bytes of data stand in the tag itself, whose upper half is then their number.
        if kind >> 16 != 0 {
            let data = self.rest.get(4..4 + (kind >> 16) as usize)?;
            self.rest = self.rest.get(8..)?;
            return Some((kind & 0xffff, data));
        }
        let length = self.whole(4)? as usize;
        let data = self.rest.get(8..length.checked_add(8)?)?;
        // Only compressed data are not filled up to a multiple of eight bytes.
        let end = 8 + if kind == COMPRESSED {
            length
        } else {
            length.next_multiple_of(8)
        };
        self.rest = self.rest.get(end..).unwrap_or_default();
        Some((kind, data))
    }
}

/// Reads a variable, or a field of the structure `of`; `None` if it is damaged.
fn matrix(
    body: &[u8],
    is_big_endian: bool,
    of: Option<&str>,
    found: &mut (Vec<Array>, Vec<String>),
) -> Option<()> {
    let mut reader = Elements {
        rest: body,
        is_big_endian,
    };
    let (_, flags) = reader.next()?;
    let class = match is_big_endian {
        true => *flags.get(3)?,
        false => *flags.first()?,
    };
    let (_, shape) = reader.next()?;
    let shape = BinaryNumber::Signed(4).values(shape, is_big_endian);
    let shape: Vec<usize> = shape.into_iter().map(|n| n.max(0.0) as usize).collect();
    let (_, name) = reader.next()?;
    let name = match of {
        Some(name) => name.to_owned(),
        None => String::from_utf8_lossy(name).into_owned(),
    };
    match class {
        6..=15 => {
            let (kind, data) = reader.next()?;
            let values = number_type(kind)?.values(data, is_big_endian);
            let count = shape.iter().try_fold(1usize, |n, k| n.checked_mul(*k));
            if count != Some(values.len()) {
                return None;
            }
            found.0.push(Array {
                name,
                shape,
                values,
            });
        }
        STRUCTURE if of.is_none() && shape.iter().product::<usize>() == 1 => {
            let (_, length) = reader.next()?;
            let length = BinaryNumber::Signed(4).values(length, is_big_endian);
            let length = (*length.first()?).max(1.0) as usize;
            let (_, names) = reader.next()?;
            for field in names.chunks(length) {
                let end = field.iter().position(|b| *b == 0).unwrap_or(field.len());
                let field = String::from_utf8_lossy(&field[..end]).into_owned();
                let (_, body) = reader.next()?;
                matrix(body, is_big_endian, Some(&field), found)?;
            }
        }
        _ => found.1.push(name),
    }
    Some(())
}

/// Returns the type of stored numbers, which may be smaller than that of the array.
fn number_type(kind: u32) -> Option<BinaryNumber> {
    Some(match kind {
        1 => BinaryNumber::Signed(1),
        2 => BinaryNumber::Unsigned(1),
        3 => BinaryNumber::Signed(2),
        4 => BinaryNumber::Unsigned(2),
        5 => BinaryNumber::Signed(4),
        6 => BinaryNumber::Unsigned(4),
        7 => BinaryNumber::Float(4),
        9 => BinaryNumber::Float(8),
        12 => BinaryNumber::Signed(8),
        13 => BinaryNumber::Unsigned(8),
        _ => return None,
    })
}
