//! Effects on the joints of a robot.

use rig_shared::effects::Effect;

use super::effects::RobotEffect;
use super::serial_robot::Robot;

/// An effect with its joints as indices from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    /// The joint that it acts on.
    pub joint: usize,
    /// The other joint, if the law depends on the motion of a second joint.
    pub other: Option<usize>,
    /// Kind and parameters.
    pub effect: Effect<f64>,
}

impl Robot {
    /// Returns the joint on which an effect acts, from 0; `None` if the robot has no such joint.
    pub(super) fn joint_of(&self, effect: &RobotEffect) -> Option<usize> {
        match &effect.joint {
            Some(name) => self.joint_index(name),
            None => (self.joints.len() == 1).then_some(0),
        }
    }

    /// Returns the effects with their joints as indices. Leaves out effects whose joint this robot does not have; a
    /// loaded description has no such effect.
    pub fn placed_effects(&self) -> Vec<Placed> {
        self.effects
            .iter()
            .filter_map(|effect| {
                Some(Placed {
                    joint: self.joint_of(effect)?,
                    other: effect.other.as_deref().and_then(|n| self.joint_index(n)),
                    effect: effect.effect,
                })
            })
            .collect()
    }
}
