//! Remarks on limits that look like degrees, before a motion is designed from them.

use super::joint::{Joint, JointKind};
use super::serial_robot::Robot;
use rig_output::format_significant;

/// Turns to either side of zero above which a limit gets a remark. Wrists of arms have up to two.
const TURNS: f64 = 2.0;
/// Least acceleration to reach the velocity limit within the range, rad/s², above which a remark is given. Arms and
/// servos are below 100 (UR5 2, Panda 2, SO-101 26, XL330 20); the same limits in degrees are above 400.
const ABRUPT: f64 = 400.0;
/// The same if no acceleration limit bounds the motion instead. Limits of 2.5 to 3.5 rad/s in rpm, over 4 to 6 rad,
/// are between 100 and 300.
const ABRUPT_UNBOUNDED: f64 = 100.0;
/// Velocity limit as a multiple of the speed that the joint reaches within its range at its acceleration limit, above
/// which a remark is given. rpm for rad/s is 9.5; a range that is restricted to a tenth makes 3 of 1.
const OUT_OF_REACH: f64 = 3.5;

/// Returns what a velocity would be in rad/s if it were in another unit, a clause and a sentence.
fn in_other_units(velocity: f64) -> String {
    format!(
        "were this deg/s, it would be {} rad/s, in rpm {}. Limits are in rad/s.",
        format_significant(velocity.to_radians(), 4),
        format_significant(velocity * std::f64::consts::PI / 30.0, 4)
    )
}

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
            let implausible = match limits.acceleration {
                Some(stated) => stated < least && least > ABRUPT,
                None => least > ABRUPT_UNBOUNDED,
            };
            implausible.then(|| {
                format!(
                    "Joint \"{}\": to reach its velocity limit of {} rad/s within its range takes at least {} rad/s²; {}",
                    joint.name,
                    number(velocity),
                    number(least),
                    in_other_units(velocity)
                )
            })
        };
        self.joints.iter().filter_map(of_joint).collect()
    }

    /// One sentence for each revolute joint whose velocity limit is far beyond what it reaches within its range at its
    /// acceleration limit, except those of [`Self::limits_in_degrees`]. A motion is safe: its acceleration is bounded.
    pub fn velocities_out_of_reach(&self) -> Vec<String> {
        let number = |v: f64| format_significant(v, 4);
        let of_joint = |joint: &Joint| {
            let limits = joint.limits.as_ref()?;
            let [low, high] = limits.position;
            let (velocity, acceleration) = (limits.known_velocity()?, limits.acceleration?);
            let reached = (acceleration * (high - low)).sqrt();
            let told = joint.kind == JointKind::Revolute
                && velocity.powi(2) <= ABRUPT * (high - low)
                && velocity > OUT_OF_REACH * reached;
            told.then(|| {
                format!(
                    "Joint \"{}\": its velocity limit is {} rad/s, but within its range it reaches only {} rad/s at its acceleration limit of {} rad/s²; {}",
                    joint.name,
                    number(velocity),
                    number(reached),
                    number(acceleration),
                    in_other_units(velocity)
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
            ([-2.8, 2.8], 29.0, "in rpm 3.037"),
            ([-2.0, 2.0], 24.0, "in rpm 2.513"),
            ([-1.6, 1.2], 19.0, "in rpm 1.990"),
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
    fn a_velocity_far_beyond_what_its_acceleration_reaches_is_told() {
        let with = |position: [f64; 2], velocity: f64, acceleration: f64| {
            let mut robot = Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("r.toml")).unwrap();
            let limits = robot.joints[0].limits.as_mut().unwrap();
            (limits.position, limits.velocity) = (position, velocity);
            limits.acceleration = Some(acceleration);
            assert_eq!(robot.limits_in_degrees(), Vec::<String>::new());
            robot.velocities_out_of_reach()
        };
        for (position, velocity, acceleration, told) in [
            ([-2.4, 2.4], 38.0, 20.0, "in rpm 3.979"),
            ([-2.8, 2.8], 29.0, 12.0, "in rpm 3.037"),
            ([-1.5, 1.5], 30.0, 15.0, "in rpm 3.142"),
        ] {
            let message = with(position, velocity, acceleration);
            assert!(
                message.len() == 1 && message[0].contains(told),
                "{message:?}"
            );
        }
        for (position, velocity, acceleration) in [
            ([-2.4, 2.4], 4.0, 20.0),
            ([-0.3, 0.3], 3.0, 5.0),
            ([-2.0, 2.0], 19.0, 100.0),
        ] {
            assert_eq!(with(position, velocity, acceleration), Vec::<String>::new());
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
            assert_eq!(robot.velocities_out_of_reach(), Vec::<String>::new());
        }
    }
}
