//! Files that pyarrow and pandas wrote (`tests/recordings/parquet/make.py`), hostile files, and what the writer writes.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::{ParquetRows, ParquetWriter};
use crate::made_for_tests::{of_others, robot};
use crate::{Block, Column, DataError, EffortNeed, Mapping, Source};

fn stored(name: &str) -> PathBuf {
    of_others(&format!("parquet/{name}"))
}

/// Names and values of all columns, NaN where a value is missing.
pub(super) fn all(path: &Path) -> Result<(Vec<String>, Vec<Vec<f64>>), DataError> {
    let (mut rows, header) = ParquetRows::open(path)?;
    let mut values = vec![0.0; header.labels.len()];
    let mut columns = vec![Vec::new(); values.len()];
    while rows.next_values(&mut values)?.is_some() {
        for (column, value) in columns.iter_mut().zip(&values) {
            column.push(*value);
        }
    }
    Ok((header.labels, columns))
}

/// Reads with the joints elbow and shoulder; returns also the remarks.
fn read(path: &Path) -> Result<(Vec<Block>, Vec<String>), DataError> {
    let robot = robot(&["elbow", "shoulder"]);
    let mapping = Mapping::default();
    let source = Source::open_mapped(path, &robot, EffortNeed::Required, &mapping)?;
    let (blocks, warnings) = source.read_all()?;
    Ok((blocks, warnings.iter().map(ToString::to_string).collect()))
}

/// Asserts that two readings are equal bit for bit.
fn same(own: &[Block], other: &[Block], name: &str) {
    let bits = |blocks: &[Block]| -> Vec<u64> {
        let columns = blocks.iter().flat_map(|block| {
            let joints = block.joints.iter().flat_map(|j| [&j.q, &j.tau]);
            std::iter::once(&block.t).chain(joints)
        });
        columns.flatten().map(|value| value.to_bits()).collect()
    };
    assert_eq!(bits(own), bits(other), "{name}");
}

/// Every codec (none, Snappy, gzip, zstd, lz4) and encoding (plain, dictionary, bytes side by side, differences, runs), pages of
/// both versions, every type of number; the truth is what pandas wrote as text.
#[test]
fn every_encoding_holds_what_pandas_writes_as_text() {
    let text = std::fs::read_to_string(stored("columns.csv")).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let number = |field: &str| match field {
        "True" => 1.0,
        "False" => 0.0,
        own => own.parse().unwrap_or(f64::NAN),
    };
    let rows: Vec<Vec<f64>> = (lines.map(|line| line.split(',').map(number).collect())).collect();
    for name in ["", "_split", "_delta", "_pages", "_old"] {
        let (found, columns) = all(&stored(&format!("columns{name}.parquet"))).unwrap();
        // The last column is text.
        assert_eq!(found, names[..names.len() - 1], "{name}");
        assert!(rows.len() == 40 && columns.iter().all(|own| own.len() == 40));
        for (k, column) in columns.iter().enumerate() {
            for (row, value) in column.iter().enumerate() {
                let truth = rows[row][k];
                let is_same = value.to_bits() == truth.to_bits();
                assert!(
                    is_same || value.is_nan() && truth.is_nan(),
                    "{name} {} {row}: {value} {truth}",
                    names[k]
                );
            }
        }
    }
    let (own, remarks) = read(&stored("columns.parquet")).unwrap();
    let (csv, _) = read(&stored("columns.csv")).unwrap();
    same(&own, &csv, "columns");
    assert!(
        remarks
            .iter()
            .any(|r| r.contains("not read: mode (text or bytes)")),
        "{remarks:?}"
    );
    assert!(
        remarks
            .iter()
            .any(|r| r.contains("`q2_deg` is converted from deg")),
        "{remarks:?}"
    );
}

#[test]
fn lists_of_equal_length_are_columns_of_joints() {
    let (own, remarks) = read(&stored("lists.parquet")).unwrap();
    let (csv, _) = read(&stored("columns.csv")).unwrap();
    assert_eq!(own[0].len(), 40);
    for (a, b) in own[0].joints.iter().zip(&csv[0].joints) {
        for k in 0..40 {
            assert!((a.q[k] - b.q[k]).abs() < 1e-15);
            // Single precision.
            assert_eq!(a.tau[k], f64::from(b.tau[k] as f32));
        }
    }
    for other in ["empty (empty lists)", "pose (nested)", "day (dates)"] {
        assert!(remarks.iter().any(|r| r.contains(other)), "{remarks:?}");
    }
    let error = read(&stored("ragged.parquet")).unwrap_err().to_string();
    assert!(
        error.contains("ragged.parquet: row 28 of column `q` is a list of fewer than 2 values"),
        "{error}"
    );
}

