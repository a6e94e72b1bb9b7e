//! The pose of a joint's frame in the frame before it.

use nalgebra::Isometry3;

use super::frame::step;
use super::joint::{Joint, JointKind};

impl Joint {
    /// Returns the pose of the joint's frame in the frame of the joint before it, at position `q`, rad or m.
    pub fn pose(&self, q: f64) -> Isometry3<f64> {
        match self.kind {
            JointKind::Revolute => step(self.alpha, self.a, self.theta + q, self.d),
            JointKind::Prismatic => step(self.alpha, self.a, self.theta, self.d + q),
        }
    }
}
