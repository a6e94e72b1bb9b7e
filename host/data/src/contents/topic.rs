//! Channels, their times and values.

use std::fmt;

use serde::{Serialize, Serializer};

use super::names::{unit, unit_of_array};
use super::picture::Picture;
use super::proposal::Proposal;
use crate::csv_header::ROW_NUMBER;
use crate::sampling::Sampling;
use crate::time_names::{is_header_stamp, is_time};
use crate::unit::Unit;

/// Number of intervals that determine the period.
const PROBED: usize = 1001;

/// What a file holds.
#[derive(Clone, Debug, Serialize)]
pub struct Contents {
    /// Name of the format.
    pub format: &'static str,
    /// Length of the file or files, bytes.
    pub bytes: u64,
    /// Streams of rows with one time: the table of a text file, or the topics of a bag.
    pub topics: Vec<Topic>,
    /// Assumptions, one sentence each.
    pub remarks: Vec<String>,
    /// What keeps other commands from reading the file, or is damaged; one sentence each.
    pub faults: Vec<String>,
    /// The columns that the channels probably are.
    pub proposal: Proposal,
}

/// A stream of rows with one time.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Topic {
    /// Name of the topic; empty for a text file.
    pub name: String,
    /// Type of the messages; empty for a text file.
    pub of: String,
    /// Number of rows or messages.
    pub rows: u64,
    /// Why the messages cannot be read, one clause.
    pub unreadable: Option<String>,
    /// Times of the rows.
    pub time: Time,
    /// The channels in their order.
    pub channels: Vec<Channel>,
}

impl Topic {
    /// Creates the table of a file whose columns have these names; `of` is what it calls them (`column` or `array`). Returns
    /// also the index of the time among the names, and those of the channels.
    pub(super) fn of_table(
        names: &[String],
        of: &'static str,
    ) -> (Self, Option<usize>, Vec<usize>) {
        let first = |is_named: fn(&str) -> bool| names.iter().position(|n| is_named(n));
        let time = first(|name| name == "t")
            .or_else(|| first(is_time))
            .or_else(|| first(is_header_stamp));
        let channels: Vec<usize> = (0..names.len())
            .filter(|k| Some(*k) != time && names[*k] != ROW_NUMBER)
            .collect();
        let mut topic = Self {
            channels: (channels.iter())
                .map(|k| Channel::new(names[*k].clone()))
                .collect(),
            ..Self::default()
        };
        topic.time.source = match time {
            Some(k) => TimeSource::Column(names[k].clone()),
            None => TimeSource::RowNumber { of },
        };
        (topic, time, channels)
    }

    /// Adds a row at time `t`; channels without a value get none.
    pub(super) fn add(&mut self, t: f64, values: &[f64]) {
        self.rows += 1;
        let is_same = |(channel, value): (&Channel, &f64)| {
            *value == channel.last_row || value.is_nan() && channel.last_row.is_nan()
        };
        let is_copy = self.rows > 1 && self.channels.iter().zip(values).all(is_same);
        self.time.add(t, self.rows, is_copy);
        for (channel, value) in self.channels.iter_mut().zip(values) {
            channel.add(t, *value, self.rows);
        }
    }
}

/// A place where the time is not even.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Step {
    /// Row or message after the step, from 1.
    pub row: u64,
    /// Time before the step, s.
    pub from: f64,
    /// Length of the step, s.
    pub step: f64,
}

/// Where the time of rows comes from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum TimeSource {
    /// Not known: no message was read.
    #[default]
    Unknown,
    /// Key `t` of the messages of this program.
    Key,
    /// Header stamp of the messages.
    HeaderStamp,
    /// Time at which the recorder wrote a message.
    LogTime,
    /// A column or an array with this name.
    Column(String),
    /// The number of the row: nothing is named as a time.
    RowNumber {
        /// `column` or `array`.
        of: &'static str,
    },
}

