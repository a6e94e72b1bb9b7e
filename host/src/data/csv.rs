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
        for field in self.line.split(|&b| b == b',') {
            if let (Some(value), Some(column)) = (values.get_mut(found), layout.columns.get(found))
            {
                *value = parse(field);
                if column.strict && !value.is_finite() {
                    return Err(self.not_a_number(&column.name, field));
                }
            }
            found += 1;
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

/// The number in a field; NaN where there is none.
fn parse(field: &[u8]) -> f64 {
    let number = |bytes: &[u8]| std::str::from_utf8(bytes).ok().and_then(|s| s.parse().ok());
    // Trimming only where needed: nearly every field is bare.
    number(field)
        .or_else(|| number(field.trim_ascii()))
        .unwrap_or(f64::NAN)
}
