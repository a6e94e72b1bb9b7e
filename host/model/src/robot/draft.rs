//! A description with places for what a URDF does not state.

use toml_edit::{Item, Table};

use super::error::RobotError;
use super::joint::{Joint, JointKind};
use super::serial_robot::Robot;
use super::written::comments;

/// Keys of `[joint.drive]` that may be filled in.
const DRIVE: [&str; 5] = [
    "gear_ratio",
    "rotor_inertia",
    "torque_constant",
    "resistance",
    "encoder_counts_per_rev",
];
/// Keys of `[joint.limits]` that may be filled in.
const LIMITS: [&str; 4] = ["position", "velocity", "acceleration", "torque"];
/// Keys of `[joint.controller]`.
const CONTROLLER: [&str; 3] = ["position_gain", "velocity_gain", "torque_gain"];

impl Robot {
    /// Returns the description as [`Robot::to_toml`], with commented lines for the limits, the drive, the controller and the
    /// wrist sensor that it does not state. They have no values. `head`: sentences for comments at the top.
    ///
    /// # Errors
    /// As [`Robot::to_toml`].
    pub fn to_toml_draft(&self, head: &[String]) -> Result<String, RobotError> {
        let text = self.to_toml()?;
        let on_one_line = |line: &String| line.replace(char::is_control, " ");
        let mut out: String = (head.iter().map(on_one_line))
            .map(|line| format!("# {line}\n"))
            .collect();
        let mut joints = self.joints.iter();
        let mut joint: Option<&Joint> = None;
        let mut pending: Vec<String> = Vec::new();
        for line in text.lines() {
            if line.starts_with('[') {
                flush(&mut out, &mut pending);
            }
            if line == "[[joint]]" || line.starts_with("[[") && joint.is_some() {
                if let Some(before) = joint.take() {
                    out.push_str(&absent_tables(before));
                }
                joint = joints.next().filter(|_| line == "[[joint]]");
            }
            out.push_str(line);
            out.push('\n');
            if let Some(joint) = joint {
                pending.extend(absent_keys(joint, line));
            }
        }
        flush(&mut out, &mut pending);
        if let Some(last) = joint {
            out.push_str(&absent_tables(last));
        }
        if self.wrist_sensor.is_none() {
            out.push_str(&absent_sensor());
        }
        Ok(out)
    }
}

/// Puts the lines behind the last table.
fn flush(out: &mut String, lines: &mut Vec<String>) {
    if lines.is_empty() {
        return;
    }
    out.truncate(out.trim_end().len());
    out.push('\n');
    lines.drain(..).for_each(|line| out.push_str(&line));
    out.push('\n');
}

/// Returns lines for the keys that the table beginning with `line` may have and does not.
fn absent_keys(joint: &Joint, line: &str) -> Vec<String> {
    let (table, keys): (&str, Vec<&str>) = match (line, &joint.limits, &joint.drive) {
        ("[joint.limits]", Some(limits), _) => {
            let absent = [
                (limits.known_velocity().is_none(), "velocity"),
                (limits.acceleration.is_none(), "acceleration"),
                (limits.torque.is_none(), "torque"),
            ];
            let absent = absent.into_iter().filter(|(none, _)| *none);
            ("limits", absent.map(|(_, key)| key).collect())
        }
        ("[joint.drive]", _, Some(drive)) => {
            let absent = [
                (drive.torque_constant == 0.0, "torque_constant"),
                (drive.resistance.is_none(), "resistance"),
                (
                    drive.encoder_counts_per_rev.is_none(),
                    "encoder_counts_per_rev",
                ),
            ];
            let absent = absent.into_iter().filter(|(none, _)| *none);
            ("drive", absent.map(|(_, key)| key).collect())
        }
        _ => return Vec::new(),
    };
    places(joint, table, &keys)
}

