//! A URDF file as its author wrote it, with replaced values.
//!
//! Everything except the values of the dynamics stays byte for byte: names, frames, meshes, comments, order. Values are
//! converted to the file's own link frames. Links that are fixed to each other form one body with one inertia that
//! cannot be divided. It is written into the link that the joint moves, and removed from the others.

use std::path::Path;

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rig_shared::multibody::{COLUMNS, column};
use roxmltree::Document;

use super::chain::{Body, Chain};
use super::choice::ChainChoice;
use super::edits::{Edit, at, put_friction, put_inertia, put_rotor, spliced};
use super::prefixes::declared;
use super::read::read;
use super::reader::{Xml, parsed};
use super::spatial::SpatialInertia;
use super::transmissions::rotor_of;
use super::unit_check::check_units;
use super::write::{Urdf, comment, escaped, levelled, rpy};
use crate::robot::dh::convert;
use crate::robot::error::RobotError;
use crate::robot::joint::{Inertial, Joint};
use crate::robot::serial_robot::Robot;

/// Values that agree within this share of the largest of their kind are equal: the rounding of a change of frames.
const ROUNDING: f64 = 1e-12;
/// Frames are those of the file if their parameters agree within this, rad and m.
const SAME_FRAME: f64 = 1e-9;

/// A URDF file, and the description read from it.
#[derive(Debug)]
pub struct Original {
    text: String,
    chain: Chain,
    robot: Robot,
    /// Frame 0 in the base link's frame.
    base: Isometry3<f64>,
    /// The frame of each moved link in its joint's frame of the description.
    links: Vec<Isometry3<f64>>,
}

impl Original {
    /// Reads the text of a file; `path` only names it in messages.
    ///
    /// # Errors
    /// [`RobotError`], as [`Robot::from_urdf`].
    pub fn read(text: String, path: &Path) -> Result<Self, RobotError> {
        Self::read_chain(text, path, &ChainChoice::default())
    }

    /// As [`Self::read`], for the chain that `choice` selects.
    ///
    /// # Errors
    /// [`RobotError`], as [`Robot::from_urdf`], also if the choice does not fit the file.
    pub fn read_chain(text: String, path: &Path, choice: &ChainChoice) -> Result<Self, RobotError> {
        let mut chain = read(&text, path, choice)?;
        let converted = convert(&chain);
        check_units(&chain, &converted.robot, path)?;
        chain.remarks.extend(converted.remarks);
        chain.notes.extend(converted.notes);
        // Written files have the declarations: edits are places in this text.
        let text = declared(&text).text.into_owned();
        Ok(Self {
            text,
            chain,
            robot: converted.robot,
            base: converted.base,
            links: converted.links,
        })
    }

    /// Returns the description.
    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    /// Returns the remarks on the file, one sentence each.
    pub fn remarks(&self) -> &[String] {
        &self.chain.remarks
    }

    /// Returns those of the remarks that need no action.
    pub fn notes(&self) -> &[String] {
        &self.chain.notes
    }

    /// Returns the chain as it was read.
    #[cfg(test)]
    pub(super) fn chain_for_tests(&self) -> &Chain {
        &self.chain
    }

    /// Returns the link that the chain ends at. Its frame is the flange.
    pub fn tip(&self) -> &str {
        &self.chain.tip_link
    }

    /// Returns the links beyond [`Self::tip`] that fixed joints hold, and that have another frame.
    pub fn beyond_tip(&self) -> &[String] {
        &self.chain.beyond_tip
    }

    /// Returns the name of link `link` (from 0; those of joints before those of followers).
    pub fn link(&self, link: usize) -> Option<&str> {
        let order = self.robot.links_outwards();
        let axis = order.iter().position(|own| *own == link)?;
        self.chain.bodies.get(axis).map(|body| body.link.as_str())
    }

