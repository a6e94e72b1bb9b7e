//! Remarks on values that URDF cannot hold.

use rig_shared::effects::Parameter;
use rig_shared::multibody::{COLUMNS, column};
use rig_shared::transmission::DriveKind;

use crate::robot::effects::{RobotEffect, title_of, unit_of};
use crate::robot::joint::JointKind;
use crate::robot::serial_robot::Robot;
use rig_output::format_significant;

impl Robot {
    /// Adds remarks on values that the file does not hold. `rotors`: for each joint, whether the file holds its rotor.
    pub(super) fn left_out(
        &self,
        parameters: &[[f64; COLUMNS]],
        rotors: &[bool],
        remarks: &mut Vec<String>,
    ) {
        let list = |place: usize, unit: fn(JointKind) -> &'static str| {
            let held = |k: usize| place == column::DRIVE_INERTIA && rotors.get(k) == Some(&true);
            let entries: Vec<String> = self
                .joints
                .iter()
                .zip(parameters)
                .enumerate()
                .filter(|(k, (_, row))| row[place] != 0.0 && !held(*k))
                .map(|(_, (joint, row))| {
                    let value = format_significant(row[place], 4);
                    format!("{} {value} {}", joint.name, unit(joint.kind))
                })
                .collect();
            (!entries.is_empty()).then(|| entries.join(", "))
        };
        let inertia = |kind| match kind {
            JointKind::Revolute => "kg*m^2",
            JointKind::Prismatic => "kg",
        };
        let torque = |kind: JointKind| kind.units().1;
        if let Some(entries) = list(column::DRIVE_INERTIA, inertia) {
            remarks.push(format!("URDF has no place for the inertia of the drives, seen at the joints: {entries}; give it to the simulator as armature or rotor inertia."));
        }
        if let Some(entries) = list(column::OFFSET, torque) {
            remarks.push(format!(
                "URDF has no place for constant torques at the joints: {entries}."
            ));
        }
        let coupled: Vec<&str> = self
            .joints
            .iter()
            .zip(self.drive_kinds())
            .filter(|(_, kind)| *kind != DriveKind::Simple)
            .map(|(joint, _)| joint.name.as_str())
            .collect();
        if !coupled.is_empty() {
            remarks.push(format!("URDF has no place for drives that move several joints or do so at a changing ratio: {}; inertia and friction of their motors beyond the joints' own are left out.", coupled.join(", ")));
        }
        let limited: Vec<&str> = self
            .joints
            .iter()
            .filter(|joint| joint.drive.as_ref().is_some_and(|d| d.limits.is_some()))
            .map(|joint| joint.name.as_str())
            .collect();
        if !limited.is_empty() {
            remarks.push(format!(
                "URDF has no place for limits of the motors ([joint.drive.limits]): {}.",
                limited.join(", ")
            ));
        }
        if !self.effects.is_empty() {
            let entries: Vec<String> = self.effects.iter().map(|e| self.effect_text(e)).collect();
            remarks.push(format!(
                "URDF has no place for effects beyond the standard model: {}.",
                entries.join("; ")
            ));
        }
    }

    /// Returns an effect with its parameters, as text.
    fn effect_text(&self, effect: &RobotEffect) -> String {
        let about = effect.effect.kind.about();
        let joint = match &effect.joint {
            Some(name) => self.joints.iter().find(|j| j.name == *name),
            None => self.joints.first(),
        };
        let kind = joint.map_or(JointKind::Revolute, |j| j.kind);
        let values = |parameters: &'static [Parameter], values: &[f64]| -> Vec<String> {
            let pairs = parameters.iter().zip(values);
            pairs
                .map(|(p, value)| format!("{} {value:?} {}", p.name, unit_of(p, kind)))
                .collect()
        };
        let mut list = values(about.gains, &effect.effect.gains);
        list.extend(values(about.shapes, &effect.effect.shapes));
        format!(
            "{} of {} ({})",
            title_of(effect.effect.kind),
            joint.map_or("the joint", |j| j.name.as_str()),
            list.join(", ")
        )
    }
}
