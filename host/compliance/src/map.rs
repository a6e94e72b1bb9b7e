//! The compliance of the tool point over the ranges of two joints.

use std::f64::consts::PI;

use rig_model::robot::JointKind;
use serde::Serialize;

use crate::error::ComplianceError;
use crate::stiffness::DriveStiffness;
use crate::tool_point::ToolPoint;

/// Points of the grid along each joint.
pub const GRID: usize = 41;

/// Motion of a motor per motion of its joint over the largest one of the map, below which the pose counts as singular. By judgement:
/// the joint is 400 times more compliant there than elsewhere, and the linear matrix holds for tiny motions only.
const DEAD_CENTRE: f64 = 0.05;

/// A pose at which a motor hardly moves its joint.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SingularPose {
    /// Joint of the drive.
    pub joint: String,
    /// Pose of the grid that is nearest to the dead centre.
    pub pose: Vec<f64>,
    /// Blank cells about it.
    pub cells: usize,
}

/// Largest displacement of the tool point per force, over the ranges of two joints.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ComplianceMap {
    /// Indices (from 0) of the two joints.
    pub joints: [usize; 2],
    /// Their names.
    pub names: [String; 2],
    /// Units of their positions.
    pub units: [&'static str; 2],
    /// Positions of the first joint.
    pub x: Vec<f64>,
    /// Positions of the second joint.
    pub y: Vec<f64>,
    /// Largest displacement per force over all directions, m/N: one row per position of the second joint. `None` where the
    /// drives do not reach or are nearly singular.
    pub values: Vec<Vec<Option<f64>>>,
    /// Positions of all joints; those of the two joints are not used.
    pub pose: Vec<f64>,
    /// Pose of the largest value.
    pub most_compliant: Vec<f64>,
    /// Pose of the smallest value.
    pub stiffest: Vec<f64>,
    /// Smallest and largest value, m/N.
    pub range: [f64; 2],
    /// One entry for each drive with a dead centre on the map.
    pub singular: Vec<SingularPose>,
}

/// Computes the map over the ranges of two joints (from 0); the others stay at `pose`.
///
/// # Errors
/// [`ComplianceError::Option`]: a joint that the robot does not have, the same joint twice, or no reachable pose.
pub fn compliance_map(
    tool: &ToolPoint<'_>,
    stiffness: &[DriveStiffness],
    joints: [usize; 2],
    pose: &[f64],
) -> Result<ComplianceMap, ComplianceError> {
    let robot = tool.robot();
    let [a, b] = joints;
    if a == b || a.max(b) >= robot.joints.len() {
        return Err(ComplianceError::Option(
            "--map takes two different joints of the robot.".to_owned(),
        ));
    }
    tool.jacobian(pose)?;
    let grid = |k: usize| -> Vec<f64> {
        let [low, high] = range(tool, k);
        let step = (high - low) / (GRID - 1) as f64;
        (0..GRID).map(|i| low + step * i as f64).collect()
    };
    let (x, y) = (grid(a), grid(b));
    let dead = DeadCentres::of(tool, stiffness, [(a, &x), (b, &y)], pose)?;
    let mut q = pose.to_vec();
    let mut best: Option<([f64; 2], [Vec<f64>; 2])> = None;
    let mut values = Vec::with_capacity(GRID);
    for second in &y {
        let mut row = Vec::with_capacity(GRID);
        for first in &x {
            (q[a], q[b]) = (*first, *second);
            let value = match tool.largest(&q, stiffness) {
                _ if dead.near(tool, &q)? => None,
                Ok(value) => Some(value).filter(|v| v.is_finite()),
                Err(ComplianceError::SingularDrives { .. }) => None,
                Err(other) => return Err(other),
            };
            if let Some(value) = value {
                let (range, poses) =
                    best.get_or_insert_with(|| ([value; 2], [q.clone(), q.clone()]));
                if value < range[0] {
                    (range[0], poses[0]) = (value, q.clone());
                }
                if value > range[1] {
                    (range[1], poses[1]) = (value, q.clone());
                }
            }
            row.push(value);
        }
        values.push(row);
    }
    let (range, [stiffest, most_compliant]) = best.ok_or_else(|| {
        ComplianceError::Option(
            "The drives reach no pose of the map; correct [joint.limits] or the screws.".to_owned(),
        )
    })?;
    Ok(ComplianceMap {
        joints,
        names: joints.map(|k| robot.joints[k].name.clone()),
        units: joints.map(|k| robot.joints[k].kind.units().0),
        x,
        y,
        values,
        pose: pose.to_vec(),
        most_compliant,
        stiffest,
        range,
        singular: dead.poses,
    })
}

/// The dead centres of the elastic drives over a map. A rigid drive yields nowhere.
struct DeadCentres {
    /// Largest motion of each motor per motion of the joints; 0 for a rigid drive.
    most: Vec<f64>,
    poses: Vec<SingularPose>,
}

impl DeadCentres {
    fn of(
        tool: &ToolPoint<'_>,
        stiffness: &[DriveStiffness],
        [(a, x), (b, y)]: [(usize, &Vec<f64>); 2],
        pose: &[f64],
    ) -> Result<Self, ComplianceError> {
        let mut cells = Vec::with_capacity(x.len() * y.len());
        let mut q = pose.to_vec();
        for second in y {
            for first in x {
                (q[a], q[b]) = (*first, *second);
                cells.push((q.clone(), tool.drives().speeds(&q)?));
            }
        }
        let mut found = Self {
            most: vec![0.0; tool.count()],
            poses: Vec::new(),
        };
        for (k, (most, drive)) in found.most.iter_mut().zip(stiffness).enumerate() {
            if drive.stiffness.is_none() {
                continue;
            }
            *most = cells.iter().map(|(_, s)| s[k]).fold(0.0, f64::max);
            let near = cells.iter().filter(|(_, s)| s[k] < DEAD_CENTRE * *most);
            let nearest = near.clone().min_by(|m, n| m.1[k].total_cmp(&n.1[k]));
            found.poses.extend(nearest.map(|(q, _)| SingularPose {
                joint: tool.robot().joints[k].name.clone(),
                pose: q.clone(),
                cells: near.count(),
            }));
        }
        Ok(found)
    }

    /// Returns true if a drive is near a dead centre.
    fn near(&self, tool: &ToolPoint<'_>, q: &[f64]) -> Result<bool, ComplianceError> {
        let speeds = tool.drives().speeds(q)?;
        Ok((speeds.iter().zip(&self.most)).any(|(s, most)| *s < DEAD_CENTRE * most))
    }
}

/// Returns the position range of a joint; one turn, or 1 m to either side, for a joint without finite limits.
pub(crate) fn range(tool: &ToolPoint<'_>, k: usize) -> [f64; 2] {
    let joint = &tool.robot().joints[k];
    let limits = joint.limits.as_ref().map(|limits| limits.position);
    let free = match joint.kind {
        JointKind::Revolute => PI,
        JointKind::Prismatic => 1.0,
    };
    limits
        .filter(|[low, high]| low.is_finite() && high.is_finite() && low < high)
        .unwrap_or([-free, free])
}