impl fmt::Display for TimeSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown => Ok(()),
            Self::Key => f.write_str("key `t` of the messages"),
            Self::HeaderStamp => f.write_str("header stamp"),
            Self::LogTime => f.write_str("log time of the recorder"),
            Self::Column(name) => write!(f, "column `{name}`"),
            Self::RowNumber { of } => {
                write!(f, "number of the row, because no {of} is named as a time")
            }
        }
    }
}

impl Serialize for TimeSource {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// Times of rows.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Time {
    /// Where the time comes from; text in JSON.
    pub source: TimeSource,
    /// Unit of the times: as the name of the column states, or as its values are likely; `None` without a column of time.
    pub unit: Option<&'static str>,
    /// Rows per second, from the period.
    pub rate: Option<f64>,
    /// Times of the first and last row, in this unit; `None` without a row.
    pub first: Option<f64>,
    /// See `first`.
    pub last: Option<f64>,
    /// Median of the first thousand intervals, in this unit.
    pub period: Option<f64>,
    /// True if these intervals vary by more than 5 % (5th to 95th percentile).
    pub irregular: bool,
    /// Number of intervals in which rows are missing.
    pub gaps: u64,
    /// The longest of them.
    pub longest_gap: Option<Step>,
    /// Number of rows whose time is that of the row before.
    pub repeated: u64,
    /// Number of those that also have its values: the other commands leave them out.
    pub copies: u64,
    /// Number of rows that are earlier than the row before.
    pub backwards: u64,
    /// The first such row, or the first repeated one that is no copy.
    pub first_not_growing: Option<Step>,
    /// Number of rows without a time.
    pub missing: u64,
    /// True if the times are seconds by the type of their column, whatever its name states.
    #[serde(skip)]
    pub(super) is_clock: bool,
    #[serde(skip)]
    probed: Vec<f64>,
    /// Intervals that were seen before the period was known.
    #[serde(skip)]
    early: Vec<Step>,
    #[serde(skip)]
    sampling: Option<Sampling>,
}

impl Time {
    /// Adds the time of a row; `is_copy`: its values are those of the row before.
    fn add(&mut self, t: f64, row: u64, is_copy: bool) {
        if !t.is_finite() {
            self.missing += 1;
            return;
        }
        self.first.get_or_insert(t);
        let Some(from) = self.last.replace(t) else {
            self.probed.push(t);
            return;
        };
        let step = Step {
            row,
            from,
            step: t - from,
        };
        if step.step <= 0.0 {
            if step.step < 0.0 {
                self.backwards += 1;
            } else {
                self.repeated += 1;
                self.copies += u64::from(is_copy);
            }
            if step.step < 0.0 || !is_copy {
                self.first_not_growing.get_or_insert(step);
            }
            return;
        }
        match self.sampling {
            Some(sampling) => self.judge(step, sampling),
            None => {
                self.probed.push(t);
                self.early.push(step);
                if self.probed.len() == PROBED {
                    self.finish();
                }
            }
        }
    }

    /// Counts a step that is too long.
    fn judge(&mut self, step: Step, sampling: Sampling) {
        if sampling.period > 0.0 && step.step > sampling.longest_interval() {
            self.gaps += 1;
            if self
                .longest_gap
                .is_none_or(|longest| longest.step < step.step)
            {
                self.longest_gap = Some(step);
            }
        }
    }

    /// Sets the unit, and with it the rate.
    pub(super) fn set_unit(&mut self, unit: &'static str) {
        let factor = Unit::named(unit).map_or(1.0, |unit| unit.factor);
        self.unit = Some(unit);
        let period = self.period.filter(|period| *period > 0.0);
        self.rate = period.map(|period| 1.0 / (period * factor));
    }

    /// Determines the period, and judges the intervals before it was known.
    pub(super) fn finish(&mut self) {
        if self.sampling.is_some() || self.probed.len() < 2 {
            return;
        }
        self.probed.sort_by(f64::total_cmp);
        let sampling = Sampling::of(&self.probed);
        self.sampling = Some(sampling);
        self.period = Some(sampling.period);
        self.irregular = sampling.irregular;
        for step in std::mem::take(&mut self.early) {
            self.judge(step, sampling);
        }
        self.probed = Vec::new();
    }
}

