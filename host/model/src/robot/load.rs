//! A load at the flange, in a file of its own.

use std::path::Path;

use nalgebra::{Isometry3, Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::array::exact;
use super::error::{Place, RobotError};
use super::fault::{MAX_NUMBER, is_safe_magnitude};
use super::joint::Inertial;
use super::serial_robot::Robot;
use super::toml_message::of_wrong_length;
use super::urdf::SpatialInertia;
use rig_output::{comment_toml, toml_document};

/// A rigid body that the flange carries, in the flange frame ([`Flange`](super::Flange)).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// kg
    pub mass: f64,
    /// m·c in the flange frame, kg·m
    #[serde(deserialize_with = "exact")]
    pub first_moment: [f64; 3],
    /// Ixx Ixy Ixz Iyy Iyz Izz about the origin of the flange frame, kg·m²
    #[serde(deserialize_with = "exact")]
    pub inertia: [f64; 6],
    /// False if the inertia was assumed, because the data of an identification do not show it.
    #[serde(default = "yes", skip_serializing_if = "is_true")]
    pub inertia_known: bool,
}

fn yes() -> bool {
    true
}

fn is_true(value: &bool) -> bool {
    *value
}

/// Returns the byte at which the line of a key begins; 0 if there is none.
fn place_of(text: &str, key: &str) -> usize {
    let mut begin = 0;
    for line in text.split_inclusive('\n') {
        let rest = line.trim_start().strip_prefix(key);
        if rest.is_some_and(|rest| rest.trim_start().starts_with('=')) {
            return begin + line.len() - line.trim_start().len();
        }
        begin += line.len();
    }
    0
}

/// Comments of the written file, by key.
const COMMENTS: &str = "
mass = 'kg'
first_moment = 'kg*m, mass times centre of mass, in the flange frame'
inertia = 'kg*m^2, Ixx Ixy Ixz Iyy Iyz Izz about the origin of the flange frame'
inertia_known = 'false: the data do not show the inertia; it is that of a sphere'
";

impl Load {
    /// Reads a load from a TOML file.
    ///
    /// # Errors
    /// [`RobotError`] with the line of what is wrong.
    pub fn read(path: &Path) -> Result<Self, RobotError> {
        let text = std::fs::read_to_string(path).map_err(|source| RobotError::ReadLoad {
            path: path.into(),
            source,
        })?;
        if text.trim_start().starts_with('{') {
            return Err(RobotError::Toml {
                path: path.into(),
                place: Place::of(&text, 0),
                message: "this is JSON; give the load as TOML (`rig load` writes load.toml beside load.json)"
                    .to_owned(),
            });
        }
        let load: Self = toml::from_str(&text).map_err(|error| RobotError::Toml {
            path: path.into(),
            place: Place::of(&text, error.span().map_or(0, |s| s.start)),
            message: match error.message().starts_with("invalid length") {
                true => of_wrong_length(&error, &text),
                false => format!(
                    "{}; a load has `mass`, `first_moment` and `inertia` (`rig load` writes such a file)",
                    error.message().lines().collect::<Vec<_>>().join(", ")
                ),
            },
        })?;
        let wrong = |key: &str, found: f64, advice: &str| RobotError::Value {
            path: path.into(),
            place: Place::of(&text, place_of(&text, key)),
            what: format!("`{key}` of the load"),
            found: found.to_string(),
            advice: advice.to_owned(),
        };
        if !(load.mass >= 0.0) {
            let advice = "it must be 0 or greater, in kg";
            return Err(wrong("mass", load.mass, advice));
        }
        for (key, values) in [
            ("mass", &[load.mass][..]),
            ("first_moment", &load.first_moment),
            ("inertia", &load.inertia),
        ] {
            if let Some(found) = values.iter().find(|v| !is_safe_magnitude(**v)) {
                let advice = format!("it must be a number of at most {MAX_NUMBER:e}");
                return Err(wrong(key, *found, &advice));
            }
        }
        if load.mass == 0.0 {
            for (key, values) in [
                ("first_moment", &load.first_moment[..]),
                ("inertia", &load.inertia),
            ] {
                if let Some(found) = values.iter().find(|v| **v != 0.0) {
                    let advice = "a body of mass 0 has none: give its mass, or 0 here as well";
                    return Err(wrong(key, *found, advice));
                }
            }
        }
        Ok(load)
    }

    /// Builds the load from its ten parameters: m mx my mz Ixx Ixy Ixz Iyy Iyz Izz.
    pub fn of([m, x, y, z, xx, xy, xz, yy, yz, zz]: [f64; 10]) -> Self {
        Self {
            mass: m,
            first_moment: [x, y, z],
            inertia: [xx, xy, xz, yy, yz, zz],
            inertia_known: true,
        }
    }

    /// Returns the ten parameters: m mx my mz Ixx Ixy Ixz Iyy Iyz Izz.
    pub fn parameters(&self) -> [f64; 10] {
        self.inertial().parameters()
    }

