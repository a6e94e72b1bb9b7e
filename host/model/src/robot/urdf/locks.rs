//! The positions at which joints outside of the chain are held.

use std::collections::HashMap;

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

use super::choice::ChainChoice;
use super::names::nearest_long;
use super::reader::{Reader, Xml, child};
use super::tree::{Motion, Tree, TreeJoint};
use crate::robot::error::RobotError;

/// Joints of the file that the user holds at a value, by their index.
pub(super) type Locks = HashMap<usize, f64>;

/// Where a locked joint stands.
pub(super) struct Held<'a> {
    /// Coordinate of the joint, rad or m.
    pub value: f64,
    /// The joint that it mimics, if that decides the value.
    pub master: Option<&'a str>,
}

impl<'a> Reader<'a> {
    /// Returns an error about the options, which have no place in the file.
    pub(super) fn choice_error(&self, message: String) -> RobotError {
        RobotError::Chain {
            path: self.path.into(),
            message,
        }
    }

    /// Checks the joints that the user holds.
    ///
    /// # Errors
    /// A joint is unknown, has no single coordinate, or its limits exclude the value.
    pub(super) fn locks(&self, tree: &Tree<'a>, choice: &ChainChoice) -> Result<Locks, RobotError> {
        let mut locks = Locks::new();
        for (name, value) in &choice.locks {
            let index = tree.joint(name).ok_or_else(|| {
                let movable = (tree.joints.iter()).filter(|own| own.motion.is_single());
                let names: Vec<&str> = movable.map(|own| own.name).collect();
                let meant = match nearest_long(name, names.iter().copied()) {
                    Some(near) => format!("is `{near}` meant?"),
                    None => format!("its movable joints are {}", few(&names)),
                };
                self.choice_error(format!(
                    "the file has no joint `{name}` that --lock could hold; {meant}"
                ))
            })?;
            let joint = &tree.joints[index];
            if !joint.motion.is_single() {
                return Err(self.error(joint.node, format!("--lock {name}: this joint has no single position that it could be held at; --lock takes revolute, continuous and prismatic joints")));
            }
            let unit = joint.motion.unit();
            let within = self.range(joint)?;
            if let Some([low, high]) = within
                && !(low..=high).contains(value)
            {
                return Err(self.error(joint.node, format!("--lock {name}={value}: this is outside of the joint's limits, {low} to {high} {unit}; give a value within them")));
            }
            if locks
                .insert(index, *value)
                .is_some_and(|first| first != *value)
            {
                return Err(self.choice_error(format!(
                    "--lock holds joint `{name}` at two values; give one"
                )));
            }
        }
        Ok(locks)
    }

    /// Returns the limits of a joint's position; `None` if it has none.
    fn range(&self, joint: &TreeJoint<'a>) -> Result<Option<[f64; 2]>, RobotError> {
        let limit = child(joint.node, "limit");
        let (Some(limit), true) = (limit, joint.motion != Motion::Continuous) else {
            return Ok(None);
        };
        let bound = |key| Ok(self.optional_number(limit, key)?.unwrap_or(0.0));
        let (low, high): (f64, f64) = (bound("lower")?, bound("upper")?);
        Ok((low < high).then_some([low, high]))
    }

