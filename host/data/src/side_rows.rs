//! Channels of another topic at the times of the rows, by linear interpolation.

use super::block::{WRENCH_COLUMNS, WRENCH_MESSAGE};
use super::error::DataError;
use super::flat_rows::FlatRows;
use super::remark::Remark;
use rig_output::format_trimmed;

/// Ratio to the usual interval above which messages are missing; the rows in between have no value then.
const GAP: f64 = 5.0;

/// Number of intervals that determine the usual one.
const PROBED: usize = 200;

/// A message with its time, ns.
struct Timed {
    time: i128,
    values: Vec<f64>,
}

impl Timed {
    /// Takes the last message of a reader, with its number where there is one more column than values.
    fn of(rows: &FlatRows, time: i128, columns: usize) -> Self {
        let mut values = rows.values.clone();
        // 2⁵³ messages are exact.
        values.resize(columns, rows.number as f64 + 0.5);
        Self { time, values }
    }
}

/// Reader of a topic beside that of the rows.
pub(super) struct SideRows {
    rows: FlatRows,
    /// Names of the columns; [`WRENCH_MESSAGE`] is the last one of a wrist sensor.
    columns: Vec<String>,
    /// Time of the first message, ns.
    first: Option<i128>,
    before: Option<Timed>,
    after: Option<Timed>,
    /// Usual interval between messages, ns.
    usual: f64,
    /// Rows without a value, and the first one.
    left_out: Option<(u64, u64)>,
}

impl SideRows {
    /// Takes a reader of the topic and the names of its columns; `probe` is a second reader of the same, which determines the
    /// usual interval.
    pub(super) fn new(
        mut rows: FlatRows,
        mut probe: FlatRows,
        mut columns: Vec<String>,
    ) -> Result<Self, DataError> {
        if columns.iter().any(|name| name == WRENCH_COLUMNS[0]) {
            columns.push(WRENCH_MESSAGE.to_owned());
        }
        let mut intervals: Vec<f64> = Vec::new();
        let mut last = probe.next_time()?;
        while intervals.len() < PROBED
            && let (Some(from), Some(to)) = (last, probe.next_time()?)
        {
            intervals.push((to - from) as f64);
            last = Some(to);
        }
        intervals.sort_by(f64::total_cmp);
        let usual = intervals.get(intervals.len() / 2).copied().unwrap_or(0.0);
        let first = rows.next_time()?;
        let after = first.map(|time| Timed::of(&rows, time, columns.len()));
        Ok(Self {
            rows,
            columns,
            first,
            before: None,
            after,
            usual,
            left_out: None,
        })
    }

    /// Returns the names of the columns.
    pub(super) fn columns(&self) -> &[String] {
        &self.columns
    }

    /// Returns true if the time of a message is its header stamp.
    pub(super) fn is_stamped(&self) -> bool {
        self.rows.is_stamped
    }

    pub(super) fn topic(&self) -> &str {
        self.rows.topic()
    }

    /// Reads the topic to its end; returns the times of its first and last message, ns.
    pub(super) fn range(&mut self) -> Result<Option<(i128, i128)>, DataError> {
        while self.rows.next_time()?.is_some() {}
        Ok(self.first.map(|first| (first, self.rows.time)))
    }

    /// Writes the values at a time, ns, which must not be earlier than that of the call before. Returns false if there is no
    /// message before, after or near it.
    pub(super) fn at(
        &mut self,
        time: i128,
        row: u64,
        values: &mut [f64],
    ) -> Result<bool, DataError> {
        while self.after.as_ref().is_some_and(|after| after.time < time) {
            self.before = self.after.take();
            let next = self.rows.next_time()?;
            self.after = next.map(|time| Timed::of(&self.rows, time, self.columns.len()));
        }
        let is_there = match (&self.before, &self.after) {
            (_, Some(after)) if after.time == time => {
                values.copy_from_slice(&after.values);
                true
            }
            (Some(before), Some(after)) => {
                let interval = (after.time - before.time) as f64;
                let share = (time - before.time) as f64 / interval;
                for ((value, a), b) in values.iter_mut().zip(&before.values).zip(&after.values) {
                    *value = a + share * (b - a);
                }
                interval <= GAP * self.usual
            }
            _ => false,
        };
        if !is_there {
            let left_out = self.left_out.get_or_insert((0, row));
            left_out.0 += 1;
        }
        Ok(is_there)
    }

    /// Returns how the topic is read.
    pub(super) fn interpolated(&self) -> Remark {
        Remark::Interpolated {
            columns: (self.columns.iter())
                .filter(|name| *name != WRENCH_MESSAGE)
                .map(String::as_str)
                .collect::<Vec<_>>()
                .join(", "),
            topic: self.rows.topic().to_owned(),
            rate: format_trimmed(1e9 / self.usual.max(1.0), 4),
        }
    }

    /// Returns the rows that were left out so far.
    pub(super) fn left_out(&self) -> Option<Remark> {
        self.left_out.map(|(rows, first)| Remark::LeftOut {
            topic: self.rows.topic().to_owned(),
            rows,
            first,
        })
    }
}
