//! Reads the channels of a file of arrays.

use std::path::Path;

use super::topic::Topic;
use crate::error::DataError;
use crate::form::Arrays;
use crate::table_rows;

/// Reads all rows; returns them with the remarks.
pub(super) fn table(path: &Path, form: Arrays) -> Result<(Topic, Vec<String>), DataError> {
    let (columns, _) = table_rows::table(path, form)?;
    let names = &columns.names;
    let (mut topic, time, channels) = Topic::of_table(names, "array");
    let rows = columns.values.first().map_or(0, Vec::len);
    for row in 0..rows {
        let t = time.map_or(row as f64, |k| columns.values[k][row]);
        let values: Vec<f64> = channels.iter().map(|k| columns.values[*k][row]).collect();
        topic.add(t, &values);
    }
    topic.time.finish();
    let others = &columns.others;
    let remark = format!("these arrays are no columns: {}.", others.join(", "));
    Ok((
        topic,
        if others.is_empty() {
            Vec::new()
        } else {
            vec![remark]
        },
    ))
}
