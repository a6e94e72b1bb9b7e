//! How far the drives twist under the arm's own weight, and how stiff they are at their joints: what a stiffness in another
//! unit makes implausible.
//!
//! A force in kN gives a thousandth of the stiffness, with which the arm would hang down under its described weight. The
//! stiffness of a screw stands at its motor; that of its joint is larger by the square of hundreds of motor radians per joint
//! radian.

use rig_output::{format_significant, format_unit};
use rig_shared::multibody::gravity_vector;
use rig_shared::transmission::DriveKind;

use crate::drives::{listed_pose, loaded};
use crate::error::ComplianceError;
use crate::stiffness::{DriveStiffness, Source};
use crate::tool_point::ToolPoint;

/// Largest plausible twist of a loaded joint, rad or m. By judgement: gears twist by milliradians, and beyond this the arm is
/// not linear.
pub(crate) const TWIST: f64 = 0.2;
/// Stiffness of a screw at its joint over the largest of the other joints, beyond which it looks like a value of the joint. By
/// judgement: the joints of one arm differ by factors of 10 to 100, and a screw has hundreds of motor radians per joint radian.
const STIFFER: f64 = 100.0;

/// Says which drives would twist implausibly far under the described weight, the furthest first. Values of static loading make an
/// error.
///
/// # Errors
/// [`ComplianceError::Recording`]: such a value from static loading. [`ComplianceError::Model`].
pub(crate) fn sagging(
    tool: &ToolPoint<'_>,
    drives: &[DriveStiffness],
    poses: &[Vec<f64>],
) -> Result<Vec<String>, ComplianceError> {
    let mut most: Vec<Option<(f64, &Vec<f64>)>> = vec![None; drives.len()];
    for pose in poses {
        let turns = match turns(tool, drives, pose) {
            Err(ComplianceError::SingularDrives { .. }) => continue,
            other => other?,
        };
        for (most, turn) in most.iter_mut().zip(turns) {
            if turn > most.map_or(TWIST, |own| own.0) {
                *most = Some((turn, pose));
            }
        }
    }
    let mut all = Vec::new();
    for (k, (drive, most)) in drives.iter().zip(most).enumerate() {
        let (Some((turn, pose)), Some(stiffness)) = (most, drive.stiffness) else {
            continue;
        };
        let (unit, _) = tool.robot().joints[k].kind.units();
        let text = format!(
            "With {} {} joint \"{}\" would hang by {} {unit} under the described weight of the arm at {}, but {TWIST} {unit} is more than any gear twists:",
            format_significant(stiffness.value, 4),
            format_unit(drive.unit),
            drive.joint,
            format_significant(turn, 3),
            listed_pose(pose),
        );
        if drive.source == Source::Loading {
            return Err(ComplianceError::Recording(format!(
                "{text} force and moment must be in N and N·m (a force in kN makes the stiffness 1000 times too small, one in lbf 4.45 times, one in kgf 9.81 times; --unit fz=kN converts it), displacements in m, encoders in rad or m. If the units are right, correct the masses of the description."
            )));
        }
        all.push(format!(
            "{text} check the unit of the stiffness and the masses of the description."
        ));
    }
    Ok(all)
}

/// Returns how far each elastic drive turns its joints under the described weight.
fn turns(
    tool: &ToolPoint<'_>,
    drives: &[DriveStiffness],
    pose: &[f64],
) -> Result<Vec<f64>, ComplianceError> {
    let wrong = |error: &dyn std::fmt::Display| ComplianceError::Model(error.to_string());
    let (n, robot) = (tool.count(), tool.robot());
    let chain = robot.chain().map_err(|e| wrong(&e))?;
    let mut weight = vec![0.0; n];
    gravity_vector(&chain, &loaded(robot)?, pose, &mut weight).map_err(|e| wrong(&e))?;
    let inverse = tool.drives().inverse(pose)?;
    Ok((drives.iter().enumerate())
        .map(|(k, drive)| {
            let torque: f64 = (0..n).map(|j| inverse[(j, k)] * weight[j]).sum();
            let twist = torque * drive.compliance().value;
            // The joint of the drive: another one may be moved against it by a coupling.
            (inverse[(k, k)] * twist).abs()
        })
        .collect())
}

/// Says which given stiffness of a screw looks like one of its joint.
///
/// # Errors
/// [`ComplianceError::Model`].
pub(crate) fn at_the_joint(
    tool: &ToolPoint<'_>,
    drives: &[DriveStiffness],
    pose: &[f64],
) -> Result<Vec<String>, ComplianceError> {
    let rows = tool.drives().rows(pose)?;
    // Stiffness as the joint of the drive feels it.
    let own: Vec<Option<f64>> = (drives.iter().enumerate())
        .map(|(k, drive)| Some(drive.stiffness?.value * rows[(k, k)].powi(2)))
        .collect();
    let mut all = Vec::new();
    for (k, drive) in drives.iter().enumerate() {
        let varies = tool.drives().kind(k) == DriveKind::Varying && !drive.source.is_measured();
        let (Some(felt), Some(given), true) = (own[k], drive.stiffness, varies) else {
            continue;
        };
        let simple = |j: &usize| tool.drives().kind(*j) != DriveKind::Varying;
        let others = (0..drives.len()).filter(simple).filter_map(|j| own[j]);
        let stiffest = others.fold(0.0, f64::max);
        if stiffest > 0.0 && felt > STIFFER * stiffest {
            all.push(format!(
                "The stiffness of joint \"{}\", {} N·m/rad at the motor of the screw, is {} N·m/rad at the joint, {} times that of the stiffest joint without a screw. If {} N·m/rad is meant at the joint, it is {} N·m/rad at the motor at {} (over the square of {} motor radians per joint radian).",
                drive.joint,
                format_significant(given.value, 4),
                format_significant(felt, 3),
                format_significant(felt / stiffest, 2),
                format_significant(given.value, 4),
                format_significant(given.value / rows[(k, k)].powi(2), 4),
                listed_pose(pose),
                format_significant(rows[(k, k)].abs(), 4),
            ));
        }
    }
    Ok(all)
}
