//! Requests with everything worked out that takes longer than a control tick has.

use rig_shared::compensation::{Compensation, EffectFault, Effects};
use rig_shared::trajectory::{Extremes, Preparation};
use rig_shared::wire::message::{Refusal, Request, RequestBody};

/// A request and what follows from it: how far a trajectory goes, what is to be done about effects.
#[derive(Clone, Debug, PartialEq)]
pub struct Examined {
    /// As the host sent it.
    pub request: Request,
    /// Extremes and preparation of the trajectory; `None` where the request brings none or brings one that makes no motion.
    pub motion: Option<(Extremes<f32>, Preparation<f32>)>,
    /// The effects, checked, or why they cannot be used; `None` where the request brings none.
    pub effects: Option<Result<Compensation<f32>, Refusal>>,
}

/// Examines a request. A Fourier series is evaluated some thousand times: do this outside the tick.
pub fn examine(request: Request) -> Examined {
    let motion = match &request.body {
        RequestBody::SetTrajectory(trajectory) => trajectory
            .validate()
            .is_ok()
            .then(|| (trajectory.extremes(), trajectory.prepare())),
        _ => None,
    };
    let effects = match &request.body {
        RequestBody::SetEffects(given) => {
            let mut effects = Effects::default();
            for (place, effect) in effects.iter_mut().zip(given) {
                *place = Some(*effect);
            }
            Some(Compensation::new(&effects).map_err(|fault| match fault {
                EffectFault::NotCompensable(kind) => Refusal::NotCompensable(kind),
                EffectFault::Parameter(_) | EffectFault::Surplus => Refusal::BadValue,
            }))
        }
        _ => None,
    };
    Examined {
        request,
        motion,
        effects,
    }
}
