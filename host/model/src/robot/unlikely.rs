//! Remarks on values that no robot on the earth has: they have another unit, or a ratio is inverted.

use super::joint::{Joint, JointKind};
use super::serial_robot::Robot;
use rig_output::format_trimmed;

/// Standard gravity, m/s².
const EARTH: f64 = 9.81;
/// Share by which gravity may differ from the standard: 0.3 % from pole to equator, and rounding in the description.
const NEAR: f64 = 0.02;
/// Other units of gravity, each with its number per m/s².
const UNITS: [(f64, &str); 5] = [
    (1.0 / EARTH, "g"),
    (100.0, "cm/s²"),
    (1000.0, "mm/s²"),
    (3.28084, "ft/s²"),
    (39.3701, "in/s²"),
];
/// Inertia of the heaviest rotors, kg·m²: servo motors of 100 kW have about 1.
const HEAVIEST_ROTOR: f64 = 10.0;
/// Torque constant of the largest motors, N·m/A: direct drives of 1000 N·m have about 20.
const LARGEST_CONSTANT: f64 = 50.0;

impl Robot {
    /// Returns one sentence for each value that no robot has.
    pub fn unlikely_values(&self) -> Vec<String> {
        let gravity = self.unlikely_gravity();
        (gravity.into_iter())
            .chain(self.joints.iter().flat_map(unlikely_drive))
            .collect()
    }

    fn unlikely_gravity(&self) -> Option<String> {
        let size = self.gravity.iter().map(|g| g * g).sum::<f64>().sqrt();
        let is = |value: f64| (size / value - 1.0).abs() < NEAR;
        // Zero gravity is allowed: a table without friction, a horizontal slide, a robot in free fall.
        if size == 0.0 || is(EARTH) {
            return None;
        }
        let what = match UNITS.iter().find(|(factor, _)| is(factor * EARTH)) {
            Some((_, unit)) => format!("were it in {unit}, it would be {EARTH}"),
            None => format!("on the earth it is {EARTH}"),
        };
        Some(format!(
            "`gravity` has the size {} m/s²; {what}. Gravity is in m/s².",
            format_trimmed(size, 4)
        ))
    }
}

fn unlikely_drive(joint: &Joint) -> Vec<String> {
    let Some(drive) = &joint.drive else {
        return Vec::new();
    };
    let number = |x: f64| format_trimmed(x, 4);
    let name = &joint.name;
    let mut found = Vec::new();
    let ratio = drive.gear_ratio.abs();
    // A ball screw has no ratio.
    if joint.kind == JointKind::Revolute && ratio > 0.0 && ratio < 1.0 {
        found.push(format!(
            "Joint \"{name}\": gear_ratio is {}, less than one motor turn per joint turn. Motor turns per joint turn are wanted: of a gear of {} to 1 give {}.",
            number(drive.gear_ratio),
            number(1.0 / ratio),
            number(1.0 / drive.gear_ratio)
        ));
    }
    if drive.rotor_inertia > HEAVIEST_ROTOR {
        found.push(format!(
            "Joint \"{name}\": rotor_inertia is {} kg·m², more than any motor of a robot has; were it in g·cm², it would be {}, in kg·cm² {}.",
            number(drive.rotor_inertia),
            number(1e-7 * drive.rotor_inertia),
            number(1e-4 * drive.rotor_inertia)
        ));
    }
    if drive.torque_constant > LARGEST_CONSTANT {
        found.push(format!(
            "Joint \"{name}\": torque_constant is {} N·m/A, more than any motor of a robot has; were it in mN·m/A, it would be {}, and a speed constant of so many rpm/V makes {}.",
            number(drive.torque_constant),
            number(1e-3 * drive.torque_constant),
            number(30.0 / (std::f64::consts::PI * drive.torque_constant))
        ));
    }
    found
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::path::Path;

    use super::super::{ONE_LINK_TEMPLATE, template};
    use super::*;

    fn remarks(change: impl Fn(&mut Robot)) -> Vec<String> {
        let mut robot = Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("r.toml")).unwrap();
        change(&mut robot);
        robot.unlikely_values()
    }

    #[test]
    fn described_robots_raise_nothing() {
        for name in ["one-link", "emps", "tx40", "xl330", "irp6", "edda"] {
            let robot = Robot::from_toml(template(name).unwrap(), Path::new("r.toml")).unwrap();
            assert_eq!(robot.unlikely_values(), [""; 0], "{}", robot.name);
        }
        let leaning = |robot: &mut Robot| robot.gravity = [3.0, 0.0, -9.34];
        assert_eq!(remarks(leaning), [""; 0]);
        assert_eq!(remarks(|robot| robot.gravity = [0.0; 3]), [""; 0]);
    }

    #[test]
    fn gravity_in_another_unit_is_named() {
        for (size, words) in [
            (1.0, "in g, it would be 9.81"),
            (9810.0, "in mm/s², it would be 9.81"),
            (980.665, "in cm/s²"),
            (32.2, "in ft/s²"),
            (386.1, "in in/s²"),
            (1.62, "on the earth it is 9.81"),
        ] {
            let found = remarks(|robot| robot.gravity = [0.0, 0.0, -size]);
            assert!(found.len() == 1 && found[0].contains(words), "{found:?}");
        }
    }

    #[test]
    fn drives_in_other_units_are_named() {
        let of = |change: &dyn Fn(&mut super::super::Drive)| {
            let found = remarks(|robot| change(robot.joints[0].drive.as_mut().unwrap()));
            assert_eq!(found.len(), 1, "{found:?}");
            found[0].clone()
        };
        for ratio in [-6.0, 50.0, 101.0, 4.5] {
            let inverted = of(&|drive| drive.gear_ratio = 1.0 / ratio);
            let wanted = format!("give {ratio}");
            assert!(inverted.replace('−', "-").contains(&wanted), "{inverted}");
        }
        let grams = of(&|drive| drive.rotor_inertia = 200.0);
        assert!(grams.contains("in g·cm², it would be 2·10⁻⁵"), "{grams}");
        let speed = of(&|drive| drive.torque_constant = 190.0);
        assert!(speed.contains("rpm/V makes 0.05026"), "{speed}");
        let milli = of(&|drive| drive.torque_constant = 53.0);
        assert!(milli.contains("in mN·m/A, it would be 0.053"), "{milli}");
    }
}
