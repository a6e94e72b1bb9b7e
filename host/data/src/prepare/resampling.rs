//! Recordings as all commands take them: unchanged, or interpolated to an even step.

use super::error::PrepareError;
use super::pieces::Recording;
use super::resample::Resampled;
use super::spacing::LONGEST_STEP;
use super::survey::Survey;
use crate::block::Block;

/// A recording with an even step.
pub enum MaybeResampled<'a> {
    /// Its rows have an even step already.
    Unchanged(&'a dyn Recording),
    /// Its rows were interpolated.
    Resampled(Resampled<'a>),
}

/// Returns the step (s) for interpolating a recording that could not be surveyed, and a sentence that says so. Returns
/// `None` for other errors, and if a step is longer than five times the mean.
pub fn interpolation(error: &PrepareError) -> Option<(f64, String)> {
    let PrepareError::Irregular {
        label,
        mean,
        longest,
        ..
    } = error
    else {
        return None;
    };
    (*longest <= LONGEST_STEP * mean).then(|| {
        let note = format!(
            "{label}: the rows come at uneven steps (up to {longest:.6} s, {mean:.6} s on average); they were interpolated to an even step, their time stamps believed."
        );
        (*mean, note)
    })
}

impl MaybeResampled<'_> {
    fn inner(&self) -> &dyn Recording {
        match self {
            Self::Unchanged(recording) => *recording,
            Self::Resampled(recording) => recording,
        }
    }
}

impl Recording for MaybeResampled<'_> {
    fn source(&self) -> Option<&dyn Recording> {
        Some(self.inner())
    }

    fn each_block(
        &self,
        rows: usize,
        take: &mut dyn FnMut(Block) -> Result<(), PrepareError>,
    ) -> Result<(), PrepareError> {
        self.inner().each_block(rows, take)
    }
}

/// Returns the recordings as trait objects.
pub fn as_recordings<R: Recording>(list: &[R]) -> Vec<&dyn Recording> {
    list.iter()
        .map(|recording| recording as &dyn Recording)
        .collect()
}

/// Surveys recordings and returns them ready for use. Those with uneven steps are interpolated, and their
/// [`Survey::note`] says so.
///
/// # Errors
/// As [`Survey::take`].
pub fn surveyed<'a>(
    recordings: &[&'a dyn Recording],
    joints: usize,
) -> Result<(Vec<Survey>, Vec<MaybeResampled<'a>>), PrepareError> {
    let mut surveys = Vec::with_capacity(recordings.len());
    let mut usable = Vec::with_capacity(recordings.len());
    for recording in recordings {
        match Survey::take(*recording, joints) {
            Ok(survey) => {
                surveys.push(survey);
                usable.push(MaybeResampled::Unchanged(*recording));
            }
            Err(error) => {
                let (step, note) = interpolation(&error).ok_or(error)?;
                let even = Resampled::new(*recording, step);
                let mut survey = Survey::take(&even, joints)?;
                survey.note = Some(note);
                surveys.push(survey);
                usable.push(MaybeResampled::Resampled(even));
            }
        }
    }
    Ok((surveys, usable))
}