    /// Returns the file with those inertias and frictions of `robot` that differ, and remarks on what URDF cannot hold.
    ///
    /// If gravity has another direction than in the file, a level link is inserted above the base link.
    ///
    /// # Errors
    /// [`RobotError::NotUrdf`] if a joint of `robot` is not in the file, or its values cannot be written.
    pub fn with_values(&self, robot: &Robot) -> Result<Urdf, RobotError> {
        self.same_chain(robot)?;
        let document = parsed(&self.text, Path::new(&self.chain.name))?;
        let mut edits = Vec::new();
        let mut remarks = Vec::new();
        let rows = robot.standard_parameters();
        let replaced = self.put_values(robot, &rows, &document, &mut edits, &mut remarks)?;
        if let Some(remark) = replaced.remark(&robot.name) {
            remarks.insert(0, remark);
        }
        self.level(&document, robot, &mut edits, &mut remarks);
        let rotors: Vec<bool> = (self.chain.bodies.iter())
            .filter(|body| body.mimic.is_none())
            .map(|body| body.rotor_inertia.is_some())
            .collect();
        robot.left_out(&rows, &rotors, &mut remarks);
        if edits.is_empty() {
            return Ok(Urdf {
                text: self.text.clone(),
                remarks,
            });
        }
        let newline = if self.text.contains("\r\n") {
            "\r\n"
        } else {
            "\n"
        };
        edits.push(Edit {
            range: at(document.root_element().range().start),
            text: remarks
                .iter()
                .map(|remark| comment(remark) + "\n")
                .collect(),
        });
        for edit in &mut edits {
            edit.text = edit.text.replace('\n', newline);
        }
        Ok(Urdf {
            text: spliced(&self.text, edits),
            remarks,
        })
    }

    /// Writes the inertias and frictions of `robot` that differ from the file's. `rows`: its standard parameters.
    fn put_values<'a>(
        &'a self,
        robot: &'a Robot,
        rows: &[[f64; COLUMNS]],
        document: &Document<'_>,
        edits: &mut Vec<Edit>,
        remarks: &mut Vec<String>,
    ) -> Result<Replaced<'a>, RobotError> {
        let mut replaced = Replaced::default();
        let before = self.robot.standard_parameters();
        let (bodies, chosen) = robot.with_bodies();
        for (axis, k) in robot.links_outwards().into_iter().enumerate() {
            let body = &self.chain.bodies[axis];
            if let (Some(inertial), Some(written)) =
                (robot.link_inertial(k), bodies.link_inertial(k))
                && (self.robot.link_inertial(k)).is_none_or(|own| !same(own, inertial))
            {
                // What is behind locked joints stays in its own links.
                let seen = SpatialInertia::of(written)
                    .seen_from(&self.links[axis].inverse())
                    .minus(&body.locked);
                let (link, merged) = put_inertia(document, body, &seen, edits).map_err(|why| {
                    RobotError::NotUrdf {
                        joint: robot.link_name(k).to_owned(),
                        why,
                    }
                })?;
                replaced.inertias.push(link);
                remarks.extend(merged);
            }
            let Some(joint) = robot.joints.get(k) else {
                continue;
            };
            let places = [column::VISCOUS, column::COULOMB];
            let [new, old] = [rows, &before].map(|rows| places.map(|place| rows[k][place]));
            if new != old && put_friction(document, &joint.name, new, edits) {
                replaced.frictions.push(joint.name.as_str());
                self.without_own_friction(document, &joint.name, edits);
            }
            let [new, old] = [rows, &before].map(|rows| rows[k][column::DRIVE_INERTIA]);
            if body.rotor_inertia.is_some() && new != old {
                let rotor = new / joint.gear_ratio().powi(2);
                put_rotor(
                    &rotor_of(document.root_element(), &joint.name),
                    rotor,
                    edits,
                );
                replaced.rotors.push(joint.name.as_str());
            }
        }
        if !replaced.inertias.is_empty() {
            remarks.extend(chosen);
        }
        Ok(replaced)
    }

    /// Removes the friction of the followers of a joint: that of the joint holds it.
    fn without_own_friction(&self, document: &Document<'_>, joint: &str, edits: &mut Vec<Edit>) {
        let follows = |body: &&Body| body.mimic.as_ref().is_some_and(|own| own.joint == joint);
        for body in self.chain.bodies.iter().filter(follows) {
            if body.friction.is_some() {
                put_friction(document, &body.joint, [0.0; 2], edits);
            }
        }
    }

    /// Refuses a description with other joints, followers or frames.
    fn same_chain(&self, robot: &Robot) -> Result<(), RobotError> {
        let numbers = |j: &Joint| [j.alpha, j.a, j.theta, j.d];
        let gears = |robot: &Robot| -> Vec<_> {
            (robot.followers.iter())
                .map(|own| (own.name.clone(), own.follows.clone(), own.ratio, own.offset))
                .collect()
        };
        let not_representable = |joint: &Joint, why: String| RobotError::NotUrdf {
            joint: joint.name.clone(),
            why,
        };
        for (joint, own) in robot.axes().iter().zip(&self.robot.axes()) {
            if joint.name != own.name || joint.kind != own.kind {
                return Err(not_representable(
                    joint,
                    format!("stands where the URDF file has joint `{}`", own.name),
                ));
            }
            if numbers(joint)
                .iter()
                .zip(numbers(own))
                .any(|(a, b)| (a - b).abs() > SAME_FRAME)
            {
                return Err(not_representable(
                    joint,
                    "has another frame (alpha, a, theta, d) than the one that the URDF file gives it".into(),
                ));
            }
        }
        if gears(robot) != gears(&self.robot)
            && let Some(own) = robot.followers.first().or(self.robot.followers.first())
        {
            return Err(not_representable(
                &own.as_joint(),
                "follows a joint in another way than <mimic> of the URDF file says".into(),
            ));
        }
        let (n, own) = (robot.joints.len(), self.robot.joints.len());
        if let Some(joint) = robot.joints.get(own).or_else(|| self.robot.joints.get(n)) {
            return Err(not_representable(
                joint,
                format!("is not in both: the description has {n} joints and the URDF file {own}"),
            ));
        }
        Ok(())
    }

    /// Inserts a level link above the base link if gravity is not along its −z.
    fn level(
        &self,
        document: &Document<'_>,
        robot: &Robot,
        edits: &mut Vec<Edit>,
        remarks: &mut Vec<String>,
    ) {
        if robot.gravity == self.robot.gravity {
            return;
        }
        let gravity: Vector3<f64> = self.base.rotation * Vector3::from(robot.gravity);
        let Some(rotation) = levelled(gravity, remarks) else {
            return;
        };
        let root = document.root_element();
        let free = |tag: &str, wish: &str| {
            let mut name = wish.to_owned();
            while root
                .children()
                .any(|n| n.has_tag_name(tag) && n.attribute("name") == Some(&name))
            {
                name.push('_');
            }
            name
        };
        let (link, joint) = (
            free("link", "level_world"),
            free("joint", "level_world_to_base"),
        );
        let base = &self.chain.base;
        let degrees = UnitQuaternion::from_rotation_matrix(&rotation)
            .angle()
            .to_degrees();
        remarks.push(format!(
            "Gravity is not along -z of {base}: link {link} is level, and the fixed joint {joint} at the end of the file turns {base} in it by {degrees:.3} degrees. Where the simulator has the base as it stands, give it gravity {:?} m/s^2 in {base} instead, and remove both.",
            [gravity.x, gravity.y, gravity.z]
        ));
        let text = format!(
            "\n  <link name=\"{link}\"/>\n  <joint name=\"{joint}\" type=\"fixed\">\n    <parent link=\"{link}\"/>\n    <child link=\"{}\"/>\n    <origin xyz=\"0 0 0\" rpy=\"{}\"/>\n  </joint>",
            escaped(base),
            rpy(&rotation)
        );
        // Position after the last element; the chain has joints, so there is one.
        if let Some(last) = root.children().rfind(Xml::is_element) {
            edits.push(Edit {
                range: at(last.range().end),
                text,
            });
        }
    }
}