/// A channel: the numbers of one column, or of one field of the messages.
#[derive(Clone, Debug, Serialize)]
pub struct Channel {
    /// Its name; `--map` takes it, with the topic in front.
    pub name: String,
    /// Number of values.
    pub values: u64,
    /// Number of rows in which it has no number.
    pub missing: u64,
    /// First row in which it has no number, from 1.
    pub first_missing: Option<u64>,
    /// Smallest value.
    pub min: Option<f64>,
    /// Largest value.
    pub max: Option<f64>,
    /// Mean value.
    pub mean: Option<f64>,
    /// Standard deviation.
    pub std: Option<f64>,
    /// Smallest change from row to row that is not zero: at most the resolution of the sensor times its scale.
    pub smallest_change: Option<f64>,
    /// Unit that its name states.
    pub unit: Option<&'static str>,
    /// True for an element of an array in messages: the end of its name is the name of a joint, or a number.
    #[serde(skip)]
    pub(super) is_element: bool,
    /// Course over time.
    #[serde(skip)]
    pub picture: Picture,
    #[serde(skip)]
    last: f64,
    /// Value in the row before, NaN if it had none.
    #[serde(skip)]
    last_row: f64,
    #[serde(skip)]
    falls: bool,
    /// Sum of squared deviations from the mean (Welford 1962).
    #[serde(skip)]
    squares: f64,
}

impl Channel {
    pub(super) fn new(name: String) -> Self {
        Self {
            unit: unit(&name).map(|unit| unit.name),
            is_element: false,
            name,
            values: 0,
            missing: 0,
            first_missing: None,
            min: None,
            max: None,
            mean: None,
            std: None,
            smallest_change: None,
            picture: Picture::default(),
            last: f64::NAN,
            last_row: f64::NAN,
            falls: false,
            squares: 0.0,
        }
    }

    /// Returns a channel of messages that begins after `rows` rows; `stem` is the part of its name that may state a unit.
    pub(super) fn of_message(name: String, stem: &str, rows: u64) -> Self {
        let is_element = stem != name;
        let stated = match is_element {
            true => unit_of_array(stem),
            false => unit(&name),
        };
        Self {
            unit: stated.map(|unit| unit.name),
            is_element,
            missing: rows,
            first_missing: (rows > 0).then_some(1),
            ..Self::new(name)
        }
    }

    fn add(&mut self, t: f64, value: f64, row: u64) {
        self.last_row = value;
        if t.is_finite() {
            self.picture.add(t, value);
        }
        if !value.is_finite() {
            self.missing += 1;
            self.first_missing.get_or_insert(row);
            return;
        }
        self.values += 1;
        self.min = Some(self.min.map_or(value, |min| min.min(value)));
        self.max = Some(self.max.map_or(value, |max| max.max(value)));
        let mean = self.mean.unwrap_or(0.0);
        let off = value - mean;
        let mean = mean + off / self.values as f64;
        self.squares += off * (value - mean);
        self.mean = Some(mean);
        self.std = Some((self.squares / self.values as f64).sqrt());
        let change = (value - self.last).abs();
        if change > 0.0 && self.smallest_change.is_none_or(|least| change < least) {
            self.smallest_change = Some(change);
        }
        self.falls |= value <= self.last;
        self.last = value;
    }

    /// Returns true if it never changes.
    pub fn is_constant(&self) -> bool {
        self.min == self.max
    }

    /// Returns true if it grows from row to row.
    pub(super) fn is_rising(&self) -> bool {
        self.values > 1 && !self.falls
    }

    /// Returns the largest magnitude; 0 without a value.
    pub fn largest(&self) -> f64 {
        let of = |value: Option<f64>| value.map_or(0.0, f64::abs);
        of(self.min).max(of(self.max))
    }
}
