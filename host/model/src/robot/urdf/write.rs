//! Writes a description as URDF.
//!
//! Link frames are the description's own (modified Denavit–Hartenberg), so that every joint turns about z of its frame
//! and keeps its zero and sense. Remarks name the values that URDF cannot hold: constant torques, couplings between
//! drives and their rotors, effects, and a size of gravity that differs from the one its readers assume.

use std::collections::HashSet;
use std::fmt::Write as _;

use nalgebra::{Isometry3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};
use rig_shared::multibody::column;
use rig_shared::transmission::DriveKind;

use super::spatial::SpatialInertia;
use crate::robot::error::RobotError;
use crate::robot::follower::Follower;
use crate::robot::frame::{GRAVITY, roll_pitch_yaw, step};
use crate::robot::joint::{Joint, JointKind, JointLimits};
use crate::robot::serial_robot::Robot;

/// Limit written if the description has none: URDF demands one.
const NO_LIMIT: f64 = 1e6;

/// A description as URDF, with remarks on values that it cannot hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Urdf {
    /// The file.
    pub text: String,
    /// Remarks, one sentence each.
    pub remarks: Vec<String>,
}

impl Robot {
    /// Returns the description as URDF text. [`Robot::from_urdf`] reads back a chain with the same dynamics. Inertia
    /// that no motion of the robot shows is chosen so that each link is a possible body.
    ///
    /// # Errors
    /// [`RobotError::NotUrdf`] if a link has no inertial parameters, or a first moment without a mass.
    pub fn to_urdf(&self) -> Result<Urdf, RobotError> {
        let (bodies, mut remarks) = self.with_bodies();
        let mut taken: HashSet<String> = HashSet::new();
        let mut name = |wish: String| {
            let mut name = wish;
            while !taken.insert(name.clone()) {
                name.push('_');
            }
            name
        };
        let mut body = String::new();
        // Gazebo passes over a base without inertia and all behind it, unless it is the world.
        let base = name("world".into());
        let tilt = levelled(Vector3::from(self.gravity), &mut remarks);
        // Writing to a String cannot fail.
        let _ = writeln!(body, "  <link name=\"{base}\"/>");
        if let Some(rotation) = &tilt {
            let (fixed, frame) = (self.free_name("world_to_base"), name("base_link".into()));
            remarks.push(format!("Gravity is not along -z of the base: link {base} is level, and frame 0 of the description stands in it as link {frame}."));
            let _ = writeln!(
                body,
                "  <link name=\"{frame}\"/>\n  <joint name=\"{fixed}\" type=\"fixed\">\n    <parent link=\"{base}\"/>\n    <child link=\"{frame}\"/>\n    <origin xyz=\"0 0 0\" rpy=\"{}\"/>\n  </joint>",
                rpy(rotation)
            );
        }
        let lean = tilt.unwrap_or_else(Rotation3::identity);
        let parameters = self.standard_parameters();
        let parent = self.write_links(&bodies, (base, lean), &mut name, &mut body, &mut remarks)?;
        if !self.flange.is_last_joint() {
            let (link, joint) = (name("flange".into()), self.free_name("last_to_flange"));
            let pose = self.flange_pose();
            let _ = writeln!(
                body,
                "  <link name=\"{link}\"/>\n  <joint name=\"{joint}\" type=\"fixed\">\n    <parent link=\"{parent}\"/>\n    <child link=\"{link}\"/>\n    <origin xyz=\"{}\" rpy=\"{}\"/>\n  </joint>",
                three(&pose.translation.vector),
                rpy(&pose.rotation.to_rotation_matrix())
            );
            remarks.push(format!(
                "The flange frame is that of link {link}: end the chain there, with --tip {link}."
            ));
        }
        let rotors = self.write_transmissions(&mut body);
        self.left_out(&parameters, &rotors, &mut remarks);
        let mut text = String::from("<?xml version=\"1.0\"?>\n");
        for remark in &remarks {
            let _ = writeln!(text, "{}", comment(remark));
        }
        let limited =
            |joint: &Joint| (joint.limits.as_ref()).is_some_and(|l| l.acceleration.is_some());
        let drake = match rotors.contains(&true) || self.joints.iter().any(limited) {
            true => " xmlns:drake=\"http://drake.mit.edu\"",
            false => "",
        };
        let _ = writeln!(text, "<robot name=\"{}\"{drake}>", escaped(&self.name));
        text.push_str(&body);
        text.push_str("</robot>\n");
        Ok(Urdf { text, remarks })
    }

