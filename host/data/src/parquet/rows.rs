//! Rows of a Parquet file. Memory holds one page a column.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::file::metadata::ParquetMetaData;

use super::column::ColumnReader;
use super::footer::{DAMAGED, footer};
use super::number::Number;
use super::schema::{Leaf, columns};
use crate::array::names_of;
use crate::columns::Layout;
use crate::error::DataError;
use crate::header::Header;
use crate::place::Place;
use crate::remark::Remark;
use crate::time_names::is_time;
use crate::unit::Unit;

/// Most elements of a list: more are no joints, as in messages.
const LONGEST: usize = 128;

/// Beginning of the name of a column that pandas writes for an index without a name.
const INDEX: &str = "__index_level_";

/// A stored column, which gives one column of the recording or, as a list, several.
struct Column {
    leaf: Leaf,
    reader: ColumnReader,
    count: usize,
    /// Whole seconds of the first time stamp.
    origin: Option<i64>,
}

/// Reader of rows.
pub(crate) struct ParquetRows {
    path: PathBuf,
    footer: Arc<ParquetMetaData>,
    columns: Vec<Column>,
    /// Names and contents of columns that are not read.
    others: Vec<String>,
    /// Groups that were entered, and rows of the last one that are still to come.
    group: usize,
    left: i64,
    /// Rows so far.
    row: u64,
    bytes: u64,
    /// Columns without a value in the last row.
    missing: Vec<usize>,
}

impl ParquetRows {
    /// Opens a file.
    pub(crate) fn open(path: &Path) -> Result<(Self, Header), DataError> {
        let failed = |source| DataError::Read {
            path: path.into(),
            source,
        };
        let file = File::open(path).map_err(failed)?;
        let bytes = file.metadata().map_err(failed)?.len();
        let refused = |message| DataError::Bag {
            path: path.into(),
            message,
        };
        let footer = footer(&file, bytes).map_err(refused)?;
        let (file, footer) = (Arc::new(file), Arc::new(footer));
        let found = columns(footer.file_metadata().schema());
        let mut rows = Self {
            path: path.into(),
            columns: Vec::new(),
            others: found.others,
            footer,
            group: 0,
            left: 0,
            row: 0,
            bytes,
            missing: Vec::new(),
        };
        for leaf in &found.leaves {
            rows.add(&file, leaf).map_err(refused)?;
        }
        if rows.columns.is_empty() {
            return Err(refused(
                "the Parquet file holds no columns of numbers; give columns t, q1, tau1 and so on, or lists q and tau of equal length"
                    .into(),
            ));
        }
        let header = rows.header();
        Ok((rows, header))
    }

    /// Adds a stored column, or notes why it is none.
    fn add(&mut self, file: &Arc<File>, leaf: &Leaf) -> Result<(), String> {
        let mut note = |what: &str| {
            self.others
                .push(format!("{} ({what})", leaf.name.escape_debug()));
        };
        if leaf.name.starts_with(INDEX) && leaf.number == Number::Plain {
            note("index of pandas");
            return Ok(());
        }
        let reader = ColumnReader::new(file, &self.footer, leaf);
        let count = match leaf.is_list {
            true => length(ColumnReader::new(file, &self.footer, leaf))?,
            false => 1,
        };
        match count {
            0 => note("empty lists"),
            LONGEST.. if count > LONGEST => note("long lists"),
            _ => self.columns.push(Column {
                leaf: leaf.clone(),
                reader,
                count,
                origin: None,
            }),
        }
        Ok(())
    }

    /// Names the columns. Those of a list are named as those of an array; an index of time stamps without a name is the time of
    /// a file without another.
    fn header(&self) -> Header {
        let stored: Vec<String> = self
            .columns
            .iter()
            .map(|own| own.leaf.name.clone())
            .collect();
        let has_time = stored.iter().any(|name| is_time(name));
        let mut header = Header::default();
        for own in &self.columns {
            let name = &own.leaf.name;
            let labels = match own.leaf.is_list {
                true => names_of(name, own.count, &stored),
                false => vec![name.clone()],
            };
            // A time stamp has its unit in its type.
            let is_clock = own.leaf.number.is_clock();
            let bare = Unit::split(name).map_or(name.as_str(), |(bare, _)| bare);
            let is_time_index = is_clock && name.starts_with(INDEX) && !has_time;
            for label in labels {
                let label = match is_time_index {
                    true => "time".to_owned(),
                    false => label,
                };
                header.names.push(label.clone());
                header.stems.push(match is_clock {
                    true => bare.to_owned(),
                    false => label.clone(),
                });
                header.labels.push(label);
            }
        }
        header
    }

