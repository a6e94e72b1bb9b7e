//! The wrench on the robot in a recording.

use nalgebra::Vector3;
use rig_data::WRENCH_COLUMNS;

use crate::error::ComplianceError;
use crate::signals::Signals;
use crate::tool_point::ToolPoint;

/// Columns of the displacement of the tool point, m, base axes.
pub(crate) const DISPLACEMENT: [&str; 3] = ["dx", "dy", "dz"];

/// Returns true if the recording has a force.
pub(crate) fn has_wrench(signals: &Signals) -> bool {
    WRENCH_COLUMNS[..3]
        .iter()
        .any(|c| signals.column(c).is_some())
}

/// Returns true if the recording has a displacement.
pub(crate) fn has_displacement(signals: &Signals) -> bool {
    DISPLACEMENT.iter().any(|c| signals.column(c).is_some())
}

/// Returns force (N) and moment (N·m), by column. Without any column of
/// the moment it is zero.
///
/// # Errors
/// [`ComplianceError::Recording`]: a column is missing.
pub(crate) fn wrench(signals: &Signals) -> Result<[Vec<f64>; 6], ComplianceError> {
    let moment = WRENCH_COLUMNS[3..]
        .iter()
        .any(|c| signals.column(c).is_some());
    let mut all: [Vec<f64>; 6] = Default::default();
    for (c, name) in WRENCH_COLUMNS.iter().enumerate() {
        all[c] = match signals.column(name) {
            Some(values) => values.to_vec(),
            None if c >= 3 && !moment => vec![0.0; signals.len()],
            None => {
                return Err(ComplianceError::Recording(format!(
                    "{} has no column `{name}`: the force is recorded as fx fy fz (N), its moment as mx my mz (N·m; all three or none). {}",
                    signals.label,
                    signals.other_columns()
                )));
            }
        };
    }
    Ok(all)
}

/// Returns the torques that a reading of the wrench puts on the joints: Jᵀ·w with the Jacobian of the frame in which it is
/// read.
pub(crate) fn torques(
    tool: &ToolPoint<'_>,
    pose: &[f64],
    reading: &[f64; 6],
) -> Result<Vec<f64>, ComplianceError> {
    let (rotation, sign, jacobian) = tool.wrench_frame(pose)?;
    let turned = |first: usize| {
        rotation * Vector3::new(reading[first], reading[first + 1], reading[first + 2]) * sign
    };
    let (force, moment) = (turned(0), turned(3));
    Ok((jacobian.column_iter())
        .map(|c| {
            let (linear, angular) = (c.fixed_rows::<3>(0), c.fixed_rows::<3>(3));
            linear.dot(&force) + angular.dot(&moment)
        })
        .collect())
}
