//! What a description must satisfy beyond its syntax.
//!
//! Physical consistency of the inertia (a density realises it) is not asked here: values that are
//! identified from data are often only fixed up to combinations, and are read back as they are.

use std::collections::HashSet;

use super::check_drives::check_transmission;
use super::effects::check_effects;
use super::workspace::check_workspace;
use super::{Drive, Joint, JointKind, Robot};

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

/// One step of the way to a value in the tree of a description.
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

/// The first fault of `robot`, if any.
pub(super) fn check(robot: &Robot) -> Result<(), Fault> {
    use Step::{At, Key};
    for (i, g) in robot.gravity.iter().enumerate() {
        if !g.is_finite() {
            return Err(fault(
                &[Key("gravity"), At(i)],
                "gravity",
                g,
                "it must be three finite numbers, in m/s²",
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
    check_transmission(robot)?;
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
        found: found.to_string(),
        right: right.into(),
    }
}

/// What a number must be.
#[derive(Clone, Copy)]
enum Must {
    Finite,
    Positive,
    NotNegative,
    NotZero,
}

fn number(
    joint: &Joint,
    way: &[Step],
    what: &str,
    unit: &str,
    must: Must,
    value: f64,
) -> Result<(), Fault> {
    let (good, right) = match must {
        Must::Finite => (true, "a finite number"),
        Must::Positive => (value > 0.0, "greater than 0"),
        Must::NotNegative => (value >= 0.0, "0 or greater"),
        Must::NotZero => (value != 0.0, "different from 0"),
    };
    if good && value.is_finite() {
        return Ok(());
    }
    let what = format!("the {what} of joint `{}`", joint.name);
    Err(fault(
        way,
        &what,
        &value,
        &format!("it must be {right}, in {unit}"),
    ))
}

fn check_joint(joint: &Joint) -> Result<(), Fault> {
    use Must::{Finite, NotNegative, NotZero, Positive};
    use Step::{At, Key};
    let (angle, force) = match joint.kind {
        JointKind::Revolute => ("rad", "N·m"),
        JointKind::Prismatic => ("m", "N"),
    };
    number(joint, &[Key("alpha")], "alpha", "rad", Finite, joint.alpha)?;
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
        let way = |k| [Key("limits"), Key(k)];
        number(
            joint,
            &way("velocity"),
            "velocity limit",
            &format!("{angle}/s"),
            Positive,
            limits.velocity,
        )?;
        if let Some(v) = limits.acceleration {
            number(
                joint,
                &way("acceleration"),
                "acceleration limit",
                &format!("{angle}/s²"),
                Positive,
                v,
            )?;
        }
        if let Some(v) = limits.torque {
            number(joint, &way("torque"), "torque limit", force, Positive, v)?;
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
    Ok(())
}

/// What a drive must satisfy on its own; [`check_transmission`] sees to what it does with the others.
fn check_drive(joint: &Joint, drive: &Drive) -> Result<(), Fault> {
    use Must::{Finite, NotNegative, NotZero, Positive};
    use Step::{At, Key};
    let way = |k| [Key("drive"), Key(k)];
    if drive.screw.is_none() {
        number(
            joint,
            &way("gear_ratio"),
            "gear ratio",
            "motor turns per joint turn",
            NotZero,
            drive.gear_ratio,
        )?;
    } else if drive.gear_ratio != 0.0 {
        return Err(Fault {
            way: way("gear_ratio").to_vec(),
            what: format!("the gear ratio of joint `{}`", joint.name),
            found: drive.gear_ratio.to_string(),
            right: "a screw moves this joint ([joint.drive.screw]); leave gear_ratio out".into(),
        });
    }
    let numbers = [
        ("zero", "motor zero", "rad", Finite, drive.zero),
        (
            "rotor_inertia",
            "rotor inertia",
            "kg·m²",
            NotNegative,
            drive.rotor_inertia,
        ),
        (
            "joint_inertia",
            "drive inertia seen at the joint",
            "kg·m² (kg where prismatic)",
            Finite,
            drive.joint_inertia,
        ),
        (
            "coulomb",
            "Coulomb friction of the motor",
            "N·m, on the motor side",
            NotNegative,
            drive.coulomb,
        ),
        (
            "viscous",
            "viscous friction of the motor",
            "N·m·s/rad, on the motor side",
            NotNegative,
            drive.viscous,
        ),
        (
            "torque_constant",
            "torque constant",
            "N·m/A",
            NotNegative,
            drive.torque_constant,
        ),
    ];
    for (key, what, unit, must, value) in numbers {
        number(joint, &way(key), what, unit, must, value)?;
    }
    let optional = [
        ("resistance", "Ω", drive.resistance),
        ("inductance", "H", drive.inductance),
        (
            "encoder_counts_per_rev",
            "counts per motor turn",
            drive.encoder_counts_per_rev,
        ),
        (
            "duty_full_scale",
            "units of the duty column",
            drive.duty_full_scale,
        ),
    ];
    for (key, unit, value) in optional {
        if let Some(v) = value {
            number(joint, &way(key), key, unit, Positive, v)?;
        }
    }
    if let Some(screw) = &drive.screw {
        let way = |k| [Key("drive"), Key("screw"), Key(k)];
        number(
            joint,
            &way("lead"),
            "lead of the screw",
            "m per motor turn",
            NotZero,
            screw.lead,
        )?;
        number(
            joint,
            &way("crank"),
            "crank of the screw",
            "m",
            Positive,
            screw.crank,
        )?;
        for (i, v) in screw.anchor.iter().enumerate() {
            let way = [Key("drive"), Key("screw"), Key("anchor"), At(i)];
            number(joint, &way, "anchor of the screw", "m", Finite, *v)?;
        }
        number(
            joint,
            &way("offset"),
            "crank's offset",
            "rad",
            Finite,
            screw.offset,
        )?;
        if let Some([low, high]) = screw.range
            && !(low.is_finite() && high.is_finite() && low < high)
        {
            return Err(Fault {
                way: way("range").to_vec(),
                what: format!("the range of the crank of joint `{}`", joint.name),
                found: format!("[{low}, {high}]"),
                right: "it must be [lowest, highest], two finite angles in rad".into(),
            });
        }
    }
    Ok(())
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
