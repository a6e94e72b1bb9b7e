//! Recordings with the torque of the description's effects subtracted before the fit.

use rig_shared::multibody::Chain;

use crate::error::IdentifyError;
use rig_data::Compensated;
use rig_data::prepare::{Recording, Treatment};
use rig_model::effects::Effects;

/// Subtracts effects and payloads from each recording with its treatment: the bare robot is identified.
pub(crate) fn freed<'a>(
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

/// Converts to trait objects.
pub(crate) fn plain<R: Recording>(list: &[R]) -> Vec<&dyn Recording> {
    list.iter().map(|r| r as &dyn Recording).collect()
}
