//! A chain of arbitrary joint axes → modified Denavit–Hartenberg frames.
//!
//! z of frame i is the joint's own axis, so that q keeps its sense and, through the offsets theta and d,
//! its zero. x of frame i lies along the common normal to the next axis; frame 0 takes z from the base
//! link, so that gravity stays (0, 0, −g).

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::angles::{angle_about, squared_poses, squared_theta, told};
use super::drive::Drive;
use super::flange::Flange;
use super::follower::Follower;
use super::frame::step;
use super::joint::{Joint, JointKind};
use super::right_angle::{ROUNDING, right_angle};
use super::serial_robot::Robot;
use super::urdf::{Body, Chain, Mimic};
use super::worth::Origin;
use rig_output::format_significant;

/// Axes closer to parallel than this are parallel, rad. [`squared_poses`] leaves no angles between rounding and its own
/// limit.
const PARALLEL: f64 = 1e-6;

/// Ratio of a frame's distance to the total length of all links above which a remark is given: no mass is there.
const FAR: f64 = 30.0;

/// The converted robot, and the poses that relate its frames to those of the URDF.
pub(super) struct Converted {
    pub robot: Robot,
    /// Frame 0 in the base link's frame.
    pub base: Isometry3<f64>,
    /// Pose of each body's own frame (the frame of the link that its axis moves) in frame i, in the order of the chain.
    pub links: Vec<Isometry3<f64>>,
    /// Angles that were replaced and frames that lie far away, one sentence for each kind.
    pub remarks: Vec<String>,
    /// Those of the remarks that need no action.
    pub notes: Vec<String>,
}

/// A line in the base link's frame.
#[derive(Clone, Copy)]
struct Line {
    point: Vector3<f64>,
    direction: Vector3<f64>,
}

/// Returns the origin on `line` and the direction x of the common normal to `next`. If these are not unique, keeps
/// `foot` as origin and `x` as direction as far as possible.
fn common_normal(
    line: Line,
    next: Line,
    foot: Vector3<f64>,
    x: Vector3<f64>,
) -> (Vector3<f64>, Vector3<f64>) {
    let z = line.direction;
    let cross = z.cross(&next.direction);
    let sine = cross.norm();
    if sine < PARALLEL {
        let to_next = next.point - foot;
        let across = to_next - z * to_next.dot(&z);
        return match across.try_normalize(ROUNDING) {
            Some(direction) => (foot, direction),
            None => (foot, x),
        };
    }
    // Foot of the common normal on `line`: solve line.point + s·z + u·cross = next.point + v·next.direction for s.
    let s = (next.point - line.point).cross(&next.direction).dot(&cross) / (sine * sine);
    let origin = line.point + z * s;
    let normal = cross / sine;
    let distance = (next.point - origin).dot(&normal);
    let forward = if distance.abs() > ROUNDING {
        distance > 0.0
    } else {
        normal.dot(&x) >= -ROUNDING
    };
    (origin, if forward { normal } else { -normal })
}

fn snap_angle(angle: f64) -> f64 {
    right_angle(angle, ROUNDING).unwrap_or(angle)
}

fn snap_length(length: f64) -> f64 {
    if length.abs() < ROUNDING { 0.0 } else { length }
}

/// Returns frame 0 in the base link's frame, by the first axis.
fn base_frame(first: Line) -> Isometry3<f64> {
    let base_line = Line {
        point: Vector3::zeros(),
        direction: Vector3::z(),
    };
    let (origin, x) = common_normal(base_line, first, Vector3::zeros(), Vector3::x());
    let y = Vector3::z().cross(&x);
    let rotation = UnitQuaternion::from_basis_unchecked(&[x, y, Vector3::z()]);
    Isometry3::from_parts(origin.into(), rotation)
}

