//! Reads the channels of a file of arrays.

use std::path::Path;

use super::topic::{Channel, Topic};
use crate::error::DataError;
use crate::form::Arrays;
use crate::table_rows;
use crate::time_names::is_time;

/// Reads all rows; returns them with the remarks.
pub(super) fn table(path: &Path, form: Arrays) -> Result<(Topic, Vec<String>), DataError> {
    let (columns, _) = table_rows::table(path, form)?;
    let names = &columns.names;
    let time =
        (names.iter().position(|n| n == "t")).or_else(|| names.iter().position(|n| is_time(n)));
    let channels: Vec<usize> = (0..names.len()).filter(|k| Some(*k) != time).collect();
    let mut topic = Topic {
        channels: channels
            .iter()
            .map(|k| Channel::new(names[*k].clone()))
            .collect(),
        ..Topic::default()
    };
    topic.time.source = match time {
        Some(k) => format!("column `{}`", names[k]),
        None => "number of the row, because no array is named as a time".into(),
    };
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
