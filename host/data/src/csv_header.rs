//! Header and column separator of a CSV file.

use std::path::Path;

use csv_core::{ReaderBuilder, Terminator};

use super::error::DataError;
use super::number::number;
use super::remark::Remark;
use super::time_names::is_time;
use super::unit::Unit;

/// Name of a first column that has none and counts the rows.
pub(super) const ROW_NUMBER: &str = "(row number)";

/// Separator between two columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Separator {
    Comma,
    Semicolon,
    Tab,
    /// Any number of blanks and tabs.
    Blank,
}

impl Separator {
    pub(super) fn byte(self) -> u8 {
        match self {
            Self::Comma => b',',
            Self::Semicolon => b';',
            Self::Tab => b'\t',
            Self::Blank => b' ',
        }
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Comma => "commas",
            Self::Semicolon => "`;`",
            Self::Tab => "tabs",
            Self::Blank => "blanks",
        }
    }

    /// Splits a line into names or fields without quotation marks.
    pub(super) fn split(self, text: &str) -> Vec<String> {
        let unquoted = |name: &str| {
            let name = name.trim();
            let inner = name.strip_prefix('"').and_then(|n| n.strip_suffix('"'));
            inner.unwrap_or(name).trim().to_owned()
        };
        if self == Self::Blank {
            return text.split_whitespace().map(unquoted).collect();
        }
        let mut reader = ReaderBuilder::new();
        let mut reader = reader
            .delimiter(self.byte())
            .terminator(Terminator::Any(b'\n'))
            .build();
        let line = format!("{text}\n\n");
        let mut fields = vec![0; line.len()];
        let mut ends = vec![0; line.len()];
        let (_, _, _, count) = reader.read_record(line.as_bytes(), &mut fields, &mut ends);
        let mut names = Vec::with_capacity(count);
        let mut start = 0;
        for end in ends.into_iter().take(count) {
            let name = fields.get(start..end).unwrap_or_default();
            names.push(unquoted(&String::from_utf8_lossy(name)));
            start = end;
        }
        names
    }

    /// Returns the separator of this header line and its names. The separator that yields a column `t` is taken,
    /// otherwise the one that yields most columns. A name such as `t [s]` has blanks, so blanks count only if they fit
    /// more of the `rows` behind the header than any other separator in it.
    fn of(text: &str, rows: &[String]) -> (Self, Vec<String>) {
        let all = [Self::Comma, Self::Semicolon, Self::Tab, Self::Blank];
        let mut tried = all.map(|s| (s, s.split(text)));
        let fitting = |(by, names): &(Self, Vec<String>)| match names.len() {
            0 | 1 => None,
            n => Some(rows.iter().filter(|row| by.split(row).len() == n).count()),
        };
        let others = tried[..3].iter().filter_map(fitting).max();
        let takes_blanks = fitting(&tried[3]) > others;
        let found = |is_it: fn(&str) -> bool| {
            (0..tried.len()).find(|k| {
                let names = &tried[*k].1;
                names.len() > 1 && names.iter().any(|n| is_it(n)) && (*k < 3 || takes_blanks)
            })
        };
        let best = found(|name| name == "t").or_else(|| found(is_time));
        let best = best.unwrap_or_else(|| {
            // `max_by_key` returns the last of equal values, so the order is reversed to take the first.
            let count = |k: &usize| tried[*k].1.len();
            (0..3).rev().max_by_key(count).unwrap_or(0)
        });
        let names = std::mem::take(&mut tried[best].1);
        (all[best], names)
    }
}

/// A file that is read line by line.
pub(super) trait Lines {
    /// Reads the next line; returns false at the end of the file.
    fn next_line(&mut self) -> Result<bool, DataError>;
    /// Returns the last line, without its end.
    fn line(&self) -> &[u8];
    /// Returns its number, from 1.
    fn number(&self) -> u64;
    /// Returns lines behind it that are read already.
    fn ahead(&self) -> Vec<String>;
    /// Returns the path of the file.
    fn path(&self) -> &Path;
}

/// The header of a file.
pub(super) struct FoundHeader {
    pub names: Vec<String>,
    pub separator: Separator,
    /// Its line.
    pub line: u64,
    /// True if the last line is a row, because the header was a comment.
    pub has_row: bool,
    /// Units that the row behind the header states, one per column; empty without such a row.
    pub units: Vec<Unit>,
    /// True if the first column counts the rows; its name is [`ROW_NUMBER`].
    pub counts: bool,
    pub remarks: Vec<Remark>,
}

