//! The frame in which loads, tools and a wrist sensor are described.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use serde::{Deserialize, Serialize};

use super::array::exact;
use super::fault::{Fault, Step, is_safe_magnitude, written};
use super::frame::roll_pitch_yaw;
use super::right_angle::{ROUNDING, right_angle};

/// Pose of the flange frame in the frame of the last joint; the same frame if it is not described. For a URDF it is the
/// frame of the link that the chain ends at (its tip).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Flange {
    /// Origin, m.
    #[serde(default, deserialize_with = "exact")]
    pub position: [f64; 3],
    /// Roll, pitch and yaw of its axes, rad: RotZ(yaw)·RotY(pitch)·RotX(roll), as in a URDF.
    #[serde(default, deserialize_with = "exact")]
    pub rotation: [f64; 3],
}

impl Flange {
    /// Returns the flange at a pose in the frame of the last joint. Angles and lengths that are rounding of a right angle or
    /// of zero become exact.
    pub fn of(pose: &Isometry3<f64>) -> Self {
        let length = |x: f64| if x.abs() < ROUNDING { 0.0 } else { x };
        let angles = roll_pitch_yaw(&pose.rotation.to_rotation_matrix());
        Self {
            position: [0, 1, 2].map(|k| length(pose.translation.vector[k])),
            rotation: angles.map(|x| right_angle(x, ROUNDING).unwrap_or(x)),
        }
    }

    /// Returns its pose in the frame of the last joint.
    pub fn pose(&self) -> Isometry3<f64> {
        let [roll, pitch, yaw] = self.rotation;
        Isometry3::from_parts(
            Translation3::from(self.position),
            UnitQuaternion::from_euler_angles(roll, pitch, yaw),
        )
    }

    /// Returns true if it is the frame of the last joint.
    pub(super) fn is_last_joint(&self) -> bool {
        *self == Self::default()
    }

    /// Returns the first value that no flange can have.
    pub(super) fn check(&self) -> Result<(), Fault> {
        let fault = |key: &'static str, found: f64, advice: &str| Fault {
            key_path: vec![Step::Key("flange"), Step::Key(key)],
            what: format!("`{key}` of the flange"),
            found: written(found),
            advice: advice.to_owned(),
        };
        if let Some(found) = self.position.iter().find(|v| !is_safe_magnitude(**v)) {
            return Err(fault("position", *found, "it must be a length in m"));
        }
        if let Some(found) = self.rotation.iter().find(|v| !(v.abs() <= 7.0)) {
            let advice = "it must be an angle in rad, at most one turn";
            return Err(fault("rotation", *found, advice));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::f64::consts::FRAC_PI_2;

    use nalgebra::Vector3;

    use super::*;
    use crate::robot::{ONE_LINK_TEMPLATE, Robot};

    fn read(table: &str) -> Result<Robot, String> {
        let text = format!("{ONE_LINK_TEMPLATE}\n[flange]\n{table}\n");
        Robot::from_toml(&text, "r.toml".as_ref()).map_err(|e| e.to_string())
    }

    /// A pose is the same after the way through position and angles, next to pitches of ±90° too.
    #[test]
    fn a_pose_survives_its_angles() {
        let mut worst = 0.0_f64;
        for off in [0.0, 1e-13, 1e-11, 1e-9, 1e-7, 1e-5, 0.1, 1.0] {
            for (roll, yaw) in [(0.0, 0.0), (0.3, -2.0), (-3.0, 1.0), (1.0, 3.1)] {
                for pitch in [FRAC_PI_2 - off, off - FRAC_PI_2, off, -off] {
                    let rotation = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
                    let pose = Isometry3::from_parts(Vector3::new(0.1, -0.2, 0.3).into(), rotation);
                    let back = Flange::of(&pose).pose();
                    let turned = back.rotation.angle_to(&rotation);
                    worst = worst.max(turned);
                    assert_eq!(back.translation, pose.translation);
                }
            }
        }
        println!("largest turn: {worst:e} rad");
        // A pitch within 1e-10 rad of a right angle becomes one.
        assert!(worst < 2e-10, "{worst:e}");
    }

    #[test]
    fn the_flange_survives_the_file() {
        let robot = read("position = [0.0, 0.01, 0.05]\nrotation = [0.0, 0.4, 0.785]").unwrap();
        let text = robot.to_toml().unwrap();
        assert_eq!(Robot::from_toml(&text, "r.toml".as_ref()).unwrap(), robot);
        let plain = Robot::from_toml(ONE_LINK_TEMPLATE, "r.toml".as_ref()).unwrap();
        assert_eq!(plain.flange_pose(), Isometry3::identity());
        assert!(!plain.to_toml().unwrap().contains("flange"));
    }

    #[test]
    fn values_that_no_flange_has_are_named() {
        for (table, said) in [
            ("position = [0.0, nan, 0.0]", "a length in m"),
            ("rotation = [0.0, 0.0, 90.0]", "in rad"),
            ("rotaton = [0.0, 0.0, 0.0]", "rotaton"),
            ("position = [0.0, 0.0]", "3 numbers"),
        ] {
            let message = read(table).unwrap_err();
            assert!(message.contains(said), "{message}");
        }
    }
}
