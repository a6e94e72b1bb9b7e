//! Recordings as every command takes them: as they are, or brought to an even step.

use super::PrepareError;
use super::pieces::Recording;
use super::resample::{LONGEST_STEP, Resampled};
use super::survey::Survey;
use crate::Block;

/// A recording at an even step.
pub enum Evened<'a> {
    /// Its rows come at an even step.
    AsItIs(&'a dyn Recording),
    /// They were interpolated.
    Resampled(Resampled<'a>),
}

/// How a recording is interpolated that could not be surveyed: at what step, s, and a sentence that says so. None where that is not
/// what it lacks: rows at steps that differ from their mean by more than a fifth, and are never longer than five times of it.
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

impl Recording for Evened<'_> {
    fn label(&self) -> String {
        self.inner().label()
    }

    fn unburdened(&self) -> bool {
        self.inner().unburdened()
    }

    fn each_block(
        &self,
        rows: usize,
        take: &mut dyn FnMut(Block) -> Result<(), PrepareError>,
    ) -> Result<(), PrepareError> {
        self.inner().each_block(rows, take)
    }

    fn passed(&self, share: f64) {
        self.inner().passed(share);
    }
}

impl Evened<'_> {
    fn inner(&self) -> &dyn Recording {
        match self {
            Self::AsItIs(recording) => *recording,
            Self::Resampled(recording) => recording,
        }
    }
}

/// Any recordings as such.
pub fn as_recordings<R: Recording>(list: &[R]) -> Vec<&dyn Recording> {
    list.iter()
        .map(|recording| recording as &dyn Recording)
        .collect()
}

/// Surveys of recordings, and the recordings as they are to be used: those at uneven steps interpolated, which their
/// [`Survey::note`] says.
///
/// # Errors
/// As [`Survey::take`].
pub fn surveyed<'a>(
    recordings: &[&'a dyn Recording],
    joints: usize,
) -> Result<(Vec<Survey>, Vec<Evened<'a>>), PrepareError> {
    let mut surveys = Vec::with_capacity(recordings.len());
    let mut usable = Vec::with_capacity(recordings.len());
    for recording in recordings {
        match Survey::take(*recording, joints) {
            Ok(survey) => {
                surveys.push(survey);
                usable.push(Evened::AsItIs(*recording));
            }
            Err(error) => {
                let (step, note) = interpolation(&error).ok_or(error)?;
                let even = Resampled::new(*recording, step);
                let mut survey = Survey::take(&even, joints)?;
                survey.note = Some(note);
                surveys.push(survey);
                usable.push(Evened::Resampled(even));
            }
        }
    }
    Ok((surveys, usable))
}
