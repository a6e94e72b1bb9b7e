//! Sample period of a recording, and the intervals that part its stretches.

use super::error::Warning;
use super::place::Place;
use super::rounded_time::{RoundedTime, resolution};

/// Spread of the intervals about whole multiples of the median (5th to 95th percentile over the median) above which the
/// recording counts as irregular. Clocked recordings stay below 0.03 (KUKA LWR over a network: 0.02), polled servos
/// begin at 0.07.
const IRREGULAR: f64 = 0.05;

/// Intervals longer than this multiple of the period are a gap: one sample is missing.
const GAP: f64 = 1.5;

/// Longest interval, in periods, that is interpolated: four missing rows. Longer ones part the recording.
const LONGEST: f64 = 5.0;

/// Largest share of intervals of two or more periods in which rows are missing one by one: a fifth of the rows lost makes
/// a fifth of the intervals longer, with a standard deviation of 1.3 % among 1000. More are a property of the clock.
const MOST_MISSING: f64 = 0.25;

/// Relative deviation of an interval from the period that splits a regular recording. Causes are controllers whose loop
/// settles over the first rows (3.6 instead of 2 ms) and rows sent twice. Stamps in single precision and clocks with
/// jitter stay well below. A single stamp off the grid (KUKA LWR over a network: 3.4 and 6.5 ms instead of twice 5 ms)
/// does not split.
const UNEVEN: f64 = 0.2;

/// Sampling of a recording, determined from its first 1001 rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    /// Median interval, s; 0 for a single row.
    pub period: f64,
    /// True if the intervals vary (5th to 95th percentile more than 5 % of the median apart). The rows must then not be
    /// treated as evenly spaced. Up to a quarter of the intervals may be whole multiples of the median: rows are missing
    /// there.
    pub irregular: bool,
    /// Resolution of the stamps whose rounding shows in their steps, s; 0 if it does not. The times of the rows are then
    /// those of a clock within half of it.
    pub resolution: f64,
}

impl Sampling {
    /// Determines the sampling from the first stamps.
    pub(super) fn of(stamps: &[f64]) -> Self {
        let plain = Self::of_times(stamps);
        let Some(resolution) = resolution(stamps) else {
            return plain;
        };
        let rounded = Self {
            resolution,
            ..plain
        };
        let times = rounded.corrected().map(|rows| rows.of_all(stamps));
        Self {
            resolution,
            ..Self::of_times(&times.unwrap_or_default())
        }
    }

    /// Returns the correction of rounded stamps; `None` if they need none.
    pub(super) fn corrected(&self) -> Option<RoundedTime> {
        let longest = LONGEST * self.period;
        (self.resolution > 0.0).then(|| RoundedTime::new(self.resolution, longest))
    }

    fn of_times(times: &[f64]) -> Self {
        let mut intervals: Vec<f64> = times
            .iter()
            .zip(times.iter().skip(1))
            .map(|(a, b)| b - a)
            .collect();
        intervals.sort_by(f64::total_cmp);
        let Some(last) = intervals.len().checked_sub(1) else {
            return Self {
                period: 0.0,
                irregular: false,
                resolution: 0.0,
            };
        };
        let at = |list: &[f64], share: f64| list[(share * last as f64).round() as usize];
        let period = at(&intervals, 0.5);
        let is_long = |interval: &&f64| **interval > GAP * period;
        let long = intervals.iter().filter(is_long).count() as f64;
        let mut off = intervals;
        if long <= MOST_MISSING * off.len() as f64 {
            let beyond = |interval: &f64| interval - whole_periods(*interval, period) * period;
            off = off.iter().map(beyond).collect();
            off.sort_by(f64::total_cmp);
        }
        Self {
            period,
            irregular: at(&off, 0.95) - at(&off, 0.05) > IRREGULAR * period,
            resolution: 0.0,
        }
    }

    /// Returns the longest interval that is not a gap, s.
    pub fn longest_interval(&self) -> f64 {
        let periods = if self.irregular { LONGEST } else { GAP };
        periods * self.period + self.resolution
    }

    /// Returns true if an interval is not that of two neighbouring rows.
    pub(super) fn is_uneven(&self, interval: f64) -> bool {
        match self.irregular {
            true => interval > self.longest_interval(),
            false => (interval - self.period).abs() > self.allowed(),
        }
    }

    /// Largest deviation of an interval from whole periods, s.
    fn allowed(&self) -> f64 {
        UNEVEN * self.period + self.resolution
    }

    /// Returns the number of rows that are missing in an interval and are interpolated. It is 0 in a recording whose rows
    /// are uneven anyway, and for an interval that is too long or no multiple of the period.
    pub(super) fn missing(&self, interval: f64) -> usize {
        let periods = whole_periods(interval, self.period);
        let fits = (interval - periods * self.period).abs() <= self.allowed();
        match fits && !self.irregular {
            true => (periods as usize).saturating_sub(1),
            false => 0,
        }
    }

    /// Returns true if this interval separates two blocks.
    pub(super) fn parts(&self, interval: f64) -> bool {
        self.is_uneven(interval) && self.missing(interval) == 0
    }

    /// Returns true if two intervals together are as long as two periods.
    pub(super) fn fits_twice(&self, both: f64) -> bool {
        (both - 2.0 * self.period).abs() <= UNEVEN * self.period
    }

    /// Returns the warning for an interval that separates two blocks.
    pub(super) fn parting(&self, place: Place, from: f64, now: f64) -> Warning {
        if now - from > self.longest_interval() {
            Warning::Gap {
                place,
                from,
                lost: now - from - self.period,
            }
        } else {
            Warning::Uneven {
                place,
                step: now - from,
                period: self.period,
            }
        }
    }
}

/// Returns an interval in whole periods, from one to the most that are interpolated.
fn whole_periods(interval: f64, period: f64) -> f64 {
    (interval / period).round().clamp(1.0, LONGEST)
}
