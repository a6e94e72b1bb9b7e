//! Converts the tree of links to a chain of bodies, each moved by one joint.

use std::cell::RefCell;
use std::path::Path;

use nalgebra::Isometry3;
use rig_shared::multibody::MAX_JOINTS;

use super::chain::{Body, Chain, Mimic};
use super::choice::ChainChoice;
use super::locks::Held;
use super::prefixes::declared;
use super::reader::{Reader, Xml, child, parsed};
use super::selection::Selection;
use super::spatial::SpatialInertia;
use super::transmissions::Motors;
use super::tree::{Motion, Tree, TreeJoint};
use crate::robot::error::RobotError;
use crate::robot::joint::JointKind;
use rig_output::format_significant;

/// Reads the chain that `choice` selects from the text of a file; `path` only names it in messages.
pub(in crate::robot) fn read(
    text: &str,
    path: &Path,
    choice: &ChainChoice,
) -> Result<Chain, RobotError> {
    let declared = declared(text);
    let document = parsed(&declared.text, path)?;
    let remark = (declared.remark()).map(|own| format!("{}: {own}", path.display()));
    let reader = Reader {
        path,
        document: &document,
        remarks: RefCell::new(remark.into_iter().collect()),
        unknown: RefCell::default(),
    };
    let notes = reader.remarks.borrow().clone();
    let mut chain = reader.chain(choice)?;
    chain.notes.splice(0..0, notes);
    Ok(chain)
}

/// A movable joint of the chain with the pose of its parent link in the frame of the body before it.
type Outgoing = (usize, Isometry3<f64>);

/// A joint that is held, as the user is told.
struct LockedJoint {
    joint: usize,
    text: String,
}

/// A link with all links fixed to it.
struct Rigid<'a> {
    /// In the frame of the link.
    inertia: SpatialInertia,
    /// The part that is behind locked joints.
    locked: SpatialInertia,
    /// Links that have an inertia and are not behind a locked joint.
    heavy: Vec<&'a str>,
    /// The next joint of the chain.
    outgoing: Option<Outgoing>,
    /// Joints in it that are locked.
    joints: Vec<LockedJoint>,
    /// Pose of the link that the chain ends at, if it is a part of this body.
    tip: Option<Isometry3<f64>>,
}

/// A place in a rigid body: a link, its pose, and whether a locked joint lies before it.
type Part<'a> = (&'a str, Isometry3<f64>, bool);

/// What is needed to read the bodies.
struct Selected<'t, 'a> {
    tree: &'t Tree<'a>,
    selection: &'t Selection<'a>,
}

