//! Finds the meaning of each column of a recording for a given robot.

use std::collections::HashSet;
use std::path::Path;

use super::block::WRENCH_COLUMNS;
use super::columns::{EffortNeed, FileColumn, Layout, Role, Signal, proposes, shown};
use super::csv_header::ROW_NUMBER;
use super::efforts::{Efforts, efforts};
use super::error::{DataError, Warning};
use super::header::Header;
use super::motors::MotorSide;
use super::place::Place;
use super::time_names::is_time;
use super::unit::Unit;
use rig_model::robot::{JointKind, Origin, Robot};
use rig_output::listed;

/// Returns the columns of a file for `robot`. Beside `need` stands whether the rows may be poses at rest.
///
/// # Errors
/// [`DataError::Header`]: columns that are missing, without a name, there twice, or of no joint of the robot.
pub(super) fn layout(
    path: &Path,
    described: &Header,
    robot: &Robot,
    (need, may_rest): (EffortNeed, bool),
) -> Result<Layout, DataError> {
    let header = |message: String| DataError::Header {
        path: path.into(),
        place: described.line.map(Place::Line),
        message,
    };
    let names = described.names.as_slice();
    let joints = robot.joints.len();
    let time = time_column(path, names, may_rest).map_err(header)?;
    check_names(names).map_err(header)?;
    let signals = signals(names, robot).map_err(header)?;
    let from_motors = motor_positions(path, names, robot).map_err(header)?;
    if let (Some(why), EffortNeed::Required) = (&described.without_effort, need) {
        return Err(header(why.clone()));
    }
    let efforts = efforts(path, names, robot, need).map_err(header)?;
    let roles = Roles {
        names,
        robot,
        from_motors,
        efforts: &efforts,
    };
    let mut warnings = Vec::new();
    let mut extras = 0;
    let mut columns = Vec::with_capacity(names.len());
    for (k, signal) in signals.into_iter().enumerate() {
        let (name, label) = (&names[k], &described.labels[k]);
        let role = match signal {
            _ if name == "t" => Role::Time,
            None => Role::None,
            Some((signal, joint)) => roles.of(name, signal, joint, &mut warnings),
        };
        let unit = described.units.get(k).copied().flatten();
        if let (Some(unit), Some((signal, joint))) = (unit, signal) {
            check_unit(unit, signal, joint, label, robot).map_err(header)?;
        }
        let keep = matches!(role, Role::None | Role::Duty(..)) && name != ROW_NUMBER;
        let strict = role != Role::None || signal.is_some() || is_numeric_extra(name);
        columns.push(FileColumn {
            name: name.clone(),
            label: label.clone(),
            factor: unit.map_or(1.0, |unit| unit.factor),
            role,
            extra: keep.then_some(extras),
            strict,
        });
        extras += usize::from(keep);
    }
    let movers = |j: usize| (0..joints).filter(|m| robot.moves(*m, j)).collect();
    let movers = (0..joints).map(movers).collect();
    let motors = motor_side(robot, from_motors, efforts.turned).map_err(header)?;
    Ok(Layout {
        columns,
        time,
        joints,
        origin: None,
        extras,
        motors,
        movers,
        warnings,
    })
}

/// Checks that a unit is one of the joint's kind of motion: m for a prismatic joint, rad for another one.
fn check_unit(
    unit: Unit,
    signal: Signal,
    joint: usize,
    label: &str,
    robot: &Robot,
) -> Result<(), String> {
    let is_of_joint = matches!(
        signal,
        Signal::Position
            | Signal::LinkPosition
            | Signal::Reference
            | Signal::Velocity
            | Signal::Torque
    );
    let Some(own) = robot.joints.get(joint).filter(|_| is_of_joint) else {
        return Ok(());
    };
    let is_prismatic = own.kind == JointKind::Prismatic;
    if unit.is_linear().is_none_or(|linear| linear == is_prismatic) {
        return Ok(());
    }
    let (kind, fitting) = match (is_prismatic, signal) {
        (true, Signal::Velocity) => ("prismatic", "m/s or mm/s"),
        (true, Signal::Torque) => ("prismatic", "N, mN or kN"),
        (true, _) => ("prismatic", "m or mm"),
        (false, Signal::Velocity) => ("revolute", "rad/s, deg/s, rpm or rev/s"),
        (false, Signal::Torque) => ("revolute", "Nm, mNm, cNm, kNm or kgcm"),
        (false, _) => ("revolute", "rad, mrad, deg or rev"),
    };
    Err(format!(
        "the unit of column `{label}` is {}, but joint `{}` of robot `{}` is {kind}; give its unit by --unit {}{}=UNIT, where UNIT is {fitting}",
        unit.name,
        own.name,
        robot.name,
        signal.prefix(),
        joint + 1
    ))
}

/// Returns true for a column with a meaning that belongs to no joint: wrist sensor or supply.
fn is_numeric_extra(name: &str) -> bool {
    name == "supply" || WRENCH_COLUMNS.contains(&name)
}

/// Returns the index of the column with this name.
fn find(names: &[String], name: &str) -> Option<usize> {
    names.iter().position(|n| n == name)
}

