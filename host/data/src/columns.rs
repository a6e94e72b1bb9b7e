//! Meaning of each column of a recording for a given robot.

use std::collections::HashSet;
use std::path::Path;

use super::error::{DataError, Warning};
use super::header::Header;
use super::motors::MotorSide;
use super::place::Place;
use rig_model::robot::Robot;

/// Whether every joint needs a torque.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EffortNeed {
    /// `tau<k>` or `i<k>` must be there for every joint.
    #[default]
    Required,
    /// It may be missing: only the motion is used, or the torque is computed from the voltage.
    Optional,
}

/// Destination of a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Role {
    Time,
    Position(usize),
    /// Joint and factor.
    Effort(usize, f64),
    /// Joint; position of its motor.
    MotorPosition(usize),
    /// Joint and factor; torque of its motor.
    MotorEffort(usize, f64),
    Velocity(usize),
    Acceleration(usize),
    Reference(usize),
    Voltage(usize),
    /// Joint, column of the supply voltage, and factor.
    Duty(usize, usize, f64),
    Temperature(usize),
    /// Joint; position on the link side of the transmission.
    LinkPosition(usize),
    /// No meaning for the model.
    None,
}

/// One column of the file.
#[derive(Clone, Debug)]
pub(super) struct FileColumn {
    pub name: String,
    /// Name in messages: the name in the file.
    pub label: String,
    pub role: Role,
    /// Index in [`super::Block::extra`], if it is kept by name.
    pub extra: Option<usize>,
    /// True if every value must be a finite number.
    pub strict: bool,
}

/// Magnitude above which no value in SI units is a measurement, even with a wrong unit: 10⁶ rad, N·m, A or V, times a
/// million for a smaller unit.
const NO_MEASUREMENT: f64 = 1e12;

/// The same for time: nanoseconds since 1970, which have a message of their own, are 1.8·10¹⁸.
const NO_TIME: f64 = 1e21;

impl FileColumn {
    /// Returns the largest magnitude that counts as a measurement.
    pub(super) fn largest(&self) -> f64 {
        match self.role {
            Role::Time => NO_TIME,
            _ => NO_MEASUREMENT,
        }
    }

    /// Returns the quantity that the column measures.
    fn quantity(&self) -> &'static str {
        match (self.role, split(&self.name)) {
            (Role::Time, _) => "time",
            (_, Some(("i", _))) => "motor current",
            (_, Some(("taum", _))) => "motor torque",
            (_, Some(("tau", _))) => "torque or force",
            (_, Some(("q" | "qm" | "ql", _))) => "position",
            (_, Some(("qd", _))) => "velocity",
            (_, Some(("qdd", _))) => "acceleration",
            (_, Some(("ref", _))) => "reference position",
            (_, Some(("u", _))) => "voltage",
            (_, Some(("duty", _))) => "duty cycle",
            (_, Some(("temp", _))) => "temperature",
            _ => "measurement",
        }
    }

    /// Returns the error for a value beyond [`FileColumn::largest`].
    pub(super) fn out_of_range(&self, path: &Path, place: Place, value: f64) -> DataError {
        DataError::OutOfRange {
            path: path.into(),
            place,
            column: self.label.clone(),
            value,
            quantity: self.quantity(),
        }
    }
}

/// All columns of the file in order.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub columns: Vec<FileColumn>,
    pub time: usize,
    pub joints: usize,
    pub extras: usize,
    /// Conversion from motors to joints, if needed.
    pub motors: Option<MotorSide>,
    /// Per joint, the motors whose columns determine its position or torque, if it is converted.
    pub movers: Vec<Vec<usize>>,
    pub warnings: Vec<Warning>,
}

/// Columns with a meaning that belong to no joint: wrist sensor and supply.
const NUMERIC_EXTRAS: [&str; 7] = ["fx", "fy", "fz", "mx", "my", "mz", "supply"];