impl<'a> Selected<'_, 'a> {
    /// Joins `link` with all links fixed to it and those behind locked joints.
    fn rigid_body(&self, reader: &Reader<'a>, link: &'a str) -> Result<Rigid<'a>, RobotError> {
        let mut rigid = Rigid {
            inertia: SpatialInertia::zero(),
            locked: SpatialInertia::zero(),
            heavy: Vec::new(),
            outgoing: None,
            joints: Vec::new(),
            tip: None,
        };
        let mut pending: Vec<Part<'a>> = vec![(link, Isometry3::identity(), false)];
        while let Some((name, pose, behind)) = pending.pop() {
            if name == self.selection.tip {
                rigid.tip = Some(pose);
            }
            if let Some(&node) = self.tree.by_name.get(name)
                && let Some(part) = reader.inertial(node)?
            {
                let part = part.seen_from(&pose);
                rigid.inertia = rigid.inertia.plus(&part);
                if behind {
                    rigid.locked = rigid.locked.plus(&part);
                } else {
                    rigid.heavy.push(name);
                }
            }
            for index in self.tree.below(name) {
                let joint = &self.tree.joints[index];
                if self.selection.active.contains(&index) {
                    rigid.outgoing = Some((index, pose));
                } else if joint.motion == Motion::Fixed {
                    pending.push((joint.child, pose * reader.origin(joint.node)?, behind));
                } else {
                    let (text, own) = self.locked(reader, index)?;
                    rigid.joints.push(LockedJoint { joint: index, text });
                    pending.push((joint.child, pose * own, true));
                }
            }
        }
        Ok(rigid)
    }

    /// Returns the links beyond the tip that fixed joints hold, and whose frames differ from its own.
    fn beyond_tip(&self, reader: &Reader<'a>) -> Result<Vec<String>, RobotError> {
        let mut found = Vec::new();
        let mut pending = vec![(self.selection.tip, Isometry3::identity())];
        while let Some((link, pose)) = pending.pop() {
            if pose != Isometry3::identity() {
                found.push(link.to_owned());
            }
            for index in self.tree.below(link) {
                let joint = &self.tree.joints[index];
                if joint.motion == Motion::Fixed {
                    pending.push((joint.child, pose * reader.origin(joint.node)?));
                }
            }
        }
        Ok(found)
    }

    /// Returns a locked joint as the user is told, and the pose of its child link.
    fn locked(
        &self,
        reader: &Reader<'a>,
        index: usize,
    ) -> Result<(String, Isometry3<f64>), RobotError> {
        let Selection { active, locks, .. } = self.selection;
        let joint = &self.tree.joints[index];
        if !joint.motion.is_single() {
            return Ok((
                format!("{} at its origin", joint.name),
                reader.origin(joint.node)?,
            ));
        }
        let Held { value, master } = reader.held(self.tree, locks, active, index)?;
        let unit = joint.motion.unit();
        let follows = master.map_or(String::new(), |name| format!(" (mimics {name})"));
        let text = format!("{} at {} {unit}{follows}", joint.name, plain(value));
        Ok((text, reader.pose_at(joint, value)?))
    }

    /// Returns the first joint with the pose of its parent link in the root, and the joints between them that are locked.
    fn to_first(
        &self,
        reader: &Reader<'a>,
    ) -> Result<(Option<Outgoing>, Vec<LockedJoint>), RobotError> {
        let mut pose = Isometry3::identity();
        let mut locked = Vec::new();
        let Some(&first) = self.selection.active.first() else {
            return Ok((None, locked));
        };
        for index in self.tree.path_to(self.tree.joints[first].parent) {
            let joint = &self.tree.joints[index];
            if joint.motion == Motion::Fixed {
                pose *= reader.origin(joint.node)?;
                continue;
            }
            let (text, own) = self.locked(reader, index)?;
            pose *= own;
            locked.push(LockedJoint { joint: index, text });
        }
        Ok((Some((first, pose)), locked))
    }

    /// Returns how an axis follows a joint of the chain, if it does.
    fn mimic(&self, index: usize) -> Option<Mimic> {
        let gear = self.selection.followers.get(&index)?;
        Some(Mimic {
            joint: self.tree.joints[gear.master].name.to_owned(),
            ratio: gear.multiplier,
            offset: gear.offset,
        })
    }

    fn body(
        &self,
        reader: &Reader<'a>,
        (index, to_parent): Outgoing,
        motors: &Motors<'a>,
    ) -> Result<(Body, Rigid<'a>), RobotError> {
        let joint = &self.tree.joints[index];
        let TreeJoint { name, node, .. } = *joint;
        let kind = match joint.motion {
            Motion::Prismatic => JointKind::Prismatic,
            _ => JointKind::Revolute,
        };
        if child(node, "axis").is_none() {
            reader.remarks.borrow_mut().push(format!(
                "{}:{}: joint `{name}` has no <axis>, so it moves along x of its own frame, as URDF defines.",
                reader.path.display(),
                reader.place(node)
            ));
        }
        let rigid = self.rigid_body(reader, joint.child)?;
        let motor = motors.get(name);
        let body = Body {
            joint: name.to_owned(),
            place: reader.place(node),
            link: joint.child.to_owned(),
            heavy: rigid.heavy.iter().map(|name| (*name).to_owned()).collect(),
            kind,
            mimic: self.mimic(index),
            axis: reader.axis(joint)?.into_inner(),
            origin: to_parent * reader.origin(node)?,
            inertia: rigid.inertia,
            locked: rigid.locked,
            limits: reader.limits(node, name, joint.motion == Motion::Continuous)?,
            friction: reader.friction(node)?,
            reduction: motor.and_then(|own| own.reduction),
            rotor_inertia: motor.and_then(|own| own.rotor_inertia),
        };
        Ok((body, rigid))
    }
}

/// Returns a position as `--lock` takes it, to a nanometre or a nanoradian.
fn plain(value: f64) -> String {
    // Adding zero turns −0 into 0.
    format!("{}", (value * 1e9).round() / 1e9 + 0.0)
}

