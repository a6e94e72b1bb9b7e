//! The trials of a result, from those of the search.

use crate::outcome::Tried;
use crate::result::sentences::refusal::refusal;
use crate::search::tried_candidate::TriedCandidate;
use rig_model::robot::{Robot, title_of};

/// Returns the entries of the result for the trials of the search.
pub(crate) fn tried(robot: &Robot, list: &[TriedCandidate]) -> Vec<Tried> {
    (list.iter())
        .map(|t| Tried {
            effect: title_of(t.kind),
            joint: robot.joints[t.joint].name.clone(),
            step: t.step,
            gain: t.gain,
            gain_sigmas: t.gain_sigmas,
            p_value: t.p_value,
            refused: t.refused.as_ref().map_or_else(String::new, refusal),
        })
        .collect()
}
