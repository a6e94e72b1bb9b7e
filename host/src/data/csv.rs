//! CSV line by line, without an allocation per line.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use super::columns::Layout;
use super::error::DataError;

/// Longest line that is read: hundreds of joints fit, a file without line ends does not.
const LONGEST_LINE: u64 = 1 << 20;

/// Bytes read at once; measured, larger ones are no faster.
const BUFFER: usize = 1 << 17;

/// Rows of a CSV file in order.
pub(super) struct CsvRows {
    path: PathBuf,
    reader: BufReader<File>,
    line: Vec<u8>,
    number: u64,
    bytes: u64,
}

impl CsvRows {
    /// Reads the header; its names are trimmed and, where quoted, unquoted.
    pub(super) fn open(path: &Path) -> Result<(Self, Vec<String>), DataError> {
        let file = File::open(path).map_err(|source| DataError::Read {
            path: path.into(),
            source,
        })?;
        let mut rows = Self {
            path: path.into(),
            reader: BufReader::with_capacity(BUFFER, file),
            line: Vec::new(),
            number: 0,
            bytes: 0,
        };
        if !rows.next_line()? {
            return Err(DataError::Empty { path: path.into() });
        }
        let not_text = || DataError::NotText {
            path: path.into(),
            line: 1,
        };
        let text = std::str::from_utf8(&rows.line).map_err(|_| not_text())?;
        let text = text.strip_prefix('\u{feff}').unwrap_or(text).trim();
        if text.chars().any(|c| c.is_control() && c != '\t') {
            return Err(not_text());
        }
        if text.is_empty() {
            return Err(DataError::Empty { path: path.into() });
        }
        let unquote = |name: &str| {
            let name = name.trim();
            let inner = name.strip_prefix('"').and_then(|n| n.strip_suffix('"'));
            inner.unwrap_or(name).to_owned()
        };
        let names = text.split(',').map(unquote).collect();
        Ok((rows, names))
    }

    pub(super) fn bytes_read(&self) -> u64 {
        self.bytes
    }

    /// Puts the next line without its end into `self.line`; false at the end of the file.
    fn next_line(&mut self) -> Result<bool, DataError> {
        self.line.clear();
        let read = (&mut self.reader)
            .take(LONGEST_LINE)
            .read_until(b'\n', &mut self.line)
            .map_err(|source| DataError::Read {
                path: self.path.clone(),
                source,
            })?;
        if read == 0 {
            return Ok(false);
        }
        self.number += 1;
        self.bytes += read as u64;
        if self.line.last() == Some(&b'\n') {
            self.line.pop();
        } else if read as u64 == LONGEST_LINE {
            let (path, line) = (self.path.clone(), self.number);
            // A file of zeros is better called what it is.
            return Err(if self.line.contains(&0) {
                DataError::NotText { path, line }
            } else {
                DataError::LineTooLong { path, line }
            });
        }
        if self.line.last() == Some(&b'\r') {
            self.line.pop();
        }
        Ok(true)
    }

    /// Reads the next row into `values`, one per column; gives its line, or none at the end.
    ///
    /// Text in a column that need not be a number becomes NaN.
    pub(super) fn next_row(
        &mut self,
        layout: &Layout,
        values: &mut [f64],
    ) -> Result<Option<u64>, DataError> {
        if !self.next_line()? {
            return Ok(None);
        }
        if self.line.trim_ascii().is_empty() {
            return self.only_empty_lines_left(layout).map(|()| None);
        }
        let mut found = 0;
        let mut rest = self.line.as_slice();
        loop {
            let (quick, used) = decimal(rest);
            let (value, end) = match (quick, rest.get(used)) {
                (Some(value), None | Some(b',')) => (value, used),
                _ => {
                    let end = rest.iter().position(|b| *b == b',');
                    let end = end.unwrap_or(rest.len());
                    (parse(&rest[..end]), end)
                }
            };
            if let (Some(place), Some(column)) = (values.get_mut(found), layout.columns.get(found))
            {
                *place = value;
                if column.strict && !value.is_finite() {
                    return Err(self.not_a_number(&column.name, &rest[..end]));
                }
            }
            found += 1;
            match rest.get(end + 1..) {
                Some(more) => rest = more,
                None => break,
            }
        }
        if found != layout.columns.len() {
            return Err(self.field_count(layout, found));
        }
        Ok(Some(self.number))
    }

