//! Checks for negative inertia of a drive, or negative inertia that a drive accelerates.
//!
//! Single elements of a link's inertia may be negative: identified values are known only in combinations, and a
//! description sets the other values to zero. The torque of a joint accelerates such a combination: the diagonal
//! element of the inertia matrix. It is positive for every way of splitting the combination.

use rig_shared::multibody::{COLUMNS, column, inertia_matrix};
use rig_shared::transmission::DriveKind;

use super::fault::{Fault, Step, written};
use super::joint::JointKind;
use super::serial_robot::Robot;

/// Share of the largest term below which a difference is rounding.
const ROUNDING: f64 = 1e-12;

/// Returns the first joint of `robot` whose drive has negative inertia, or whose torque accelerates negative inertia,
/// and the fault with the path from that joint.
pub(super) fn negative_inertia(robot: &Robot) -> Option<(usize, Fault)> {
    let rows = robot.standard_parameters();
    let drive = (0..robot.joints.len()).find_map(|k| Some((k, of_drive(robot, &rows, k)?)));
    // A coupled drive adds to several joints.
    let simple = robot
        .drive_kinds()
        .iter()
        .all(|kind| *kind == DriveKind::Simple);
    // Noise may make an identified value slightly negative; it is read back unchanged.
    let exact = simple && robot.identified.is_none();
    drive.or_else(|| exact.then(|| of_joints(robot, &rows)).flatten())
}

/// Checks the drive inertia of joint `k`: its own gear plus the rotors of all drives.
fn of_drive(robot: &Robot, rows: &[[f64; COLUMNS]], k: usize) -> Option<Fault> {
    let joint = &robot.joints[k];
    let own = joint.drive.as_ref()?;
    let total = rows[k][column::DRIVE_INERTIA];
    let is_negative = total < -ROUNDING * own.joint_inertia.abs();
    is_negative.then(|| Fault {
        key_path: vec![Step::Key("drive"), Step::Key("joint_inertia")],
        what: format!("the drive inertia seen at joint `{}`", joint.name),
        found: format!("{} {}", written(total), unit(joint.kind)),
        advice: "a drive has no less inertia than none; it must be 0 or greater, with the rotors' part in it".into(),
    })
}

/// Checks the diagonal of the inertia matrix with the joints at zero and in the middle of their limits.
fn of_joints(robot: &Robot, rows: &[[f64; COLUMNS]]) -> Option<(usize, Fault)> {
    let n = robot.joints.len();
    let chain = robot.chain().ok()?;
    let largest = rows.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
    [vec![0.0; n], robot.middle_position()]
        .iter()
        .find_map(|q| {
            let mut mass = vec![0.0; n * n];
            inertia_matrix(&chain, rows, q, &mut mass).ok()?;
            // From the tip: a missing inertia of a link shows in all joints before it.
            let found = (0..n)
                .rev()
                .find(|k| mass[k * n + k] < -ROUNDING * largest)?;
            Some((found, too_little(robot, found, mass[found * n + found])))
        })
}

fn too_little(robot: &Robot, k: usize, inertia: f64) -> Fault {
    let joint = &robot.joints[k];
    let (key, advice) = match joint.kind {
        JointKind::Revolute => (
            "inertia",
            "Izz of the links that it moves, about its axis, with the drive inertia must be greater than 0",
        ),
        JointKind::Prismatic => (
            "mass",
            "the mass that it moves with the drive inertia must be greater than 0",
        ),
    };
    Fault {
        key_path: vec![Step::Key("inertial"), Step::Key(key)],
        what: format!(
            "the inertia that the torque of joint `{}` accelerates",
            joint.name
        ),
        found: format!("{} {}", written(inertia), unit(joint.kind)),
        advice: advice.into(),
    }
}

fn unit(kind: JointKind) -> &'static str {
    match kind {
        JointKind::Revolute => "kg·m²",
        JointKind::Prismatic => "kg",
    }
}

#[cfg(test)]
#[path = "inertia_test.rs"]
mod tests;
