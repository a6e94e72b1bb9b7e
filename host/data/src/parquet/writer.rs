//! Writes Parquet files: required columns of doubles, plain and not compressed.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use parquet::basic::{Encoding, Repetition, Type as Physical};
use parquet::data_type::DoubleType;
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use tempfile::NamedTempFile;

use crate::error::DataError;
use crate::written_rows::{Column, Rows};
use rig_output::persist;

/// Rows of a group: 1 MiB a column, as other writers take.
const GROUP: usize = 1 << 17;

/// Parquet writer. Equal rows give equal bytes; units and metadata are in the footer.
pub struct ParquetWriter {
    pub(crate) rows: Rows,
    out: SerializedFileWriter<NamedTempFile>,
    /// Rows of the group that is not written yet, column by column.
    values: Vec<Vec<f64>>,
}

impl ParquetWriter {
    /// Starts the file; see [`crate::RecordingWriter::create`].
    pub fn create(
        path: &Path,
        columns: &[Column],
        metadata: &BTreeMap<String, String>,
    ) -> Result<Self, DataError> {
        let (rows, file) = Rows::start(path, columns)?;
        let out = start(file, columns, metadata).map_err(|e| rows.failed(other(e)))?;
        Ok(Self {
            values: vec![Vec::new(); columns.len()],
            rows,
            out,
        })
    }

    /// Appends a row.
    pub fn push_row(&mut self, row: &[f64]) -> Result<(), DataError> {
        self.rows.accept(row)?;
        for (column, value) in self.values.iter_mut().zip(row) {
            column.push(*value);
        }
        if self.values.first().is_some_and(|own| own.len() == GROUP) {
            self.write_group().map_err(|e| self.rows.failed(other(e)))?;
        }
        Ok(())
    }

    fn write_group(&mut self) -> Result<(), ParquetError> {
        let mut group = self.out.next_row_group()?;
        for values in &mut self.values {
            if let Some(mut column) = group.next_column()? {
                column
                    .typed::<DoubleType>()
                    .write_batch(values, None, None)?;
                column.close()?;
            }
            values.clear();
        }
        group.close().map(drop)
    }

    /// Completes the file.
    pub fn finish(mut self) -> Result<(), DataError> {
        let is_left = self.values.first().is_some_and(|own| !own.is_empty());
        let written = match is_left {
            true => self.write_group(),
            false => Ok(()),
        };
        let Self { rows, out, .. } = self;
        let file = written.and_then(|()| out.into_inner());
        let file = file.map_err(|e| rows.failed(other(e)))?;
        persist(file, &rows.path).map_err(|e| rows.failed(e))
    }
}

/// Writes what stands before the rows.
fn start(
    file: NamedTempFile,
    columns: &[Column],
    metadata: &BTreeMap<String, String>,
) -> Result<SerializedFileWriter<NamedTempFile>, ParquetError> {
    let fields: Result<Vec<_>, ParquetError> = (columns.iter())
        .map(|column| {
            let field = Type::primitive_type_builder(&column.name, Physical::DOUBLE);
            let field = field.with_repetition(Repetition::REQUIRED).build()?;
            Ok(Arc::new(field))
        })
        .collect();
    let schema = Type::group_type_builder("recording");
    let schema = schema.with_fields(fields?).build()?;
    let units: serde_json::Map<String, serde_json::Value> = (columns.iter())
        .map(|column| (column.name.clone(), column.unit.as_str().into()))
        .collect();
    let units = serde_json::Value::from(units).to_string();
    let metadata = metadata.iter().map(|(k, v)| (k.clone(), v.clone()));
    let metadata = metadata.chain([("units".to_owned(), units)]);
    let properties = WriterProperties::builder()
        .set_created_by("rig".to_owned())
        .set_dictionary_enabled(false)
        .set_encoding(Encoding::PLAIN)
        .set_statistics_enabled(EnabledStatistics::None)
        .set_key_value_metadata(Some(metadata.map(|(k, v)| KeyValue::new(k, v)).collect()))
        .build();
    SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties))
}

/// Returns the error of the disk that the crate wraps.
fn other(error: ParquetError) -> std::io::Error {
    match error {
        ParquetError::External(source) => match source.downcast::<std::io::Error>() {
            Ok(own) => *own,
            Err(source) => std::io::Error::other(source),
        },
        error => std::io::Error::other(error),
    }
}
