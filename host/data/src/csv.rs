//! CSV reader that works line by line without an allocation per line.

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use csv_core::{ReadRecordResult, Reader, ReaderBuilder, Terminator};

use super::columns::{FileColumn, Layout, Role};
use super::csv_header::{Lines, Separator, find_header};
use super::error::DataError;
use super::header::Header;
use super::iso_time::iso_time;
use super::number::{decimal, number};
use super::place::Place;
use super::remark::Remark;
use super::text_file::TextFile;

/// Maximum length of a line, bytes: hundreds of joints fit; a file without line ends does not.
const LONGEST_LINE: usize = 1 << 20;

/// Magnitude below which a number of any column needs no further check.
const LARGEST_QUICK: f64 = 1e9;

/// Number of rows that decide whether blanks separate the columns.
const AHEAD: usize = 50;

/// Bytes read at once; larger buffers measured no faster.
const BUFFER: usize = 1 << 17;

/// Lines of a text file.
pub(super) struct TextLines {
    path: PathBuf,
    reader: BufReader<TextFile>,
    /// The last line, without its end.
    line: Vec<u8>,
    number: u64,
    /// True if a line end stands behind the last line.
    has_end: bool,
    bytes: u64,
    /// Byte that ends a line: a line feed, or a carriage return if the file has only those.
    end: u8,
}

impl TextLines {
    /// Opens a text file.
    pub(super) fn open(path: &Path) -> Result<Self, DataError> {
        let failed = |source| DataError::Read {
            path: path.into(),
            source,
        };
        let file = TextFile::open(path).map_err(failed)?;
        let mut reader = BufReader::with_capacity(BUFFER, file);
        let start = reader.fill_buf().map_err(failed)?;
        let first = start.iter().position(|b| matches!(b, b'\n' | b'\r'));
        let is_return_alone = first.is_some_and(|k| {
            let behind = start.get(k + 1);
            start[k] == b'\r' && behind.is_some_and(|b| *b != b'\n')
        });
        Ok(Self {
            path: path.into(),
            reader,
            line: Vec::new(),
            number: 0,
            has_end: true,
            bytes: 0,
            end: if is_return_alone { b'\r' } else { b'\n' },
        })
    }

    /// Returns the number of bytes read so far.
    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Returns true if the last line is the end of the file without a line end, as where a file was cut off: a number at its
    /// end may lack digits.
    pub(super) fn is_cut(&self) -> bool {
        !self.has_end && !self.line.trim_ascii().is_empty()
    }
}

