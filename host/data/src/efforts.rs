//! Sources of the joints' torques: their own columns, or torques and currents of the motors.

use std::path::Path;

use super::columns::{EffortNeed, Role, proposes, shown};
use rig_model::robot::Robot;

/// Sources of the torques.
pub(super) struct Efforts {
    /// Per joint: column and factor, if the joint has its own drive.
    own: Vec<Option<(String, f64)>>,
    /// Per joint: true if its torque comes from motor torques through the Jacobian.
    pub turned: Vec<bool>,
    /// Per motor: column and factor to its torque, if needed.
    motor: Vec<Option<(String, f64)>>,
}

impl Efforts {
    /// Returns the role of a motor's column; `None` if no torque needs it.
    pub(super) fn role(&self, name: &str, joint: usize) -> Option<Role> {
        let of = |list: &[Option<(String, f64)>]| {
            let (column, factor) = list.get(joint)?.as_ref()?;
            (column == name).then_some(*factor)
        };
        of(&self.motor)
            .map(|f| Role::MotorEffort(joint, f))
            .or_else(|| of(&self.own).map(|f| Role::Effort(joint, f)))
    }
}

/// Finds a source for the torque of every joint: its own column, or all motors that move it.
pub(super) fn efforts(
    path: &Path,
    names: &[String],
    robot: &Robot,
    need: EffortNeed,
) -> Result<Efforts, String> {
    let n = robot.joints.len();
    let mut found = Efforts {
        own: vec![None; n],
        turned: vec![false; n],
        motor: vec![None; n],
    };
    for j in 0..n {
        if has(names, format!("tau{}", j + 1)).is_some() {
            continue;
        }
        let movers: Vec<usize> = (0..n).filter(|m| robot.moves(*m, j)).collect();
        let mut sources = Vec::with_capacity(movers.len());
        for &m in &movers {
            sources.push(motor_source(names, robot, m)?);
        }
        if sources.iter().all(Option::is_none) && need == EffortNeed::Optional {
            continue;
        }
        if let Some(gap) = sources.iter().position(Option::is_none) {
            return Err(format!(
                "{}; {}",
                no_source(names, robot, j, movers[gap]),
                proposes(path)
            ));
        }
        let simple = movers == [j]
            && robot.joints[j]
                .drive
                .as_ref()
                .is_none_or(|d| d.screw.is_none());
        for (&m, source) in movers.iter().zip(sources) {
            let Some((name, factor)) = source else {
                continue;
            };
            if simple {
                let ratio = robot.joints[m].drive.as_ref().map_or(1.0, |d| d.gear_ratio);
                found.own[m] = Some((name, factor * ratio));
            } else {
                found.motor[m] = Some((name, factor));
                found.turned[j] = true;
            }
        }
    }
    // If a motor's torque acts on several joints, its column is a motor torque; its own joint then follows by the
    // Jacobian.
    for m in 0..n {
        if found.motor[m].is_some() && found.own[m].take().is_some() {
            found.turned[m] = true;
        }
    }
    Ok(found)
}

/// Returns the name if there is a column of this name.
fn has(names: &[String], name: String) -> Option<String> {
    names.contains(&name).then_some(name)
}

/// Returns column and factor (to N·m) for the torque of motor `m`; `None` if it has no column.
fn motor_source(
    names: &[String],
    robot: &Robot,
    m: usize,
) -> Result<Option<(String, f64)>, String> {
    if let Some(name) = has(names, format!("taum{}", m + 1)) {
        return match &robot.joints[m].drive {
            Some(_) => Ok(Some((name, 1.0))),
            None => Err(format!(
                "column `{name}` is a motor torque, but joint `{}` of robot `{}` has no [joint.drive]; add its gear_ratio to the robot, or record `tau{}`",
                robot.joints[m].name,
                robot.name,
                m + 1
            )),
        };
    }
    let Some(name) = has(names, format!("i{}", m + 1)) else {
        return Ok(None);
    };
    let (joint, k) = (&robot.joints[m].name, m + 1);
    match &robot.joints[m].drive {
        None => Err(format!(
            "column `i{k}` is a motor current, but joint `{joint}` of robot `{}` has no [joint.drive]; add its gear_ratio and torque_constant to the robot, or record `tau{k}`",
            robot.name
        )),
        Some(drive) if drive.torque_constant == 0.0 => Err(format!(
            "column `i{k}` is a motor current, but the drive of joint `{joint}` of robot `{}` has no torque_constant; add it (N·m/A) to the robot, or record `tau{k}`",
            robot.name
        )),
        Some(drive) => Ok(Some((name, drive.torque_constant))),
    }
}

/// Returns the message for joint `j` that has no torque because its motor `mover` has none.
fn no_source(names: &[String], robot: &Robot, j: usize, mover: usize) -> String {
    let n = robot.joints.len();
    let (joint, k, m) = (&robot.joints[j].name, j + 1, mover + 1);
    if m == k {
        format!(
            "there is neither `tau{k}` (torque of joint `{joint}`, N·m or N) nor `i{k}` (its motor current, A) nor `taum{k}` (its motor torque, N·m); one of them is needed{}, and the columns are {}",
            if n == 1 && (has(names, "u1".into()).is_some() || names.iter().any(|c| c == "supply"))
            {
                " (`rig diagnose` alone identifies a joint from its motor voltage)"
            } else {
                ""
            },
            shown(names)
        )
    } else {
        format!(
            "there is no `tau{k}` (torque of joint `{joint}`, N·m or N), and motor {m}, which moves that joint too, has neither `i{m}` (A) nor `taum{m}` (N·m); the columns are {}",
            shown(names)
        )
    }
}