/// Dates of an index without a name are the time; nanoseconds since 1970 lose no digit.
#[test]
fn time_stamps_are_counted_as_dates_in_text_are() {
    let (csv, _) = read(&stored("stamps.csv")).unwrap();
    let (own, remarks) = read(&stored("stamps.parquet")).unwrap();
    same(&own, &csv, "ns");
    assert!((own[0].t[39] - own[0].t[0] - 0.078).abs() < 1e-15);
    assert!(
        remarks.iter().any(|r| r.contains("time stamps")),
        "{remarks:?}"
    );
    // The name says ns, but the type says µs.
    let (own, _) = read(&stored("stamps_us.parquet")).unwrap();
    for (a, b) in own[0].t.iter().zip(&csv[0].t) {
        assert!((b - a - 0.789e-6).abs() < 1e-12, "{a} {b}");
    }
}

#[test]
fn an_index_is_left_out_and_a_missing_value_is_named() {
    let (own, remarks) = read(&stored("chosen.parquet")).unwrap();
    assert_eq!(own.iter().map(Block::len).sum::<usize>(), 27);
    assert!(
        remarks
            .iter()
            .any(|r| r.contains("__index_level_0__ (index of pandas)")),
        "{remarks:?}"
    );
    let error = read(&stored("missing.parquet")).unwrap_err().to_string();
    assert!(
        error.contains("row 28") && error.contains("q2_deg") && error.contains("nothing"),
        "{error}"
    );
}

/// A file that was cut off anywhere is an error, and so is one with a byte changed, unless it still is a file; nothing panics
/// or takes much memory. The seeds are fixed.
#[test]
fn damaged_files_are_refused_in_a_sentence() {
    use rand::{RngExt, SeedableRng};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.parquet");
    let mut random = rand_pcg::Pcg64::seed_from_u64(7);
    for name in [
        "columns",
        "columns_split",
        "columns_delta",
        "columns_pages",
        "columns_old",
        "lists",
        "stamps",
    ] {
        let whole = std::fs::read(stored(&format!("{name}.parquet"))).unwrap();
        for length in 0..whole.len() {
            if length > 64 && length % 29 != 0 && length + 64 < whole.len() {
                continue;
            }
            std::fs::write(&path, &whole[..length]).unwrap();
            let error = all(&path).unwrap_err().to_string();
            assert!(
                error.contains("log.parquet: the Parquet file is"),
                "{length}: {error}"
            );
        }
        for _ in 0..300 {
            let mut bytes = whole.clone();
            for _ in 0..random.random_range(1..4) {
                let at = random.random_range(0..bytes.len());
                // Mostly in the footer, whose length is in the last bytes.
                let at = if random.random_bool(0.5) {
                    bytes.len() - 1 - at % 4000
                } else {
                    at
                };
                bytes[at] = random.random();
            }
            std::fs::write(&path, &bytes).unwrap();
            if let Err(error) = all(&path) {
                assert!(error.to_string().contains("log.parquet"), "{error}");
            }
        }
    }
}

#[test]
fn what_is_written_is_read_bit_for_bit_over_groups() {
    let folder = tempfile::tempdir().unwrap();
    let rows = (1 << 17) + 100;
    let value = |k: usize, row: usize| {
        (0.37 * row as f64 + k as f64).sin() * 10_f64.powi(row as i32 % 600 - 300)
    };
    let columns =
        [("t", "s"), ("q1", "rad"), ("odd \u{e9}", "")].map(|(name, unit)| Column::new(name, unit));
    let write = |name: &str| {
        let path = folder.path().join(name);
        let mut writer = ParquetWriter::create(&path, &columns, &BTreeMap::new()).unwrap();
        for row in 0..rows {
            writer
                .push_row(&[0.001 * row as f64, value(1, row), value(2, row)])
                .unwrap();
        }
        assert!(!path.exists());
        writer.finish().unwrap();
        path
    };
    let path = write("a.parquet");
    let (names, found) = all(&path).unwrap();
    assert_eq!(names, ["t", "q1", "odd \u{e9}"]);
    for k in 1..3 {
        assert_eq!(found[k].len(), rows);
        assert!((0..rows).all(|row| found[k][row].to_bits() == value(k, row).to_bits()));
    }
    let bytes = |path: &Path| std::fs::read(path).unwrap();
    assert!(
        bytes(&path) == bytes(&write("b.parquet")),
        "equal rows give equal bytes"
    );
}
