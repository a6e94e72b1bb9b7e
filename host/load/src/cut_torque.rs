//! Torques that are cut: the drive saturates, and its torque is no longer that of the load.

use rig_model::robot::Joint;
use rig_output::{format_significant, format_unit, listed};

use crate::error::LoadError;
use crate::intake::MOST_SATURATED;

/// Torques of a joint that were left out of a recording because they are at a limit.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CutTorque {
    /// Name of the recording.
    pub recording: String,
    /// Index of the joint.
    pub joint: usize,
    /// Limits, N·m or N: the described one, or the value at which torques are cut.
    pub limits: [Option<f64>; 2],
    /// Rows left out.
    pub rows: u64,
    /// Rows of the recording in the band of the fit.
    pub of: u64,
}

impl CutTorque {
    /// Returns the share of the rows that was left out.
    fn share(&self) -> f64 {
        self.rows as f64 / self.of.max(1) as f64
    }

    fn words(&self, joints: &[Joint]) -> String {
        let joint = &joints[self.joint];
        let unit = format_unit(joint.kind.units().1);
        let limits: Vec<String> = (self.limits.iter().flatten())
            .map(|limit| format!("{} {unit}", format_significant(*limit, 4)))
            .collect();
        format!(
            "{}: the torque of {} saturates ({}); {} of {} rows of this joint ({} %) were left out.",
            self.recording,
            joint.name,
            listed(&limits),
            self.rows,
            self.of,
            format_significant(100.0 * self.share(), 2)
        )
    }
}

/// Says which torques were left out.
///
/// # Errors
/// [`LoadError::Fault`] if a joint lost most of its rows, unless the user goes on.
pub(crate) fn words(
    all: &[CutTorque],
    joints: &[Joint],
    even_if_wrong: bool,
) -> Result<Vec<String>, LoadError> {
    let worst = all.iter().find(|own| own.share() > MOST_SATURATED);
    match worst {
        Some(own) if !even_if_wrong => Err(LoadError::Fault(format!(
            "{} Record a slower motion, or a lighter load.",
            own.words(joints)
        ))),
        _ => Ok(all.iter().map(|own| own.words(joints)).collect()),
    }
}
