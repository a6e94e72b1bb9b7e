//! Checks of a description beyond its syntax.
//!
//! Physical consistency of the inertia (a density realises it) is not required. Identified values are often known only
//! in combinations and must be read back unchanged.

use std::collections::HashSet;

use rig_shared::multibody::MAX_JOINTS;

use super::check_drives::check_transmission;
use super::check_effects::check_effects;
use super::check_followers::check_followers;
use super::check_joint::check_joint;
use super::check_workspace::check_workspace;
use super::fault::{Fault, MAX_NUMBER, Step, fault, is_safe_magnitude};
use super::inertia::negative_inertia;
use super::serial_robot::Robot;
use super::unit_check::oversized;

fn check_gravity(robot: &Robot) -> Result<(), Fault> {
    use Step::{At, Key};
    for (i, g) in robot.gravity.iter().enumerate() {
        if !is_safe_magnitude(*g) {
            return Err(fault(
                &[Key("gravity"), At(i)],
                "gravity",
                g,
                &format!("it must be three finite numbers, in m/s², at most {MAX_NUMBER:e}"),
            ));
        }
    }
    Ok(())
}

/// Checks that every joint and every follower has a name of its own.
fn check_names(robot: &Robot) -> Result<(), Fault> {
    use Step::{At, Key};
    let mut names = HashSet::new();
    for (i, joint) in robot.joints.iter().enumerate() {
        if joint.name.trim().is_empty() {
            return Err(Fault {
                key_path: vec![Key("joint"), At(i), Key("name")],
                what: format!("the name of joint {}", i + 1),
                found: "empty".into(),
                advice: "every joint has a name of its own".into(),
            });
        }
        if !names.insert(joint.name.as_str()) {
            return Err(Fault {
                key_path: vec![Key("joint"), At(i), Key("name")],
                what: format!("the name of joint {}", i + 1),
                found: format!("`{}` again", joint.name),
                advice: "every joint has a name of its own".into(),
            });
        }
    }
    for (i, own) in robot.followers.iter().enumerate() {
        let found = match own.name.trim().is_empty() {
            true => "empty".to_owned(),
            false if names.insert(own.name.as_str()) => continue,
            false => format!("`{}` again", own.name),
        };
        return Err(Fault {
            key_path: vec![Key("follower"), At(i), Key("name")],
            what: format!("the name of follower {}", i + 1),
            found,
            advice: "every joint and every follower has a name of its own".into(),
        });
    }
    Ok(())
}

/// Returns the first fault of `robot`, if any.
pub(super) fn check(robot: &Robot) -> Result<(), Fault> {
    use Step::{At, Key};
    check_gravity(robot)?;
    if robot.joints.is_empty() {
        return Err(Fault {
            key_path: vec![Key("joint")],
            what: "the list of joints".into(),
            found: "empty".into(),
            advice: "a robot has at least one [[joint]]".into(),
        });
    }
    if robot.link_count() > MAX_JOINTS {
        let (key_path, what) = match robot.joints.len() > MAX_JOINTS {
            true => (vec![Key("joint"), At(MAX_JOINTS)], "the number of joints"),
            false => (vec![Key("follower")], "the number of joints and followers"),
        };
        return Err(Fault {
            key_path,
            what: what.into(),
            found: robot.link_count().to_string(),
            advice: format!("a robot has at most {MAX_JOINTS}"),
        });
    }
    check_names(robot)?;
    for (i, joint) in robot.joints.iter().enumerate() {
        check_joint(joint).map_err(|mut f| {
            f.key_path.splice(0..0, [Key("joint"), At(i)]);
            f
        })?;
    }
    check_followers(robot)?;
    // Identified values may be known only in combinations and are read back unchanged.
    if robot.identified.is_none()
        && let Some((axis, mut fault)) = oversized(&robot.axes())
    {
        let link = robot.links_outwards()[axis];
        fault.key_path.splice(0..0, robot.link_key(link));
        return Err(fault);
    }
    check_transmission(robot)?;
    if let Some((i, mut fault)) = negative_inertia(robot) {
        fault.key_path.splice(0..0, [Key("joint"), At(i)]);
        return Err(fault);
    }
    check_workspace(robot)?;
    robot.flange.check()?;
    if let Some(sensor) = &robot.wrist_sensor {
        sensor.check()?;
    }
    if let Some(band) = &robot.identified {
        band.check(robot.joints.len())?;
    }
    robot.uncertainty.check()?;
    check_effects(robot)
}
