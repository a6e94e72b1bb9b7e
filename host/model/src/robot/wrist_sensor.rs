//! A six-axis force and torque sensor between the last link and the load.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rig_output::{format_short, format_significant};
use serde::{Deserialize, Serialize};

use super::array::exact;
use super::fault::{Fault, Step, written};

/// Distance from the flange at which no wrist sensor is, m. By judgement: sensors lie within 0.3 m, and a millimetre that counts
/// as a metre is beyond.
const FARTHEST: f64 = 1.0;
/// Largest standard deviation of a gain, relative. Data sheets state 0.25 to 2 %; 0.5 is 0.5 % in per cent.
pub const LARGEST_GAIN_STD: f64 = 0.1;

/// The sensor at the wrist; [`Flange`](super::Flange) has the flange frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WristSensor {
    /// Origin of its axes in the flange frame, m.
    #[serde(default, deserialize_with = "exact")]
    pub position: [f64; 3],
    /// Roll, pitch and yaw of its axes in the flange frame, rad: RotZ(yaw)·RotY(pitch)·RotX(roll), as in a URDF.
    #[serde(default, deserialize_with = "exact")]
    pub rotation: [f64; 3],
    /// Which of the two opposite wrenches it reads; `None` if unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reads: Option<Reads>,
    /// Largest force that an axis reads, N.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_range: Option<f64>,
    /// Largest moment that an axis reads, N·m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moment_range: Option<f64>,
    /// Standard deviation of the gain of a channel, relative: 0.005 for 0.5 %.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gain_std: Option<f64>,
}

/// The wrench that a sensor reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Reads {
    /// The wrench of the load on the robot: a load at rest reads its weight, downwards.
    Load,
    /// The wrench of the robot on the load: a load at rest reads what carries it, upwards.
    Robot,
}

impl Reads {
    /// Returns 1 for the wrench of the robot on the load, −1 for its opposite.
    pub fn sign(self) -> f64 {
        match self {
            Self::Robot => 1.0,
            Self::Load => -1.0,
        }
    }
}

impl WristSensor {
    /// Returns the pose of its axes in the flange frame.
    pub fn pose(&self) -> Isometry3<f64> {
        let [roll, pitch, yaw] = self.rotation;
        Isometry3::from_parts(
            Translation3::from(self.position),
            UnitQuaternion::from_euler_angles(roll, pitch, yaw),
        )
    }

    /// Says that no wrist sensor is where the description puts it, with the unit that it looks like. At rest every position
    /// explains the readings, with another centre of mass, and in motion it makes the moments look like another unit. So the
    /// length itself tells.
    pub fn too_far(&self) -> Option<String> {
        let away = Vector3::from(self.position).norm();
        if away <= FARTHEST {
            return None;
        }
        let list = |scale: f64| self.position.map(|x| format_short(scale * x)).join(", ");
        let unit = match away <= 1e3 * FARTHEST {
            true => format!(" They look like mm: these would be [{}] m.", list(1e-3)),
            false => String::new(),
        };
        Some(format!(
            "The wrist sensor is described at [{}] m, {} m from the flange, where no wrist sensor is.{unit} Give its position in the flange frame in m (--sensor-position, or position in [wrist_sensor]).",
            list(1.0),
            format_significant(away, 3)
        ))
    }

    /// Returns the first value that no sensor can have.
    pub(super) fn check(&self) -> Result<(), Fault> {
        let fault = |key: &'static str, found: f64, advice: &str| Fault {
            key_path: vec![Step::Key("wrist_sensor"), Step::Key(key)],
            what: format!("`{key}` of the wrist sensor"),
            found: written(found),
            advice: advice.to_owned(),
        };
        if let Some(found) = self.position.iter().find(|v| !v.is_finite()) {
            return Err(fault("position", *found, "it must be a length in m"));
        }
        if let Some(text) = self.too_far() {
            let farthest = self.position.into_iter().fold(0.0, largest);
            let advice = text.replacen("The wrist", "the wrist", 1);
            return Err(fault("position", farthest, advice.trim_end_matches('.')));
        }
        if let Some(found) = self.rotation.iter().find(|v| !(v.abs() <= 7.0)) {
            let advice = "it must be an angle in rad, at most one turn";
            return Err(fault("rotation", *found, advice));
        }
        for (key, range, unit) in [
            ("force_range", self.force_range, "N"),
            ("moment_range", self.moment_range, "N·m"),
        ] {
            if let Some(found) = range.filter(|r| !(*r > 0.0 && r.is_finite())) {
                return Err(fault(
                    key,
                    found,
                    &format!("it must be greater than 0, in {unit}"),
                ));
            }
        }
        if let Some(found) = self
            .gain_std
            .filter(|s| !(0.0..=LARGEST_GAIN_STD).contains(s))
        {
            let advice = format!(
                "it must be at least 0 and at most {LARGEST_GAIN_STD}, a share of 1, not %"
            );
            return Err(fault("gain_std", found, &advice));
        }
        Ok(())
    }
}

/// Returns the number of the larger size.
fn largest(a: f64, b: f64) -> f64 {
    if b.abs() > a.abs() { b } else { a }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::robot::{ONE_LINK_TEMPLATE, Robot};

    fn read(table: &str) -> Result<Robot, String> {
        let text = format!("{ONE_LINK_TEMPLATE}\n[wrist_sensor]\n{table}\n");
        Robot::from_toml(&text, "r.toml".as_ref()).map_err(|e| e.to_string())
    }

    #[test]
    fn sensor_survives_the_file() {
        let table = "position = [0.0, 0.01, 0.05]\nrotation = [0.0, 0.0, 0.785]\nreads = \"load\"\nforce_range = 100.0\ngain_std = 0.005";
        let robot = read(table).unwrap();
        let sensor = robot.wrist_sensor.as_ref().unwrap();
        assert_eq!(sensor.reads, Some(Reads::Load));
        // The sensor's x axis lies between those of the flange.
        let x = sensor.pose().rotation * nalgebra::Vector3::x();
        assert!((x.x - x.y).abs() < 1e-3 && x.x > 0.7);
        let text = robot.to_toml().unwrap();
        assert_eq!(Robot::from_toml(&text, "r.toml".as_ref()).unwrap(), robot);
    }

    #[test]
    fn values_that_no_sensor_has_are_named() {
        for (table, said) in [
            (
                "position = [0.0, 0.0, 50.0]",
                "They look like mm: these would be [0, 0, 0.05] m",
            ),
            ("position = [0.0, 5.0, 0.0]", "[0, 0.005, 0] m"),
            ("position = [0.0, nan, 0.0]", "a length in m"),
            ("rotation = [0.0, 0.0, 90.0]", "in rad"),
            ("force_range = -1.0", "greater than 0, in N"),
            ("moment_range = nan", "NaN"),
            ("gain_std = 0.5", "a share of 1, not %"),
            ("reads = \"up\"", "load"),
            ("rotaton = [0.0, 0.0, 0.0]", "rotaton"),
            ("position = [0.0, 0.0]", "3 numbers"),
        ] {
            let message = read(table).unwrap_err();
            assert!(message.contains(said), "{message}");
        }
    }
}
