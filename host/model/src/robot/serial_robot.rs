//! The whole robot: its joints, and what concerns all of them.

use serde::{Deserialize, Serialize};

use super::array::exact;
use super::band::IdentifiedBand;
use super::effects::RobotEffect;
use super::flange::Flange;
use super::follower::Follower;
use super::joint::Joint;
use super::uncertainty::Uncertainty;
use super::workspace::Region;
use super::worth::Origin;
use super::wrist_sensor::WristSensor;

/// A serial robot as a file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Robot {
    /// Name for titles and files.
    pub name: String,
    /// Gravity acceleration in the base frame, m/s².
    #[serde(deserialize_with = "exact")]
    pub gravity: [f64; 3],
    /// Joints from the base outwards.
    #[serde(rename = "joint")]
    pub joints: Vec<Joint>,
    /// Axes that the drive of a joint turns too.
    #[serde(default, rename = "follower", skip_serializing_if = "Vec::is_empty")]
    pub followers: Vec<Follower>,
    /// Pose of the flange frame in the frame of the last axis.
    #[serde(default, skip_serializing_if = "Flange::is_last_joint")]
    pub flange: Flange,
    /// Force and torque sensor at the wrist, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wrist_sensor: Option<WristSensor>,
    /// Regions that points of the links must not leave.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub workspace: Vec<Region>,
    /// Effects beyond the standard model, as `diagnose` adds them.
    #[serde(default, rename = "effect", skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<RobotEffect>,
    /// Band of the identification, if the values were identified.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub identified: Option<IdentifiedBand>,
    /// Joint uncertainty of the base parameters, if the values were identified.
    #[serde(default, skip_serializing_if = "Uncertainty::is_empty")]
    pub uncertainty: Uncertainty,
    /// Source of the values. It decides how far they are trusted ([`worth`](fn@super::worth)). Not stored in the file.
    #[serde(skip)]
    pub origin: Origin,
}

impl Robot {
    /// Returns the pose of the flange frame in the frame of the last axis.
    pub fn flange_pose(&self) -> nalgebra::Isometry3<f64> {
        self.flange.pose()
    }

    /// Returns a point of the flange frame in the frame of the last joint, m.
    pub fn point_of_flange(&self, point: [f64; 3]) -> [f64; 3] {
        (self.flange_pose() * nalgebra::Point3::from(point))
            .coords
            .into()
    }

    /// Returns the index (from 0) of the joint called `name`.
    pub fn joint_index(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|j| j.name == name)
    }
}
