//! Recordings whose rows come at uneven steps, which is known only once they are prepared.

use std::collections::BTreeMap;

use rig_data::prepare::{Evened, PrepareError, Recording, Resampled, interpolation};

/// Step of recordings that are interpolated, s, and what is said of it, by their names.
#[derive(Default)]
pub(super) struct Uneven(BTreeMap<String, (f64, String)>);

impl Uneven {
    /// Whether a recording that could not be prepared can be when interpolated, which is remembered.
    pub(super) fn takes(&mut self, error: &PrepareError) -> bool {
        let (PrepareError::Irregular { label, .. }, Some(how)) = (error, interpolation(error))
        else {
            return false;
        };
        self.0.insert(label.clone(), how).is_none()
    }

    /// Recordings as they are to be used.
    pub(super) fn even<'a>(&self, recordings: &[&'a dyn Recording]) -> Vec<Evened<'a>> {
        (recordings.iter())
            .map(|recording| match self.0.get(&recording.label()) {
                Some((step, _)) => Evened::Resampled(Resampled::new(*recording, *step)),
                None => Evened::AsItIs(*recording),
            })
            .collect()
    }

    /// What is to be said of those that were interpolated.
    pub(super) fn told(&self) -> impl Iterator<Item = String> {
        self.0.values().map(|(_, note)| note.clone())
    }
}

/// The recordings that an error of preparing names.
pub(super) fn of_error<'a>(
    error: &PrepareError,
    given: &[&'a dyn Recording],
) -> Vec<&'a dyn Recording> {
    let PrepareError::Irregular { label, .. } = error else {
        return Vec::new();
    };
    let own = |recording: &&&dyn Recording| recording.label() == *label;
    given.iter().filter(own).copied().collect()
}