impl<'a> Reader<'a> {
    /// Reads the chain that `choice` selects.
    ///
    /// # Errors
    /// The first fault of the file, with its line, or of the choice.
    fn chain(&self, choice: &ChainChoice) -> Result<Chain, RobotError> {
        let root: Xml<'a> = self.document.root_element();
        let tree = self.tree()?;
        let selection = self.selection(&tree, choice)?;
        let chosen = Selected {
            tree: &tree,
            selection: &selection,
        };
        let active: Vec<&str> = (selection.active.iter())
            .map(|joint| tree.joints[*joint].name)
            .collect();
        let motors = self.motors(&tree, &active)?;
        let mut told = Vec::new();
        let (mut outgoing, locked) = chosen.to_first(self)?;
        told.extend(locked.iter().map(|own| own.text.clone()));
        let mut used: Vec<usize> = locked.iter().map(|own| own.joint).collect();
        let mut merged = Vec::new();
        let mut bodies: Vec<Body> = Vec::new();
        let mut tip = Isometry3::identity();
        while let Some(next) = outgoing {
            if bodies.len() == MAX_JOINTS {
                let node = tree.joints[next.0].node;
                return Err(self.error(node, format!("this is movable joint {} of the chain, but a robot has at most {MAX_JOINTS}", MAX_JOINTS + 1)));
            }
            let (body, rigid) = chosen.body(self, next, &motors)?;
            told.extend(rigid.joints.iter().map(|own| own.text.clone()));
            used.extend(rigid.joints.iter().map(|own| own.joint));
            if !rigid.joints.is_empty() {
                let kilograms = format_significant(rigid.locked.mass, 4);
                merged.push(format!("{kilograms} kg into link `{}`", body.link));
            }
            outgoing = rigid.outgoing;
            tip = rigid.tip.unwrap_or_default();
            bodies.push(body);
        }
        let followers = self.geared(&mut bodies)?;
        self.tell_unknown();
        self.last_link(&bodies);
        self.assumed(&chosen, choice, [told, merged], &used);
        Ok(Chain {
            name: root.attribute("name").unwrap_or("robot").to_owned(),
            file: self.path.display().to_string(),
            base: selection.root.to_owned(),
            bodies,
            tip,
            tip_link: selection.tip.to_owned(),
            beyond_tip: chosen.beyond_tip(self)?,
            remarks: self.remarks.take(),
            notes: followers.into_iter().collect(),
        })
    }

    /// Adds a remark if the last body has no mass.
    fn last_link(&self, bodies: &[Body]) {
        let Some(last) = bodies
            .last()
            .filter(|body| body.heavy.is_empty() && body.inertia.mass == 0.0)
        else {
            return;
        };
        self.remarks.borrow_mut().push(format!(
            "{}:{}: the last link `{}` has no mass, nor has what is fixed to it, so torque does not move joint `{}` as it does the real one; give the link an <inertial>, or end the chain before it with --tip.",
            self.path.display(), last.place, last.link, last.joint
        ));
    }

    /// Adds a remark on the chain, the joints that are locked and the masses that are merged, unless the file has one
    /// chain and nothing was chosen.
    fn assumed(
        &self,
        chosen: &Selected<'_, 'a>,
        choice: &ChainChoice,
        [told, merged]: [Vec<String>; 2],
        used: &[usize],
    ) {
        let Selected { tree, selection } = chosen;
        let beside = (tree.joints.iter().enumerate())
            .filter(|(index, joint)| {
                joint.motion != Motion::Fixed
                    && !selection.active.contains(index)
                    && !used.contains(index)
            })
            .count();
        if told.is_empty() && beside == 0 && *choice == ChainChoice::default() {
            return;
        }
        let names: Vec<&str> = selection
            .active
            .iter()
            .map(|j| tree.joints[*j].name)
            .collect();
        let ends = match names.as_slice() {
            [] => String::new(),
            [one] => format!("joint {one}"),
            [first, .., last] => format!("{} joints, {first} to {last}", names.len()),
        };
        let mut text = format!(
            "{}: the robot is the chain from link `{}` to link `{}` ({ends}).",
            self.path.display(),
            selection.base,
            selection.tip
        );
        if !told.is_empty() {
            text += &format!(" Locked: {}.", told.join(", "));
        }
        if !merged.is_empty() {
            text += &format!(" Merged from behind locked joints: {}.", merged.join(", "));
        }
        if beside > 0 {
            let joints = if beside == 1 { "joint" } else { "joints" };
            text += &format!(" {beside} movable {joints} outside of the moved links do not enter.");
        }
        text += " Choose otherwise with --base, --tip and --lock.";
        self.remarks.borrow_mut().push(text);
    }
}

#[cfg(test)]
#[path = "read_test.rs"]
mod tests;