    /// Empty lines may end a file, not interrupt it.
    fn only_empty_lines_left(&mut self, layout: &Layout) -> Result<(), DataError> {
        let line = self.number;
        while self.next_line()? {
            if !self.line.trim_ascii().is_empty() {
                self.number = line;
                return Err(self.field_count(layout, 0));
            }
        }
        Ok(())
    }

    fn field_count(&self, layout: &Layout, found: usize) -> DataError {
        let hint = match layout.columns.get(found) {
            Some(column) => format!("the first one missing is `{}`", column.name),
            None => "the last field named is the last that may stand there".to_owned(),
        };
        DataError::FieldCount {
            path: self.path.clone(),
            line: self.number,
            found,
            expected: layout.columns.len(),
            hint,
        }
    }

    fn not_a_number(&self, column: &str, field: &[u8]) -> DataError {
        let text = String::from_utf8_lossy(field.trim_ascii());
        let short: String = text.chars().take(40).collect();
        let found = if short.is_empty() {
            "nothing".to_owned()
        } else {
            format!("\"{}\"", short.escape_debug())
        };
        DataError::NotANumber {
            path: self.path.clone(),
            line: self.number,
            column: column.to_owned(),
            found,
        }
    }
}

/// Powers of ten that are exact in double precision.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

/// A plain decimal number at the start of `text`, and the bytes up to its end: nearly every field of a recording.
///
/// With digits that make an exact integer below 2⁵³ and at most 22 of them behind the point, the quotient of two
/// exact numbers is the double nearest to the text (Clinger 1990), to the bit what the standard library gives. None
/// for everything else, which is then left to that.
fn decimal(text: &[u8]) -> (Option<f64>, usize) {
    let negative = text.first() == Some(&b'-');
    let start = usize::from(negative);
    let mut mantissa = 0u64;
    let mut point = None;
    let mut end = start;
    for byte in &text[start..] {
        let digit = byte.wrapping_sub(b'0');
        if digit < 10 {
            // At most 18 digits are read below, so that this cannot overflow there.
            mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(digit));
        } else if *byte == b'.' && point.is_none() {
            point = Some(end);
        } else {
            break;
        }
        end += 1;
    }
    let digits = end - start - usize::from(point.is_some());
    let behind = point.map_or(0, |p| end - p - 1);
    if !(1..=18).contains(&digits) || mantissa >= 1 << 53 {
        return (None, end);
    }
    let value = mantissa as f64 / POWERS[behind];
    (Some(if negative { -value } else { value }), end)
}

/// The number in a field; NaN where there is none.
fn parse(field: &[u8]) -> f64 {
    let number = |bytes: &[u8]| std::str::from_utf8(bytes).ok().and_then(|s| s.parse().ok());
    // Trimming only where needed: nearly every field is bare.
    number(field)
        .or_else(|| number(field.trim_ascii()))
        .unwrap_or(f64::NAN)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn plain_numbers_are_read_as_the_standard_library_reads_them() {
        let mut g = rand_pcg::Pcg64::seed_from_u64(9);
        let mut quick = 0;
        for k in 0..200_000 {
            let x = (g.random::<f64>() - 0.5) * 10f64.powi(k % 19 - 9);
            let text = match k % 4 {
                0 => format!("{x:.7}"),
                1 => format!("{x}"),
                2 => format!("{x:.0}"),
                _ => format!("{x:.digits$}", digits = (k % 24) as usize),
            };
            let (found, used) = decimal(text.as_bytes());
            if let Some(found) = found {
                assert_eq!(used, text.len());
                assert_eq!(
                    found.to_bits(),
                    text.parse::<f64>().unwrap().to_bits(),
                    "{text}"
                );
                quick += 1;
            }
        }
        assert!(quick > 100_000, "{quick}");
        for text in [
            "",
            "-",
            ".",
            "-.",
            "1e5",
            "nan",
            "+1",
            "9007199254740993",
            "1_0",
            " 1",
            "0x1",
        ] {
            let (found, used) = decimal(text.as_bytes());
            assert!(found.is_none() || used < text.len(), "{text}");
        }
        for (text, value) in [
            ("0", 0.0),
            ("-0.0", -0.0),
            ("5.", 5.0),
            (".5", 0.5),
            ("-12.25", -12.25),
        ] {
            let (found, _) = decimal(text.as_bytes());
            assert_eq!(found.unwrap().to_bits(), f64::to_bits(value), "{text}");
        }
    }
}
