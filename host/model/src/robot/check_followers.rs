//! Checks of the axes that follow a joint.

use rig_shared::transmission::DriveKind;

use super::check_joint::check_joint;
use super::fault::{Fault, Step, is_safe_magnitude, written};
use super::follower::Follower;
use super::serial_robot::Robot;

/// Returns the first fault of the followers, if any. The names of joints and followers are checked elsewhere.
pub(super) fn check_followers(robot: &Robot) -> Result<(), Fault> {
    for (k, own) in robot.followers.iter().enumerate() {
        let within = |mut fault: Fault| {
            fault
                .key_path
                .splice(0..0, [Step::Key("follower"), Step::At(k)]);
            fault.what = fault.what.replace("of joint `", "of follower `");
            fault
        };
        check_joint(&own.as_joint()).map_err(within)?;
        motion(robot, own).map_err(within)?;
    }
    if robot.has_followers() {
        simple_drives(robot)?;
    }
    Ok(())
}

/// Checks which joint a follower follows, and how.
fn motion(robot: &Robot, own: &Follower) -> Result<(), Fault> {
    let names: Vec<&str> = robot
        .joints
        .iter()
        .map(|joint| joint.name.as_str())
        .collect();
    let fault = |key: &'static str, what: String, found: String, advice: String| Fault {
        key_path: vec![Step::Key(key)],
        what,
        found,
        advice,
    };
    let name = &own.name;
    if robot.joint_index(&own.follows).is_none() {
        return Err(fault(
            "follows",
            format!("the joint that follower `{name}` follows"),
            format!("`{}`", own.follows),
            format!("it must be one of the joints {}", names.join(", ")),
        ));
    }
    if let Some(after) = &own.after
        && robot.joint_index(after).is_none()
    {
        return Err(fault(
            "after",
            format!("the joint behind which follower `{name}` stands"),
            format!("`{after}`"),
            format!(
                "it must be one of the joints {}, or be left out for a place before the first",
                names.join(", ")
            ),
        ));
    }
    if own.ratio == 0.0 || !is_safe_magnitude(own.ratio) {
        return Err(fault(
            "ratio",
            format!("the ratio of follower `{name}`"),
            written(own.ratio),
            "it must be a number other than 0: the follower's position per position of the joint"
                .into(),
        ));
    }
    if !is_safe_magnitude(own.offset) {
        return Err(fault(
            "offset",
            format!("the offset of follower `{name}`"),
            written(own.offset),
            "it must be the follower's position where the joint is at zero, in rad or m".into(),
        ));
    }
    Ok(())
}

/// Refuses drives that move several joints or move at a varying ratio: equations for these together with followers do not
/// exist.
fn simple_drives(robot: &Robot) -> Result<(), Fault> {
    let kinds = robot.drive_kinds();
    let Some(k) = kinds.iter().position(|kind| *kind != DriveKind::Simple) else {
        return Ok(());
    };
    let (joint, own) = (&robot.joints[k].name, &robot.followers[0]);
    let key = match &robot.joints[k].drive {
        Some(drive) if drive.screw.is_some() => "screw",
        _ => "couples",
    };
    Err(Fault {
        key_path: vec![
            Step::Key("joint"),
            Step::At(k),
            Step::Key("drive"),
            Step::Key(key),
        ],
        what: format!("the drive of joint `{joint}`"),
        found: "one that moves several joints, or moves its joint at a varying ratio".into(),
        advice: format!(
            "the robot has follower `{}`, and beside followers every drive must move its own joint at a constant ratio; remove `{key}` or the follower",
            own.name
        ),
    })
}

#[cfg(test)]
#[path = "check_followers_test.rs"]
mod tests;
