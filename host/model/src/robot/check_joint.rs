//! Checks of one joint and its link.

use std::f64::consts::TAU;

use super::check_drives::check_drive;
use super::fault::{Fault, Requirement, Step, fault, number};
use super::joint::{Controller, Inertial, Joint, JointFriction, JointKind, JointLimits};
use super::voltage_controller::VoltageController;

/// Units of a joint's position and torque in messages.
#[derive(Clone, Copy)]
struct Units {
    angle: &'static str,
    force: &'static str,
}

impl Units {
    fn of(kind: JointKind) -> Self {
        let (angle, force) = match kind {
            JointKind::Revolute => ("rad", "N·m"),
            JointKind::Prismatic => ("m", "N"),
        };
        Self { angle, force }
    }
}

/// Returns the first fault of a joint, with the way from it.
pub(super) fn check_joint(joint: &Joint) -> Result<(), Fault> {
    let units = Units::of(joint.kind);
    check_geometry(joint)?;
    if let Some(inertial) = &joint.inertial {
        check_inertial(joint, inertial)?;
    }
    if let Some(limits) = &joint.limits {
        check_limits(joint, limits, units)?;
    }
    if let Some(friction) = &joint.friction {
        check_friction(joint, friction, units)?;
    }
    if let Some(drive) = &joint.drive {
        check_drive(joint, drive)?;
    }
    if let Some(controller) = &joint.controller {
        check_controller(joint, controller, units)?;
    }
    if let Some(controller) = &joint.voltage_controller {
        check_voltage_controller(joint, controller)?;
    }
    Ok(())
}

fn check_geometry(joint: &Joint) -> Result<(), Fault> {
    use Requirement::Finite;
    use Step::Key;
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
    number(joint, &[Key("d")], "d", "m", Finite, joint.d)
}

fn check_inertial(joint: &Joint, inertial: &Inertial) -> Result<(), Fault> {
    use Requirement::{Finite, NotNegative};
    use Step::{At, Key};
    number(
        joint,
        &[Key("inertial"), Key("mass")],
        "mass",
        "kg",
        NotNegative,
        inertial.mass,
    )?;
    for (i, v) in inertial.first_moment.iter().enumerate() {
        let key_path = [Key("inertial"), Key("first_moment"), At(i)];
        number(joint, &key_path, "first_moment", "kg·m", Finite, *v)?;
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
    Ok(())
}

fn check_limits(joint: &Joint, limits: &JointLimits, units: Units) -> Result<(), Fault> {
    use Requirement::Limit;
    use Step::Key;
    let Units { angle, force } = units;
    check_position_limits(joint, limits.position, angle)?;
    check_soft_limits(joint, limits, angle)?;
    let key_path = |k| [Key("limits"), Key(k)];
    // An infinite one is not known.
    if limits.velocity != f64::INFINITY {
        number(
            joint,
            &key_path("velocity"),
            "velocity limit",
            &format!("{angle}/s"),
            Limit,
            limits.velocity,
        )?;
    }
    if let Some(v) = limits.acceleration {
        number(
            joint,
            &key_path("acceleration"),
            "acceleration limit",
            &format!("{angle}/s²"),
            Limit,
            v,
        )?;
    }
    if let Some(v) = limits.torque {
        number(joint, &key_path("torque"), "torque limit", force, Limit, v)?;
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
        key_path: vec![Step::Key("limits"), Step::Key("soft_position")],
        what: format!("the soft position range of joint `{}`", joint.name),
        found: format!("[{lower}, {upper}]"),
        advice: format!(
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
        key_path: vec![Step::Key("limits"), Step::Key("position")],
        what: format!("the position range of joint `{}`", joint.name),
        found: format!("[{lower}, {upper}]"),
        advice: format!(
            "it must be [lowest, highest], two finite numbers in {unit} (or [-inf, inf] for a revolute joint that turns endlessly)"
        ),
    })
}

fn check_friction(joint: &Joint, friction: &JointFriction, units: Units) -> Result<(), Fault> {
    use Requirement::{Finite, NotNegative};
    use Step::Key;
    let Units { angle, force } = units;
    let key_path = |k| [Key("friction"), Key(k)];
    number(
        joint,
        &key_path("coulomb"),
        "Coulomb friction",
        force,
        NotNegative,
        friction.coulomb,
    )?;
    let unit = format!("{force}·s/{angle}");
    number(
        joint,
        &key_path("viscous"),
        "viscous friction",
        &unit,
        NotNegative,
        friction.viscous,
    )?;
    number(
        joint,
        &key_path("offset"),
        "constant torque",
        force,
        Finite,
        friction.offset,
    )?;
    Ok(())
}

fn check_controller(joint: &Joint, controller: &Controller, units: Units) -> Result<(), Fault> {
    use Requirement::{Finite, NotNegative, NotZero};
    use Step::Key;
    let Units { angle, force } = units;
    let key_path = |k| [Key("controller"), Key(k)];
    number(
        joint,
        &key_path("position_gain"),
        "position gain",
        "1/s",
        NotNegative,
        controller.position_gain,
    )?;
    let unit = format!("controller output per {angle}/s");
    number(
        joint,
        &key_path("velocity_gain"),
        "velocity gain",
        &unit,
        Finite,
        controller.velocity_gain,
    )?;
    let unit = format!("{force} per controller output");
    number(
        joint,
        &key_path("torque_gain"),
        "torque gain",
        &unit,
        NotZero,
        controller.torque_gain,
    )?;
    Ok(())
}

/// Refuses values that no controller has.
fn check_voltage_controller(joint: &Joint, c: &VoltageController) -> Result<(), Fault> {
    use Requirement::{Finite, NotNegative, Positive};
    let key_path = |key| [Step::Key("voltage_controller"), Step::Key(key)];
    let unit = joint.kind.units().0;
    for (key, what, per, requirement, value) in [
        (
            "proportional",
            "proportional gain",
            "1/",
            NotNegative,
            c.proportional,
        ),
        ("integral", "integral gain", "1/s/", NotNegative, c.integral),
        ("derivative", "derivative gain", "s/", Finite, c.derivative),
        (
            "velocity_feedforward",
            "velocity feed-forward",
            "s/",
            Finite,
            c.velocity_feedforward,
        ),
        (
            "acceleration_feedforward",
            "acceleration feed-forward",
            "s^2/",
            Finite,
            c.acceleration_feedforward,
        ),
    ] {
        number(
            joint,
            &key_path(key),
            what,
            &format!("{per}{unit}"),
            requirement,
            value,
        )?;
    }
    number(
        joint,
        &key_path("bias"),
        "constant share",
        "1",
        Finite,
        c.bias,
    )?;
    if let Some(limit) = c.limit {
        number(
            joint,
            &key_path("limit"),
            "largest share of the supply",
            "1",
            Positive,
            limit,
        )?;
    }
    for (place, what, requirement) in [
        (0, "supply without load", Positive),
        (1, "change of the supply", Finite),
    ] {
        let key_path = [
            Step::Key("voltage_controller"),
            Step::Key("supply"),
            Step::At(place),
        ];
        number(joint, &key_path, what, "V", requirement, c.supply[place])?;
    }
    Ok(())
}
