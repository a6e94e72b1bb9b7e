//! Writes recordings atomically; equal rows give equal bytes.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use ::mcap::records::MessageHeader;
use tempfile::NamedTempFile;

use super::error::DataError;
use super::mcap_rows::TOPIC;
use super::parquet::ParquetWriter;
use super::written_rows::{Column, Rows};
use rig_output::format_short;
use rig_output::persist;

/// Writer of one recording; the file gets its name in [`RecordingWriter::finish`].
pub enum RecordingWriter {
    /// `.csv`
    Csv(CsvWriter),
    /// `.mcap`
    Mcap(Box<McapWriter>),
    /// `.parquet`
    Parquet(Box<ParquetWriter>),
}

impl RecordingWriter {
    /// Starts a recording in the format of the file extension; the first column must be `t`.
    ///
    /// MCAP and Parquet store units and metadata; CSV has only a header line and cannot.
    pub fn create(
        path: &Path,
        columns: &[Column],
        metadata: &BTreeMap<String, String>,
    ) -> Result<Self, DataError> {
        let extension = path
            .extension()
            .and_then(|e| e.to_str())
            .map(str::to_ascii_lowercase);
        match extension.as_deref() {
            Some("csv") => CsvWriter::create(path, columns).map(Self::Csv),
            Some("mcap") => {
                McapWriter::create(path, columns, metadata).map(|w| Self::Mcap(Box::new(w)))
            }
            Some("parquet") => {
                ParquetWriter::create(path, columns, metadata).map(|w| Self::Parquet(Box::new(w)))
            }
            _ => Err(DataError::UnknownFormat { path: path.into() }),
        }
    }

    /// Appends a row, one finite value per column.
    pub fn push_row(&mut self, row: &[f64]) -> Result<(), DataError> {
        match self {
            Self::Csv(w) => w.push_row(row),
            Self::Mcap(w) => w.push_row(row),
            Self::Parquet(w) => w.push_row(row),
        }
    }

    /// Returns the path of the hidden temporary file used until [`RecordingWriter::finish`]. A program that exits at
    /// once must remove it first.
    pub fn temporary(&self) -> &Path {
        match self {
            Self::Csv(w) => &w.rows.hidden,
            Self::Mcap(w) => &w.rows.hidden,
            Self::Parquet(w) => &w.rows.hidden,
        }
    }

    /// Completes the file and renames it; without this call no file remains.
    pub fn finish(self) -> Result<(), DataError> {
        match self {
            Self::Csv(w) => w.finish(),
            Self::Mcap(w) => w.finish(),
            Self::Parquet(w) => w.finish(),
        }
    }
}

/// CSV writer: a header line, then one line per row; numbers have the shortest form that reads back equal.
pub struct CsvWriter {
    rows: Rows,
    out: BufWriter<NamedTempFile>,
}

impl CsvWriter {
    /// Starts the file; see [`RecordingWriter::create`].
    pub fn create(path: &Path, columns: &[Column]) -> Result<Self, DataError> {
        let (rows, file) = Rows::start(path, columns)?;
        let mut out = BufWriter::with_capacity(1 << 17, file);
        writeln!(out, "{}", rows.names.join(",")).map_err(|e| rows.failed(e))?;
        Ok(Self { rows, out })
    }

    /// Appends a row.
    pub fn push_row(&mut self, row: &[f64]) -> Result<(), DataError> {
        self.rows.accept(row)?;
        let text = &mut self.rows.text;
        text.clear();
        for (i, value) in row.iter().enumerate() {
            if i > 0 {
                text.push(',');
            }
            push_number(text, *value);
        }
        text.push('\n');
        self.out
            .write_all(text.as_bytes())
            .map_err(|e| self.rows.failed(e))
    }

    /// Completes the file.
    pub fn finish(self) -> Result<(), DataError> {
        let Self { rows, out } = self;
        let file = out.into_inner().map_err(|e| rows.failed(e.into_error()))?;
        persist(file, &rows.path).map_err(|e| rows.failed(e))
    }
}

