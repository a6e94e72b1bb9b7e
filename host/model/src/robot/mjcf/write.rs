//! Writes what an identification gives to the joints of an MJCF model.

use rig_shared::multibody::column;

use crate::robot::joint::Joint;
use crate::robot::serial_robot::Robot;
use crate::robot::urdf::escaped;

/// A fragment of MJCF, and remarks on what it cannot hold.
#[derive(Clone, Debug)]
pub struct MjcfJoints {
    /// The text.
    pub text: String,
    /// Remarks, one sentence each.
    pub remarks: Vec<String>,
}

impl Robot {
    /// Returns a fragment of MJCF with a class of defaults for each joint, named like the joint, which holds armature, damping
    /// and frictionloss, and a motor for each joint with its gear.
    ///
    /// A model takes it by `<include file="joints.xml"/>` and `class="NAME"` at each joint.
    pub fn to_mjcf_joints(&self) -> MjcfJoints {
        let rows = self.standard_parameters();
        let mut remarks = Vec::new();
        let mut classes = String::new();
        let mut motors = String::new();
        for (joint, row) in self.joints.iter().zip(&rows) {
            let name = escaped(&joint.name);
            // MuJoCo takes no negative values; an identification within its interval of zero may give one.
            let mut value = |what: &str, column: usize| {
                let value = row[column];
                if value < 0.0 {
                    remarks.push(format!(
                        "{what} of joint {} is {value}, which MuJoCo does not take; 0 is written.",
                        joint.name
                    ));
                }
                value.max(0.0)
            };
            classes += &format!(
                "    <default class=\"{name}\">\n      <joint armature=\"{}\" damping=\"{}\" frictionloss=\"{}\"/>\n    </default>\n",
                value("armature", column::DRIVE_INERTIA),
                value("damping", column::VISCOUS),
                value("frictionloss", column::COULOMB)
            );
            motors += &format!(
                "    <motor name=\"{name}\" joint=\"{name}\" gear=\"{}\"/>\n",
                joint.gear_ratio()
            );
        }
        remarks.extend(
            self.beyond_mjcf(
                &rows
                    .iter()
                    .map(|row| row[column::OFFSET])
                    .collect::<Vec<_>>(),
            ),
        );
        let text = format!(
            "<!-- Joints of {}: class=\"NAME\" at a joint takes its values; the control of a motor is its torque, N·m. -->\n<mujoco>\n  <default>\n{classes}  </default>\n  <actuator>\n{motors}  </actuator>\n</mujoco>\n",
            escaped(&self.name).replace("--", "- -")
        );
        MjcfJoints { text, remarks }
    }

    /// Names what the fragment cannot hold.
    fn beyond_mjcf(&self, offsets: &[f64]) -> Vec<String> {
        let mut remarks = Vec::new();
        let named = |joints: &[&Joint]| {
            let names: Vec<&str> = joints.iter().map(|joint| joint.name.as_str()).collect();
            names.join(", ")
        };
        let constant: Vec<&Joint> = (self.joints.iter().zip(offsets))
            .filter(|(_, offset)| **offset != 0.0)
            .map(|(joint, _)| joint)
            .collect();
        if !constant.is_empty() {
            remarks.push(format!(
                "MJCF has no place for the constant torques of {}.",
                named(&constant)
            ));
        }
        let followers: Vec<String> = (self.followers.iter())
            .map(|own| {
                format!(
                    "<joint joint1=\"{}\" joint2=\"{}\" polycoef=\"{:?} {:?} 0 0 0\"/>",
                    own.name, own.follows, own.offset, own.ratio
                )
            })
            .collect();
        if !followers.is_empty() {
            remarks.push(format!(
                "The fragment does not couple axes: put {} into <equality> of the model.",
                followers.join(" ")
            ));
        }
        let is_coupled = |joint: &&Joint| {
            let drive = joint.drive.as_ref();
            drive.is_some_and(|drive| !drive.couples.is_empty() || drive.screw.is_some())
        };
        let coupled: Vec<&Joint> = self.joints.iter().filter(is_coupled).collect();
        if !coupled.is_empty() {
            remarks.push(format!(
                "MJCF has no place for the coupled drives of {}; their inertia at the other joints is left out.",
                named(&coupled)
            ));
        }
        if !self.effects.is_empty() {
            let kinds: Vec<String> = self
                .effects
                .iter()
                .map(|own| own.effect.kind.about().name.to_owned())
                .collect();
            remarks.push(format!(
                "MJCF has no place for the effects {}.",
                kinds.join(", ")
            ));
        }
        remarks
    }
}
