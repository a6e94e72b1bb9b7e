//! Recordings whose rows come at uneven steps, brought to an even one.

use std::collections::BTreeMap;

use crate::prepare::{LONGEST_STEP, PrepareError, Recording, Resampled, interpolated};

/// Mean and longest step of recordings that are interpolated, by their names, s.
#[derive(Default)]
pub(super) struct Uneven(BTreeMap<String, [f64; 2]>);

impl Uneven {
    /// Whether a recording that could not be prepared can be when interpolated, which is remembered.
    pub(super) fn takes(&mut self, error: &PrepareError) -> bool {
        let PrepareError::Irregular {
            label,
            mean,
            longest,
            ..
        } = error
        else {
            return false;
        };
        *longest <= LONGEST_STEP * mean && self.0.insert(label.clone(), [*mean, *longest]).is_none()
    }

    /// Recordings as they are to be used.
    pub(super) fn even<'a>(&self, recordings: &[&'a dyn Recording]) -> Vec<Evened<'a>> {
        (recordings.iter())
            .map(|recording| match self.0.get(&recording.label()) {
                Some([mean, _]) => Evened::Resampled(Resampled::new(*recording, *mean)),
                None => Evened::AsItIs(*recording),
            })
            .collect()
    }

    /// What is to be said of those that were interpolated.
    pub(super) fn told(&self) -> impl Iterator<Item = String> {
        (self.0.iter()).map(|(label, [mean, longest])| interpolated(label, *longest, *mean))
    }
}

/// A recording at an even step.
pub(super) enum Evened<'a> {
    AsItIs(&'a dyn Recording),
    Resampled(Resampled<'a>),
}

/// As recordings.
pub(super) fn borrowed<'e>(recordings: &'e [Evened<'_>]) -> Vec<&'e dyn Recording> {
    let one = |recording: &'e Evened<'_>| -> &'e dyn Recording {
        match recording {
            Evened::AsItIs(recording) => *recording,
            Evened::Resampled(recording) => recording,
        }
    };
    recordings.iter().map(one).collect()
}
