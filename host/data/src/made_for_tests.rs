//! Robots and files that several tests of this crate use.

#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use rig_model::robot::{ONE_LINK_TEMPLATE, Robot};

/// A robot with joints of these names, without drives and limits.
pub(crate) fn robot(names: &[&str]) -> Robot {
    let mut robot = Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("one-link.toml")).unwrap();
    let mut joint = robot.joints.remove(0);
    (joint.drive, joint.limits, joint.friction, joint.inertial) = (None, None, None, None);
    for name in names {
        joint.name = (*name).into();
        robot.joints.push(joint.clone());
    }
    robot
}

/// A file that another program wrote (`tests/recordings/make.py`).
pub(crate) fn of_others(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../tests/recordings")
        .join(name)
}
