//! What the sampling of a recording alone may cause.

use rig_data::runs::Run;

/// Share of a sample by which a torque may be late without a delay. A mean over the last sample, such as a summed
/// current, is half a sample old; a tenth allows for the error of the estimate.
const LATE: f64 = 0.6;

/// Upper limit of that time, s: a board reads its sensors within it, even if they are recorded slowly.
const LATEST: f64 = 0.001;

/// Returns the lateness that sampling alone may cause, s.
pub(crate) fn sampling_jitter(runs: &[Run]) -> f64 {
    runs.first()
        .map_or(0.0, |run| (LATE / run.rate).min(LATEST))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_than_half_a_sample_late_is_sampling() {
        let late = |rate: f64| {
            sampling_jitter(&[Run {
                rate,
                ..Run::default()
            }])
        };
        // Half a sample at 1 kHz is sampling; three quarters with a current filter are not.
        assert!(late(1000.0) > 0.0005 && late(1000.0) < 0.00075);
        assert_eq!(late(100.0), LATEST);
        assert_eq!(sampling_jitter(&[]), 0.0);
    }
}