/// Writes the shortest form that reads back to the same number; whole numbers have no point.
fn push_number(text: &mut String, value: f64) {
    // Very large or small numbers in plain notation would have hundreds of digits.
    let magnitude = value.abs();
    let plain = value == 0.0 || (1e-5..1e16).contains(&magnitude);
    // Writing to a String cannot fail.
    let _ = if plain {
        write!(text, "{value}")
    } else {
        write!(text, "{value:e}")
    };
}

/// MCAP writer: one JSON message per row on `/joint/state`, with a JSON schema that names the units.
///
/// Log and publish time are `t` in nanoseconds, so that players show the recording's own time.
pub struct McapWriter {
    rows: Rows,
    out: ::mcap::Writer<BufWriter<NamedTempFile>>,
    channel: u16,
}

impl McapWriter {
    /// Starts the file; see [`RecordingWriter::create`].
    pub fn create(
        path: &Path,
        columns: &[Column],
        metadata: &BTreeMap<String, String>,
    ) -> Result<Self, DataError> {
        let (rows, file) = Rows::start(path, columns)?;
        let schema = schema(columns);
        let begin = || -> ::mcap::McapResult<_> {
            let mut out = ::mcap::WriteOptions::new()
                .compression(None)
                .library("rig")
                .create(BufWriter::with_capacity(1 << 17, file))?;
            let schema = out.add_schema("rig.JointState", "jsonschema", schema.as_bytes())?;
            let channel = out.add_channel(schema, TOPIC, "json", &BTreeMap::new())?;
            out.write_metadata(&::mcap::records::Metadata {
                name: "rig".into(),
                metadata: metadata.clone(),
            })?;
            Ok((out, channel))
        };
        let (out, channel) = begin().map_err(|e| rows.failed(io::Error::other(e)))?;
        Ok(Self { rows, out, channel })
    }

    /// Appends a row; its time must not be negative.
    pub fn push_row(&mut self, row: &[f64]) -> Result<(), DataError> {
        self.rows.accept(row)?;
        let t = row.first().copied().unwrap_or(0.0);
        // 2^64 ns are 584 years.
        if !(0.0..1.8e10).contains(&t) {
            return Err(DataError::BadRow {
                path: self.rows.path.clone(),
                row: self.rows.count,
                message: format!(
                    "its time is {} s, but MCAP counts nanoseconds from 0 upwards; shift the time or write .csv",
                    format_short(t)
                ),
            });
        }
        let text = &mut self.rows.text;
        text.clear();
        for (i, (name, value)) in self.rows.names.iter().zip(row).enumerate() {
            text.push(if i == 0 { '{' } else { ',' });
            text.push('"');
            text.push_str(&escaped(name));
            text.push_str("\":");
            push_number(text, *value);
        }
        text.push('}');
        let nanoseconds = (t * 1e9).round() as u64;
        // The sequence number of MCAP is 32 bits wide and optional: it wraps.
        let header = MessageHeader {
            channel_id: self.channel,
            sequence: (self.rows.count - 1) as u32,
            log_time: nanoseconds,
            publish_time: nanoseconds,
        };
        self.out
            .write_to_known_channel(&header, self.rows.text.as_bytes())
            .map_err(|e| self.rows.failed(io::Error::other(e)))
    }

    /// Completes the file.
    pub fn finish(self) -> Result<(), DataError> {
        let Self { rows, mut out, .. } = self;
        out.finish().map_err(|e| rows.failed(io::Error::other(e)))?;
        let file = out
            .into_inner()
            .into_inner()
            .map_err(|e| rows.failed(e.into_error()))?;
        persist(file, &rows.path).map_err(|e| rows.failed(e))
    }
}

fn escaped(name: &str) -> String {
    let quoted = serde_json::Value::from(name).to_string();
    quoted.trim_matches('"').to_owned()
}

fn schema(columns: &[Column]) -> String {
    let property = |c: &Column| {
        let description = serde_json::Value::from(c.unit.as_str());
        format!(
            "\"{}\":{{\"type\":\"number\",\"description\":{description}}}",
            escaped(&c.name)
        )
    };
    let properties: Vec<String> = columns.iter().map(property).collect();
    format!(
        "{{\"title\":\"rig.JointState\",\"type\":\"object\",\"properties\":{{{}}}}}",
        properties.join(",")
    )
}
