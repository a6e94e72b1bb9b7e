//! Requests with everything worked out that takes longer than a control tick has.

use rig_shared::trajectory::Extremes;
use rig_shared::wire::message::{Request, RequestBody};

/// A request and, for a trajectory, how far it goes.
#[derive(Clone, Debug, PartialEq)]
pub struct Examined {
    /// As the host sent it.
    pub request: Request,
    /// Extremes of the trajectory; `None` where the request brings none or brings one that makes no motion.
    pub extremes: Option<Extremes<f32>>,
}

/// Examines a request. A Fourier series is evaluated some thousand times: do this outside the tick.
pub fn examine(request: Request) -> Examined {
    let extremes = match &request.body {
        RequestBody::SetTrajectory(trajectory) => {
            trajectory.validate().is_ok().then(|| trajectory.extremes())
        }
        _ => None,
    };
    Examined { request, extremes }
}
