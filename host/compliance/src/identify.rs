//! The whole: stiffness of the drives from all sources, and the compliance of the tool point.

use rig_data::prepare::Recording;
use rig_data::{Block, Implausible, JointColumns, implausible_positions};
use rig_model::robot::Robot;
use rig_output::{format_significant, format_unit};
use serde::Serialize;

use crate::drives::{Drives, listed_pose};
use crate::error::ComplianceError;
use crate::frequency::{FrequencyResponse, respond};
use crate::loading::{LoadingFindings, loading};
use crate::map::{ComplianceMap, compliance_map};
use crate::sag::{at_the_joint, sagging};
use crate::signals::{Signals, read, refuse_degrees};
use crate::stiffness::{DriveStiffness, Source, described_stiffness, given_stiffness};
use crate::tool_point::{ToolCompliance, ToolPoint};
use crate::value::Value;

/// Standard deviations beyond which two estimates of one stiffness contradict each other.
const CONTRADICTS: f64 = 4.0;
/// Relative difference below which they do not, whatever the standard deviations.
const AGREES: f64 = 0.1;

/// Point and axes of a recorded wrench.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WrenchFrame {
    /// On the robot at the tool point, in the axes of the base.
    Base,
    /// The readings of the wrist sensor.
    Sensor,
}

/// What to compute.
#[derive(Clone, Debug, Default)]
pub struct ComplianceOptions {
    /// Stiffness by hand, base joint first; empty for none.
    pub stiffness: Vec<f64>,
    /// Standard deviations of it, or empty.
    pub stiffness_std: Vec<f64>,
    /// The joint of the frequency response, from 0.
    pub joint: usize,
    /// True for the reference as instrument, false for the torque; `None` for the reference if it was recorded.
    pub by_reference: Option<bool>,
    /// Where a recorded wrench is read; `None` for the sensor if the description has one.
    pub wrench: Option<WrenchFrame>,
    /// Tool point in the flange frame, m.
    pub tool: [f64; 3],
    /// Poses; empty for the middle of the ranges.
    pub poses: Vec<Vec<f64>>,
    /// The two joints of the map, from 0; `None` for none.
    pub map: Option<[usize; 2]>,
}

/// The result.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Compliance {
    /// Name and version of this format.
    pub schema: &'static str,
    /// Name of the robot.
    pub robot: String,
    /// Stiffness of each drive, base joint first.
    pub drives: Vec<DriveStiffness>,
    /// Static loading.
    pub loading: Option<LoadingFindings>,
    /// Frequency response.
    pub frequency: Option<FrequencyResponse>,
    /// Tool point in the flange frame, m.
    pub tool: [f64; 3],
    /// Compliance of the tool point at each pose.
    pub poses: Vec<ToolCompliance>,
    /// Map over two joints.
    pub map: Option<ComplianceMap>,
    /// What to know about the result.
    pub warnings: Vec<String>,
}

/// Identifies the stiffness of the drives and computes the compliance of the tool point.
///
/// Values of the description are replaced by given ones, and those by measured ones.
///
/// # Errors
/// [`ComplianceError`].
pub fn identify_compliance(
    robot: &Robot,
    load: &[&dyn Recording],
    response: &[&dyn Recording],
    options: &ComplianceOptions,
) -> Result<Compliance, ComplianceError> {
    let mut tool = ToolPoint::new(robot, options.tool)?;
    let sensed = match options.wrench {
        Some(frame) => frame == WrenchFrame::Sensor,
        None => robot.wrist_sensor.is_some() && !load.is_empty(),
    };
    if sensed {
        tool = tool.with_sensor()?;
    }
    let (mut warnings, mut poses) = (Vec::new(), options.poses.clone());
    let mut drives = described_stiffness(robot)?;
    if !options.stiffness.is_empty() {
        given_stiffness(&mut drives, &options.stiffness, &options.stiffness_std)?;
    }
    let loading = match load {
        [] => None,
        _ => {
            let stretches = read(load)?;
            refuse_degrees(robot, &stretches)?;
            poses.extend(stretches.iter().map(middle));
            Some(loading(&tool, &stretches)?)
        }
    };
    let frequency = match response {
        [] => None,
        _ => Some(respond(
            robot,
            &Drives::of(robot)?,
            &read(response)?,
            options.joint,
            options.by_reference,
        )?),
    };
    measured(
        &mut drives,
        loading.as_ref(),
        frequency.as_ref(),
        &mut warnings,
    );
    warnings.extend(loading.iter().flat_map(|l| l.warnings.clone()));
    warnings.extend(frequency.iter().flat_map(|f| f.warnings.clone()));
    let elastic = drives.iter().any(|d| d.stiffness.is_some());
    if let (false, Some(found)) = (elastic, &loading) {
        let missing = found.drives.iter().find_map(|d| d.missing.as_deref());
        return Err(ComplianceError::Recording(format!(
            "The recordings show the stiffness of no joint. {}",
            missing.unwrap_or_default()
        )));
    }
    if !elastic {
        return Err(ComplianceError::Option(format!(
            "The stiffness of no joint of {} is known: give --stiffness, recordings (--static, --frequency), or [[effect]] kind = \"joint_elasticity\" in the description.",
            robot.name
        )));
    }
    if options.stiffness.is_empty() {
        warnings.extend(rigid(&drives));
    }
    warnings.extend(not_described(robot, &drives));
    let (computed, map) = at_poses(&tool, &drives, options, &mut warnings)?;
    warnings.extend(sagging(&tool, &drives, &poses)?);
    Ok(Compliance {
        schema: "rig-compliance/1",
        robot: robot.name.clone(),
        drives,
        loading,
        frequency,
        tool: options.tool,
        poses: computed,
        map,
        warnings,
    })
}