/// Returns commented tables that the joint does not have.
fn absent_tables(joint: &Joint) -> String {
    let tables = [
        (joint.limits.is_none(), "limits", &LIMITS[..]),
        (joint.drive.is_none(), "drive", &DRIVE[..]),
        (joint.controller.is_none(), "controller", &CONTROLLER[..]),
    ];
    let mut out = String::new();
    for (absent, table, keys) in tables {
        if absent {
            out += &format!("# [joint.{table}]\n");
            places(joint, table, keys)
                .iter()
                .for_each(|line| out += line);
            out.push('\n');
        }
    }
    out
}

/// Returns the commented table of the wrist sensor.
fn absent_sensor() -> String {
    let comments = comments(JointKind::Revolute);
    let own = comments.get("wrist_sensor").and_then(Item::as_table);
    let keys = own.into_iter().flat_map(Table::iter);
    let lines = keys.map(|(key, meaning)| place(key, meaning.as_str().unwrap_or_default()));
    format!("# [wrist_sensor]\n{}\n", lines.collect::<String>())
}

/// Returns a commented line for a key.
fn place(key: &str, meaning: &str) -> String {
    format!("# {key} =   # {meaning}\n")
}

/// Returns a commented line for each key of a table, with its unit.
fn places(joint: &Joint, table: &str, keys: &[&str]) -> Vec<String> {
    let comments = comments(joint.kind);
    let meaning = |key: &str| {
        let joint: Option<&Table> = comments.get("joint").and_then(Item::as_table);
        let own = joint
            .and_then(|own| own.get(table))
            .and_then(Item::as_table);
        own.and_then(|own| own.get(key)).and_then(Item::as_str)
    };
    keys.iter()
        .map(|key| place(key, meaning(key).unwrap_or_default()))
        .collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::path::Path;

    use super::super::{ONE_LINK_TEMPLATE, Robot};

    /// The places can be filled in: with the comment signs removed and values given, all of them are read.
    #[test]
    fn places_become_values_once_they_are_filled_in() {
        let mut robot = Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("r.toml")).unwrap();
        let stated = robot.joints[0].clone();
        let joint = &mut robot.joints[0];
        (joint.drive, joint.controller) = (None, None);
        joint.limits.as_mut().unwrap().acceleration = None;
        let second = super::Joint {
            name: "second".into(),
            limits: None,
            ..joint.clone()
        };
        robot.joints.push(second);
        let draft = robot.to_toml_draft(&["From a file.".to_owned()]).unwrap();
        assert_eq!(
            Robot::from_toml(&draft, Path::new("d.toml")).unwrap(),
            robot
        );
        let filled: String = (draft.lines().skip(1))
            .map(|line| {
                let line = line.strip_prefix("# ").unwrap_or(line);
                let value = match line.split(" =").next().unwrap_or_default() {
                    "position" if line.contains("origin of its axes") => "[0.0, 0.0, 0.03]",
                    "rotation" => "[0.0, 0.0, 0.4]",
                    "reads" => "\"load\"",
                    "gain_std" => "0.005",
                    "position" => "[-1.0, 1.0]",
                    _ => "2.5",
                };
                line.replace(" =  ", &format!(" = {value} ")) + "\n"
            })
            .collect();
        let filled = Robot::from_toml(&filled, Path::new("d.toml")).unwrap();
        for joint in &filled.joints {
            let limits = joint.limits.as_ref().unwrap();
            assert_eq!(limits.acceleration, Some(2.5));
            assert!(limits.torque.is_some());
            assert_eq!(joint.drive.as_ref().unwrap().torque_constant, 2.5);
            assert_eq!(joint.controller.as_ref().unwrap().velocity_gain, 2.5);
        }
        assert_eq!(filled.joints[0].inertial, stated.inertial);
        let sensor = filled.wrist_sensor.unwrap();
        assert_eq!(sensor.position, [0.0, 0.0, 0.03]);
        assert_eq!(sensor.rotation, [0.0, 0.0, 0.4]);
        assert_eq!(sensor.force_range, Some(2.5));
    }
}
