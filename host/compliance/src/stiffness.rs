//! The stiffness of the drives, and where it comes from.

use rig_model::robot::{Robot, RobotEffect};
use rig_shared::effects::{Effect, Kind};
use serde::Serialize;

use crate::drives::Drives;
use crate::error::ComplianceError;
use crate::value::Value;

/// Source of a stiffness.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// Typed by the user.
    Given,
    /// The effect `joint_elasticity` (or `backlash`) of the description.
    Description,
    /// Static loading.
    Loading,
    /// Frequency response.
    Frequency,
    /// The mean of loading and frequency response, weighted by their variances.
    Both,
    /// Typed by the user as rigid (inf).
    GivenRigid,
    /// No value: the drive counts as rigid.
    Rigid,
}

impl Source {
    /// Returns the source in words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Given => "given",
            Self::Description => "description",
            Self::Loading => "static loading",
            Self::Frequency => "frequency response",
            Self::Both => "loading and frequency response",
            Self::GivenRigid => "rigid, as given",
            Self::Rigid => "unknown, counted as rigid",
        }
    }

    /// Returns true for a value from recordings.
    pub const fn is_measured(self) -> bool {
        matches!(self, Self::Loading | Self::Frequency | Self::Both)
    }
}

/// The stiffness of one drive.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DriveStiffness {
    /// Name of the joint.
    pub joint: String,
    /// c, in `unit`; `None` if the drive counts as rigid.
    pub stiffness: Option<Value>,
    /// Damping beside the spring, in `unit` times s; `None` if unknown.
    pub damping: Option<Value>,
    /// Unit of the stiffness, ASCII.
    pub unit: &'static str,
    /// Source of the value.
    pub source: Source,
}

impl DriveStiffness {
    /// Returns the compliance 1/c; 0 for a rigid drive.
    pub fn compliance(&self) -> Value {
        self.stiffness
            .map_or(Value::default(), |value| value.reciprocal())
    }
}

/// Returns the stiffness that the description states, one entry per joint.
///
/// # Errors
/// [`ComplianceError::Model`].
pub fn described_stiffness(robot: &Robot) -> Result<Vec<DriveStiffness>, ComplianceError> {
    let drives = Drives::of(robot)?;
    let placed = robot.placed_effects();
    let of = |k: usize| {
        let own = placed.iter().filter(|p| p.joint == k);
        own.filter_map(|p| p.effect.kind.transmission(&p.effect.shapes))
            .find(|[_, stiffness, _]| *stiffness > 0.0)
    };
    Ok((robot.joints.iter().enumerate())
        .map(|(k, joint)| {
            let found = of(k);
            DriveStiffness {
                joint: joint.name.clone(),
                stiffness: found.map(|[_, stiffness, _]| Value::new(stiffness, 0.0)),
                damping: found.map(|[_, _, damping]| Value::new(damping, 0.0)),
                unit: drives.unit(robot, k),
                source: match found {
                    Some(_) => Source::Description,
                    None => Source::Rigid,
                },
            }
        })
        .collect())
}

/// Replaces all values by given ones, base joint first. `stds` are standard deviations, or empty.
///
/// # Errors
/// [`ComplianceError::Option`]: a wrong count, or a number that is not positive. Infinity means rigid.
pub fn given_stiffness(
    list: &mut [DriveStiffness],
    values: &[f64],
    stds: &[f64],
) -> Result<(), ComplianceError> {
    let n = list.len();
    let wrong = |option: &str, count: usize, hint: &str| {
        ComplianceError::Option(format!(
            "{option} has {count} numbers, but the robot has {n} joints; give one for each joint, base first ({hint})."
        ))
    };
    // A wrong value says more than a wrong number of them.
    for (std, entry) in stds.iter().zip(list.iter()) {
        if !(*std >= 0.0 && std.is_finite()) {
            return Err(ComplianceError::Option(format!(
                "--stiffness-std {std} of joint \"{}\" is not possible: a standard deviation is 0 or greater.",
                entry.joint
            )));
        }
    }
    if values.len() != n {
        return Err(wrong("--stiffness", values.len(), "inf for a rigid one"));
    }
    if !(stds.is_empty() || stds.len() == n) {
        return Err(wrong("--stiffness-std", stds.len(), "0 for a rigid one"));
    }
    for (k, entry) in list.iter_mut().enumerate() {
        let (value, std) = (values[k], stds.get(k).copied().unwrap_or(0.0));
        if !(value > 0.0) {
            return Err(ComplianceError::Option(format!(
                "--stiffness {value} of joint \"{}\" is not possible: a stiffness is greater than 0 (inf for a rigid drive).",
                entry.joint
            )));
        }
        entry.damping = None;
        entry.stiffness = value.is_finite().then_some(Value::new(value, std));
        entry.source = match entry.stiffness {
            Some(_) => Source::Given,
            None => Source::GivenRigid,
        };
    }
    Ok(())
}

/// Returns the effects `joint_elasticity` of measured drives, for a description.
pub fn elasticity_effects(list: &[DriveStiffness]) -> Vec<RobotEffect> {
    (list.iter().filter(|entry| entry.source.is_measured()))
        .filter_map(|entry| {
            let shapes = [
                entry.stiffness?.value,
                entry.damping.map_or(0.0, |d| d.value.max(0.0)),
                0.0,
            ];
            let mut effect = Effect {
                kind: Kind::JointElasticity,
                gains: [0.0; rig_shared::effects::GAINS],
                shapes: [0.0; rig_shared::effects::SHAPES],
            };
            effect.shapes[..shapes.len()].copy_from_slice(&shapes);
            Some(RobotEffect {
                joint: Some(entry.joint.clone()),
                other: None,
                effect,
            })
        })
        .collect()
}
