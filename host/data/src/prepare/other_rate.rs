//! Adapts a plan that was decided at one sample rate to a recording of another rate.

use super::error::PrepareError;
use super::preprocessing_plan::{MAX_CUTOFF_SHARE, PreprocessingPlan};
use super::rate::{parallel_pass, same_rate, trimmed_rows};
use super::survey::Survey;
use rig_output::format_short;

impl PreprocessingPlan {
    /// Returns the plan for a further recording (a hold-out) at that recording's own rate. The band of torque and
    /// regressor is as close as a whole number of rows allows; masks and torque lead are kept. Returns it unchanged if
    /// the rates agree within 1 %.
    ///
    /// A slower recording may need a lower cut-off of the position. Above the band, that cut-off changes no compared
    /// value.
    ///
    /// # Errors
    /// [`PrepareError::BandBeyondRate`].
    pub fn at_rate_of(&self, survey: &Survey) -> Result<Self, PrepareError> {
        if same_rate(survey, self.sample_rate).is_ok() {
            return Ok(self.clone());
        }
        let rate = survey.sample_rate;
        let most = MAX_CUTOFF_SHARE * rate / 2.0;
        if self.parallel_edge > most {
            return Err(PrepareError::BandBeyondRate {
                label: survey.label.clone(),
                rate,
                most,
                band: self.parallel_edge,
            });
        }
        let cutoff = self.cutoff.min(most);
        let decimation = if self.decimation == 1 {
            // Without decimation, the low-pass over torque and regressor is that of the position, at any rate.
            1
        } else {
            (rate / self.kept_rate()).round().max(1.0) as usize
        };
        let (parallel_edge, parallel_filter) = parallel_pass(self.order, cutoff, decimation, rate);
        let as_fitted = format!(
            "as for the recordings at {} Hz.",
            format_short(self.sample_rate)
        );
        Ok(Self {
            sample_rate: rate,
            cutoff,
            cutoff_reason: format!("{cutoff:.3} Hz, {as_fitted}"),
            decimation,
            decimation_reason: format!(
                "One row in {decimation}, up to {parallel_edge:.3} Hz, {as_fitted}"
            ),
            parallel_edge,
            parallel_filter,
            trimmed: trimmed_rows(cutoff, decimation, rate),
            ..self.clone()
        })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::prepare::{Choice, InMemory, PrepareOptions};
    use crate::{Block, JointColumns};

    fn survey(rate: f64) -> Survey {
        let t: Vec<f64> = (0..(20.0 * rate) as usize)
            .map(|k| k as f64 / rate)
            .collect();
        let joint = JointColumns {
            q: t.iter().map(|t| (5.0 * t).sin()).collect(),
            tau: t.iter().map(|t| (5.0 * t).cos()).collect(),
            ..Default::default()
        };
        let recording = InMemory {
            label: "made".into(),
            blocks: vec![Block {
                t,
                joints: vec![joint],
                first_line: 2,
                ..Default::default()
            }],
        };
        Survey::take(&recording, 1).unwrap()
    }

    fn decided(cutoff: f64, decimation: usize) -> PreprocessingPlan {
        let options = PrepareOptions {
            cutoff: Choice::Fixed(cutoff),
            decimation: Choice::Fixed(decimation),
            ..Default::default()
        };
        PreprocessingPlan::decide(&[survey(1000.0)], &options, &[None]).unwrap()
    }

    #[test]
    fn the_band_stays_whatever_the_rate() {
        let fitted = decided(50.0, 20);
        assert_eq!(fitted.parallel_edge, 20.0);
        assert_eq!(fitted.at_rate_of(&survey(1000.0)).unwrap(), fitted);
        for (rate, decimation, cutoff) in [(5000.0, 100, 50.0), (250.0, 5, 50.0), (100.0, 2, 40.0)]
        {
            let own = fitted.at_rate_of(&survey(rate)).unwrap();
            assert_eq!(own.decimation, decimation);
            assert!((own.cutoff - cutoff).abs() < 1e-9);
            assert!((own.parallel_edge - 20.0).abs() < 1e-9);
            assert_eq!(own.speed_threshold, fitted.speed_threshold);
            assert!(own.trimmed as f64 / rate >= 3.0 / cutoff);
            assert!(own.position_filter().is_some() && own.parallel_low_pass().is_some());
        }
        // Without decimation the low-pass over the torque is that of the position, at any rate.
        let whole = decided(50.0, 1).at_rate_of(&survey(5000.0)).unwrap();
        assert_eq!((whole.decimation, whole.parallel_edge), (1, 50.0));
    }

    #[test]
    fn a_rate_that_cannot_hold_the_band_is_refused() {
        let error = decided(50.0, 20).at_rate_of(&survey(40.0)).unwrap_err();
        assert!(matches!(error, PrepareError::BandBeyondRate { .. }));
        let sentence = error.to_string();
        assert!(
            sentence.contains("20.0 Hz") && sentence.contains("16.0 Hz"),
            "{sentence}"
        );
    }
}
