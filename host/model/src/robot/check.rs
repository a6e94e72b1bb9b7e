//! Checks of a description beyond its syntax.
//!
//! Physical consistency of the inertia (a density realises it) is not required. Identified values are often known only
//! in combinations and must be read back unchanged.

use std::collections::HashSet;
use std::f64::consts::TAU;

use rig_shared::multibody::MAX_JOINTS;

use super::check_drives::{check_drive, check_transmission};
use super::effects::check_effects;
use super::inertia::negative_inertia;
use super::sizes::oversized;
use super::voltage_controller::check_voltage_controller;
use super::workspace::check_workspace;
use super::{Joint, JointKind, JointLimits, Robot};

/// Names of effects beyond the standard model.
pub const EFFECT_NAMES: [&str; 22] = [
    "stribeck",
    "asymmetric_coulomb",
    "quadratic_drag",
    "load_friction",
    "position_friction",
    "presliding",
    "viscous_warmup",
    "cogging",
    "torque_ripple",
    "gear_eccentricity",
    "backlash",
    "joint_elasticity",
    "encoder_eccentricity",
    "current_offset",
    "torque_saturation",
    "measurement_delay",
    "gravity_tilt",
    "payload",
    "spring",
    "drive_deadzone",
    "inertia_coupling",
    "torque_offset",
];

/// One step of the path to a value in the tree of a description.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// A key of a table.
    Key(&'static str),
    /// An index of a list.
    At(usize),
    /// A key of a table whose keys are names.
    Name(String),
}

/// A value that cannot be right.
#[derive(Debug)]
pub(super) struct Fault {
    pub way: Vec<Step>,
    pub what: String,
    pub found: String,
    pub right: String,
}

/// Returns the first fault of `robot`, if any.
pub(super) fn check(robot: &Robot) -> Result<(), Fault> {
    use Step::{At, Key};
    for (i, g) in robot.gravity.iter().enumerate() {
        if !sound(*g) {
            return Err(fault(
                &[Key("gravity"), At(i)],
                "gravity",
                g,
                &format!("it must be three finite numbers, in m/s², at most {LARGEST:e}"),
            ));
        }
    }
    if robot.joints.is_empty() {
        return Err(Fault {
            way: vec![Key("joint")],
            what: "the list of joints".into(),
            found: "empty".into(),
            right: "a robot has at least one [[joint]]".into(),
        });
    }
    if robot.joints.len() > MAX_JOINTS {
        return Err(Fault {
            way: vec![Key("joint"), At(MAX_JOINTS)],
            what: "the number of joints".into(),
            found: robot.joints.len().to_string(),
            right: format!("a robot has at most {MAX_JOINTS}"),
        });
    }
    let mut names = HashSet::new();
    for (i, joint) in robot.joints.iter().enumerate() {
        if joint.name.trim().is_empty() {
            return Err(Fault {
                way: vec![Key("joint"), At(i), Key("name")],
                what: format!("the name of joint {}", i + 1),
                found: "empty".into(),
                right: "every joint has a name of its own".into(),
            });
        }
        if !names.insert(joint.name.as_str()) {
            return Err(Fault {
                way: vec![Key("joint"), At(i), Key("name")],
                what: format!("the name of joint {}", i + 1),
                found: format!("`{}` again", joint.name),
                right: "every joint has a name of its own".into(),
            });
        }
        check_joint(joint).map_err(|mut f| {
            f.way.splice(0..0, [Key("joint"), At(i)]);
            f
        })?;
    }
    // Identified values may be known only in combinations and are read back unchanged.
    if robot.identified.is_none()
        && let Some((i, mut fault)) = oversized(&robot.joints)
    {
        fault.way.splice(0..0, [Key("joint"), At(i)]);
        return Err(fault);
    }
    check_transmission(robot)?;
    if let Some((i, mut fault)) = negative_inertia(robot) {
        fault.way.splice(0..0, [Key("joint"), At(i)]);
        return Err(fault);
    }
    check_workspace(robot)?;
    if let Some(band) = &robot.identified {
        band.check(robot.joints.len())?;
    }
    check_effects(robot)
}

fn fault(way: &[Step], what: &str, found: &f64, right: &str) -> Fault {
    Fault {
        way: way.to_vec(),
        what: what.into(),
        found: written(*found),
        right: right.into(),
    }
}