    /// Writes links and joints outwards from the world, in which frame 0 leans. `bodies`: the robot with inertias as they are
    /// written; `name`: makes a name unique. Returns the last link.
    fn write_links(
        &self,
        bodies: &Self,
        (world, lean): (String, Rotation3<f64>),
        name: &mut impl FnMut(String) -> String,
        out: &mut String,
        remarks: &mut Vec<String>,
    ) -> Result<String, RobotError> {
        let parameters = self.standard_parameters();
        let mut parent = world;
        let mut before = Isometry3::from_parts(Translation3::identity(), lean.into());
        for number in bodies.links_outwards() {
            let Some(mut joint) = bodies.link_as_joint(number) else {
                continue;
            };
            let follower = (number.checked_sub(self.joints.len())).map(|k| &bodies.followers[k]);
            if let Some(own) = follower {
                joint.limits = self.followed_limits(own);
            }
            let link = name(format!("{}_link", escaped(&joint.name)));
            write_link(out, &joint, &link)?;
            let row = &parameters[number];
            let (viscous, coulomb) = (row[column::VISCOUS], row[column::COULOMB]);
            let pose = before * step(joint.alpha, joint.a, joint.theta, joint.d);
            before = Isometry3::identity();
            write_joint(
                out,
                (&joint, pose),
                follower,
                [&parent, &link],
                [viscous, coulomb],
                remarks,
            );
            parent = link;
        }
        Ok(parent)
    }

    /// Returns the limits of the axis of a follower, which are those of its joint.
    fn followed_limits(&self, follower: &Follower) -> Option<JointLimits> {
        let joint = self.joint_index(&follower.follows)?;
        let own = self.joints[joint].limits.as_ref()?;
        let turned = |[low, high]: [f64; 2]| {
            let [a, b] = [low, high].map(|q| follower.ratio * q + follower.offset);
            [a.min(b), a.max(b)]
        };
        Some(JointLimits {
            position: turned(own.position),
            soft_position: None,
            velocity: own.velocity * follower.ratio.abs(),
            acceleration: None,
            // URDF demands a number; the motor is that of the joint.
            torque: own.torque,
        })
    }

    /// Returns a name for a fixed joint that no joint of the robot has.
    fn free_name(&self, wish: &str) -> String {
        let mut name = wish.to_owned();
        let taken = |name: &str| (0..self.link_count()).any(|link| self.link_name(link) == name);
        while taken(&name) {
            name.push('_');
        }
        name
    }

    /// Writes gear ratios, and rotors as Drake reads them ("Supported formats", multibody parsing). Returns, for each joint,
    /// whether its rotor is written.
    fn write_transmissions(&self, out: &mut String) -> Vec<bool> {
        let mut rotors = vec![false; self.joints.len()];
        for (k, (joint, kind)) in self.joints.iter().zip(self.drive_kinds()).enumerate() {
            let Some(drive) = &joint.drive else { continue };
            let square = drive.gear_ratio * drive.gear_ratio;
            let rotor_inertia = drive.rotor_inertia + drive.joint_inertia / square;
            rotors[k] = kind == DriveKind::Simple && rotor_inertia > 0.0;
            if kind != DriveKind::Simple || drive.gear_ratio == 1.0 && !rotors[k] {
                continue;
            }
            let rotor = match rotors[k] {
                true => format!(
                    "      <drake:gear_ratio value=\"{:?}\"/>\n      <drake:rotor_inertia value=\"{:?}\"/>\n",
                    drive.gear_ratio, rotor_inertia
                ),
                false => String::new(),
            };
            let name = escaped(&joint.name);
            let _ = writeln!(
                out,
                "  <transmission name=\"{name}_transmission\">\n    <type>transmission_interface/SimpleTransmission</type>\n    <joint name=\"{name}\">\n      <hardwareInterface>hardware_interface/EffortJointInterface</hardwareInterface>\n    </joint>\n    <actuator name=\"{name}_motor\">\n      <mechanicalReduction>{:?}</mechanicalReduction>\n{rotor}    </actuator>\n  </transmission>",
                drive.gear_ratio
            );
        }
        rotors
    }
}

