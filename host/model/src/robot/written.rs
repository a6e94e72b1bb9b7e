//! Writes a description as TOML, each line with its unit.

use std::fmt::Write as _;

use super::ball_screw_crank::BallScrewCrank;
use super::check_effects::check_effects;
use super::drive::Drive;
use super::effects::{RobotEffect, unit_of};
use super::error::RobotError;
use super::joint::{Controller, Inertial, Joint, JointFriction, JointKind, JointLimits};
use super::serial_robot::Robot;
use super::toml_lines::{float, line, list, optional, quoted, table};
use super::voltage_controller::{AntiWindup, VoltageController};
use super::workspace::Region;

pub(super) fn write(robot: &Robot) -> Result<String, RobotError> {
    let mut out = String::new();
    line(
        &mut out,
        "name",
        &quoted(&robot.name),
        "for titles and files",
    );
    line(
        &mut out,
        "gravity",
        &list(&robot.gravity),
        "in the base frame, m/s^2",
    );
    if robot.joints.is_empty() {
        out.push_str("joint = []\n");
    }
    for joint in &robot.joints {
        write_joint(&mut out, joint);
    }
    for region in &robot.workspace {
        write_region(&mut out, region);
    }
    check_effects(robot).map_err(|fault| RobotError::Write {
        robot: robot.name.clone(),
        message: format!("{} is {}, but {}", fault.what, fault.found, fault.advice),
    })?;
    for effect in &robot.effects {
        write_effect(&mut out, robot, effect);
    }
    if let Some(band) = &robot.identified {
        band.write(&mut out);
    }
    Ok(out)
}

fn write_region(out: &mut String, region: &Region) {
    out.push_str("\n[[workspace]]\n");
    line(
        out,
        "joint",
        &quoted(&region.joint),
        "whose link carries the point",
    );
    line(
        out,
        "point",
        &list(&region.point),
        "m, in that joint's frame",
    );
    for (key, value, comment) in [
        ("min", region.min, "m, x y z in the base frame"),
        ("max", region.max, "m"),
        (
            "normal",
            region.normal,
            "towards the allowed side of a plane",
        ),
    ] {
        if let Some(value) = value {
            line(out, key, &list(&value), comment);
        }
    }
    if let Some(beyond) = region.beyond {
        line(
            out,
            "beyond",
            &float(beyond),
            "m along the normal from the base frame's origin",
        );
    }
}

fn write_joint(out: &mut String, joint: &Joint) {
    let (angle, force) = joint.kind.units();
    write_geometry(out, joint);
    if let Some(i) = &joint.inertial {
        write_inertial(out, i);
    }
    if let Some(l) = &joint.limits {
        write_limits(out, l, angle, force);
    }
    if let Some(f) = &joint.friction {
        write_friction(out, f, angle, force);
    }
    if let Some(d) = &joint.drive {
        write_drive(out, d);
    }
    if let Some(c) = &joint.controller {
        write_controller(out, c, angle, force);
    }
    if let Some(c) = &joint.voltage_controller {
        write_voltage_controller(out, c, angle);
    }
}

fn write_geometry(out: &mut String, joint: &Joint) {
    let kind = match joint.kind {
        JointKind::Revolute => "revolute",
        JointKind::Prismatic => "prismatic",
    };
    out.push_str("\n[[joint]]\n");
    line(out, "name", &quoted(&joint.name), "unique in the robot");
    line(out, "kind", &quoted(kind), "revolute or prismatic");
    line(
        out,
        "alpha",
        &float(joint.alpha),
        "rad, rotation about x of frame i-1 (modified Denavit-Hartenberg)",
    );
    line(
        out,
        "a",
        &float(joint.a),
        "m, translation along x of frame i-1",
    );
    line(
        out,
        "theta",
        &float(joint.theta),
        "rad, rotation about z of frame i (offset where revolute)",
    );
    line(
        out,
        "d",
        &float(joint.d),
        "m, translation along z of frame i (offset where prismatic)",
    );
}

fn write_inertial(out: &mut String, i: &Inertial) {
    out.push_str("\n[joint.inertial]\n");
    line(out, "mass", &float(i.mass), "kg");
    line(
        out,
        "first_moment",
        &list(&i.first_moment),
        "m*c in frame i, kg*m",
    );
    line(
        out,
        "inertia",
        &list(&i.inertia),
        "Ixx Ixy Ixz Iyy Iyz Izz about the origin of frame i, kg*m^2",
    );
}

fn write_limits(out: &mut String, l: &JointLimits, angle: &str, force: &str) {
    out.push_str("\n[joint.limits]\n");
    line(out, "position", &list(&l.position), angle);
    if let Some(soft) = &l.soft_position {
        line(
            out,
            "soft_position",
            &list(soft),
            &format!("{angle}, range of designed motions"),
        );
    }
    line(out, "velocity", &float(l.velocity), &format!("{angle}/s"));
    optional(out, "acceleration", l.acceleration, &format!("{angle}/s^2"));
    optional(out, "torque", l.torque, force);
}

fn write_friction(out: &mut String, f: &JointFriction, angle: &str, force: &str) {
    out.push_str("\n[joint.friction]\n");
    line(out, "coulomb", &float(f.coulomb), force);
    line(
        out,
        "viscous",
        &float(f.viscous),
        &format!("{force}*s/{angle}"),
    );
    line(
        out,
        "offset",
        &float(f.offset),
        &format!("{force}, constant torque or force at the joint"),
    );
}

