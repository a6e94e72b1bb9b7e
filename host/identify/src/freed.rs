//! Recordings freed of the description's effects before anything is fitted to them.

use rig_shared::multibody::Chain;

use super::IdentifyError;
use rig_data::Compensated;
use rig_data::prepare::{Recording, Treatment};
use rig_model::effects::Effects;

/// Each of several recordings and its treatment, payloads taken off too: what is identified is the robot without them.
pub(super) fn freed<'a>(
    list: &[&'a dyn Recording],
    effects: &'a Effects,
    chain: &'a Chain<f64>,
    treatments: &[Treatment],
) -> Result<Vec<Compensated<'a>>, IdentifyError> {
    list.iter()
        .zip(treatments)
        .map(|(r, treatment)| Ok(Compensated::new(*r, effects, chain, treatment, true)?))
        .collect()
}

/// As recordings.
pub(super) fn plain<R: Recording>(list: &[R]) -> Vec<&dyn Recording> {
    list.iter().map(|r| r as &dyn Recording).collect()
}
