//! Values of one column, one behind the other, with some hundred rows and a page in memory.

use std::fs::File;
use std::sync::Arc;

use parquet::column::reader::{ColumnReader as Typed, ColumnReaderImpl};
use parquet::errors::ParquetError;
use parquet::file::metadata::ParquetMetaData;
use parquet::file::properties::ReaderProperties;
use parquet::file::reader::RowGroupReader;
use parquet::file::serialized_reader::SerializedRowGroupReader;

use super::footer::{DAMAGED, refusal};
use super::number::{Numeric, Stored};
use super::schema::Leaf;
use crate::library_panic::caught;

/// Rows that are decoded at a time.
const ROWS: usize = 512;

/// A stored element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Item {
    /// `None` if the value is missing.
    pub value: Option<Stored>,
    /// True for the first element of a row.
    pub begins: bool,
    /// True if the row holds an empty list, or none.
    pub is_empty: bool,
}

/// Reader of a column.
pub(super) struct ColumnReader {
    file: Arc<File>,
    footer: Arc<ParquetMetaData>,
    leaf: Leaf,
    /// Group of rows that is read.
    group: usize,
    pages: Option<Typed>,
    decoded: Decoded,
    /// The next element of `decoded`, and the next of its values.
    at: usize,
    value: usize,
}

/// Some rows.
#[derive(Debug, Default)]
struct Decoded {
    /// Number of elements.
    count: usize,
    repetition: Vec<i16>,
    definition: Vec<i16>,
    /// Those that are not missing.
    values: Vec<Stored>,
}

impl ColumnReader {
    /// Begins with the first group of rows.
    pub(super) fn new(file: &Arc<File>, footer: &Arc<ParquetMetaData>, leaf: &Leaf) -> Self {
        Self {
            file: file.clone(),
            footer: footer.clone(),
            leaf: leaf.clone(),
            group: 0,
            pages: None,
            decoded: Decoded::default(),
            at: 0,
            value: 0,
        }
    }

    /// Goes to a group of rows.
    pub(super) fn enter(&mut self, group: usize) {
        (self.group, self.at, self.pages) = (group, 0, None);
        self.decoded.count = 0;
    }

    /// Reads the next element of the group; `None` at its end.
    ///
    /// # Errors
    /// What is damaged or not supported, one clause.
    #[inline]
    pub(super) fn next(&mut self) -> Result<Option<Item>, String> {
        if self.at == self.decoded.count && !self.decode()? {
            return Ok(None);
        }
        let (leaf, decoded) = (&self.leaf, &self.decoded);
        let level = |levels: &[i16]| levels.get(self.at).copied();
        let begins = !leaf.is_list || level(&decoded.repetition) == Some(0);
        let level = level(&decoded.definition).unwrap_or(leaf.defined);
        self.at += 1;
        let value = match level == leaf.defined {
            true => {
                self.value += 1;
                Some(*decoded.values.get(self.value - 1).ok_or(DAMAGED)?)
            }
            false => None,
        };
        Ok(Some(Item {
            value,
            begins,
            is_empty: leaf.is_list && level + i16::from(leaf.is_optional) < leaf.defined,
        }))
    }

    /// Decodes further rows; returns false at the end of the group.
    fn decode(&mut self) -> Result<bool, String> {
        if self.pages.is_none() {
            self.pages = Some(self.open()?);
        }
        (self.at, self.value) = (0, 0);
        let (decoded, pages) = (&mut self.decoded, &mut self.pages);
        // The crate panics at some damages, for instance at values of a dictionary that is missing (`parquet` 59.3).
        let read = caught(|| match pages {
            Some(Typed::BoolColumnReader(pages)) => decoded.read(pages),
            Some(Typed::Int32ColumnReader(pages)) => decoded.read(pages),
            Some(Typed::Int64ColumnReader(pages)) => decoded.read(pages),
            Some(Typed::Int96ColumnReader(pages)) => decoded.read(pages),
            Some(Typed::FloatColumnReader(pages)) => decoded.read(pages),
            Some(Typed::DoubleColumnReader(pages)) => decoded.read(pages),
            _ => Err(ParquetError::NYI("a column without numbers".into())),
        });
        match read {
            Some(Ok(())) => Ok(self.decoded.count > 0),
            Some(Err(_)) | None => Err(DAMAGED.into()),
        }
    }

    /// Opens the pages of the group.
    fn open(&self) -> Result<Typed, String> {
        let groups = self.footer.row_groups();
        let group = groups.get(self.group).ok_or(DAMAGED)?;
        let chunk = group.columns().get(self.leaf.at).ok_or(DAMAGED)?;
        if let Some(why) = refusal(chunk) {
            let name = self.leaf.name.escape_debug();
            return Err(format!("column `{name}` of the Parquet file {why}"));
        }
        let properties = Arc::new(ReaderProperties::builder().build());
        let reader = SerializedRowGroupReader::new(self.file.clone(), group, None, properties);
        let reader = reader.and_then(|own| own.get_column_reader(self.leaf.at));
        reader.map_err(|_| DAMAGED.into())
    }
}

impl Decoded {
    fn read<T: Numeric>(&mut self, pages: &mut ColumnReaderImpl<T>) -> Result<(), ParquetError> {
        self.repetition.clear();
        self.definition.clear();
        let mut values = Vec::with_capacity(ROWS);
        let levels = (&mut self.definition, &mut self.repetition);
        let (_, _, count) =
            pages.read_records(ROWS, Some(levels.0), Some(levels.1), &mut values)?;
        self.count = count;
        self.values.clear();
        self.values.extend(values.iter().map(T::stored));
        Ok(())
    }
}
