//! Reads TOML and locates its faults.

use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::angles::square;
use super::check::check;
use super::check_effects::check_tables;
use super::drive::Drive;
use super::error::{Place, RobotError};
use super::fault::{Fault, Step};
use super::serial_robot::Robot;
use super::toml_message::sentence;

/// Returns the robot and the remarks on the text, one sentence each.
pub(super) fn read(text: &str, path: &Path) -> Result<(Robot, Vec<String>), RobotError> {
    let refused = |f: Fault| RobotError::Value {
        path: path.into(),
        place: Place::of(text, offset(text, &f.key_path)),
        what: f.what,
        found: f.found,
        advice: f.advice,
    };
    // Effects are checked first: the reader of the whole file gives no line for an effect.
    if let Ok(tables) = toml::from_str::<toml::Table>(text)
        && let Some(toml::Value::Array(effects)) = tables.get("effect")
    {
        check_tables(effects).map_err(refused)?;
    }
    let mut robot: Robot = toml::from_str(text).map_err(|e| RobotError::Toml {
        path: path.into(),
        place: Place::of(text, e.span().map_or(0, |s| s.start)),
        message: sentence(&e, text),
    })?;
    missing_ratio(&robot, text, path)?;
    check(&robot).map_err(refused)?;
    for (i, joint) in robot.joints.iter().enumerate() {
        let drive = [Step::Key("joint"), Step::At(i), Step::Key("drive")];
        let key_path = [&drive[..], &[Step::Key("torque_constant")]].concat();
        // Absent means unknown. A written zero can only be a mistake.
        if joint
            .drive
            .as_ref()
            .is_some_and(|d| d.torque_constant == 0.0)
            && reaches(text, &key_path)
        {
            return Err(RobotError::Value {
                path: path.into(),
                place: Place::of(text, offset(text, &key_path)),
                what: format!("the torque constant of joint `{}`", joint.name),
                found: "0".into(),
                advice: "it must be greater than 0, in N·m/A, or left out where unknown".into(),
            });
        }
    }
    let remarks = square(&mut robot).into_iter().map(|squared| {
        let [table, at] = robot.link_key(squared.link);
        let key_path = [table, at, Step::Key(squared.key)];
        let place = Place::of(text, offset(text, &key_path));
        format!("{}:{place}: {}", path.display(), squared.remark)
    });
    let remarks = remarks.collect();
    Ok((robot, remarks))
}

/// Checks that every drive has a ratio or a screw.
fn missing_ratio(robot: &Robot, text: &str, path: &Path) -> Result<(), RobotError> {
    for (i, joint) in robot.joints.iter().enumerate() {
        let key_path = [Step::Key("joint"), Step::At(i), Step::Key("drive")];
        let absent = |drive: &Drive| drive.screw.is_none() && drive.gear_ratio == 0.0;
        if joint.drive.as_ref().is_some_and(absent)
            && !reaches(text, &[&key_path[..], &[Step::Key("gear_ratio")]].concat())
        {
            return Err(RobotError::Toml {
                path: path.into(),
                place: Place::of(text, offset(text, &key_path)),
                message: "missing field `gear_ratio`; add this key (motor turns per joint turn) to the table that begins here, or a table [joint.drive.screw]".into(),
            });
        }
    }
    Ok(())
}

/// Returns the place of a value of a joint's table in the text of a TOML description, or of the deepest table on the way to
/// it that is there. `keys` leads from the table of the joint to the value.
pub fn joint_place(text: &str, joint: usize, keys: &[&'static str]) -> Place {
    let mut key_path = vec![Step::Key("joint"), Step::At(joint)];
    key_path.extend(keys.iter().map(|key| Step::Key(key)));
    Place::of(text, offset(text, &key_path))
}

/// Returns the byte offset of the deepest value that `key_path` reaches.
fn offset(text: &str, key_path: &[Step]) -> usize {
    walk(text, key_path).0
}

fn reaches(text: &str, key_path: &[Step]) -> bool {
    walk(text, key_path).1
}

fn walk(text: &str, key_path: &[Step]) -> (usize, bool) {
    let Ok(root) = DeTable::parse(text) else {
        return (0, false);
    };
    let root = root.into_inner();
    let Some((Step::Key(first), rest)) = key_path.split_first() else {
        return (0, true);
    };
    let Some(mut here): Option<&Spanned<DeValue<'_>>> = root.get(*first) else {
        return (0, false);
    };
    for step in rest {
        let next = match step {
            Step::Key(key) => here.get_ref().get(*key),
            Step::At(index) => here.get_ref().get(*index),
            Step::Name(name) => here.get_ref().get(name.as_str()),
        };
        match next {
            Some(value) => here = value,
            None => return (here.span().start, false),
        }
    }
    (here.span().start, true)
}
