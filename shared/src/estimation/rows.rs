//! Counts of the rows that an on-line estimator has used or left out, and why it learns nothing.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::report::Update;

/// Whether an on-line estimator learns now, and otherwise why not. Refers to the rows since the last report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[repr(u8)]
pub enum Learning {
    /// At least one row was used.
    Active,
    /// The bridge is off, or the motor brakes after a fault: the motion is not the motor's alone.
    BridgeOff,
    /// The current was read before its amplifier had settled after an edge of the bridge.
    CurrentUnsettled,
    /// The joint is slower than the slip velocity of the settings, so that its friction may be in presliding.
    TooSlow,
    /// The estimator's filter holds what came before the start, a standstill, a reversal or a gap.
    #[default]
    FilterSettling,
    /// The rows add too little to what is known already.
    Uninformative,
    /// Position, velocity or torque are not finite, or beyond the range of any rig.
    OutOfRange,
}

impl Learning {
    /// All values, in the order of their numbers.
    pub const ALL: [Self; 7] = [
        Self::Active,
        Self::BridgeOff,
        Self::CurrentUnsettled,
        Self::TooSlow,
        Self::FilterSettling,
        Self::Uninformative,
        Self::OutOfRange,
    ];
}

impl From<Update> for Learning {
    fn from(update: Update) -> Self {
        match update {
            Update::Used | Update::Changed => Self::Active,
            Update::Uninformative => Self::Uninformative,
            Update::Slow => Self::TooSlow,
            Update::Masked => Self::FilterSettling,
            Update::Invalid => Self::OutOfRange,
        }
    }
}

/// Rows since the estimator's last restart. Each row counts once; a counter stays at its largest value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct RowCounts {
    /// Rows that have moved the estimate.
    pub used: u32,
    /// Rows that the model does not describe, or whose readings are in doubt: each reason of [`Learning`] but
    /// `Uninformative`.
    pub masked: u32,
    /// Rows that carried too little information for their noise.
    pub uninformative: u32,
}

/// Counts the rows between two reports by what became of them.
///
/// A row costs one increment; the totals are added up for a report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RowCounter {
    since_report: [u16; Learning::ALL.len()],
    total: RowCounts,
}

impl RowCounter {
    /// Counts a row.
    #[inline(always)]
    pub fn count(&mut self, outcome: Learning) {
        // At most 65 535 rows between two reports: a minute at 1 kHz, far longer than any report takes.
        let count = &mut self.since_report[outcome as usize];
        *count = count.wrapping_add(1);
    }

    /// Returns the counts since the last restart, and what became of most rows since the last report: one that was used
    /// decides, otherwise the most frequent reason.
    pub fn report(&mut self) -> (RowCounts, Learning) {
        let counts = core::mem::take(&mut self.since_report);
        let total = &mut self.total;
        let mut learning = (Learning::default(), 0);
        for (outcome, count) in Learning::ALL.into_iter().zip(counts) {
            let sum = match outcome {
                Learning::Active => &mut total.used,
                Learning::Uninformative => &mut total.uninformative,
                _ => &mut total.masked,
            };
            *sum = sum.saturating_add(count.into());
            if count > learning.1 && (outcome == Learning::Active || learning.0 != Learning::Active)
            {
                learning = (outcome, count);
            }
        }
        (*total, learning.0)
    }

    /// Forgets all counts, as the estimator does at a restart.
    pub fn restart(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every row counts once, in one of three sums. A used row decides; otherwise the most frequent reason does.
    #[test]
    fn rows_are_counted_once_and_the_most_frequent_reason_is_told() {
        let mut counter = RowCounter::default();
        assert_eq!(
            counter.report(),
            (RowCounts::default(), Learning::FilterSettling)
        );
        for (rows, learning) in [
            (
                &[Learning::BridgeOff, Learning::TooSlow, Learning::TooSlow][..],
                Learning::TooSlow,
            ),
            (
                &[Learning::TooSlow, Learning::TooSlow, Learning::Active],
                Learning::Active,
            ),
            (
                &[
                    Learning::Uninformative,
                    Learning::Uninformative,
                    Learning::OutOfRange,
                ],
                Learning::Uninformative,
            ),
        ] {
            rows.iter().for_each(|row| counter.count(*row));
            assert_eq!(counter.report().1, learning);
        }
        let counts = RowCounts {
            used: 1,
            masked: 6,
            uninformative: 2,
        };
        assert_eq!(counter.report(), (counts, Learning::FilterSettling));
        counter.count(Learning::Active);
        counter.restart();
        assert_eq!(counter, RowCounter::default());
    }

    /// The place in `ALL` is the number on the wire and of the counter.
    #[test]
    fn all_values_are_in_the_order_of_their_numbers() {
        for (place, learning) in Learning::ALL.into_iter().enumerate() {
            assert_eq!(learning as usize, place);
        }
    }
}
