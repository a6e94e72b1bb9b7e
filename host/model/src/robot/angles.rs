//! Angles that are multiples of a right angle but for the digits that they are written with.
//!
//! α = 1.5708 is not π/2, and axes that are 7e-6 rad off parallel have their common normal tens of kilometres away, and
//! base parameters that no motion tells apart. So an angle between neighbouring axes within [`WRITTEN`] of a multiple of π/2 is
//! taken as that multiple when a description is read, and the reader is told of it. Of a revolute joint theta is a mere
//! offset of the position and stays as it is; of a prismatic one it is an angle between axes too.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

use super::urdf::{Body, Chain};
use super::{JointKind, Robot};
use rig_output::format_significant;

/// What four decimals leave of an angle at most, rad: 0.05 mm at the end of a metre, less than a calibration finds.
pub(super) const WRITTEN: f64 = 5e-5;

/// Angles (rad) and lengths (m) closer than this to a multiple of π/2 or to zero are rounding of the arithmetic, of which
/// there is nothing to say.
pub(super) const ROUNDING: f64 = 1e-10;

/// The multiple of π/2 that `angle` stands for, where it stands for one.
fn meant(angle: f64) -> Option<f64> {
    right_angle(angle, WRITTEN)
}

/// The multiple of π/2 that lies closer to `angle` than `tolerance`, rad.
pub(super) fn right_angle(angle: f64, tolerance: f64) -> Option<f64> {
    let exact = (angle / FRAC_PI_2).round() * FRAC_PI_2;
    // Without the sign of a zero.
    ((angle - exact).abs() < tolerance).then_some(exact + 0.0)
}

/// How far `angle` is from the multiple that it is taken as, as the end of a sentence.
fn taken(off: f64, exact: f64) -> String {
    let name = match (exact / FRAC_PI_2).round() as i64 {
        0 => "0".to_owned(),
        1 => "π/2".to_owned(),
        -1 => "-π/2".to_owned(),
        2 => "π".to_owned(),
        -2 => "-π".to_owned(),
        quarters => format!("{quarters}·π/2"),
    };
    format!("{off:.1e} rad off {name}, and is taken as {name}")
}

/// An angle of a description that is taken as another.
pub(super) struct Squared {
    /// Joint, from 0.
    pub joint: usize,
    /// Key of the angle.
    pub key: &'static str,
    /// A sentence without its place.
    pub said: String,
}

/// Makes the angles of `robot` that stand for multiples of a right angle exactly that.
pub(super) fn square(robot: &mut Robot) -> Vec<Squared> {
    let mut all = Vec::new();
    for (number, joint) in robot.joints.iter_mut().enumerate() {
        let slides = joint.kind == JointKind::Prismatic;
        let angles = [
            ("alpha", Some(&mut joint.alpha)),
            ("theta", slides.then_some(&mut joint.theta)),
        ];
        for (key, angle) in angles {
            let Some(angle) = angle else { continue };
            let Some(exact) = meant(*angle) else { continue };
            let off = (*angle - exact).abs();
            if off > ROUNDING {
                all.push(Squared {
                    joint: number,
                    key,
                    said: format!(
                        "{key} of joint `{}` is {angle} rad, {}.",
                        joint.name,
                        taken(off, exact)
                    ),
                });
            }
            *angle = exact;
        }
    }
    all
}

/// Places of the bodies of a URDF chain in the base link's frame at zero position, with neighbouring axes that are nearly
/// parallel or perpendicular made so: a joint is turned about its own place, and all that hangs on it with it. With a
/// sentence for each joint that was turned.
pub(super) fn squared_poses(chain: &Chain) -> (Vec<Isometry3<f64>>, Vec<String>) {
    let (mut poses, mut said) = (Vec::new(), Vec::new());
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
        if let Some(exact) = meant(angle)
            && (angle - exact).abs() > ROUNDING
        {
            said.push(format!(
                "{}:{}: the axis of joint `{}` stands at {} rad to {other}, {}.",
                chain.file,
                body.place,
                body.joint,
                format_significant(angle, 8),
                taken((angle - exact).abs(), exact)
            ));
            // Along `before`, or across it.
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
                && let Some(exact) = meant(angle)
                && (angle - exact).abs() > ROUNDING
            {
                said.push(format!(
                    "{}:{}: about the axis of prismatic joint `{}`, joint `{}` stands at {} rad to the axes before, {}.",
                    chain.file,
                    body.place,
                    chain.bodies[k - 1].joint,
                    body.joint,
                    format_significant(angle, 8),
                    taken((angle - exact).abs(), exact)
                ));
                pose = turned(&pose, &about, exact - angle);
            }
        }
        axes.push(pose.rotation * body.axis);
        poses.push(pose);
    }
    (poses, said)
}

/// The multiple of π/2 that theta of a prismatic joint stands for, as TOML takes it, with a sentence where it is another.
pub(super) fn squared_theta(file: &str, body: &Body, theta: f64) -> Option<(f64, Option<String>)> {
    let exact = meant(theta)?;
    let off = (theta - exact).abs();
    let said = (off > ROUNDING).then(|| {
        format!(
            "{file}:{}: theta of prismatic joint `{}` is {theta} rad, {}.",
            body.place,
            body.joint,
            taken(off, exact)
        )
    });
    Some((exact, said))
}

/// Where the last joint of `axes` slides: its axis, and the last one before that stands at a fixed angle to what follows
/// and is not parallel to it.
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

/// `pose` turned about its own place.
fn turned(pose: &Isometry3<f64>, about: &Vector3<f64>, angle: f64) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_axis_angle(&Unit::new_normalize(*about), angle);
    Isometry3::from_parts(
        Translation3::from(pose.translation.vector),
        turn * pose.rotation,
    )
}
