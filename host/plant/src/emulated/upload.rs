//! Requests that send a description to a rig.

use rig_firmware::validation;
use rig_shared::compensation::{Compensation, EFFECTS, Effects, Role};
use rig_shared::effects::{Effect, Kind};
use rig_shared::wire::message::RequestBody;

use super::nameplate::{Nameplate, NameplateError};
use rig_model::robot::Robot;

/// Returns limits, model, friction, gains and estimator; friction is compensated if `precompensation` is true.
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

/// Requests for a description.
#[derive(Clone, Debug, PartialEq)]
pub struct Upload {
    /// Requests in their order.
    pub requests: Vec<RequestBody>,
    /// Effects that are not compensated, with the reason: a sentence each.
    pub left_out: Vec<String>,
}

/// Returns the requests for a description: settings with precompensation, and effects. A payload is added to the link's
/// inertial parameters. Effects that cannot be compensated are left out if `leave_out` is true; otherwise they are an
/// error.
///
/// # Errors
/// A description that is not a one-link rig, has too many effects, or has effects that the rig cannot or will not
/// compensate.
pub fn requests(robot: &Robot, leave_out: bool) -> Result<Upload, NameplateError> {
    let (mut effects, mut left_out) = (Vec::new(), Vec::new());
    for Effect {
        kind,
        gains,
        shapes,
    } in robot.placed_effects().into_iter().map(|one| one.effect)
    {
        if kind == Kind::Payload {
            // The nameplate's model already includes it.
            continue;
        }
        if let Some(reason) = Role::refusal(kind) {
            left_out.push(format!(
                "the effect {} is not compensated: {reason}",
                kind.about().name
            ));
        } else {
            effects.push(Effect {
                kind,
                gains: gains.map(|value| value as f32),
                shapes: shapes.map(|value| value as f32),
            });
        }
    }
    if !left_out.is_empty() && !leave_out {
        return Err(NameplateError::NotCompensable {
            robot: robot.name.clone(),
            left_out,
        });
    }
    let count = effects.len();
    if count > EFFECTS {
        return Err(NameplateError::TooManyEffects {
            robot: robot.name.clone(),
            effects: count,
        });
    }
    let nameplate = Nameplate::from_robot(robot)?;
    let unusable = |what: String| NameplateError::UnusableEffect {
        robot: robot.name.clone(),
        what,
    };
    let mut given = Effects::default();
    for (place, effect) in given.iter_mut().zip(&effects) {
        *place = Some(*effect);
    }
    let compensation = Compensation::new(&given).map_err(|fault| unusable(fault.to_string()))?;
    validation::effects(&nameplate.config, &compensation)
        .map_err(|excess| unusable(excess.to_string()))?;
    let mut requests = settings(&nameplate, true);
    requests.push(RequestBody::SetEffects(effects.into_iter().collect()));
    Ok(Upload { requests, left_out })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic)]
mod tests {
    use std::path::Path;

    use super::*;
    use rig_model::robot::ONE_LINK_TEMPLATE;

    fn with(effects: &str) -> Robot {
        let text = format!("{ONE_LINK_TEMPLATE}\n{effects}");
        Robot::from_toml(&text, Path::new("rig.toml")).unwrap()
    }

    const BACKLASH: &str = "[[effect]]\nkind = 'backlash'\njoint = 'link'\ngap = 0.01\nstiffness = 5e3\ndamping = 5.0\nlink_friction = 0.5\n";
    const STRIBECK: &str =
        "[[effect]]\nkind = 'stribeck'\njoint = 'link'\nbreakaway = 0.1\nvelocity = 0.05\n";

    #[test]
    fn what_cannot_be_compensated_is_said_by_effect_with_the_reason() {
        let robot = with(&format!("{BACKLASH}{STRIBECK}"));
        let error = requests(&robot, false).unwrap_err().to_string();
        assert!(
            error.contains("backlash is not compensated: it acts between motor and link"),
            "{error}"
        );
        assert!(!error.contains("stribeck"), "{error}");
        let upload = requests(&robot, true).unwrap();
        assert_eq!(upload.left_out.len(), 1);
        assert!(matches!(
            upload.requests.last(),
            Some(RequestBody::SetEffects(effects)) if effects.len() == 1
        ));
        let many = with(&STRIBECK.repeat(EFFECTS + 1));
        assert!(matches!(
            requests(&many, true),
            Err(NameplateError::TooManyEffects { .. })
        ));
    }

    /// An effect that the rig would refuse is named before it is sent.
    #[test]
    fn a_correction_beyond_what_a_sensor_can_be_wrong_by_is_named() {
        let offset = "[[effect]]\nkind = 'current_offset'\njoint = 'link'\noffset = 3.0\n";
        let error = requests(&with(offset), false).unwrap_err().to_string();
        assert!(
            error.contains("current_offset makes 1.2 A of the reading its error")
                && error.contains("0.5 A at most"),
            "{error}"
        );
    }

    /// A point mass of 0.5 kg at 0.2 m: 0.02 kg·m² and 0.1 kg·m, 0.981 N·m of gravity.
    #[test]
    fn a_payload_goes_into_the_model() {
        let payload = "[[effect]]\nkind = 'payload'\njoint = 'link'\nmass = 0.5\ndistance = 0.2\n";
        let model = |robot: &Robot| {
            let upload = requests(robot, false).unwrap();
            let found = upload.requests.iter().find_map(|body| match body {
                RequestBody::SetModel(model) => Some(*model),
                _ => None,
            });
            found.unwrap()
        };
        let (bare, loaded) = (model(&with("")), model(&with(payload)));
        assert!((loaded.inertia - bare.inertia - 0.02).abs() < 1e-6);
        assert!((loaded.gravity_cos - bare.gravity_cos - 0.981).abs() < 1e-5);
    }
}
