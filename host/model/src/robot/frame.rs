//! The step from frame to frame, and gravity in the base frame.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

/// Acceleration of gravity assumed for URDF, which does not state one: m/s², downwards along z of the base link. It is
/// the rounded value that robot descriptions and simulators commonly use.
pub(super) const GRAVITY: f64 = 9.81;

/// Modified DH step without the joint's own motion.
pub(super) fn step(alpha: f64, a: f64, theta: f64, d: f64) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::identity(),
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), alpha),
    ) * Translation3::new(a, 0.0, 0.0)
        * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), theta)
        * Translation3::new(0.0, 0.0, d)
}