const QUANTITIES: [&str; 12] = [
    "taum", "tau", "ref", "temp", "duty", "qdd", "qd", "qm", "ql", "q", "i", "u",
];

/// Splits `tau12` into ("tau", 12); a number has no leading zero except `0` itself.
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
    described: &Header,
    robot: &Robot,
    need: EffortNeed,
) -> Result<Layout, DataError> {
    let header = |message: String| DataError::Header {
        path: path.into(),
        place: described.line.map(Place::Line),
        message,
    };
    let names = described.names.as_slice();
    let joints = robot.joints.len();
    let find = |name: &str| names.iter().position(|n| n == name);
    let Some(time) = find("t") else {
        let only = names.first().map_or("", String::as_str);
        let hint = if only.parse::<f64>().is_ok() {
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
                "column {} has no name; every column needs one (is there a separator too many?)",
                i + 1
            )));
        }
        if !seen.insert(name.as_str()) {
            return Err(header(format!(
                "column `{name}` is there twice; every column must have a name of its own"
            )));
        }
    }
    // The duty cycle of a single joint needs no number.
    let bare = joints == 1 && !names.iter().any(|name| name == "duty1");
    let split =
        |name: &str| split(name).or_else(|| (bare && name == "duty").then_some(("duty", 1)));
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
    let from_motors = motor_positions(names, robot, joints).map_err(header)?;
    if let (Some(why), EffortNeed::Required) = (&described.without_effort, need) {
        return Err(header(why.clone()));
    }
    let efforts = efforts(names, robot, need).map_err(header)?;
    let mut extras = 0;
    let mut columns = Vec::with_capacity(names.len());
    for (name, label) in names.iter().zip(&described.labels) {
        let (role, keep) = match split(name) {
            _ if name == "t" => (Role::Time, false),
            None => (Role::None, true),
            Some((quantity, k)) => {
                let joint = k - 1;
                match quantity {
                    "q" if from_motors => (Role::None, true),
                    "q" => (Role::Position(joint), false),
                    "qm" if from_motors => (Role::MotorPosition(joint), false),
                    "tau" => (Role::Effort(joint, 1.0), false),
                    "qm" => (Role::None, true),
                    "taum" | "i" => match efforts.role(name, joint) {
                        Some(role) => (role, false),
                        // The joint torque is recorded, so the model does not need that of the motor.
                        None => (Role::None, true),
                    },
                    "qd" => (Role::Velocity(joint), false),
                    "qdd" => (Role::Acceleration(joint), false),
                    "ref" => (Role::Reference(joint), false),
                    "u" => (Role::Voltage(joint), false),
                    "temp" => (Role::Temperature(joint), false),
                    "ql" => (Role::LinkPosition(joint), false),
                    _ => match supply {
                        _ if find(&format!("u{k}")).is_some() => (Role::None, true),
                        Some(column) => (Role::Duty(joint, column, duty_scale(robot, joint)), true),
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
            label: label.clone(),
            role,
            extra: keep.then_some(extras),
            strict,
        });
        extras += usize::from(keep);
    }
    let movers = |j: usize| (0..joints).filter(|m| robot.moves(*m, j)).collect();
    let movers = (0..joints).map(movers).collect();
    let motors = if from_motors || efforts.turned.contains(&true) {
        let side = MotorSide::new(robot, from_motors, efforts.turned).map_err(|e| {
            header(format!(
                "the drives of robot `{}` cannot turn motor columns to the joints: {e}",
                robot.name
            ))
        })?;
        Some(side)
    } else {
        None
    };
    Ok(Layout {
        columns,
        time,
        joints,
        extras,
        motors,
        movers,
        warnings,
    })
}

/// Returns the share of the supply voltage per unit of a joint's duty column.
fn duty_scale(robot: &Robot, joint: usize) -> f64 {
    let drive = robot.joints.get(joint).and_then(|j| j.drive.as_ref());
    drive
        .and_then(|d| d.duty_full_scale)
        .map_or(1.0, |full| 1.0 / full)
}

/// Returns true if the positions are those of the motors.
fn motor_positions(names: &[String], robot: &Robot, joints: usize) -> Result<bool, String> {
    let missing = |quantity: &str| -> Vec<usize> {
        (1..=joints)
            .filter(|k| !names.iter().any(|n| *n == format!("{quantity}{k}")))
            .collect()
    };
    let (joint, motor) = (missing("q"), missing("qm"));
    let Some(&first) = joint.first() else {
        return Ok(false);
    };
    let Some(&first_motor) = motor.first() else {
        return match robot.joints.iter().position(|j| j.drive.is_none()) {
            None => Ok(true),
            Some(k) => Err(format!(
                "there is no column `q{}`, and column `qm{}` is a motor position, but joint `{}` of robot `{}` has no [joint.drive]; add its gear_ratio (and couples, zero) to the robot",
                first,
                k + 1,
                robot.joints[k].name,
                robot.name
            )),
        };
    };
    let name = &robot.joints[first - 1].name;
    // Some joints are recorded and others not, for example those of a gripper.
    let unmoved = if joint.len() < joints {
        format!("where joint `{name}` never moves, make it type=\"fixed\" in the URDF; ")
    } else {
        String::new()
    };
    Err(if motor.len() == joints {
        format!(
            "there is no column `q{first}` (position of joint `{name}`, in rad or m); {unmoved}the columns are {}",
            shown(names)
        )
    } else {
        format!(
            "there is neither `q{first}` (position of joint `{name}`, in rad or m) nor `qm{first_motor}` (motor position, rad); the position must be given by q for every joint or by qm for every motor, and the columns are {}",
            shown(names)
        )
    })
}

/// Sources of the torques.
struct Efforts {
    /// Per joint: column and factor, if the joint has its own drive.
    own: Vec<Option<(String, f64)>>,
    /// Per joint: true if its torque comes from motor torques through the Jacobian.
    turned: Vec<bool>,
    /// Per motor: column and factor to its torque, if needed.
    motor: Vec<Option<(String, f64)>>,
}

impl Efforts {
    fn role(&self, name: &str, joint: usize) -> Option<Role> {
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
fn efforts(names: &[String], robot: &Robot, need: EffortNeed) -> Result<Efforts, String> {
    let n = robot.joints.len();
    let has = |name: String| names.contains(&name).then_some(name);
    let mut found = Efforts {
        own: vec![None; n],
        turned: vec![false; n],
        motor: vec![None; n],
    };
    // Column and factor (to N·m) for the torque of motor m.
    let source = |m: usize| -> Result<Option<(String, f64)>, String> {
        if let Some(name) = has(format!("taum{}", m + 1)) {
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
        let Some(name) = has(format!("i{}", m + 1)) else {
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
    };
    for j in 0..n {
        if has(format!("tau{}", j + 1)).is_some() {
            continue;
        }
        let movers: Vec<usize> = (0..n).filter(|m| robot.moves(*m, j)).collect();
        let mut sources = Vec::with_capacity(movers.len());
        for &m in &movers {
            sources.push(source(m)?);
        }
        if sources.iter().all(Option::is_none) && need == EffortNeed::Optional {
            continue;
        }
        let (joint, k) = (&robot.joints[j].name, j + 1);
        if let Some(gap) = sources.iter().position(Option::is_none) {
            let m = movers[gap] + 1;
            return Err(if m == k {
                format!(
                    "there is neither `tau{k}` (torque of joint `{joint}`, N·m or N) nor `i{k}` (its motor current, A) nor `taum{k}` (its motor torque, N·m); one of them is needed{}, and the columns are {}",
                    if n == 1 && (has("u1".into()).is_some() || names.iter().any(|c| c == "supply"))
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
            });
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
