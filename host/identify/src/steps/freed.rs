//! Recordings with the torque of the description's effects subtracted before the fit.

use rig_shared::multibody::Chain;

use super::recordings::{Sets, Surveyed};
use crate::error::IdentifyError;
use rig_data::Compensated;
use rig_data::prepare::{PreprocessingPlan, Recording, Spooled, as_recordings};
use rig_model::effects::Effects;

/// Subtracts effects and payloads from each recording with its treatment: the bare robot is identified.
fn freed<'a>(
    list: &[&'a dyn Recording],
    effects: &'a Effects,
    chain: &'a Chain<f64>,
    treatments: &[PreprocessingPlan],
) -> Result<Vec<Compensated<'a>>, IdentifyError> {
    list.iter()
        .zip(treatments)
        .map(|(r, treatment)| Ok(Compensated::new(*r, effects, chain, treatment, true)?))
        .collect()
}

/// Recordings without the torque of effects.
pub(crate) struct Freed<'a> {
    training: Vec<Compensated<'a>>,
    holdout: Vec<Compensated<'a>>,
    sources: Vec<Compensated<'a>>,
}

impl<'a> Freed<'a> {
    /// Subtracts `effects` from all recordings of `sets`, each with `treatment` at its own rate; none if there are no
    /// effects.
    ///
    /// # Errors
    /// [`IdentifyError::Prepare`]: a treatment that is impossible at a recording's rate.
    pub(crate) fn of(
        sets: &Sets<'a>,
        surveyed: &Surveyed,
        treatment: &PreprocessingPlan,
        effects: &'a Effects,
        chain: &'a Chain<f64>,
    ) -> Result<Option<Self>, IdentifyError> {
        if effects.is_empty() {
            return Ok(None);
        }
        let free = |list: &[&'a dyn Recording], treatments: &[PreprocessingPlan]| {
            freed(list, effects, chain, treatments)
        };
        let fitted = vec![treatment.clone(); sets.training.len()];
        Ok(Some(Self {
            training: free(&sets.training, &fitted)?,
            holdout: free(&sets.holdout, &surveyed.at_holdout_rates(treatment)?)?,
            sources: free(&sets.sources, &fitted)?,
        }))
    }

    /// Returns training and hold-out recordings that are computed once and then read any number of times.
    pub(crate) fn spooled(&self) -> [Vec<Spooled<'_>>; 2] {
        [&self.training, &self.holdout].map(|list| Spooled::all(&as_recordings(list)))
    }

    /// Returns the recordings, with training and hold-out as [`Self::spooled`].
    pub(crate) fn sets<'b>(&'b self, [training, holdout]: &'b [Vec<Spooled<'b>>; 2]) -> Sets<'b> {
        Sets {
            training: as_recordings(training),
            holdout: as_recordings(holdout),
            sources: as_recordings(&self.sources),
        }
    }
}