    /// Returns true if column `k` holds time stamps or times of day.
    pub(crate) fn is_clock(&self, k: usize) -> bool {
        let numbers = self.columns.iter();
        let mut all = numbers.flat_map(|own| std::iter::repeat_n(own.leaf.number, own.count));
        all.nth(k).is_some_and(|number| number.is_clock())
    }

    /// Returns the share of the file that the rows so far are, bytes.
    pub(crate) fn bytes_read(&self) -> u64 {
        let rows = self.footer.file_metadata().num_rows();
        let share = self.row as f64 / rows.max(1) as f64;
        (self.bytes as f64 * share.min(1.0)) as u64
    }

    /// Returns the columns that are not read, and whether times are counted.
    pub(crate) fn remarks(&self) -> Vec<Remark> {
        let others = (!self.others.is_empty()).then(|| Remark::OtherColumns {
            names: self.others.join(", "),
        });
        let is_counted = self.columns.iter().any(|own| own.origin.is_some());
        let counted = is_counted.then_some(Remark::CountedTime {
            what: "time stamps or times of day",
        });
        others.into_iter().chain(counted).collect()
    }

    /// Reads the next row into `values`; returns its number from 1, or `None` at the end.
    pub(crate) fn next_row(
        &mut self,
        layout: &Layout,
        values: &mut [f64],
    ) -> Result<Option<u64>, DataError> {
        let Some(row) = self.next_values(values)? else {
            return Ok(None);
        };
        let Some((k, column, value)) = layout.refused(values) else {
            return Ok(Some(row));
        };
        let place = Place::Row(row);
        Err(match self.missing.contains(&k) {
            true => DataError::NotANumber {
                path: self.path.clone(),
                place,
                column: column.label.clone(),
                found: "nothing".into(),
            },
            false => column.no_measurement(&self.path, place, value),
        })
    }

    /// Reads the next row whatever it holds; a missing value is NaN.
    pub(crate) fn next_values(&mut self, values: &mut [f64]) -> Result<Option<u64>, DataError> {
        while self.left == 0 {
            let Some(group) = self.footer.row_groups().get(self.group) else {
                return Ok(None);
            };
            self.left = group.num_rows().max(0);
            for column in &mut self.columns {
                column.reader.enter(self.group);
            }
            self.group += 1;
        }
        self.left -= 1;
        self.row += 1;
        self.missing.clear();
        let mut at = 0;
        for column in &mut self.columns {
            let own = values.get_mut(at..at + column.count).unwrap_or_default();
            let read = column.read(self.row, own, at, &mut self.missing);
            read.map_err(|message| DataError::Bag {
                path: self.path.clone(),
                message,
            })?;
            at += column.count;
        }
        Ok(Some(self.row))
    }
}

impl Column {
    /// Reads the values of a row. The first of them is column `at` of the recording.
    fn read(
        &mut self,
        row: u64,
        values: &mut [f64],
        at: usize,
        missing: &mut Vec<usize>,
    ) -> Result<(), String> {
        for (k, place) in values.iter_mut().enumerate() {
            let item = self.reader.next()?;
            let item = match item {
                Some(item) if self.leaf.is_list => {
                    if item.is_empty || item.begins != (k == 0) {
                        let is_longer = k == 0 && !item.begins;
                        return Err(self.uneven(row - u64::from(is_longer), is_longer));
                    }
                    item
                }
                Some(item) => item,
                None if k > 0 => return Err(self.uneven(row, false)),
                None => return Err(DAMAGED.into()),
            };
            *place = match item.value {
                Some(stored) => self.leaf.number.value(stored, &mut self.origin),
                None => {
                    missing.push(at + k);
                    f64::NAN
                }
            };
        }
        Ok(())
    }

    fn uneven(&self, row: u64, is_longer: bool) -> String {
        format!(
            "row {row} of column `{}` is a list of {} than {} values, as row 1 has them; write lists of equal length, one value a joint",
            self.leaf.name.escape_debug(),
            if is_longer { "more" } else { "fewer" },
            self.count
        )
    }
}

/// Returns the length of the first list of a column, at most one more than [`LONGEST`].
fn length(mut reader: ColumnReader) -> Result<usize, String> {
    let mut count = 0;
    while count <= LONGEST
        && let Some(item) = reader.next()?
        && !item.is_empty
        && (count == 0 || !item.begins)
    {
        count += 1;
    }
    Ok(count)
}