    /// Returns the position of a joint outside of the chain: the one that `locks` holds it at; if it mimics another, the
    /// one that follows from that; otherwise the position within its limits that is nearest to zero.
    ///
    /// # Errors
    /// The joint mimics a joint that does not exist, itself, or one of `active`, which move.
    pub(super) fn held(
        &self,
        tree: &Tree<'a>,
        locks: &Locks,
        active: &[usize],
        index: usize,
    ) -> Result<Held<'a>, RobotError> {
        let (mut scale, mut shift) = (1.0, 0.0);
        let mut here = index;
        let mut master = None;
        for _ in 0..=tree.joints.len() {
            let joint = &tree.joints[here];
            if active.contains(&here) {
                let name = tree.joints[index].name;
                return Err(self.error(tree.joints[index].node, format!("joint `{name}` mimics joint `{}`, which the robot moves, so the two are coupled and it cannot be held by rule; hold it with --lock {name}=VALUE, or hold both with --lock {}=VALUE", joint.name, joint.name)));
            }
            let own = match (locks.get(&here), &joint.mimic) {
                (Some(value), _) => Some(*value),
                (None, None) => Some(match self.range(joint)? {
                    Some([low, high]) => 0.0f64.clamp(low, high),
                    None => 0.0,
                }),
                (None, Some(_)) => None,
            };
            if let Some(value) = own {
                let value = scale * value + shift;
                return Ok(Held { value, master });
            }
            if let Some(mimic) = &joint.mimic {
                shift += scale * mimic.offset;
                scale *= mimic.multiplier;
                here = self.master(tree, mimic.node, joint.name, mimic.master)?;
                master.get_or_insert(mimic.master);
            }
        }
        Err(self.mimics_itself(&tree.joints[index]))
    }

    /// Returns the refusal of a joint that mimics itself.
    pub(super) fn mimics_itself(&self, joint: &TreeJoint<'a>) -> RobotError {
        let node = joint.mimic.as_ref().map_or(joint.node, |mimic| mimic.node);
        self.error(
            node,
            format!(
                "joint `{}` mimics itself through other joints; let one of them move by itself",
                joint.name
            ),
        )
    }

    /// Returns the joint that joint `name` mimics.
    pub(super) fn master(
        &self,
        tree: &Tree<'a>,
        node: Xml<'a>,
        name: &str,
        master: &str,
    ) -> Result<usize, RobotError> {
        tree.joint(master).ok_or_else(|| {
            let names = tree.joints.iter().map(|joint| joint.name);
            let meant = match nearest_long(master, names) {
                Some(near) => format!("is `{near}` meant?"),
                None => "correct the name or remove <mimic>".to_owned(),
            };
            self.error(node, format!("joint `{name}` mimics joint `{master}`, which the file does not describe; {meant}"))
        })
    }

    /// Returns the unit vector of a joint's axis, in the joint's frame.
    ///
    /// # Errors
    /// The axis is no direction.
    pub(super) fn axis(&self, joint: &TreeJoint<'a>) -> Result<Unit<Vector3<f64>>, RobotError> {
        let Some(node) = child(joint.node, "axis") else {
            // The default of the URDF definition.
            return Ok(Vector3::x_axis());
        };
        let axis = self.vector(node, "xyz")?.ok_or_else(|| {
            let text = format!(
                "<axis> of joint `{}` has no `xyz`; give the direction, such as xyz=\"0 0 1\"",
                joint.name
            );
            self.error(node, text)
        })?;
        Unit::try_new(axis, 1e-9).ok_or_else(|| self.error(node, format!("the axis of joint `{}` is the zero vector, but it must be a direction such as \"0 0 1\"", joint.name)))
    }

    /// Returns the pose of a joint's child link in its parent link, with the joint at `value`.
    ///
    /// # Errors
    /// The axis is no direction.
    pub(super) fn pose_at(
        &self,
        joint: &TreeJoint<'a>,
        value: f64,
    ) -> Result<Isometry3<f64>, RobotError> {
        let origin = self.origin(joint.node)?;
        if !joint.motion.is_single() || value == 0.0 {
            return Ok(origin);
        }
        let axis = self.axis(joint)?;
        Ok(match joint.motion {
            Motion::Prismatic => origin * Translation3::from(axis.into_inner() * value),
            _ => origin * UnitQuaternion::from_axis_angle(&axis, value),
        })
    }
}

/// Returns the names as a list, at most the first eight.
pub(super) fn few(names: &[&str]) -> String {
    const MOST: usize = 8;
    let shown: Vec<String> = (names.iter().take(MOST))
        .map(|name| format!("`{name}`"))
        .collect();
    match names.len() {
        0 => "none".to_owned(),
        n if n > MOST => format!("{} and {} more", shown.join(", "), n - MOST),
        _ => rig_output::listed(&shown),
    }
}
