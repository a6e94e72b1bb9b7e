//! What each column of a recording means for a given robot.

use std::collections::HashSet;
use std::path::Path;

use super::error::{DataError, Warning};
use crate::robot::Robot;

/// Whether every joint must come with its torque.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EffortNeed {
    /// `tau<k>` or `i<k>` must be there for every joint.
    #[default]
    Required,
    /// It may be missing: the motion alone is wanted, or torque comes from the voltage.
    Optional,
}

/// Where a value goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Role {
    Time,
    Position(usize),
    /// Times this factor.
    Effort(usize, f64),
    Velocity(usize),
    Acceleration(usize),
    Reference(usize),
    Voltage(usize),
    /// Times the value of that column.
    Duty(usize, usize),
    Temperature(usize),
    /// No meaning to the model.
    None,
}

/// One column of the file.
#[derive(Clone, Debug)]
pub(super) struct FileColumn {
    pub name: String,
    pub role: Role,
    /// Place in [`super::Block::extra`], if it is kept by name.
    pub extra: Option<usize>,
    /// Whether every value must be a finite number.
    pub strict: bool,
}

/// All columns of the file in their order.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub columns: Vec<FileColumn>,
    pub time: usize,
    pub joints: usize,
    pub extras: usize,
    pub warnings: Vec<Warning>,
}

/// Columns that mean something beside the joints' own: wrist sensor and supply.
const NUMERIC_EXTRAS: [&str; 7] = ["fx", "fy", "fz", "mx", "my", "mz", "supply"];

const QUANTITIES: [&str; 9] = ["tau", "ref", "temp", "duty", "qdd", "qd", "q", "i", "u"];

/// `tau12` → ("tau", 12); a number has no leading zero except `0` itself.
fn split(name: &str) -> Option<(&'static str, usize)> {
    QUANTITIES.iter().find_map(|quantity| {
        let digits = name.strip_prefix(quantity)?;
        let plain = !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
        let canonical = plain && (digits == "0" || !digits.starts_with('0'));
        canonical
            .then(|| digits.parse().ok())
            .flatten()
            .map(|k| (*quantity, k))
    })
}

fn shown(names: &[String]) -> String {
    const MOST: usize = 12;
    let list: Vec<String> = names
        .iter()
        .take(MOST)
        .map(|n| format!("`{}`", n.escape_debug()))
        .collect();
    let more = if names.len() > MOST { ", …" } else { "" };
    list.join(", ") + more
}

pub(super) fn layout(
    path: &Path,
    names: &[String],
    robot: &Robot,
    need: EffortNeed,
) -> Result<Layout, DataError> {
    let header = |message: String| DataError::Header {
        path: path.into(),
        message,
    };
    let joints = robot.joints.len();
    let find = |name: &str| names.iter().position(|n| n == name);
    let Some(time) = find("t") else {
        let only = names.first().map_or("", String::as_str);
        let hint = if names.len() == 1 && (only.contains(';') || only.contains('\t')) {
            "; columns must be separated by commas"
        } else if only.parse::<f64>().is_ok() {
            "; the first line must name the columns"
        } else {
            ""
        };
        return Err(header(format!(
            "there is no column `t` (time in s); the columns are {}{hint}",
            shown(names)
        )));
    };
    let mut seen = HashSet::new();
    for (i, name) in names.iter().enumerate() {
        if name.is_empty() {
            return Err(header(format!(
                "column {} has no name; every column needs one (is there a comma too many?)",
                i + 1
            )));
        }
        if !seen.insert(name.as_str()) {
            return Err(header(format!(
                "column `{name}` is there twice; every column must have a name of its own"
            )));
        }
    }
    for name in names {
        if let Some((quantity, k)) = split(name)
            && (k == 0 || k > joints)
        {
            return Err(header(format!(
                "column `{name}` belongs to joint {k}, but robot `{}` has joint{} (`{quantity}1` is the first); correct the column or give the robot that was recorded",
                robot.name,
                if joints == 1 {
                    " 1 only".to_owned()
                } else {
                    format!("s 1 to {joints}")
                }
            )));
        }
    }
    let mut warnings = Vec::new();
    let supply = find("supply");
    for (k, joint) in (1..).zip(&robot.joints) {
        if find(&format!("q{k}")).is_none() {
            return Err(header(format!(
                "there is no column `q{k}` (position of joint `{}`, in rad or m); the columns are {}",
                joint.name,
                shown(names)
            )));
        }
        if find(&format!("tau{k}")).is_some() {
            continue;
        }
        if find(&format!("i{k}")).is_none() {
            if need == EffortNeed::Required {
                return Err(header(format!(
                    "there is neither `tau{k}` (torque of joint `{}`, N·m or N) nor `i{k}` (its motor current, A); one of them is needed, and the columns are {}",
                    joint.name,
                    shown(names)
                )));
            }
            continue;
        }
        match &joint.drive {
            None => {
                return Err(header(format!(
                    "column `i{k}` is a motor current, but joint `{}` of robot `{}` has no [joint.drive]; add its gear_ratio and torque_constant to the robot, or record `tau{k}`",
                    joint.name, robot.name
                )));
            }
            Some(drive) if drive.torque_constant == 0.0 => {
                return Err(header(format!(
                    "column `i{k}` is a motor current, but the drive of joint `{}` of robot `{}` has no torque_constant; add it (N·m/A) to the robot, or record `tau{k}`",
                    joint.name, robot.name
                )));
            }
            Some(_) => {}
        }
    }
    let mut extras = 0;
    let mut columns = Vec::with_capacity(names.len());
    for name in names {
        let (role, keep) = match split(name) {
            _ if name == "t" => (Role::Time, false),
            None => (Role::None, true),
            Some((quantity, k)) => {
                let joint = k - 1;
                match quantity {
                    "q" => (Role::Position(joint), false),
                    "tau" => (Role::Effort(joint, 1.0), false),
                    // With the torque itself there, the current says nothing more to the model.
                    "i" if find(&format!("tau{k}")).is_some() => (Role::None, true),
                    "i" => {
                        let drive = robot.joints.get(joint).and_then(|j| j.drive.as_ref());
                        (
                            Role::Effort(
                                joint,
                                drive.map_or(0.0, |d| d.gear_ratio * d.torque_constant),
                            ),
                            false,
                        )
                    }
                    "qd" => (Role::Velocity(joint), false),
                    "qdd" => (Role::Acceleration(joint), false),
                    "ref" => (Role::Reference(joint), false),
                    "u" => (Role::Voltage(joint), false),
                    "temp" => (Role::Temperature(joint), false),
                    _ => match supply {
                        _ if find(&format!("u{k}")).is_some() => (Role::None, true),
                        Some(column) => (Role::Duty(joint, column), true),
                        None => {
                            warnings.push(Warning::DutyWithoutSupply {
                                column: name.clone(),
                            });
                            (Role::None, true)
                        }
                    },
                }
            }
        };
        let strict =
            role != Role::None || split(name).is_some() || NUMERIC_EXTRAS.contains(&name.as_str());
        columns.push(FileColumn {
            name: name.clone(),
            role,
            extra: keep.then_some(extras),
            strict,
        });
        extras += usize::from(keep);
    }
    Ok(Layout {
        columns,
        time,
        joints,
        extras,
        warnings,
    })
}