/// Returns the frame of this gravity in a world with gravity along −z; `None` if gravity already is along −z.
pub(super) fn levelled(gravity: Vector3<f64>, remarks: &mut Vec<String>) -> Option<Rotation3<f64>> {
    let size = gravity.norm();
    if (size - GRAVITY).abs() > 1e-9 {
        remarks.push(format!(
            "URDF states no gravity, and its readers assume {GRAVITY} m/s^2 along -z; this description has {size} m/s^2: set it in the program that loads the file."
        ));
    }
    let down = Unit::try_new(gravity, 1e-12)?;
    if down.x == 0.0 && down.y == 0.0 && down.z < 0.0 {
        return None;
    }
    let turn = UnitQuaternion::rotation_between(&down, &-Vector3::z_axis())
        // Upside down: any half turn about a level axis is correct.
        .unwrap_or_else(|| {
            UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
        });
    Some(turn.to_rotation_matrix())
}

/// Returns `<inertial>` of a body about its centre of mass, in lines that begin with `indent`.
///
/// # Errors
/// The obstacle, as the rest of a sentence about the joint.
pub(super) fn inertial_element(body: &SpatialInertia, indent: &str) -> Result<String, String> {
    let (centre, i) = body.about_centre().ok_or(
        "has a first moment but no mass, so it has no centre of mass, which URDF is written about",
    )?;
    Ok(format!(
        "<inertial>\n{indent}  <origin xyz=\"{}\" rpy=\"0 0 0\"/>\n{indent}  <mass value=\"{:?}\"/>\n{indent}  <inertia ixx=\"{:?}\" ixy=\"{:?}\" ixz=\"{:?}\" iyy=\"{:?}\" iyz=\"{:?}\" izz=\"{:?}\"/>\n{indent}</inertial>",
        three(&centre),
        body.mass,
        i.m11,
        i.m12,
        i.m13,
        i.m22,
        i.m23,
        i.m33
    ))
}

fn write_link(out: &mut String, joint: &Joint, link: &str) -> Result<(), RobotError> {
    let refused = |why: String| RobotError::NotUrdf {
        joint: joint.name.clone(),
        why,
    };
    let inertial = joint.inertial.as_ref().ok_or_else(|| {
        refused("has no [joint.inertial], which URDF needs of every link that moves".into())
    })?;
    let element = inertial_element(&SpatialInertia::of(inertial), "    ").map_err(refused)?;
    let _ = writeln!(out, "  <link name=\"{link}\">\n    {element}\n  </link>");
    Ok(())
}

/// Kind of a joint in URDF.
#[derive(Clone, Copy, PartialEq, Eq)]
enum UrdfKind {
    Prismatic,
    Revolute,
    /// A revolute joint that turns without end.
    Continuous,
}

impl UrdfKind {
    const fn name(self) -> &'static str {
        match self {
            Self::Prismatic => "prismatic",
            Self::Revolute => "revolute",
            Self::Continuous => "continuous",
        }
    }
}

