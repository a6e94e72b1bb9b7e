//! Angles that are multiples of a right angle except for rounded digits.
//!
//! α = 1.5708 is not π/2. Axes that are 7e-6 rad off parallel have a common normal tens of kilometres away and base
//! parameters that are not identifiable. So an angle between neighbouring axes within [`WRITTEN`] of a multiple of π/2
//! is read as that multiple, and the reader gets a remark. Theta of a revolute joint is only an offset of the position
//! and stays unchanged. Theta of a prismatic joint is also an angle between axes.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

use super::error::Place;
use super::joint::JointKind;
use super::right_angle::{ROUNDING, WRITTEN, right_angle};
use super::serial_robot::Robot;
use super::urdf::{Body, Chain};
use rig_output::{format_significant, listed};

/// Returns the multiple of π/2 that `angle` means, if it means one.
fn intended_angle(angle: f64) -> Option<f64> {
    right_angle(angle, WRITTEN)
}

/// Returns the distance of an angle from its multiple, as the end of a sentence.
fn rounding_note(off: f64, exact: f64) -> String {
    let name = match (exact / FRAC_PI_2).round() as i64 {
        0 => "0".to_owned(),
        1 => "π/2".to_owned(),
        -1 => "-π/2".to_owned(),
        2 => "π".to_owned(),
        -2 => "-π".to_owned(),
        quarters => format!("{quarters}·π/2"),
    };
    let off = format_significant(off, 2);
    format!("{off} rad off {name}, and is taken as {name}")
}

/// An angle of a description that was replaced by a multiple of π/2.
pub(super) struct Squared {
    /// Link whose axis it is, from 0.
    pub link: usize,
    /// Key of the angle.
    pub key: &'static str,
    /// The remark without its place.
    pub remark: String,
}

/// Sets the angles of `robot` that mean multiples of a right angle to exact values.
pub(super) fn square(robot: &mut Robot) -> Vec<Squared> {
    let mut all = Vec::new();
    let joints = (robot.joints.iter_mut()).map(|own| {
        let angles = [&mut own.alpha, &mut own.theta];
        ("joint", &own.name, own.kind, angles)
    });
    let followers = (robot.followers.iter_mut()).map(|own| {
        let angles = [&mut own.alpha, &mut own.theta];
        ("follower", &own.name, own.kind, angles)
    });
    for (link, (what, name, kind, [alpha, theta])) in joints.chain(followers).enumerate() {
        let slides = kind == JointKind::Prismatic;
        let angles = [("alpha", Some(alpha)), ("theta", slides.then_some(theta))];
        for (key, angle) in angles {
            let Some(angle) = angle else { continue };
            let Some(exact) = intended_angle(*angle) else {
                continue;
            };
            let off = (*angle - exact).abs();
            if off > ROUNDING {
                all.push(Squared {
                    link,
                    key,
                    remark: format!(
                        "{key} of {what} `{name}` is {angle} rad, {}.",
                        rounding_note(off, exact)
                    ),
                });
            }
            *angle = exact;
        }
    }
    all
}

/// A joint of a URDF chain that was turned to a multiple of π/2.
pub(super) struct Turned {
    /// Its name.
    joint: String,
    /// Distance from the multiple, rad.
    off: f64,
    /// The sentence on it alone.
    sentence: String,
    /// Its angle, for a sentence on several joints.
    angle: &'static str,
    /// Where it stands in the file.
    place: Place,
}

/// Returns one sentence for each angle of these joints.
pub(super) fn told(file: &str, mut turned: Vec<Turned>) -> Vec<String> {
    let mut sentences = Vec::new();
    while let Some(angle) = turned.first().map(|own| own.angle) {
        let (same, others): (Vec<_>, Vec<_>) =
            turned.into_iter().partition(|own| own.angle == angle);
        turned = others;
        if let [one] = same.as_slice() {
            sentences.push(one.sentence.clone());
            continue;
        }
        let names: Vec<String> = same.iter().map(|own| format!("`{}`", own.joint)).collect();
        let off = same.iter().map(|own| own.off).fold(0.0, f64::max);
        sentences.push(format!(
            "{file}:{}: {angle} joints {} are up to {} rad off multiples of π/2, and are taken as these.",
            same[0].place,
            listed(&names),
            format_significant(off, 2)
        ));
    }
    sentences
}