    /// Returns the load as TOML with units in comments.
    ///
    /// # Errors
    /// [`RobotError::Write`].
    pub fn to_toml(&self) -> Result<String, RobotError> {
        let mut document = toml_document(self, &[]).map_err(|error| RobotError::Write {
            robot: "load".to_owned(),
            message: error.to_string(),
        })?;
        comment_toml(
            &mut document,
            &COMMENTS
                .parse::<toml_edit::DocumentMut>()
                .unwrap_or_default(),
        );
        Ok(document.to_string())
    }

    /// Returns the same body in another frame; `pose` is the flange frame in that frame.
    #[must_use]
    pub fn seen_from(&self, pose: &Isometry3<f64>) -> Self {
        let body = SpatialInertia::of(&self.inertial())
            .seen_from(pose)
            .inertial();
        Self::of(body.parameters())
    }

    /// Returns the centre of mass, m in the flange frame, and the inertia about it, kg·m²; `None` for a first moment without
    /// a mass.
    pub fn about_centre(&self) -> Option<(Vector3<f64>, Matrix3<f64>)> {
        SpatialInertia::of(&self.inertial()).about_centre()
    }

    fn inertial(&self) -> Inertial {
        Inertial {
            mass: self.mass,
            first_moment: self.first_moment,
            inertia: self.inertia,
        }
    }
}

impl Robot {
    /// Returns the robot with a load at its flange: the load becomes a part of the last link.
    #[must_use]
    pub fn with_load(&self, load: &Load) -> Self {
        let mut robot = self.clone();
        if let Some(last) = robot.link_inertial_mut(self.last_link()) {
            let load = SpatialInertia::of(&load.inertial()).seen_from(&self.flange_pose());
            *last = Some(match &*last {
                Some(own) => SpatialInertia::of(own).plus(&load).inertial(),
                None => load.inertial(),
            });
        }
        robot
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::robot::{Flange, IRP6_TEMPLATE};

    fn bar() -> Load {
        Load::of([1.2, 0.1, -0.05, 0.3, 0.2, 0.01, -0.02, 0.25, 0.03, 0.1])
    }

    #[test]
    fn load_survives_the_file_and_wrong_values_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("load.toml");
        std::fs::write(&path, bar().to_toml().unwrap()).unwrap();
        assert_eq!(Load::read(&path).unwrap(), bar());
        for (text, said) in [
            (
                "mass = -1.0\nfirst_moment = [0, 0, 0]\ninertia = [0, 0, 0, 0, 0, 0]",
                "0 or greater",
            ),
            (
                "mass = 1.0\nfirst_moment = [0, inf, 0]\ninertia = [0, 0, 0, 0, 0, 0]",
                ":2:",
            ),
            (
                "mass = 1.0\nfirst_moment = [0, 0]\ninertia = [0, 0, 0, 0, 0, 0]",
                ":2:16: `first_moment`: invalid length 2, expected a list of 3 numbers",
            ),
            (
                "mass = 0\nfirst_moment = [0, 0.1, 0]\ninertia = [0, 0, 0, 0, 0, 0]",
                ":2:1: `first_moment` of the load is 0.1",
            ),
            (
                "# of mass 0\nmass = 0\nfirst_moment = [0, 0, 0]\ninertia = [1, 0, 0, 0, 0, 0]",
                ":4:1: `inertia` of the load is 1",
            ),
            (
                "# kg: mass\nmass = -1.0\nfirst_moment = [0, 0, 0]\ninertia = [0, 0, 0, 0, 0, 0]",
                ":2:1:",
            ),
            ("mass = 1.0", "first_moment"),
            (
                "{\n  \"schema\": \"rig-load/1\"\n}",
                "this is JSON; give the load as TOML (`rig load` writes load.toml beside load.json)",
            ),
        ] {
            std::fs::write(&path, text).unwrap();
            let message = Load::read(&path).unwrap_err().to_string();
            assert!(message.contains(said), "{message}");
        }
    }

    /// A load in a turned and shifted flange frame adds its weight and its inertia about the joint, by Steiner.
    #[test]
    fn load_is_a_part_of_the_last_link() {
        let mut robot = Robot::from_toml(IRP6_TEMPLATE, "irp6.toml".as_ref()).unwrap();
        robot.flange = Flange {
            position: [0.1, 0.0, 0.2],
            rotation: [0.0, 0.0, std::f64::consts::FRAC_PI_2],
        };
        // A point of 2 kg at x = 0.3 of the flange: in the joint's frame at y = 0.3, beside the shift.
        let load = Load::of([2.0, 0.6, 0.0, 0.0, 0.0, 0.0, 0.0, 0.18, 0.0, 0.18]);
        let before = robot.joints.last().unwrap().inertial.clone().unwrap();
        let after = robot
            .with_load(&load)
            .joints
            .last()
            .unwrap()
            .inertial
            .clone()
            .unwrap();
        assert!((after.mass - before.mass - 2.0).abs() < 1e-12);
        for (k, expected) in [0.2, 0.6, 0.4].into_iter().enumerate() {
            let grown = after.first_moment[k] - before.first_moment[k];
            assert!((grown - expected).abs() < 1e-12, "{grown}");
        }
        // Izz = 2·(0.1² + 0.3²).
        assert!((after.inertia[5] - before.inertia[5] - 0.2).abs() < 1e-12);
    }
}