/// Computes the compliance at the poses and the map, and tells what is special about the poses.
fn at_poses(
    tool: &ToolPoint<'_>,
    drives: &[DriveStiffness],
    options: &ComplianceOptions,
    warnings: &mut Vec<String>,
) -> Result<(Vec<ToolCompliance>, Option<ComplianceMap>), ComplianceError> {
    let robot = tool.robot();
    let poses = match options.poses.as_slice() {
        [] => vec![robot.middle_position()],
        given => given.to_vec(),
    };
    for pose in &poses {
        refuse_pose_in_degrees(robot, pose)?;
    }
    warnings.extend(poses.iter().filter_map(|pose| outside(robot, pose)));
    let computed: Vec<ToolCompliance> = (poses.iter())
        .map(|pose| tool.compliance(pose, drives))
        .collect::<Result<_, _>>()?;
    let map = (options.map)
        .map(|joints| compliance_map(tool, drives, joints, &poses[0]))
        .transpose()?;
    warnings.extend(at_the_joint(tool, drives, &poses[0])?);
    warnings.extend(computed.iter().filter_map(on_axis));
    for (own, map) in map
        .iter()
        .flat_map(|m| m.singular.iter().map(move |s| (s, m)))
    {
        let [a, b] = map.joints;
        warnings.push(format!(
            "The drive of joint \"{}\" is near a dead centre at {} {:.3} {}, {} {:.3} {}: its motor hardly moves the joint there, and the arm yields without bound. {} cells of the map about such poses are left blank.",
            own.joint, map.names[0], own.pose[a], map.units[0], map.names[1], own.pose[b], map.units[1], own.cells
        ));
    }
    Ok((computed, map))
}

/// Returns the mean position of a stretch.
fn middle(signals: &Signals) -> Vec<f64> {
    let all = signals.joints.iter();
    all.map(|joint| rig_numerics::statistics::mean_or_zero(&joint.q))
        .collect()
}

/// Refuses a pose in degrees, by the rule for recordings.
fn refuse_pose_in_degrees(robot: &Robot, pose: &[f64]) -> Result<(), ComplianceError> {
    let row = |q: &f64| JointColumns {
        q: vec![*q],
        ..JointColumns::default()
    };
    let block = Block {
        joints: pose.iter().map(row).collect(),
        ..Block::default()
    };
    let found = implausible_positions(&block, robot).into_iter();
    let in_degrees = found.filter_map(|wrong| match wrong {
        Implausible::Degrees { joint, .. } => Some(joint - 1),
        _ => None,
    });
    match in_degrees.min() {
        None => Ok(()),
        Some(joint) => Err(ComplianceError::Option(format!(
            "The pose {} has joint \"{}\" at {} rad, far beyond its limits, which looks like degrees; give positions in rad ({}° is {} rad).",
            listed_pose(pose),
            robot.joints[joint].name,
            format_significant(pose[joint], 4),
            format_significant(pose[joint], 4),
            format_significant(pose[joint].to_radians(), 4)
        ))),
    }
}

/// Names the joints that a pose puts beyond their limits.
fn outside(robot: &Robot, pose: &[f64]) -> Option<String> {
    let names: Vec<String> = (robot.joints.iter().zip(pose))
        .filter_map(|(joint, q)| {
            let [low, high] = joint.limits.as_ref()?.position;
            (*q < low || *q > high).then(|| {
                format!(
                    "\"{}\" at {} (limits {} to {} {})",
                    joint.name,
                    format_significant(*q, 4),
                    format_significant(low, 4),
                    format_significant(high, 4),
                    joint.kind.units().0
                )
            })
        })
        .collect();
    (!names.is_empty()).then(|| {
        format!(
            "The pose {} is beyond the limits of joint {}; its compliance is computed all the same. Positions are in rad and m.",
            listed_pose(pose),
            names.join(", ")
        )
    })
}

/// Arm over which a rotation of the tool point moves it, m, below which it lies on the axes.
const ON_AXIS: f64 = 1e-9;

