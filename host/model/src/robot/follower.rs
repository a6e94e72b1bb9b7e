//! An axis that the drive of a joint turns too, and the link that it moves.

use serde::{Deserialize, Serialize};

use super::joint::{Inertial, Joint, JointKind};

/// An axis of the chain without a drive of its own: its position is ratio · q + offset of the joint that it follows
/// (`<mimic>` of a URDF).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Follower {
    /// Name, unique among joints and followers.
    pub name: String,
    /// The joint whose drive moves it.
    pub follows: String,
    /// Its position per position of that joint.
    pub ratio: f64,
    /// Its position where that joint is at zero, rad or m.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub offset: f64,
    /// The joint behind which it stands in the chain; absent: before the first joint. Followers behind the same joint stand
    /// in the order of the file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub after: Option<String>,
    /// Kind of its motion.
    pub kind: JointKind,
    /// Modified Denavit–Hartenberg, as of a joint: rotation about x of the frame before it, rad.
    pub alpha: f64,
    /// Translation along x of the frame before it, m.
    pub a: f64,
    /// Rotation about z of its frame, rad (offset where revolute).
    pub theta: f64,
    /// Translation along z of its frame, m (offset where prismatic).
    pub d: f64,
    /// Prior inertial parameters of the link that it moves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inertial: Option<Inertial>,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

impl Follower {
    /// Returns its axis and link as those of a joint without drive, friction and limits.
    pub fn as_joint(&self) -> Joint {
        Joint {
            inertial: self.inertial.clone(),
            ..Joint::new(
                &self.name,
                self.kind,
                [self.alpha, self.a, self.theta, self.d],
            )
        }
    }
}