impl Lines for TextLines {
    fn next_line(&mut self) -> Result<bool, DataError> {
        self.line.clear();
        let read = (&mut self.reader)
            .take(LONGEST_LINE as u64)
            .read_until(self.end, &mut self.line)
            .map_err(|source| DataError::Read {
                path: self.path.clone(),
                source,
            })?;
        if read == 0 {
            return Ok(false);
        }
        self.number += 1;
        self.has_end = self.line.last() == Some(&self.end);
        self.bytes += read as u64 * self.reader.get_ref().bytes_a_character();
        if self.has_end {
            self.line.pop();
        } else if read == LONGEST_LINE {
            let (path, line) = (self.path.clone(), self.number);
            // A file of zero bytes is reported as not text.
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

    fn line(&self) -> &[u8] {
        &self.line
    }

    fn number(&self) -> u64 {
        self.number
    }

    fn ahead(&self) -> Vec<String> {
        let buffered = self.reader.buffer();
        let mut lines: Vec<&[u8]> = buffered.split(|b| *b == self.end).take(AHEAD + 1).collect();
        // The last one may go on behind the buffer, if it is not empty.
        if lines.len() > 1 {
            lines.pop();
        }
        let texts = lines
            .into_iter()
            .map(|line| String::from_utf8_lossy(line).into_owned());
        texts.filter(|line| !line.trim().is_empty()).collect()
    }

    fn path(&self) -> &Path {
        &self.path
    }
}

/// Rows from which a last row without a line end is left out. In a file with fewer rows each may be a pose that counts.
pub(super) const SPARED: u64 = 256;

/// Rows of a CSV file in order.
pub(super) struct CsvRows {
    lines: TextLines,
    separator: Separator,
    /// Decimal point or comma, after the first number that has one.
    mark: Option<u8>,
    remarks: Vec<Remark>,
    /// True if the first column counts the rows and is not used.
    counts: bool,
    /// True if the last line is a row that was not returned yet: the header was in a comment before it.
    waiting: bool,
    /// Whole seconds of the first time that is a date or a time of day.
    iso_origin: Option<i64>,
    quoted: QuotedRow,
    /// Number of rows so far.
    rows: u64,
}

/// A row with quoted fields: the joined text, and the end of each field.
struct QuotedRow {
    reader: Reader,
    text: Vec<u8>,
    ends: Vec<usize>,
}

impl CsvRows {
    /// Finds the header and the column separator.
    pub(super) fn open(path: &Path) -> Result<(Self, Header), DataError> {
        let mut lines = TextLines::open(path)?;
        let found = find_header(&mut lines)?;
        let mut reader = ReaderBuilder::new();
        reader
            .delimiter(found.separator.byte())
            .terminator(Terminator::Any(b'\n'));
        let rows = Self {
            lines,
            separator: found.separator,
            mark: None,
            remarks: found.remarks,
            counts: found.counts,
            waiting: found.has_row,
            iso_origin: None,
            quoted: QuotedRow {
                reader: reader.build(),
                text: Vec::new(),
                ends: Vec::new(),
            },
            rows: 0,
        };
        let mut header = Header::of(found.names);
        header.line = Some(found.line);
        header.row_units = found.units;
        Ok((rows, header))
    }

    pub(super) fn bytes_read(&self) -> u64 {
        self.lines.bytes
    }

    /// Returns the assumptions so far.
    pub(super) fn remarks(&self) -> Vec<Remark> {
        let iso = self.iso_origin.map(|_| Remark::CountedTime {
            what: "dates or times of day (ISO 8601)",
        });
        self.remarks.iter().cloned().chain(iso).collect()
    }

    /// Reads the next row into `values`, one per column; returns its line, or `None` at the end.
    ///
    /// Text in a column that need not be a number becomes NaN.
    pub(super) fn next_row(
        &mut self,
        layout: &Layout,
        values: &mut [f64],
    ) -> Result<Option<u64>, DataError> {
        if !std::mem::take(&mut self.waiting) && !self.lines.next_line()? {
            return Ok(None);
        }
        if self.lines.line.trim_ascii().is_empty() {
            return self.only_empty_lines_left(layout).map(|()| None);
        }
        let row = self.lines.number;
        let is_cut = self.lines.is_cut();
        if is_cut && self.rows >= SPARED {
            self.remarks.push(Remark::CutRow { line: row });
            return Ok(None);
        }
        // Put back below: the fields are read from it while the state of the file changes.
        let line = std::mem::take(&mut self.lines.line);
        let found = match self.separator {
            Separator::Blank => self.blank_fields(layout, values, &line).map(Some),
            _ => self.plain_fields(layout, values, &line),
        };
        self.lines.line = line;
        let found = match found {
            Ok(None) => self.quoted_fields(layout, values),
            found => found.map(Option::unwrap_or_default),
        };
        if let (true, Some(number)) = (self.counts, values.first_mut()) {
            *number = f64::NAN;
        }
        if is_cut {
            let is_whole = matches!(found, Ok(found) if found == layout.columns.len());
            let remark = match is_whole {
                true => Remark::OpenEnd { line: row },
                false => Remark::CutRow { line: row },
            };
            self.remarks.push(remark);
            self.rows += u64::from(is_whole);
            return Ok(is_whole.then_some(row));
        }
        let found = found?;
        if found != layout.columns.len() {
            return Err(self.field_count(layout, row, found));
        }
        self.rows += 1;
        Ok(Some(row))
    }

    /// Reads the fields of a line; returns their number, or `None` if there are quotation marks.
    fn plain_fields(
        &mut self,
        layout: &Layout,
        values: &mut [f64],
        line: &[u8],
    ) -> Result<Option<usize>, DataError> {
        let separator = self.separator.byte();
        let mut found = 0;
        let mut rest = line;
        loop {
            let (quick, used, marked) = decimal(rest, self.mark.unwrap_or(b'.'));
            let column = layout.columns.get(found);
            let is_whole = rest.get(used).is_none_or(|b| *b == separator);
            let end = match quick {
                Some(value) if is_whole && value.abs() <= LARGEST_QUICK => {
                    self.keep(values, found, column, value, marked);
                    used
                }
                _ => {
                    if rest.contains(&b'"') {
                        return Ok(None);
                    }
                    let end = rest.iter().position(|b| *b == separator);
                    let end = end.unwrap_or(rest.len());
                    // The whole line is one field, so the separator is another one.
                    if end == line.len() && layout.columns.len() > 1 {
                        return Ok(Some(1));
                    }
                    self.field(values, found, column, &rest[..end])?;
                    end
                }
            };
            found += 1;
            match rest.get(end + 1..) {
                Some(more) => rest = more,
                None => break,
            }
        }
        Ok(Some(found))
    }

    /// Stores a plain number.
    #[inline]
    fn keep(
        &mut self,
        values: &mut [f64],
        found: usize,
        column: Option<&FileColumn>,
        value: f64,
        marked: bool,
    ) {
        if let (Some(place), Some(column)) = (values.get_mut(found), column) {
            *place = value;
            if marked && column.strict && self.mark.is_none() {
                self.mark = Some(b'.');
            }
        }
    }

    /// Reads a line like [`CsvRows::plain_fields`], with columns separated by blanks and tabs.
    fn blank_fields(
        &mut self,
        layout: &Layout,
        values: &mut [f64],
        line: &[u8],
    ) -> Result<usize, DataError> {
        let mut found = 0;
        let fields = line.split(u8::is_ascii_whitespace);
        for field in fields.filter(|f| !f.is_empty()) {
            self.field(values, found, layout.columns.get(found), field)?;
            found += 1;
        }
        Ok(found)
    }

    /// Reads the last line like [`CsvRows::plain_fields`]. It has quotation marks, and a quoted field may continue in
    /// the lines after it.
    fn quoted_fields(&mut self, layout: &Layout, values: &mut [f64]) -> Result<usize, DataError> {
        let first = self.lines.number;
        let open = |rows: &Self| DataError::OpenQuote {
            path: rows.lines.path.clone(),
            line: first,
        };
        let separator = self.separator.byte();
        let (mut used, mut count) = (0, 0);
        self.quoted.reader.reset();
        loop {
            let line = &self.lines.line;
            let QuotedRow { reader, text, ends } = &mut self.quoted;
            text.resize(used + line.len() + 1, 0);
            let separators = line.iter().filter(|b| **b == separator).count();
            ends.resize(count + separators + 2, 0);
            let mut done = false;
            for input in [line.as_slice(), b"\n"] {
                let (result, _, out, fields) =
                    reader.read_record(input, &mut text[used..], &mut ends[count..]);
                used += out;
                count += fields;
                done = result == ReadRecordResult::Record;
            }
            if done {
                break;
            }
            if used > LONGEST_LINE || !self.lines.next_line()? {
                return Err(open(self));
            }
        }
        let text = std::mem::take(&mut self.quoted.text);
        let ends = std::mem::take(&mut self.quoted.ends);
        let mut start = 0;
        let mut read = Ok(count);
        for (found, end) in ends.iter().take(count).enumerate() {
            let field = text.get(start..*end).unwrap_or_default();
            start = *end;
            if let Err(error) = self.field(values, found, layout.columns.get(found), field) {
                read = Err(error);
                break;
            }
        }
        (self.quoted.text, self.quoted.ends) = (text, ends);
        read
    }

    /// Reads one field in any notation.
    fn field(
        &mut self,
        values: &mut [f64],
        found: usize,
        column: Option<&FileColumn>,
        field: &[u8],
    ) -> Result<(), DataError> {
        let (Some(place), Some(column)) = (values.get_mut(found), column) else {
            return Ok(());
        };
        let own = if field.contains(&b',') { b',' } else { b'.' };
        let value = number(field, own);
        *place = value;
        if !column.strict {
            return Ok(());
        }
        if value.is_nan()
            && column.role == Role::Time
            && let Some((seconds, nanoseconds)) = std::str::from_utf8(field).ok().and_then(iso_time)
        {
            // Whole seconds are subtracted before the sum, which so keeps the nanoseconds.
            let origin = *self.iso_origin.get_or_insert(seconds);
            if let Some(place) = values.get_mut(found) {
                *place = (seconds - origin) as f64 + nanoseconds as f64 * 1e-9;
            }
            return Ok(());
        }
        if !value.is_finite() {
            return Err(self.not_a_number(&column.label, field));
        }
        if value.abs() > column.largest() {
            let place = Place::Line(self.lines.number);
            return Err(column.out_of_range(&self.lines.path, place, value));
        }
        if field.contains(&own) {
            let mark = *self.mark.get_or_insert(own);
            if mark != own {
                return Err(DataError::MixedDecimals {
                    path: self.lines.path.clone(),
                    line: self.lines.number,
                    column: column.label.clone(),
                    found: String::from_utf8_lossy(field.trim_ascii()).into_owned(),
                    is_comma: own == b',',
                });
            }
            let is_known = |r: &Remark| matches!(r, Remark::QuotedDecimalComma { .. });
            if own == b','
                && self.separator == Separator::Comma
                && !self.remarks.iter().any(is_known)
            {
                self.remarks.push(Remark::QuotedDecimalComma {
                    line: self.lines.number,
                });
            }
        }
        Ok(())
    }

    /// Checks that only empty lines follow: they may end a file but not interrupt it.
    fn only_empty_lines_left(&mut self, layout: &Layout) -> Result<(), DataError> {
        let line = self.lines.number;
        while self.lines.next_line()? {
            if !self.lines.line.trim_ascii().is_empty() {
                return Err(self.field_count(layout, line, 0));
            }
        }
        Ok(())
    }

    fn field_count(&self, layout: &Layout, line: u64, found: usize) -> DataError {
        let hint = match layout.columns.get(found) {
            Some(_) if found == 1 => format!(
                "columns are separated by {}, as in the header",
                self.separator.name()
            ),
            Some(column) => format!("the first one missing is `{}`", column.label),
            None if self.separator == Separator::Comma => {
                "a decimal comma makes two fields of a number: write numbers with a decimal point, or separate the columns by `;`"
                    .to_owned()
            }
            None => "the last field named is the last that may stand there".to_owned(),
        };
        DataError::FieldCount {
            path: self.lines.path.clone(),
            line,
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
            path: self.lines.path.clone(),
            place: Place::Line(self.lines.number),
            column: column.to_owned(),
            found,
        }
    }
}