/// Returns the poses of the bodies of a URDF chain in the base link's frame at zero position, and the turned
/// joints. Neighbouring axes that are nearly parallel or perpendicular become exactly so: a joint turns about its
/// own origin and carries all bodies behind it.
pub(super) fn squared_poses(chain: &Chain) -> (Vec<Isometry3<f64>>, Vec<Turned>) {
    let (mut poses, mut joints) = (Vec::new(), Vec::new());
    let mut pose = Isometry3::identity();
    let mut axes: Vec<Vector3<f64>> = Vec::new();
    for (k, body) in chain.bodies.iter().enumerate() {
        pose *= body.origin;
        let before = axes.last().copied().unwrap_or_else(Vector3::z);
        let other = match k.checked_sub(1) {
            Some(before) => format!("the axis of joint `{}`", chain.bodies[before].joint),
            None => format!("z of base link `{}`", chain.base),
        };
        let axis = pose.rotation * body.axis;
        let angle = between(&before, &axis);
        if let Some(exact) = intended_angle(angle)
            && (angle - exact).abs() > ROUNDING
        {
            let sentence = format!(
                "{}:{}: the axis of joint `{}` stands at {} rad to {other}, {}.",
                chain.file,
                body.place,
                body.joint,
                format_significant(angle, 8),
                rounding_note((angle - exact).abs(), exact)
            );
            joints.push(Turned {
                joint: body.joint.clone(),
                off: (angle - exact).abs(),
                sentence,
                angle: "the axes of",
                place: body.place,
            });
            // Direction along `before`, or across it.
            let square = match axis.dot(&before) {
                cosine if exact == FRAC_PI_2 => axis - before * cosine,
                cosine => before * cosine.signum(),
            };
            pose = turned(&pose, &axis.cross(&square), between(&axis, &square));
        }
        let axis = pose.rotation * body.axis;
        if let Some((about, from)) = slid(chain, &axes) {
            let across = |v: &Vector3<f64>| v - about * v.dot(&about);
            let (from, to) = (across(&from), across(&axis));
            let angle = angle_about(from, to, about);
            if to.norm() > WRITTEN
                && let Some(exact) = intended_angle(angle)
                && (angle - exact).abs() > ROUNDING
            {
                let sentence = format!(
                    "{}:{}: about the axis of prismatic joint `{}`, joint `{}` stands at {} rad to the axes before, {}.",
                    chain.file,
                    body.place,
                    chain.bodies[k - 1].joint,
                    body.joint,
                    format_significant(angle, 8),
                    rounding_note((angle - exact).abs(), exact)
                );
                joints.push(Turned {
                    joint: body.joint.clone(),
                    off: (angle - exact).abs(),
                    sentence,
                    angle: "the turns about a prismatic axis before",
                    place: body.place,
                });
                pose = turned(&pose, &about, exact - angle);
            }
        }
        axes.push(pose.rotation * body.axis);
        poses.push(pose);
    }
    (poses, joints)
}

/// Returns the multiple of π/2 that theta of a prismatic joint means, with the turned joint if theta differs from it.
pub(super) fn squared_theta(file: &str, body: &Body, theta: f64) -> Option<(f64, Option<Turned>)> {
    let exact = intended_angle(theta)?;
    let off = (theta - exact).abs();
    let turned = (off > ROUNDING).then(|| Turned {
        joint: body.joint.clone(),
        off,
        sentence: format!(
            "{file}:{}: theta of prismatic joint `{}` is {theta} rad, {}.",
            body.place,
            body.joint,
            rounding_note(off, exact)
        ),
        angle: "theta of prismatic",
        place: body.place,
    });
    Some((exact, turned))
}

/// If the last joint of `axes` is prismatic: returns its axis, and the last earlier axis that has a fixed angle to the
/// following joint and is not parallel to it.
fn slid(chain: &Chain, axes: &[Vector3<f64>]) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let (about, earlier) = axes.split_last()?;
    let slides = |joint: usize| chain.bodies[joint].kind == JointKind::Prismatic;
    if !slides(earlier.len()) {
        return None;
    }
    let base = Vector3::z();
    let mut fixed = Vec::new();
    for joint in (0..earlier.len()).rev() {
        fixed.push(&earlier[joint]);
        if !slides(joint) {
            break;
        }
    }
    if fixed.len() == earlier.len() && (0..earlier.len()).all(slides) {
        fixed.push(&base);
    }
    let from = fixed
        .into_iter()
        .find(|axis| axis.cross(about).norm() > WRITTEN)?;
    Some((*about, *from))
}

/// Angle from `from` to `to` about `about`, rad.
pub(super) fn angle_about(from: Vector3<f64>, to: Vector3<f64>, about: Vector3<f64>) -> f64 {
    from.cross(&to).dot(&about).atan2(from.dot(&to))
}

/// Angle between two directions, rad, exact where it is small.
fn between(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}

/// Returns `pose` turned about its own origin.
fn turned(pose: &Isometry3<f64>, about: &Vector3<f64>, angle: f64) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_axis_angle(&Unit::new_normalize(*about), angle);
    Isometry3::from_parts(
        Translation3::from(pose.translation.vector),
        turn * pose.rotation,
    )
}
