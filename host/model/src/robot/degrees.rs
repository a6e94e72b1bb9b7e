//! Remarks on limits that look like degrees, before a motion is designed from them.

use super::joint::{Joint, JointKind};
use super::serial_robot::Robot;
use rig_output::format_significant;

/// Turns to either side of zero above which a limit gets a remark. Wrists of arms have up to two.
const TURNS: f64 = 2.0;
/// Least acceleration to reach the velocity limit within the range, rad/s², above which a remark is given. Arms and
/// servos are below 100 (UR5 2, Panda 2, SO-101 26, XL330 20); the same limits in degrees are above 400.
const ABRUPT: f64 = 400.0;

impl Robot {
    /// One sentence for each revolute joint whose limits look like degrees.
    pub fn limits_in_degrees(&self) -> Vec<String> {
        let number = |v: f64| format_significant(v, 4);
        let of_joint = |joint: &Joint| {
            let limits = joint.limits.as_ref()?;
            let [low, high] = limits.position;
            if joint.kind != JointKind::Revolute || !low.is_finite() || !high.is_finite() {
                return None;
            }
            let reach = low.abs().max(high.abs());
            let turns = reach / std::f64::consts::TAU;
            if turns > TURNS {
                let speed = limits.known_velocity().map_or(String::new(), |v| {
                    format!(
                        " (and a velocity of {} deg/s {} rad/s)",
                        number(v),
                        number(v.to_radians())
                    )
                });
                return Some(format!(
                    "Joint \"{}\": position limits of {} to {} rad are {} turns; were these degrees, they would be {} to {} rad{speed}. Limits are in rad and rad/s.",
                    joint.name,
                    number(low),
                    number(high),
                    format_significant((high - low) / std::f64::consts::TAU, 3),
                    number(low.to_radians()),
                    number(high.to_radians())
                ));
            }
            let velocity = limits.known_velocity()?;
            let least = velocity.powi(2) / (high - low);
            let stated = limits.acceleration.is_none_or(|a| a < least);
            (least > ABRUPT && stated).then(|| {
                format!(
                    "Joint \"{}\": to reach its velocity limit of {} rad/s within its range takes at least {} rad/s²; were this deg/s, it would be {} rad/s, in rpm {}. Limits are in rad/s.",
                    joint.name,
                    number(velocity),
                    number(least),
                    number(velocity.to_radians()),
                    number(velocity * std::f64::consts::PI / 30.0)
                )
            })
        };
        self.joints.iter().filter_map(of_joint).collect()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::super::*;
    use std::path::Path;

    fn with(position: [f64; 2], velocity: f64) -> Vec<String> {
        let mut robot = Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("r.toml")).unwrap();
        let limits = robot.joints[0].limits.as_mut().unwrap();
        (limits.position, limits.velocity) = (position, velocity);
        limits.acceleration = None;
        robot.limits_in_degrees()
    }

    #[test]
    fn limits_in_degrees_are_told_with_what_they_would_be() {
        for (position, velocity, told) in [
            ([-160.0, 160.0], 180.0, "2.793"),
            ([0.0, 90.0], 1.0, "1.571"),
            ([-178.0, 178.0], 340.0, "5.934"),
            ([-3.1, 3.1], 57.0, "0.9948"),
            ([-2.9, 2.9], 180.0, "3.142"),
        ] {
            let message = with(position, velocity);
            assert!(
                message.len() == 1 && message[0].contains(told),
                "{message:?}"
            );
        }
        for (position, velocity) in [
            ([-3.1, 3.1], 6.0),
            ([-6.3, 6.3], 3.0),
            ([-12.5, 12.5], 7.0),
            ([-1.9, 1.9], 10.0),
            ([f64::NEG_INFINITY, f64::INFINITY], 600.0),
        ] {
            assert_eq!(with(position, velocity), Vec::<String>::new());
        }
    }

    #[test]
    fn no_description_that_ships_looks_like_degrees() {
        for text in [
            ONE_LINK_TEMPLATE,
            EDDA_TEMPLATE,
            IRP6_TEMPLATE,
            TX40,
            XL330,
            EMPS,
        ] {
            let robot = Robot::from_toml(text, Path::new("r.toml")).unwrap();
            assert_eq!(robot.limits_in_degrees(), Vec::<String>::new());
        }
    }
}