/// Returns a number in the form that a person writes.
pub fn written(value: f64) -> String {
    let small = value != 0.0 && value.abs() < 1.0 / LARGEST;
    if (sound(value) && !small) || !value.is_finite() {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// Largest number of a description, in its written unit. It exceeds every robot's values, and products of such numbers
/// do not overflow.
pub(super) const LARGEST: f64 = 1e12;

/// Returns true if products of `value` do not overflow.
pub fn sound(value: f64) -> bool {
    value.abs() <= LARGEST
}

/// Requirement on a number.
#[derive(Clone, Copy)]
pub(super) enum Must {
    Finite,
    Positive,
    /// Greater than 0, of any size: a very large limit means no limit.
    Limit,
    NotNegative,
    NotZero,
}

pub(super) fn number(
    joint: &Joint,
    way: &[Step],
    what: &str,
    unit: &str,
    must: Must,
    value: f64,
) -> Result<(), Fault> {
    let (good, right) = match must {
        Must::Finite => (true, "a finite number"),
        Must::Positive | Must::Limit => (value > 0.0, "greater than 0"),
        Must::NotNegative => (value >= 0.0, "0 or greater"),
        Must::NotZero => (value != 0.0, "different from 0"),
    };
    let large = !matches!(must, Must::Limit) && value.is_finite() && !sound(value);
    if good && value.is_finite() && !large {
        return Ok(());
    }
    let what = format!("the {what} of joint `{}`", joint.name);
    let right = if large {
        format!("it must be at most {LARGEST:e} in {unit}")
    } else {
        format!("it must be {right}, in {unit}")
    };
    Err(fault(way, &what, &value, &right))
}

fn check_joint(joint: &Joint) -> Result<(), Fault> {
    use Must::{Finite, Limit, NotNegative, NotZero};
    use Step::{At, Key};
    let (angle, force) = match joint.kind {
        JointKind::Revolute => ("rad", "N·m"),
        JointKind::Prismatic => ("m", "N"),
    };
    number(joint, &[Key("alpha")], "alpha", "rad", Finite, joint.alpha)?;
    // The angle between two axes: a value beyond one turn has another unit.
    if joint.alpha.abs() > TAU {
        return Err(fault(
            &[Key("alpha")],
            &format!("the alpha of joint `{}`", joint.name),
            &joint.alpha,
            &format!(
                "it must be an angle within a turn, in rad; were these degrees, it would be {:.6}",
                joint.alpha.to_radians()
            ),
        ));
    }
    number(joint, &[Key("a")], "a", "m", Finite, joint.a)?;
    number(joint, &[Key("theta")], "theta", "rad", Finite, joint.theta)?;
    number(joint, &[Key("d")], "d", "m", Finite, joint.d)?;
    if let Some(inertial) = &joint.inertial {
        number(
            joint,
            &[Key("inertial"), Key("mass")],
            "mass",
            "kg",
            NotNegative,
            inertial.mass,
        )?;
        for (i, v) in inertial.first_moment.iter().enumerate() {
            let way = [Key("inertial"), Key("first_moment"), At(i)];
            number(joint, &way, "first_moment", "kg·m", Finite, *v)?;
        }
        for (i, v) in inertial.inertia.iter().enumerate() {
            number(
                joint,
                &[Key("inertial"), Key("inertia"), At(i)],
                "inertia",
                "kg·m²",
                Finite,
                *v,
            )?;
        }
    }
    if let Some(limits) = &joint.limits {
        check_position_limits(joint, limits.position, angle)?;
        check_soft_limits(joint, limits, angle)?;
        let way = |k| [Key("limits"), Key(k)];
        number(
            joint,
            &way("velocity"),
            "velocity limit",
            &format!("{angle}/s"),
            Limit,
            limits.velocity,
        )?;
        if let Some(v) = limits.acceleration {
            number(
                joint,
                &way("acceleration"),
                "acceleration limit",
                &format!("{angle}/s²"),
                Limit,
                v,
            )?;
        }
        if let Some(v) = limits.torque {
            number(joint, &way("torque"), "torque limit", force, Limit, v)?;
        }
    }
    if let Some(friction) = &joint.friction {
        let way = |k| [Key("friction"), Key(k)];
        number(
            joint,
            &way("coulomb"),
            "Coulomb friction",
            force,
            NotNegative,
            friction.coulomb,
        )?;
        let unit = format!("{force}·s/{angle}");
        number(
            joint,
            &way("viscous"),
            "viscous friction",
            &unit,
            NotNegative,
            friction.viscous,
        )?;
        number(
            joint,
            &way("offset"),
            "constant torque",
            force,
            Finite,
            friction.offset,
        )?;
    }
    if let Some(drive) = &joint.drive {
        check_drive(joint, drive)?;
    }
    if let Some(controller) = &joint.controller {
        let way = |k| [Key("controller"), Key(k)];
        number(
            joint,
            &way("position_gain"),
            "position gain",
            "1/s",
            NotNegative,
            controller.position_gain,
        )?;
        let unit = format!("controller output per {angle}/s");
        number(
            joint,
            &way("velocity_gain"),
            "velocity gain",
            &unit,
            Finite,
            controller.velocity_gain,
        )?;
        let unit = format!("{force} per controller output");
        number(
            joint,
            &way("torque_gain"),
            "torque gain",
            &unit,
            NotZero,
            controller.torque_gain,
        )?;
    }
    if let Some(controller) = &joint.voltage_controller {
        check_voltage_controller(joint, controller)?;
    }
    Ok(())
}

fn check_soft_limits(joint: &Joint, limits: &JointLimits, unit: &str) -> Result<(), Fault> {
    let Some([lower, upper]) = limits.soft_position else {
        return Ok(());
    };
    let [lowest, highest] = limits.position;
    if lower.is_finite()
        && upper.is_finite()
        && lowest <= lower
        && lower < upper
        && upper <= highest
    {
        return Ok(());
    }
    Err(Fault {
        way: vec![Step::Key("limits"), Step::Key("soft_position")],
        what: format!("the soft position range of joint `{}`", joint.name),
        found: format!("[{lower}, {upper}]"),
        right: format!(
            "it must be [lowest, highest], two finite numbers in {unit} within position = [{lowest}, {highest}]"
        ),
    })
}

fn check_position_limits(joint: &Joint, [lower, upper]: [f64; 2], unit: &str) -> Result<(), Fault> {
    let endless =
        joint.kind == JointKind::Revolute && lower == f64::NEG_INFINITY && upper == f64::INFINITY;
    if endless || (lower.is_finite() && upper.is_finite() && lower < upper) {
        return Ok(());
    }
    Err(Fault {
        way: vec![Step::Key("limits"), Step::Key("position")],
        what: format!("the position range of joint `{}`", joint.name),
        found: format!("[{lower}, {upper}]"),
        right: format!(
            "it must be [lowest, highest], two finite numbers in {unit} (or [-inf, inf] for a revolute joint that turns endlessly)"
        ),
    })
}
