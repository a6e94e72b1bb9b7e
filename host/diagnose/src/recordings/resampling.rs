//! Recordings with uneven sample times. Only their preparation detects them.

use std::collections::BTreeMap;

use rig_data::prepare::{MaybeResampled, PrepareError, Recording, Resampled, interpolation};

/// Interpolation step (s) and message of each resampled recording, by label.
#[derive(Default)]
pub(crate) struct Uneven(BTreeMap<String, (f64, String)>);

impl Uneven {
    /// Returns true if a recording that failed can be prepared by interpolation, and stores its step.
    pub(crate) fn takes(&mut self, error: &PrepareError) -> bool {
        let (PrepareError::Irregular { label, .. }, Some(how)) = (error, interpolation(error))
        else {
            return false;
        };
        self.0.insert(label.clone(), how).is_none()
    }

    /// Returns the recordings, resampled where necessary.
    pub(crate) fn even<'a>(&self, recordings: &[&'a dyn Recording]) -> Vec<MaybeResampled<'a>> {
        (recordings.iter())
            .map(|recording| match self.0.get(&recording.label()) {
                Some((step, _)) => MaybeResampled::Resampled(Resampled::new(*recording, *step)),
                None => MaybeResampled::Unchanged(*recording),
            })
            .collect()
    }

    /// Returns the messages about interpolated recordings.
    pub(crate) fn told(&self) -> impl Iterator<Item = String> {
        self.0.values().map(|(_, note)| note.clone())
    }
}

/// Returns the recordings that a preparation error names.
pub(crate) fn of_error<'a>(
    error: &PrepareError,
    given: &[&'a dyn Recording],
) -> Vec<&'a dyn Recording> {
    let PrepareError::Irregular { label, .. } = error else {
        return Vec::new();
    };
    let own = |recording: &&&dyn Recording| recording.label() == *label;
    given.iter().filter(own).copied().collect()
}