fn write_controller(out: &mut String, c: &Controller, angle: &str, force: &str) {
    out.push_str("\n[joint.controller]\n");
    line(out, "position_gain", &float(c.position_gain), "1/s");
    line(
        out,
        "velocity_gain",
        &float(c.velocity_gain),
        &format!("controller output per {angle}/s"),
    );
    line(
        out,
        "torque_gain",
        &float(c.torque_gain),
        &format!("{force} per controller output"),
    );
}

fn write_voltage_controller(out: &mut String, c: &VoltageController, angle: &str) {
    out.push_str("\n[joint.voltage_controller]\n");
    line(
        out,
        "proportional",
        &float(c.proportional),
        &format!("share of the supply per {angle} of reference - position"),
    );
    for (key, value, comment) in [
        (
            "integral",
            c.integral,
            format!("per {angle}*s of its integral"),
        ),
        (
            "derivative",
            c.derivative,
            format!("per {angle}/s, taken off"),
        ),
        (
            "velocity_feedforward",
            c.velocity_feedforward,
            format!("per {angle}/s of the reference"),
        ),
        (
            "acceleration_feedforward",
            c.acceleration_feedforward,
            format!("per {angle}/s^2 of the reference"),
        ),
        ("bias", c.bias, "constant share of the supply".to_owned()),
    ] {
        if value != 0.0 {
            line(out, key, &float(value), &comment);
        }
    }
    optional(out, "limit", c.limit, "largest share of the supply");
    if c.anti_windup == AntiWindup::Clamping {
        line(
            out,
            "anti_windup",
            &quoted("clamping"),
            "the integral stands still at the limit; or none",
        );
    }
    line(
        out,
        "supply",
        &list(&c.supply),
        "V without load, V that a share of one changes it by",
    );
}

fn write_drive(out: &mut String, d: &Drive) {
    out.push_str("\n[joint.drive]\n");
    if d.screw.is_none() || d.gear_ratio != 0.0 {
        line(
            out,
            "gear_ratio",
            &float(d.gear_ratio),
            "motor turns per joint turn, negative where the gear reverses",
        );
    }
    if !d.couples.is_empty() {
        line(
            out,
            "couples",
            &table(&d.couples),
            "motor turns per turn of these joints",
        );
    }
    let beyond = [
        (
            "zero",
            d.zero,
            "rad, motor position where all joints are at zero (beyond the screw's)",
        ),
        (
            "joint_inertia",
            d.joint_inertia,
            "kg*m^2 (kg where prismatic), seen at the joint beside the rotors",
        ),
        ("coulomb", d.coulomb, "N*m, on the motor side"),
        ("viscous", d.viscous, "N*m*s/rad, on the motor side"),
    ];
    for (key, value, comment) in beyond {
        if value != 0.0 {
            line(out, key, &float(value), comment);
        }
    }
    line(
        out,
        "rotor_inertia",
        &float(d.rotor_inertia),
        "kg*m^2, on the motor side",
    );
    if d.torque_constant != 0.0 {
        line(
            out,
            "torque_constant",
            &float(d.torque_constant),
            "N*m/A, on the motor side",
        );
    }
    optional(out, "resistance", d.resistance, "ohm");
    optional(out, "inductance", d.inductance, "H");
    optional(
        out,
        "encoder_counts_per_rev",
        d.encoder_counts_per_rev,
        "counts per motor turn after quadrature",
    );
    optional(
        out,
        "duty_full_scale",
        d.duty_full_scale,
        "value of the duty column that is the whole supply",
    );
    if let Some(p) = d.pole_pairs {
        line(out, "pole_pairs", &p.to_string(), "0 where brushed");
    }
    if let Some(s) = &d.screw {
        write_screw(out, s);
    }
}

fn write_screw(out: &mut String, s: &BallScrewCrank) {
    out.push_str("\n[joint.drive.screw]\n");
    line(
        out,
        "lead",
        &float(s.lead),
        "m per motor turn, negative where the screw shortens as the motor turns forwards",
    );
    line(out, "crank", &float(s.crank), "m");
    line(
        out,
        "anchor",
        &list(&s.anchor),
        "m, fixed end of the screw in the crank's plane, the axle at the origin",
    );
    line(
        out,
        "angle",
        &table(&s.angle),
        "turns of the crank per turn of these joints",
    );
    line(
        out,
        "offset",
        &float(s.offset),
        "rad, the crank's angle where all joints are at zero",
    );
    if let Some(range) = &s.range {
        line(
            out,
            "range",
            &list(range),
            "rad, lowest and highest angle of the crank",
        );
    }
}

/// Writes one table, with units in comments.
fn write_effect(out: &mut String, robot: &Robot, effect: &RobotEffect) {
    let about = effect.effect.kind.about();
    // Writing to a String cannot fail.
    let _ = writeln!(out, "\n[[effect]]");
    line(out, "kind", &quoted(about.name), about.title);
    if let Some(law) = about.law {
        line(out, "law", &quoted(law), about.source);
    }
    let joints = [
        ("joint", &effect.joint, "on which it acts"),
        ("other", &effect.other, "whose motion it depends on"),
    ];
    for (key, name, comment) in joints {
        if let Some(name) = name {
            line(out, key, &quoted(name), comment);
        }
    }
    let kind = robot
        .joint_of(effect)
        .map_or(JointKind::Revolute, |j| robot.joints[j].kind);
    for (p, value) in effect.values() {
        let comment = format!("{}, {}", unit_of(p, kind), p.meaning);
        line(out, p.name, &float(value), &comment);
    }
}
