//! Reads the channels of a text file, also of one that no other command takes.

use std::path::Path;

use super::topic::Topic;
use crate::csv::{SPARED, TextLines};
use crate::csv_header::{Lines, Separator, find_header};
use crate::error::DataError;
use crate::iso_time::iso_time;
use crate::number::number;
use crate::remark::Remark;

/// What a text file holds.
pub(super) struct Text {
    pub topic: Topic,
    pub remarks: Vec<String>,
    pub faults: Vec<String>,
}

/// Rows that are not as the header says.
#[derive(Default)]
struct Odd {
    /// Number of rows with another number of fields, the first one's line, and its number of fields.
    fields: Option<(u64, u64, usize)>,
    /// Number of empty lines between rows, and the first one.
    empty: Option<(u64, u64)>,
}

/// Reads all rows; `advance` takes the bytes read so far.
pub(super) fn text(path: &Path, advance: &mut dyn FnMut(u64)) -> Result<Text, DataError> {
    let mut lines = TextLines::open(path)?;
    let mut found = find_header(&mut lines)?;
    let mut faults = Vec::new();
    let mut remarks: Vec<String> = found.remarks.iter().map(|r| format!("{r}.")).collect();
    let mut has_row = found.has_row;
    let is_number = |name: &String| number(name.replace(',', ".").as_bytes(), b'.').is_finite();
    if found
        .names
        .iter()
        .all(|n| is_number(n) || iso_time(n).is_some())
    {
        faults.push(format!(
            "line {} holds numbers and no names, so there is no header; write a line such as `t,q1,tau1` before it.",
            found.line
        ));
        found.names = (1..=found.names.len())
            .map(|k| format!("column {k}"))
            .collect();
        has_row = true;
    }
    if let Some(again) = repeated(&found.names) {
        faults.push(format!(
            "column `{again}` is there twice; every column must have a name of its own."
        ));
    }
    let (mut topic, time, channels) = Topic::of_table(&found.names, "column");
    for (channel, k) in topic.channels.iter_mut().zip(&channels) {
        if let Some(unit) = found.units.get(*k) {
            channel.unit = Some(unit.name);
        }
    }
    let unit_of_time = time.and_then(|k| found.units.get(k));
    topic.time.unit = unit_of_time.map(|unit| unit.name);
    let mut reader = Rows {
        separator: found.separator,
        expected: found.names.len(),
        time,
        channels,
        odd: Odd::default(),
        empty: None,
        is_iso: false,
        iso_origin: None,
    };
    let mut values = vec![f64::NAN; found.names.len()];
    while std::mem::take(&mut has_row) || lines.next_line()? {
        if lines.is_cut() {
            let line = lines.number();
            if topic.rows >= SPARED {
                faults.push(format!("{}.", Remark::CutRow { line }));
                break;
            }
            faults.push(format!("{}.", Remark::OpenEnd { line }));
        }
        reader.row(lines.line(), lines.number(), &mut values, &mut topic);
        if topic.rows % 4096 == 0 {
            advance(lines.bytes());
        }
    }
    topic.time.finish();
    faults.extend(reader.odd.faults(found.names.len()));
    if reader.is_iso {
        remarks.push(format!(
            "{} holds dates or times of day (ISO 8601); they are counted from the first row in s.",
            topic.time.source
        ));
    }
    Ok(Text {
        topic,
        remarks,
        faults,
    })
}

fn repeated(names: &[String]) -> Option<&String> {
    (names.iter().enumerate()).find_map(|(k, name)| names[..k].contains(name).then_some(name))
}

/// Reader of rows that takes what it can.
struct Rows {
    separator: Separator,
    expected: usize,
    time: Option<usize>,
    channels: Vec<usize>,
    odd: Odd,
    /// Line of the first of the empty lines at present.
    empty: Option<u64>,
    is_iso: bool,
    /// Seconds of the first ISO time.
    iso_origin: Option<i64>,
}

impl Rows {
    fn row(&mut self, line: &[u8], place: u64, values: &mut [f64], topic: &mut Topic) {
        if line.trim_ascii().is_empty() {
            self.empty.get_or_insert(place);
            return;
        }
        if let Some(first) = self.empty.take() {
            let empty = self.odd.empty.get_or_insert((0, first));
            empty.0 += 1;
        }
        values.fill(f64::NAN);
        let mut count = 0;
        let is_quoted = line.contains(&b'"');
        let text;
        if is_quoted {
            text = String::from_utf8_lossy(line);
            for field in self.separator.split(&text) {
                self.field(field.as_bytes(), count, values);
                count += 1;
            }
        } else if self.separator == Separator::Blank {
            let fields = line.split(u8::is_ascii_whitespace);
            for field in fields.filter(|f| !f.is_empty()) {
                self.field(field, count, values);
                count += 1;
            }
        } else {
            let separator = self.separator.byte();
            for field in line.split(|b| *b == separator) {
                self.field(field, count, values);
                count += 1;
            }
        }
        if count != self.expected {
            let odd = self.odd.fields.get_or_insert((0, place, count));
            odd.0 += 1;
        }
        let t = match self.time {
            Some(k) => values.get(k).copied().unwrap_or(f64::NAN),
            None => topic.rows as f64,
        };
        let ordered: Vec<f64> = self.channels.iter().map(|k| values[*k]).collect();
        topic.add(t, &ordered);
    }

    fn field(&mut self, field: &[u8], k: usize, values: &mut [f64]) {
        let Some(place) = values.get_mut(k) else {
            return;
        };
        let mark = if field.contains(&b',') { b',' } else { b'.' };
        *place = number(field, mark);
        if place.is_nan()
            && self.time == Some(k)
            && let Some((seconds, nanoseconds)) = std::str::from_utf8(field).ok().and_then(iso_time)
        {
            self.is_iso = true;
            let origin = *self.iso_origin.get_or_insert(seconds);
            *place = (seconds - origin) as f64 + nanoseconds as f64 * 1e-9;
        }
    }
}

impl Odd {
    fn faults(&self, expected: usize) -> Vec<String> {
        let mut faults = Vec::new();
        if let Some((rows, line, found)) = self.fields {
            faults.push(format!(
                "{rows} rows have another number of fields than the header, which names {expected} columns; the first is line {line} with {found} fields."
            ));
        }
        if let Some((count, line)) = self.empty {
            faults.push(format!(
                "empty lines stand between the rows in {count} places; the first is line {line}."
            ));
        }
        faults
    }
}