/// Names of what was replaced in a file.
#[derive(Default)]
struct Replaced<'a> {
    /// Links with other inertias.
    inertias: Vec<&'a str>,
    /// Joints with another friction.
    frictions: Vec<&'a str>,
    /// Joints with another rotor.
    rotors: Vec<&'a str>,
}

impl Replaced<'_> {
    /// Returns a sentence on the values that now are those of the description `name`; `None` if there are none.
    fn remark(&self, name: &str) -> Option<String> {
        let listed = |names: &[&str], what: &str| {
            (!names.is_empty()).then(|| format!("{what} of {}", names.join(", ")))
        };
        let replaced: Vec<String> = [
            listed(&self.inertias, "the inertial values"),
            listed(&self.frictions, "damping and friction"),
            listed(&self.rotors, "the rotor inertia"),
        ]
        .into_iter()
        .flatten()
        .collect();
        (!replaced.is_empty()).then(|| {
            format!(
                "Replaced by those of the description \"{name}\", in the links' own frames: {}; everything else is as it was.",
                replaced.join("; ")
            )
        })
    }
}

/// Returns true if both are equal except for rounding.
fn same(a: &Inertial, b: &Inertial) -> bool {
    let alike = |a: &[f64], b: &[f64]| {
        let size = a.iter().chain(b).fold(0.0f64, |m, v| m.max(v.abs()));
        a.iter()
            .zip(b)
            .all(|(a, b)| (a - b).abs() <= ROUNDING * size)
    };
    alike(&[a.mass], &[b.mass])
        && alike(&a.first_moment, &b.first_moment)
        && alike(&a.inertia, &b.inertia)
}

#[cfg(test)]
#[path = "original_test.rs"]
mod tests;