/// Converts a URDF chain. Never fails: every chain of axes has such frames.
pub(super) fn convert(chain: &Chain) -> Converted {
    let (poses, mut turned) = squared_poses(chain);
    let mut remarks = Vec::new();
    let lengths = (chain.bodies.iter()).map(|own| own.origin.translation.vector.norm());
    let reach: f64 = lengths.sum();
    let axis_of = |i: usize| Line {
        point: poses[i].translation.vector,
        direction: poses[i].rotation * chain.bodies[i].axis,
    };
    let base = base_frame(axis_of(0));

    // Each frame is placed relative to the frame that the parameters produce so far. So neither the snapping above nor
    // the file's rounding accumulates along the chain.
    let mut frame = base;
    let (mut joints, mut followers): (Vec<Joint>, Vec<Follower>) = (Vec::new(), Vec::new());
    let mut links = Vec::new();
    for (i, body) in chain.bodies.iter().enumerate() {
        let line = axis_of(i);
        let x_before = frame.rotation * Vector3::x();
        let z_before = frame.rotation * Vector3::z();
        let alpha = snap_angle(angle_about(z_before, line.direction, x_before));
        let a = snap_length((line.point - frame.translation.vector).dot(&x_before));
        let bent = frame * step(alpha, a, 0.0, 0.0);
        let z = bent.rotation * Vector3::z();
        // Intersection of normal and axis: the default origin if the next axis does not fix it.
        let foot = bent.translation.vector;
        let (origin, x) = if i + 1 < chain.bodies.len() {
            common_normal(
                Line {
                    point: foot,
                    direction: z,
                },
                axis_of(i + 1),
                foot,
                x_before,
            )
        } else {
            (foot, x_before)
        };
        let mut theta = snap_angle(angle_about(x_before, x, z));
        if body.kind == JointKind::Prismatic
            && let Some((exact, joint)) = squared_theta(&chain.file, body, theta)
        {
            theta = exact;
            turned.extend(joint);
        }
        let d = snap_length((origin - foot).dot(&z));
        let far = a.abs().max(d.abs());
        if far > FAR * reach {
            remarks.push(far_normal(&chain.file, body, far));
        }
        frame = bent * step(0.0, 0.0, theta, d);
        let link = frame.inverse() * poses[i];
        let made = joint(body, [alpha, a, theta, d], &link);
        match &body.mimic {
            None => joints.push(made),
            Some(mimic) => {
                let after = joints.last().map(|own| own.name.clone());
                followers.push(follower(made, mimic, after));
            }
        }
        links.push(link);
    }
    let robot = Robot {
        origin: Origin::Urdf,
        followers,
        flange: Flange::of(&(links.last().copied().unwrap_or_default() * chain.tip)),
        ..Robot::new(&chain.name, joints)
    };
    let notes = told(&chain.file, turned);
    remarks.extend(notes.iter().cloned());
    Converted {
        robot,
        base,
        links,
        remarks,
        notes,
    }
}

/// Returns a remark on two axes whose common normal lies `far` (m) away.
fn far_normal(file: &str, body: &Body, far: f64) -> String {
    format!(
        "{file}:{}: about joint `{}` axes are so little off parallel that their common normal lies {} m away; parameters there cannot be told apart. Where the axes are meant parallel, write them so.",
        body.place,
        body.joint,
        format_significant(far, 3)
    )
}

fn joint(body: &Body, geometry: [f64; 4], link_in_frame: &Isometry3<f64>) -> Joint {
    Joint {
        inertial: Some(body.inertia.seen_from(link_in_frame).inertial()),
        limits: body.limits.clone(),
        friction: body.friction.clone(),
        drive: drive(body),
        ..Joint::new(&body.joint, body.kind, geometry)
    }
}

/// Returns the axis of `made` as one that follows a joint. `after`: the joint before it.
fn follower(made: Joint, mimic: &Mimic, after: Option<String>) -> Follower {
    Follower {
        name: made.name,
        follows: mimic.joint.clone(),
        ratio: mimic.ratio,
        offset: mimic.offset,
        after,
        kind: made.kind,
        alpha: made.alpha,
        a: made.a,
        theta: made.theta,
        d: made.d,
        inertial: made.inertial,
    }
}

/// Returns the drive that the file states. Without a gear the motor turns with the joint.
fn drive(body: &Body) -> Option<Drive> {
    (body.reduction.is_some() || body.rotor_inertia.is_some()).then(|| Drive {
        gear_ratio: body.reduction.unwrap_or(1.0),
        rotor_inertia: body.rotor_inertia.unwrap_or(0.0),
        ..Drive::default()
    })
}

/// Pose of frame i in frame i−1 at joint coordinate `q`.
#[cfg(test)]
pub(super) fn joint_pose(joint: &Joint, q: f64) -> Isometry3<f64> {
    match joint.kind {
        JointKind::Revolute => step(joint.alpha, joint.a, joint.theta + q, joint.d),
        JointKind::Prismatic => step(joint.alpha, joint.a, joint.theta, joint.d + q),
    }
}

#[cfg(test)]
#[path = "dh_test.rs"]
pub(in crate::robot) mod tests;
