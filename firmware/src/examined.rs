//! Requests whose slow computations and checks are done outside the control tick.

use rig_shared::compensation::{Compensation, EffectFault, Effects};
use rig_shared::estimation::one_link;
use rig_shared::trajectory::{Extremes, Preparation};
use rig_shared::wire::message::{Refusal, Request, RequestBody};

use crate::config::Config;
use crate::usable;

/// A request with the result of its examination.
#[derive(Clone, Debug, PartialEq)]
pub struct Examined {
    /// The request as the host sent it.
    pub request: Request,
    /// The result, or the refusal if the request is invalid in every state of the rig.
    pub finding: Result<Finding, Refusal>,
}

/// Result of an examination.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant)] // four of them lie in a queue, and nowhere else
pub enum Finding {
    /// No further result.
    Plain,
    /// Extremes of a trajectory, and its preparation.
    Motion(Extremes<f32>, Preparation<f32>),
    /// Effects, checked.
    Effects(Compensation<f32>),
    /// An estimator's constants.
    Estimator(one_link::Config<f32>),
}

/// Examines a request. Evaluates a Fourier series about a thousand times: call this outside the tick.
pub fn examine(config: &Config, request: Request) -> Examined {
    let finding = find(config, &request.body);
    Examined { request, finding }
}

fn find(config: &Config, body: &RequestBody) -> Result<Finding, Refusal> {
    let good = match body {
        RequestBody::SetTrajectory(trajectory) => {
            return match trajectory.validate() {
                Ok(()) => Ok(Finding::Motion(trajectory.extremes(), trajectory.prepare())),
                Err(_) => Err(Refusal::BadValue),
            };
        }
        RequestBody::SetEffects(given) => {
            let mut effects = Effects::default();
            for (place, effect) in effects.iter_mut().zip(given) {
                *place = Some(*effect);
            }
            let compensation = Compensation::new(&effects).map_err(|fault| match fault {
                EffectFault::NotCompensable(kind) => Refusal::NotCompensable(kind),
                EffectFault::Parameter(_) | EffectFault::Surplus => Refusal::BadValue,
            })?;
            return match usable::effects(config, &compensation) {
                Ok(()) => Ok(Finding::Effects(compensation)),
                Err(_) => Err(Refusal::BadValue),
            };
        }
        RequestBody::SetEstimator(settings) => {
            return one_link::Config::new(settings, config.rates.estimator_hz())
                .map(Finding::Estimator)
                .map_err(|_| Refusal::BadValue);
        }
        RequestBody::SetGains(gains) => usable::gains(config, gains),
        RequestBody::SetModel(model) => usable::model(model),
        RequestBody::SetFriction(friction) => friction.check().is_ok(),
        RequestBody::SetPrecompensation(precompensation) => {
            usable::precompensation(precompensation)
        }
        RequestBody::SetLimits(limits) => usable::limits(config, limits),
        _ => true,
    };
    if good {
        Ok(Finding::Plain)
    } else {
        Err(Refusal::BadValue)
    }
}
