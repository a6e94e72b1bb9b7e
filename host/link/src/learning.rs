//! What the rig's on-line estimator has learnt from, and why it learns nothing, in words.

use rig_shared::estimation::{Learning, RowCounts};
use rig_shared::wire::message::Estimate;

/// Returns why nothing is learnt as a clause; for [`Learning::Active`] that something is.
pub const fn describe_learning(learning: Learning) -> &'static str {
    match learning {
        Learning::Active => "the estimator learns",
        Learning::BridgeOff => "the bridge is off, or the motor brakes after a fault",
        Learning::CurrentUnsettled => {
            "the current is read before its amplifier has settled, because the duty is too high"
        }
        Learning::TooSlow => {
            "the joint moves slower than the estimator's slip velocity (0.2 rad/s unless it was set), below which friction is not known to slide"
        }
        Learning::FilterSettling => {
            "the estimator's filter still holds what came before the last start, standstill, reversal or gap"
        }
        Learning::Uninformative => "the motion shows nothing that is not known already",
        Learning::OutOfRange => "position, velocity or torque are no numbers of any rig",
    }
}

/// Sums up what the rig told of its estimator during a recording.
#[derive(Clone, Copy, Debug, Default)]
pub struct LearningLog {
    previous: Option<RowCounts>,
    rows: RowCounts,
    /// Number of reports with each value of [`Learning`].
    reports: [u32; Learning::ALL.len()],
}

impl LearningLog {
    /// Adds a report. Its counts include rows before the recording, so that differences are summed. Counts that have shrunk
    /// are those after a restart of the estimator.
    pub fn add(&mut self, estimate: &Estimate) {
        let now = estimate.rows;
        if let Some(before) = self.previous.replace(now) {
            let restarted = now.used < before.used
                || now.masked < before.masked
                || now.uninformative < before.uninformative;
            let before = if restarted {
                RowCounts::default()
            } else {
                before
            };
            let sum = |sum: u32, now: u32, before: u32| sum.saturating_add(now - before);
            self.rows = RowCounts {
                used: sum(self.rows.used, now.used, before.used),
                masked: sum(self.rows.masked, now.masked, before.masked),
                uninformative: sum(
                    self.rows.uninformative,
                    now.uninformative,
                    before.uninformative,
                ),
            };
        }
        self.reports[estimate.learning as usize] += 1;
    }

    /// Returns the rows between the first report and the last.
    pub fn rows(&self) -> RowCounts {
        self.rows
    }

    /// Describes the rows in a sentence, and if none was used, the most frequent reason; `None` if there were no rows.
    pub fn sentence(&self) -> Option<String> {
        let RowCounts {
            used,
            masked,
            uninformative,
        } = self.rows;
        let all = u64::from(used) + u64::from(masked) + u64::from(uninformative);
        if all == 0 {
            return None;
        }
        let counts = format!(
            "The rig's on-line estimator used {used} of {all} rows, left out {masked} that its model does not describe, and found nothing new in {uninformative}."
        );
        let reasons = Learning::ALL.into_iter().zip(self.reports);
        let reason = reasons
            .filter(|(learning, _)| *learning != Learning::Active)
            .max_by_key(|(_, reports)| *reports);
        Some(match reason {
            Some((learning, reports)) if used == 0 && reports > 0 => {
                format!(
                    "{counts} It learnt nothing, mostly because {}.",
                    describe_learning(learning)
                )
            }
            _ => counts,
        })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn estimate(rows: [u32; 3], learning: Learning) -> Estimate {
        let [used, masked, uninformative] = rows;
        Estimate {
            tick: 0,
            value: [0.0; 6],
            std: [0.0; 6],
            trusted: [false; 6],
            residual_rms: 0.0,
            rows: RowCounts {
                used,
                masked,
                uninformative,
            },
            learning,
        }
    }

    /// Rows before the first report do not count; those of a new estimator do.
    #[test]
    fn rows_are_summed_over_a_restart_of_the_estimator() {
        let mut log = LearningLog::default();
        assert_eq!(log.sentence(), None);
        for (rows, learning) in [
            ([1000, 20, 3], Learning::Active),
            ([1050, 20, 3], Learning::Active),
            ([0, 40, 0], Learning::FilterSettling),
            ([30, 50, 10], Learning::Active),
        ] {
            log.add(&estimate(rows, learning));
        }
        let expected = RowCounts {
            used: 80,
            masked: 50,
            uninformative: 10,
        };
        assert_eq!(log.rows(), expected);
        let sentence = log.sentence().unwrap();
        assert!(
            sentence.contains("used 80 of 140 rows, left out 50"),
            "{sentence}"
        );
        assert!(!sentence.contains("learnt nothing"), "{sentence}");
    }

    /// Each reason is told in its own words if no row was used.
    #[test]
    fn a_recording_without_any_used_row_says_why() {
        for learning in Learning::ALL.into_iter().skip(1) {
            let mut log = LearningLog::default();
            log.add(&estimate([5, 0, 0], Learning::Active));
            log.add(&estimate([5, 30, 0], learning));
            log.add(&estimate([5, 60, 1], learning));
            let sentence = log.sentence().unwrap();
            let why = format!(
                "It learnt nothing, mostly because {}.",
                describe_learning(learning)
            );
            assert!(sentence.ends_with(&why), "{sentence}");
        }
    }
}
