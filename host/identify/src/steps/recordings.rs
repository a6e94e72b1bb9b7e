//! The recordings of an identification, surveyed and with even steps.

use crate::error::IdentifyError;
use rig_data::prepare::{
    MaybeResampled, PrepareError, PreprocessingPlan, Recording, Spooled, Survey, as_recordings,
    surveyed,
};

/// The recordings that the passes of an identification read.
#[derive(Clone)]
pub(crate) struct Sets<'a> {
    /// Recordings of the fit.
    pub training: Vec<&'a dyn Recording>,
    /// Recordings that only judge the fit.
    pub holdout: Vec<&'a dyn Recording>,
    /// Those of the fit with all their columns.
    pub sources: Vec<&'a dyn Recording>,
}

/// Recordings with their surveys.
pub(crate) struct Surveyed<'a> {
    /// Of the training recordings.
    pub training_surveys: Vec<Survey>,
    /// Of the hold-out recordings.
    pub holdout_surveys: Vec<Survey>,
    training: Vec<MaybeResampled<'a>>,
    holdout: Vec<MaybeResampled<'a>>,
}

impl<'a> Surveyed<'a> {
    /// Surveys training and hold-out recordings of a robot with `joints` joints.
    ///
    /// # Errors
    /// [`IdentifyError`]: no training recording; recordings that cannot be read.
    pub(crate) fn of(
        [training, holdout]: &'a [Vec<Spooled<'_>>; 2],
        joints: usize,
    ) -> Result<Self, IdentifyError> {
        let (training_surveys, training) = surveyed(&as_recordings(training), joints)?;
        if training_surveys.is_empty() {
            return Err(IdentifyError::NoRecording);
        }
        let (holdout_surveys, holdout) = surveyed(&as_recordings(holdout), joints)?;
        Ok(Self {
            training_surveys,
            holdout_surveys,
            training,
            holdout,
        })
    }

    /// Returns the recordings. `originals` are the training recordings as given: spooled ones contain no references.
    pub(crate) fn sets<'b>(&'b self, originals: &[&'b dyn Recording]) -> Sets<'b> {
        let training = as_recordings(&self.training);
        let mut surveys = self.training_surveys.iter();
        // References do not match interpolated rows, so users of references are told that they are missing.
        let sources = if surveys.any(|survey| survey.note.is_some()) {
            training.clone()
        } else {
            originals.to_vec()
        };
        Sets {
            training,
            holdout: as_recordings(&self.holdout),
            sources,
        }
    }

    /// Requires a torque of every joint.
    ///
    /// # Errors
    /// [`IdentifyError::NoTorque`].
    pub(crate) fn check_torque(&self, joints: usize) -> Result<(), IdentifyError> {
        let surveys = &self.training_surveys;
        let silent = |&j: &usize| surveys.iter().all(|s| s.joints[j].torque_rms == 0.0);
        match (0..joints).find(silent) {
            Some(j) => Err(IdentifyError::NoTorque {
                joint: j + 1,
                still: surveys.iter().all(|s| s.joints[j].still()),
            }),
            None => Ok(()),
        }
    }

    /// Returns `treatment` at the sample rate of each hold-out recording.
    ///
    /// # Errors
    /// [`PrepareError::BandBeyondRate`].
    pub(crate) fn at_holdout_rates(
        &self,
        treatment: &PreprocessingPlan,
    ) -> Result<Vec<PreprocessingPlan>, PrepareError> {
        let of = |survey| treatment.at_rate_of(survey);
        self.holdout_surveys.iter().map(of).collect()
    }
}
