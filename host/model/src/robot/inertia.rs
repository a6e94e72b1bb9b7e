//! Inertia that no joint has: less than none for its own drive to accelerate.
//!
//! Single elements of a link's inertia may be negative: identified values are known in combinations only, whose rest a description
//! puts at zero. What the torque of a joint accelerates is such a combination itself, the diagonal of the inertia matrix, and it is
//! positive for every way of splitting it.

use rig_shared::multibody::{COLUMNS, Chain, column, inertia_matrix};
use rig_shared::transmission::DriveKind;

use super::check::{Fault, Step, written};
use super::{JointKind, Robot};

/// Share of the largest addend up to which a difference is rounding.
const ROUNDING: f64 = 1e-12;

/// The first joint of `robot` whose drive has less inertia than none, or whose torque has less than none to accelerate, with the
/// way to the value from its joint on.
pub(super) fn negative_inertia(robot: &Robot) -> Option<(usize, Fault)> {
    let rows = robot.standard_parameters();
    let drive = (0..rows.len()).find_map(|k| Some((k, of_drive(robot, &rows, k)?)));
    // A coupled drive adds to more joints than its own.
    let simple = robot
        .drive_kinds()
        .iter()
        .all(|kind| *kind == DriveKind::Simple);
    // What was identified may be a little less than none by its noise, and is read back as it is.
    let exact = simple && robot.identified.is_none();
    drive.or_else(|| exact.then(|| of_joints(robot, &rows)).flatten())
}

/// Drive inertia of joint `k`: that of its own gear with what the rotors of all drives add.
fn of_drive(robot: &Robot, rows: &[[f64; COLUMNS]], k: usize) -> Option<Fault> {
    let joint = &robot.joints[k];
    let own = joint.drive.as_ref()?;
    let total = rows[k][column::DRIVE_INERTIA];
    let is_negative = total < -ROUNDING * own.joint_inertia.abs();
    is_negative.then(|| Fault {
        way: vec![Step::Key("drive"), Step::Key("joint_inertia")],
        what: format!("the drive inertia seen at joint `{}`", joint.name),
        found: format!("{} {}", written(total), unit(joint.kind)),
        right: "a drive has no less inertia than none; it must be 0 or greater, with the rotors' part in it".into(),
    })
}

/// Diagonal of the inertia matrix where the joints are at zero and in the middle of their limits.
fn of_joints(robot: &Robot, rows: &[[f64; COLUMNS]]) -> Option<(usize, Fault)> {
    let n = robot.joints.len();
    let chain = Chain::new(&robot.geometry(), robot.gravity).ok()?;
    let largest = rows.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
    [vec![0.0; n], robot.middle_position()]
        .iter()
        .find_map(|q| {
            let mut mass = vec![0.0; n * n];
            inertia_matrix(&chain, rows, q, &mut mass).ok()?;
            // From the tip: what a link lacks shows in all joints before it.
            let found = (0..n)
                .rev()
                .find(|k| mass[k * n + k] < -ROUNDING * largest)?;
            Some((found, too_little(robot, found, mass[found * n + found])))
        })
}

fn too_little(robot: &Robot, k: usize, inertia: f64) -> Fault {
    let joint = &robot.joints[k];
    let (key, mend) = match joint.kind {
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
        way: vec![Step::Key("inertial"), Step::Key(key)],
        what: format!(
            "the inertia that the torque of joint `{}` accelerates",
            joint.name
        ),
        found: format!("{} {}", written(inertia), unit(joint.kind)),
        right: mend.into(),
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