/// Says that no force moves the tool point.
fn on_axis(found: &ToolCompliance) -> Option<String> {
    let trace = |rows: std::ops::Range<usize>| rows.map(|r| found.compliance[r][r]).sum::<f64>();
    let (linear, angular) = (trace(0..3), trace(3..6));
    (angular > 0.0 && linear <= ON_AXIS * ON_AXIS * angular).then(|| {
        format!(
            "At the pose {} the tool point lies on the axis of every elastic joint, so that no force moves it: the displacement is 0. Give the tool point by --tool.",
            listed_pose(&found.pose)
        )
    })
}

/// Names the drives without a stiffness.
fn rigid(drives: &[DriveStiffness]) -> Option<String> {
    let rigid: Vec<String> = (drives.iter())
        .filter(|d| d.source == Source::Rigid)
        .map(|d| format!("\"{}\"", d.joint))
        .collect();
    (!rigid.is_empty()).then(|| {
        format!(
            "The stiffness of joint {} is unknown: these drives count as rigid, so the tool point is more compliant than computed.",
            rigid.join(", ")
        )
    })
}

/// Says that the description cannot take measured values as effects.
fn not_described(robot: &Robot, drives: &[DriveStiffness]) -> Option<String> {
    let is_measured = drives.iter().any(|own| own.source.is_measured());
    (robot.has_followers() && is_measured).then(|| {
        "A description with axes that follow joints cannot hold the effects of compliance.toml; give the stiffness with --stiffness instead.".to_owned()
    })
}

/// Puts measured values into the list.
fn measured(
    drives: &mut [DriveStiffness],
    loading: Option<&LoadingFindings>,
    frequency: Option<&FrequencyResponse>,
    warnings: &mut Vec<String>,
) {
    let loaded = loading.into_iter().flat_map(|l| &l.drives);
    let mut all: Vec<(usize, Value, Source)> = loaded
        .filter_map(|d| Some((d.index, d.stiffness?, Source::Loading)))
        .collect();
    all.extend(frequency.map(|f| (f.index, f.stiffness, Source::Frequency)));
    for (k, value, source) in all {
        let own = &mut drives[k];
        let before = own.source.is_measured();
        match own.stiffness.filter(|_| before) {
            None => {
                warnings.extend(replaced(own, value));
                own.damping = None;
                (own.stiffness, own.source) = (Some(value), source);
            }
            Some(other) => match contradiction(own, other, value) {
                // What contradicts each other has no mean.
                Some(told) => {
                    warnings.push(told);
                    continue;
                }
                None => {
                    own.stiffness = Some(fused(other, value));
                    own.source = match own.source == source {
                        true => source,
                        false => Source::Both,
                    };
                }
            },
        }
        if let (Source::Frequency, Some(response)) = (source, frequency) {
            own.damping = Some(response.damping);
        }
    }
}

/// Says that a given stiffness is not used, because another one was measured.
fn replaced(drive: &DriveStiffness, measured: Value) -> Option<String> {
    let given = drive.stiffness.filter(|_| drive.source == Source::Given)?;
    let off = (given.value - measured.value).abs();
    (off > CONTRADICTS * measured.std && off > AGREES * given.value.min(measured.value)).then(|| {
        format!(
            "The given stiffness of joint \"{}\", {} {unit}, contradicts the measured one, {} ± {} {unit}. The measured one is used. If the given one is right, check the unit of the force or torque, the pose and the tool point.",
            drive.joint,
            format_significant(given.value, 4),
            format_significant(measured.value, 4),
            format_significant(measured.std, 2),
            unit = format_unit(drive.unit)
        )
    })
}

/// Weighted mean of two independent estimates.
fn fused(a: Value, b: Value) -> Value {
    let weights = [a.std, b.std].map(|s| 1.0 / (s * s));
    if !weights.iter().all(|w| w.is_finite()) {
        return if a.std <= b.std { a } else { b };
    }
    let sum = weights[0] + weights[1];
    Value::new(
        (weights[0] * a.value + weights[1] * b.value) / sum,
        1.0 / sum.sqrt(),
    )
}

/// Says that a further measurement contradicts the earlier ones.
fn contradiction(drive: &DriveStiffness, before: Value, new: Value) -> Option<String> {
    let off = (before.value - new.value).abs();
    let beyond =
        off > CONTRADICTS * before.std.hypot(new.std) && off > AGREES * before.value.min(new.value);
    beyond.then(|| {
        format!(
            "Two measurements of the stiffness of joint \"{}\" contradict each other: {} ± {} by {} and then {} ± {} {}. The first is used. Static loading shows the whole deflection at large loads, a frequency response the spring at small amplitudes.",
            drive.joint,
            format_significant(before.value, 4),
            format_significant(before.std, 2),
            drive.source.words(),
            format_significant(new.value, 4),
            format_significant(new.std, 2),
            format_unit(drive.unit)
        )
    })
}