/// Returns the column of time. `may_rest`: the rows may be poses, whose times only have to rise.
fn time_column(path: &Path, names: &[String], may_rest: bool) -> Result<usize, String> {
    find(names, "t").ok_or_else(|| {
        let only = names.first().map_or("", String::as_str);
        let times: Vec<String> = names.iter().filter(|n| is_time(n)).cloned().collect();
        if let [first, _, ..] = times.as_slice() {
            return format!(
                "there is no column `t` (time in s), and {} are all named as a time; choose one, for instance by --map 't={first}'",
                listed(&times)
            );
        }
        let hint = if only.parse::<f64>().is_ok() {
            "; the first line must name the columns".to_owned()
        } else {
            format!("; {}", proposes(path))
        };
        format!(
            "there is no column `t` (time in s); the columns are {}{hint}{}",
            shown(names),
            match may_rest {
                true => ". For poses at rest any number that rises from row to row serves as `t`",
                false => "",
            }
        )
    })
}

/// Checks that every column has a name of its own.
fn check_names(names: &[String]) -> Result<(), String> {
    let mut seen = HashSet::new();
    for (i, name) in names.iter().enumerate() {
        if name.is_empty() {
            return Err(format!(
                "column {} has no name; every column needs one (is there a separator too many?)",
                i + 1
            ));
        }
        if !seen.insert(name.as_str()) {
            return Err(format!(
                "column `{name}` is there twice; every column must have a name of its own"
            ));
        }
    }
    Ok(())
}

/// Returns what each column holds and its joint from 0, for columns that belong to a joint.
fn signals(names: &[String], robot: &Robot) -> Result<Vec<Option<(Signal, usize)>>, String> {
    let joints = robot.joints.len();
    // The duty cycle of a single joint needs no number.
    let bare = joints == 1 && find(names, "duty1").is_none();
    let split = |name: &String| {
        Signal::split(name).or_else(|| (bare && name == "duty").then_some((Signal::Duty, 1)))
    };
    let of = |name: &String| match split(name) {
        None => Ok(None),
        Some((signal, k)) if (1..=joints).contains(&k) => Ok(Some((signal, k - 1))),
        Some((signal, k)) => Err(format!(
            "column `{name}` belongs to joint {k}, but robot `{}` has joint{} (`{}1` is the first); correct the column or give the robot that was recorded",
            robot.name,
            if joints == 1 {
                " 1 only".to_owned()
            } else {
                format!("s 1 to {joints}")
            },
            signal.prefix()
        )),
    };
    names.iter().map(of).collect()
}

/// What decides the roles of the joints' columns.
struct Roles<'a> {
    names: &'a [String],
    robot: &'a Robot,
    /// True if the positions are those of the motors.
    from_motors: bool,
    efforts: &'a Efforts,
}

impl Roles<'_> {
    /// Returns the role of a column of a joint.
    fn of(&self, name: &str, signal: Signal, joint: usize, warnings: &mut Vec<Warning>) -> Role {
        match signal {
            Signal::Position if self.from_motors => Role::None,
            Signal::Position => Role::Position(joint),
            Signal::MotorPosition if self.from_motors => Role::MotorPosition(joint),
            Signal::MotorPosition => Role::None,
            Signal::Torque => Role::Effort(joint, 1.0),
            // If the joint torque is recorded, the model does not need that of the motor.
            Signal::MotorTorque | Signal::Current => {
                self.efforts.role(name, joint).unwrap_or(Role::None)
            }
            Signal::Velocity => Role::Velocity(joint),
            Signal::Acceleration => Role::Acceleration(joint),
            Signal::Reference => Role::Reference(joint),
            Signal::Voltage => Role::Voltage(joint),
            Signal::Temperature => Role::Temperature(joint),
            Signal::LinkPosition => Role::LinkPosition(joint),
            Signal::Duty => self.duty(name, joint, warnings),
        }
    }

    /// Returns the role of a duty cycle, which needs the supply voltage and yields to a recorded voltage.
    fn duty(&self, name: &str, joint: usize, warnings: &mut Vec<Warning>) -> Role {
        if find(self.names, &format!("u{}", joint + 1)).is_some() {
            return Role::None;
        }
        match find(self.names, "supply") {
            Some(column) => Role::Duty(joint, column, duty_scale(self.robot, joint)),
            None => {
                warnings.push(Warning::DutyWithoutSupply {
                    column: name.to_owned(),
                });
                Role::None
            }
        }
    }
}

/// Returns the conversion from motors to joints, if positions or torques need it.
fn motor_side(
    robot: &Robot,
    from_motors: bool,
    turned: Vec<bool>,
) -> Result<Option<MotorSide>, String> {
    if !from_motors && !turned.contains(&true) {
        return Ok(None);
    }
    let side = MotorSide::new(robot, from_motors, turned);
    side.map(Some).map_err(|e| {
        format!(
            "the drives of robot `{}` cannot turn motor columns to the joints: {e}",
            robot.name
        )
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
fn motor_positions(path: &Path, names: &[String], robot: &Robot) -> Result<bool, String> {
    let joints = robot.joints.len();
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
    let unmoved = match (joint.len() < joints, robot.origin) {
        (true, Origin::Urdf) => format!(
            "where joint `{name}` never moves, make it type=\"fixed\" in the URDF, or record its constant position; "
        ),
        (true, _) => format!("where joint `{name}` never moves, record its constant position; "),
        (false, _) => String::new(),
    };
    Err(if motor.len() == joints {
        format!(
            "there is no column `q{first}` (position of joint `{name}`, in rad or m); {unmoved}the columns are {}; {}",
            shown(names),
            proposes(path)
        )
    } else {
        format!(
            "there is neither `q{first}` (position of joint `{name}`, in rad or m) nor `qm{first_motor}` (motor position, rad); the position must be given by q for every joint or by qm for every motor, and the columns are {}; {}",
            shown(names),
            proposes(path)
        )
    })
}
