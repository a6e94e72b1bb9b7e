//! The hold-out of a comparison.

use super::repeat::Path;
use crate::error::IdentifyError;
use crate::estimators::problem::Problem;
use crate::rows::factor::TriangularFactor;
use crate::rows::planned::Planned;
use crate::uncertainty::relative_error::judge;
use rig_data::prepare::Recording;

/// The hold-out recordings.
pub(crate) struct Held {
    /// Rows of all of them, one factor per joint.
    pub all: Vec<TriangularFactor>,
    /// Rows of those with a motion that is not in the training data; none if every one repeats a training motion.
    pub fresh: Option<Vec<TriangularFactor>>,
    /// Recordings that repeat a training motion.
    pub repeated: Vec<String>,
}

impl Held {
    /// Compares `holdout` with the training motions; none for an empty hold-out.
    pub(crate) fn of(
        problem: &Problem,
        holdout: &[Planned],
    ) -> Result<Option<Self>, IdentifyError> {
        let Some(all) = judge(problem, holdout)? else {
            return Ok(None);
        };
        let frequency = problem.plan.treatment.motion_frequency;
        let path = |recording: &dyn Recording| Path::of(recording, frequency);
        let learnt: Vec<Path> = (problem.training.iter())
            .map(|recording| path(*recording))
            .collect::<Result<_, _>>()?;
        let (mut fresh, mut repeated) = (Vec::new(), Vec::new());
        for held in holdout {
            if path(held.recording)?.repeats(&learnt) {
                repeated.push(held.recording.label());
            } else {
                fresh.push(*held);
            }
        }
        let fresh = if repeated.is_empty() {
            Some(all.clone())
        } else {
            judge(problem, &fresh)?
        };
        Ok(Some(Self {
            all,
            fresh,
            repeated,
        }))
    }
}
