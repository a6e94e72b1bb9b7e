//! Requests whose slow computations and checks are done outside the control tick.

use rig_shared::compensation::{Compensation, EffectFault, Effects};
use rig_shared::estimation::one_link;
use rig_shared::trajectory::{Extremes, TrajectoryConstants};
use rig_shared::wire::message::{Refusal, Request, RequestBody};

use crate::config::Config;
use crate::validation;

/// A request with the result of its precheck.
#[derive(Clone, Debug, PartialEq)]
pub struct PrecheckedRequest {
    /// The request as the host sent it.
    pub request: Request,
    /// The result, or the refusal if the request is invalid in every state of the rig.
    pub prepared: Result<Prepared, Refusal>,
}

/// Values computed by a precheck.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant)] // four of them lie in a queue, and nowhere else
pub enum Prepared {
    /// No further result.
    Nothing,
    /// Extremes of a trajectory, and its preparation.
    Trajectory(Extremes<f32>, TrajectoryConstants<f32>),
    /// Effects, checked.
    Effects(Compensation<f32>),
    /// An estimator's constants.
    Estimator(one_link::Config<f32>),
}

/// Checks a request. Evaluates a Fourier series about a thousand times: call this outside the tick.
pub fn precheck(config: &Config, request: Request) -> PrecheckedRequest {
    let prepared = prepare(config, &request.body);
    PrecheckedRequest { request, prepared }
}

fn prepare(config: &Config, body: &RequestBody) -> Result<Prepared, Refusal> {
    match body {
        RequestBody::SetTrajectory(trajectory) => {
            trajectory.validate().map_err(|_| Refusal::BadValue)?;
            return Ok(Prepared::Trajectory(
                trajectory.extremes(),
                trajectory.prepare(),
            ));
        }
        RequestBody::SetEffects(given) => {
            let mut effects = Effects::default();
            for (slot, effect) in effects.iter_mut().zip(given) {
                *slot = Some(*effect);
            }
            let compensation = Compensation::new(&effects).map_err(|fault| match fault {
                EffectFault::NotCompensable(kind) => Refusal::NotCompensable(kind),
                EffectFault::Parameter(_) | EffectFault::Surplus => Refusal::BadValue,
            })?;
            validation::effects(config, &compensation)?;
            return Ok(Prepared::Effects(compensation));
        }
        RequestBody::SetEstimator(settings) => {
            validation::estimator(config, settings)?;
            return one_link::Config::new(settings, config.rates.estimator_hz())
                .map(Prepared::Estimator)
                .map_err(|_| Refusal::BadValue);
        }
        RequestBody::SetGains(gains) => validation::gains(config, gains),
        RequestBody::SetModel(model) => validation::model(config, model),
        RequestBody::SetFriction(friction) => validation::friction(config, friction),
        RequestBody::SetPrecompensation(precompensation) => {
            validation::precompensation(precompensation)
        }
        RequestBody::SetLimits(limits) => validation::limits(config, limits),
        _ => Ok(()),
    }
    .map(|()| Prepared::Nothing)
}
