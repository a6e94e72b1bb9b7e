//! What a description asks a rig to be told.

use rig_shared::compensation::EFFECTS;
use rig_shared::effects::Effect;
use rig_shared::wire::message::RequestBody;

use super::nameplate::{Nameplate, NameplateError};
use crate::robot::Robot;

/// Limits, model, friction, gains and estimator; friction is compensated where `precompensation` says so.
pub fn settings(nameplate: &Nameplate, precompensation: bool) -> Vec<RequestBody> {
    let settings = &nameplate.settings;
    let mut compensation = settings.precompensation;
    compensation.enabled = precompensation;
    vec![
        RequestBody::SetLimits(settings.limits),
        RequestBody::SetModel(settings.model),
        RequestBody::SetFriction(settings.friction),
        RequestBody::SetPrecompensation(compensation),
        RequestBody::SetGains(settings.gains),
        RequestBody::SetEstimator(settings.estimator),
    ]
}

/// All of a description: the settings, precompensation on, and the effects.
///
/// # Errors
/// A description that is none of a one-link rig, or has more effects than a rig compensates.
pub fn requests(robot: &Robot) -> Result<Vec<RequestBody>, NameplateError> {
    let placed = robot.placed_effects();
    if placed.len() > EFFECTS {
        return Err(NameplateError::TooManyEffects {
            robot: robot.name.clone(),
            effects: placed.len(),
        });
    }
    let single = |effect: Effect<f64>| Effect {
        kind: effect.kind,
        gains: effect.gains.map(|value| value as f32),
        shapes: effect.shapes.map(|value| value as f32),
    };
    let mut all = settings(&Nameplate::from_robot(robot)?, true);
    let effects = placed.iter().map(|one| single(one.effect)).collect();
    all.push(RequestBody::SetEffects(effects));
    Ok(all)
}
