//! The numbers of a description, for the equations.

use rig_shared::multibody::{COLUMNS, JointGeometry, JointKind as Kind, column};

use super::joint::{Joint, JointKind};
use super::serial_robot::Robot;

/// Returns the geometry of a joint.
pub(super) fn geometry_of(joint: &Joint) -> JointGeometry<f64> {
    JointGeometry {
        kind: match joint.kind {
            JointKind::Revolute => Kind::Revolute,
            JointKind::Prismatic => Kind::Prismatic,
        },
        alpha: joint.alpha,
        a: joint.a,
        theta: joint.theta,
        d: joint.d,
    }
}

impl Robot {
    /// Returns the geometry, joint by joint, without followers; [`Self::chain`] has all axes.
    pub fn geometry(&self) -> Vec<JointGeometry<f64>> {
        self.joints.iter().map(geometry_of).collect()
    }

    /// Returns the torque limit of each joint, N·m or N, if one is stated.
    pub fn torque_limits(&self) -> Vec<Option<f64>> {
        (self.joints.iter())
            .map(|j| j.limits.as_ref().and_then(|l| l.torque))
            .collect()
    }

    /// Returns the standard parameters, one row a link (joints, then followers) in the order of `COLUMN_NAMES`; 0 for
    /// values that are not stated. Inertia and friction of the drives are on the joint side. [`Self::motor_parameters`] returns the terms
    /// of coupled drives and screws beyond the joints' diagonals.
    pub fn standard_parameters(&self) -> Vec<[f64; COLUMNS]> {
        let joint = |joint: &Joint| {
            let mut row = [0.0; COLUMNS];
            if let Some(inertial) = &joint.inertial {
                row[..column::DRIVE_INERTIA].copy_from_slice(&inertial.parameters());
            }
            if let Some(friction) = &joint.friction {
                row[column::VISCOUS] = friction.viscous;
                row[column::COULOMB] = friction.coulomb;
                row[column::OFFSET] = friction.offset;
            }
            row
        };
        let mut rows: Vec<[f64; COLUMNS]> = self.joints.iter().map(joint).collect();
        self.add_drives(&mut rows);
        rows.extend(self.followers.iter().map(|own| joint(&own.as_joint())));
        rows
    }
}
