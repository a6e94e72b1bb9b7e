//! Requests with everything worked out and checked that takes longer than a control tick has.

use rig_shared::compensation::{Compensation, EffectFault, Effects};
use rig_shared::estimation::one_link;
use rig_shared::trajectory::{Extremes, Preparation};
use rig_shared::wire::message::{Refusal, Request, RequestBody};

use crate::config::Config;
use crate::usable;

/// A request, and what follows from it.
#[derive(Clone, Debug, PartialEq)]
pub struct Examined {
    /// As the host sent it.
    pub request: Request,
    /// What follows, or why it is refused whatever the rig does.
    pub finding: Result<Finding, Refusal>,
}

/// What follows from a request.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant)] // four of them lie in a queue, and nowhere else
pub enum Finding {
    /// Nothing: it says all by itself.
    Plain,
    /// How far a trajectory goes, and its preparation.
    Motion(Extremes<f32>, Preparation<f32>),
    /// Effects, checked.
    Effects(Compensation<f32>),
    /// An estimator's constants.
    Estimator(one_link::Config<f32>),
}

/// Examines a request. A Fourier series is evaluated some thousand times: do this outside the tick.
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
