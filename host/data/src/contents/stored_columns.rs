//! Reads the channels of a Parquet file.

use std::path::Path;

use super::topic::Topic;
use crate::error::DataError;
use crate::parquet::ParquetRows;

/// Reads all rows; returns them with the remarks. `advance` takes the bytes read so far.
pub(super) fn stored_columns(
    path: &Path,
    advance: &mut dyn FnMut(u64),
) -> Result<(Topic, Vec<String>), DataError> {
    let (mut rows, header) = ParquetRows::open(path)?;
    let names = &header.labels;
    let (mut topic, time, channels) = Topic::of_table(names, "column");
    topic.time.is_clock = time.is_some_and(|k| rows.is_clock(k));
    let mut all = vec![f64::NAN; names.len()];
    let mut values = Vec::with_capacity(channels.len());
    while let Some(row) = rows.next_values(&mut all)? {
        values.clear();
        values.extend(channels.iter().map(|k| all[*k]));
        let t = time.map_or((row - 1) as f64, |k| all[k]);
        topic.add(t, &values);
        if row % 4096 == 0 {
            advance(rows.bytes_read());
        }
    }
    topic.time.finish();
    let remarks = rows.remarks().into_iter().map(|own| format!("{own}."));
    Ok((topic, remarks.collect()))
}
