//! Effects that recordings cannot show, with the missing data and the remedy.
//!
//! Leaves out: whether the effect is large enough; see the detectable sizes.

mod confounded;
mod evidence;
mod missing;
mod needs;
mod sentences;
#[cfg(test)]
mod tests;

pub use confounded::confounded;

use rig_shared::effects::Kind;

use crate::outcome::NotTestable;
use rig_data::runs::Run;
use rig_model::robot::Robot;

/// Returns the reason why `runs` cannot show the effect on a joint (index from 0); `None` if they can.
pub fn not_testable(kind: Kind, robot: &Robot, joint: usize, runs: &[Run]) -> Option<NotTestable> {
    let missing = needs::missing(kind, robot, joint, runs)?;
    let own = &robot.joints[joint];
    Some(NotTestable {
        effect: kind.about().name.to_owned(),
        joint: own.name.clone(),
        why: sentences::why(own, missing),
        experiment: sentences::remedy(own, joint + 1, missing),
    })
}
