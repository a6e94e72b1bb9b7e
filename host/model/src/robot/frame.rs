//! The step from frame to frame, and gravity in the base frame.

use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion, Vector3};

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

/// Level below which a pitch is ±90°: the sine and cosine of roll are then rounding.
const UPRIGHT: f64 = 1e-12;

/// Returns fixed-axis roll, pitch and yaw of a rotation RotZ(yaw)·RotY(pitch)·RotX(roll), rad.
pub(super) fn roll_pitch_yaw(rotation: &Rotation3<f64>) -> [f64; 3] {
    let r = rotation.matrix();
    let level = r.m32.hypot(r.m33);
    let pitch = (-r.m31).atan2(level);
    // Pitch of ±90°: roll and yaw turn about the same axis, and roll is set to zero.
    if level < UPRIGHT {
        return [0.0, pitch, (-r.m12).atan2(r.m22)];
    }
    let yaw = r.m21.atan2(r.m11);
    // Roll about the axes turned by that yaw: so the two make up for each other's rounding near ±90°.
    let (sin, cos) = yaw.sin_cos();
    let roll = (sin * r.m13 - cos * r.m23).atan2(cos * r.m22 - sin * r.m12);
    [roll, pitch, yaw]
}