fn write_joint(
    out: &mut String,
    (joint, pose): (&Joint, Isometry3<f64>),
    follower: Option<&Follower>,
    [parent, link]: [&str; 2],
    [viscous, coulomb]: [f64; 2],
    remarks: &mut Vec<String>,
) {
    let limits = joint.limits.as_ref();
    let position = limits
        .map(|l| l.position)
        .filter(|[low, high]| low.is_finite() && high.is_finite());
    let kind = match (joint.kind, position) {
        (JointKind::Prismatic, _) => UrdfKind::Prismatic,
        (JointKind::Revolute, Some(_)) => UrdfKind::Revolute,
        (JointKind::Revolute, None) => UrdfKind::Continuous,
    };
    let _ = writeln!(
        out,
        "  <joint name=\"{}\" type=\"{}\">\n    <parent link=\"{parent}\"/>\n    <child link=\"{link}\"/>\n    <origin xyz=\"{}\" rpy=\"{}\"/>\n    <axis xyz=\"0 0 1\"/>",
        escaped(&joint.name),
        kind.name(),
        three(&pose.translation.vector),
        rpy(&pose.rotation.to_rotation_matrix())
    );
    if let Some(own) = follower {
        let _ = writeln!(
            out,
            "    <mimic joint=\"{}\" multiplier=\"{:?}\" offset=\"{:?}\"/>",
            escaped(&own.follows),
            own.ratio,
            own.offset
        );
    }
    write_limits(out, joint, (kind, position), remarks);
    if let Some([low, high]) = limits.and_then(|l| l.soft_position) {
        let _ = writeln!(
            out,
            "    <safety_controller soft_lower_limit=\"{low:?}\" soft_upper_limit=\"{high:?}\" k_velocity=\"0\"/>"
        );
    }
    if viscous != 0.0 || coulomb != 0.0 {
        let _ = writeln!(
            out,
            "    <dynamics damping=\"{viscous:?}\" friction=\"{coulomb:?}\"/>"
        );
    }
    out.push_str("  </joint>\n");
}

/// Writes the limits of a joint; for those that are not known, numbers that nothing reaches, and a remark.
fn write_limits(
    out: &mut String,
    joint: &Joint,
    (kind, position): (UrdfKind, Option<[f64; 2]>),
    remarks: &mut Vec<String>,
) {
    let limits = joint.limits.as_ref();
    let torque = limits.and_then(|l| l.torque);
    if limits.is_some() || kind == UrdfKind::Prismatic {
        let mut unknown = Vec::new();
        let mut known = |value: Option<f64>, what: &'static str| {
            value.unwrap_or_else(|| {
                unknown.push(what);
                NO_LIMIT
            })
        };
        let range = match (kind, position) {
            (UrdfKind::Continuous, _) => String::new(),
            (_, Some([low, high])) => format!("lower=\"{low:?}\" upper=\"{high:?}\" "),
            (_, None) => {
                let far = known(None, "position");
                format!("lower=\"{:?}\" upper=\"{far:?}\" ", -far)
            }
        };
        let velocity = known(limits.and_then(JointLimits::known_velocity), "velocity");
        let effort = known(torque, "effort");
        let acceleration = limits.and_then(|l| l.acceleration);
        let acceleration = acceleration.map_or(String::new(), |own| {
            format!(" drake:acceleration=\"{own:?}\"")
        });
        let _ = writeln!(
            out,
            "    <limit {range}velocity=\"{velocity:?}\" effort=\"{effort:?}\"{acceleration}/>"
        );
        if !unknown.is_empty() {
            remarks.push(format!(
                "The limits of joint {} for {} are not known; {NO_LIMIT:e} stands for them, as URDF demands numbers.",
                joint.name,
                unknown.join(", ")
            ));
        }
    }
}

/// Returns fixed-axis roll, pitch and yaw of a rotation Rz(yaw)·Ry(pitch)·Rx(roll).
pub(super) fn rpy(rotation: &Rotation3<f64>) -> String {
    three(&Vector3::from(roll_pitch_yaw(rotation)))
}

fn three(v: &Vector3<f64>) -> String {
    // Adding zero turns −0 into 0.
    format!("{:?} {:?} {:?}", v.x + 0.0, v.y + 0.0, v.z + 0.0)
}

/// Returns an XML comment. Two dashes would end it, so they are replaced.
pub(super) fn comment(text: &str) -> String {
    let mut text = text.to_owned();
    while text.contains("--") {
        text = text.replace("--", "- -");
    }
    format!("<!-- {text} -->")
}

/// Returns text for an XML attribute.
pub(in crate::robot) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() => {
                let _ = write!(out, "&#{};", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
#[path = "write_test.rs"]
pub(in crate::robot) mod tests;
