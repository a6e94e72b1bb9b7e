//! Robots with known geometry and nothing else.

use super::flange::Flange;
use super::frame::GRAVITY;
use super::joint::{Joint, JointKind};
use super::serial_robot::Robot;
use super::uncertainty::Uncertainty;
use super::worth::Origin;

impl Joint {
    /// A joint of this geometry: alpha, a, theta and d of the modified Denavit–Hartenberg convention, rad and m.
    pub fn new(name: &str, kind: JointKind, [alpha, a, theta, d]: [f64; 4]) -> Self {
        Self {
            name: name.to_owned(),
            kind,
            alpha,
            a,
            theta,
            d,
            inertial: None,
            limits: None,
            friction: None,
            drive: None,
            controller: None,
            voltage_controller: None,
        }
    }
}

impl Robot {
    /// Returns a robot with joints from the base outwards; z of the base points up, against gravity.
    pub fn new(name: &str, joints: Vec<Joint>) -> Self {
        Self {
            name: name.to_owned(),
            gravity: [0.0, 0.0, -GRAVITY],
            joints,
            followers: Vec::new(),
            flange: Flange::default(),
            wrist_sensor: None,
            workspace: Vec::new(),
            effects: Vec::new(),
            identified: None,
            uncertainty: Uncertainty::default(),
            origin: Origin::Own,
        }
    }
}
