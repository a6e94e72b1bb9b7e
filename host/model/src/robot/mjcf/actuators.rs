//! What the actuators of an MJCF file add to the joints that they drive.

use std::collections::HashMap;

use super::elements::{Reader, Xml};
use super::tree::{BodyJoint, Tree};
use crate::robot::error::RobotError;

/// The drive of a joint.
#[derive(Clone, Copy)]
pub(super) struct Drive {
    /// Gear of the first actuator of the joint.
    pub gear: f64,
    /// Armatures of all of its actuators, seen at the joint, kg·m² or kg.
    pub armature: f64,
    /// Linear dampings of all of its actuators, seen at the joint, N·m·s/rad or N·s/m.
    pub damping: f64,
}

/// The drives by the name of the joint, and the lines of actuators of one joint whose gears differ.
#[derive(Default)]
pub(super) struct Drives<'a> {
    pub of: HashMap<&'a str, Drive>,
    pub other_gears: Vec<Xml<'a>>,
}

impl<'a> Drives<'a> {
    /// Reads the actuators. An actuator turns by its gear times the joint, so that its armature and damping count by the
    /// square of the gear.
    ///
    /// # Errors
    /// An actuator of a joint that is not there, or that its gear does not move, by its line.
    pub(super) fn read(reader: &Reader<'a>, tree: &Tree<'a>) -> Result<Self, RobotError> {
        let root = reader.document.root_element();
        let mut drives = Self::default();
        let actuators = root.children().filter(|n| n.has_tag_name("actuator"));
        for node in actuators.flat_map(|n| n.children()).filter(Xml::is_element) {
            let tag = node.tag_name().name();
            // The two differ in ball and free joints alone.
            let target = node.attribute("joint").or(node.attribute("jointinparent"));
            let Some(joint) = target else {
                continue;
            };
            let is_it = |own: &BodyJoint<'_>| own.name == joint;
            if !tree.bodies.iter().any(|body| body.joints.iter().any(is_it)) {
                return Err(reader.error(
                    node,
                    format!(
                        "<{tag}> acts on joint `{joint}`, but the file has no joint of this name"
                    ),
                ));
            }
            let (gear, _) = reader.leading(node, "gear", 6, 1.0)?;
            if gear == 0.0 {
                return Err(reader.error(
                    node,
                    format!("`gear` of <{tag}> is 0, so it does not move joint `{joint}`; give the gear ratio, or remove the actuator"),
                ));
            }
            let armature = reader.number(node, "armature", 0.0)?;
            let (damping, _) = reader.leading(node, "damping", 3, 0.0)?;
            for (what, value) in [("armature", armature), ("damping", damping)] {
                if value < 0.0 {
                    return Err(reader.error(
                        node,
                        format!("`{what}` of <{tag}> is {value}, but it must be 0 or greater"),
                    ));
                }
            }
            let drive = drives.of.entry(joint).or_insert(Drive {
                gear,
                armature: 0.0,
                damping: 0.0,
            });
            if drive.gear != gear {
                drives.other_gears.push(node);
            }
            drive.armature += gear * gear * armature;
            if !reader.is_undamped {
                drive.damping += gear * gear * damping;
            }
        }
        Ok(drives)
    }
}