impl FoundHeader {
    /// Takes a row of units behind the header, which is the last line if `row` has its text.
    fn take_units(&mut self, row: Option<&str>, lines: &mut impl Lines) -> Result<(), DataError> {
        let ahead = match row {
            Some(row) => Some(row.to_owned()),
            None => lines.ahead().into_iter().next(),
        };
        let fields = ahead.map(|text| self.separator.split(&text));
        let Some(fields) = fields.filter(|own| own.len() == self.names.len()) else {
            return Ok(());
        };
        let units: Vec<Unit> = fields.iter().filter_map(|own| Unit::named(own)).collect();
        if units.len() != self.names.len() {
            return Ok(());
        }
        if row.is_none() {
            while lines.next_line()? && lines.line().trim_ascii().is_empty() {}
        }
        self.units = units;
        self.has_row = false;
        let line = lines.number();
        self.remarks.push(Remark::UnitsRow { line });
        Ok(())
    }

    /// Names a first column that has no name and counts these rows, from any whole number on.
    fn name_counts(&mut self, rows: &[String]) {
        if self.names.len() < 2 || !self.names[0].is_empty() || rows.is_empty() {
            return;
        }
        let number = |row: &String| self.separator.split(row).first()?.parse::<u64>().ok();
        let numbers: Vec<Option<u64>> = rows.iter().map(number).collect();
        let is_next = |pair: &[Option<u64>]| pair[1] == pair[0].and_then(|own| own.checked_add(1));
        if numbers.iter().all(Option::is_some) && numbers.windows(2).all(is_next) {
            self.names[0] = ROW_NUMBER.to_owned();
            self.counts = true;
            self.remarks.push(Remark::RowNumbers);
        }
    }
}

/// A comment line.
struct Comment {
    sign: char,
    line: u64,
    text: String,
}

/// Reads up to the header; empty lines, comments and the separator line of spreadsheet programs may precede it.
pub(super) fn find_header(lines: &mut impl Lines) -> Result<FoundHeader, DataError> {
    let mut comment: Option<Comment> = None;
    while lines.next_line()? {
        let line = lines.number();
        let bytes = lines.line();
        let bytes = match line {
            1 => bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes),
            _ => bytes,
        };
        // The name of the first column may be empty.
        let is_nameless = bytes.starts_with(b"\t");
        let bytes = bytes.trim_ascii();
        if bytes.is_empty() || (bytes.len() == 5 && bytes.starts_with(b"sep=")) {
            continue;
        }
        let not_text = || DataError::NotText {
            path: lines.path().into(),
            line,
        };
        let text = std::str::from_utf8(bytes).map_err(|_| not_text())?;
        let text = text.trim();
        if text.chars().any(|c| c.is_control() && c != '\t') {
            return Err(not_text());
        }
        if let Some(behind) = text.strip_prefix(['#', '%']) {
            comment = Some(Comment {
                sign: if text.starts_with('#') { '#' } else { '%' },
                line,
                text: behind.trim_start_matches(['#', '%']).trim().to_owned(),
            });
            continue;
        }
        let text = match is_nameless && text.contains('\t') {
            true => format!("\t{text}"),
            false => text.to_owned(),
        };
        let mut found = header(&text, line, comment, lines.ahead());
        let row = found.has_row.then_some(text);
        found.take_units(row.as_deref(), lines)?;
        let rows = row.into_iter().filter(|_| found.has_row);
        let rows: Vec<String> = rows.chain(lines.ahead()).collect();
        found.name_counts(&rows);
        return Ok(found);
    }
    Err(DataError::Empty {
        path: lines.path().into(),
    })
}

/// Returns this line as the header, or the comment before it if this line is a row that fits it.
fn header(text: &str, line: u64, comment: Option<Comment>, mut ahead: Vec<String>) -> FoundHeader {
    let (separator, names) = Separator::of(text, &ahead);
    let mut remarks = Vec::new();
    if let Some(comment) = comment {
        ahead.insert(0, text.to_owned());
        let (by, named) = Separator::of(&comment.text, &ahead);
        let row = by.split(text);
        // In a row a comma may be a decimal comma, in names it is not.
        let is_number = |field: &String| {
            let mark = if field.contains(',') { b',' } else { b'.' };
            number(field.as_bytes(), mark).is_finite()
        };
        let is_row = row.iter().any(is_number) || row.iter().all(|own| Unit::named(own).is_some());
        let fits = row.len() == named.len() && is_row;
        let has_time = |names: &[String]| names.len() > 1 && names.iter().any(|n| is_time(n));
        if fits && !has_time(&names) && has_time(&named) {
            remarks.push(Remark::CommentedHeader {
                line: comment.line,
                sign: comment.sign,
            });
            return FoundHeader {
                names: named,
                separator: by,
                line: comment.line,
                has_row: true,
                units: Vec::new(),
                counts: false,
                remarks: with_separator(remarks, by),
            };
        }
    }
    if line > 1 {
        remarks.push(Remark::Preamble { before: line - 1 });
    }
    FoundHeader {
        names,
        separator,
        line,
        has_row: false,
        units: Vec::new(),
        counts: false,
        remarks: with_separator(remarks, separator),
    }
}

fn with_separator(mut remarks: Vec<Remark>, separator: Separator) -> Vec<Remark> {
    if separator != Separator::Comma {
        remarks.push(Remark::Separator {
            separator: separator.name(),
        });
    }
    remarks
}
