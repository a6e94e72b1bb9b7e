//! The torque check: predicted against measured torque.

use rig_shared::multibody::COLUMNS;

use crate::{TorqueCheck, ValidateError};
use rig_data::Compensated;
use rig_data::prepare::{Recording, Survey};
use rig_identify::{Plan, Planned, torque_residuals};
use rig_model::robot::Robot;
use rig_model::simulate::Model;
use rig_output::Finding;

/// Share of unexplained torque above which a warning is given; [`rig_identify`] uses the same.
const UNEXPLAINED: f64 = 0.3;

/// Returns the columns of the non-zero parameters, and their values.
pub(crate) fn nonzero_parameters(model: &Model) -> (Vec<usize>, Vec<f64>) {
    // Parameters of coupled drives follow those of the joints.
    let motors = model
        .motors
        .as_ref()
        .map_or(&[][..], |m| m.parameters.as_flattened());
    // Zero parameters add no torque, so their columns are not computed.
    model
        .parameters
        .iter()
        .flatten()
        .chain(motors)
        .copied()
        .enumerate()
        .filter(|(_, value)| *value != 0.0)
        .unzip()
}

/// Compares the predicted with the measured torque of each joint.
pub(crate) fn torque_checks(
    robot: &Robot,
    model: &Model,
    plan: &Plan<'_>,
    values: &[f64],
    recording: &dyn Recording,
    survey: &Survey,
) -> Result<Vec<TorqueCheck>, ValidateError> {
    let free = Compensated::new(recording, &model.effects, plan.chain, plan.treatment, false)?;
    let compared: &dyn Recording = if model.effects.is_empty() {
        recording
    } else {
        &free
    };
    let whole = (!model.effects.is_empty()).then(|| Planned::all(&[recording], plan));
    let residuals = torque_residuals(
        &Planned::all(&[compared], plan),
        std::slice::from_ref(survey),
        values,
        &|_, _| 0.0,
        whole.as_deref(),
    )?;
    Ok(residuals
        .into_iter()
        .zip(&robot.joints)
        .map(|(residual, joint)| TorqueCheck {
            joint: joint.name.clone(),
            unit: joint.kind.units().1.to_owned(),
            residual,
        })
        .collect())
}

/// Reports the joints whose torque the description does not explain, or that have no usable row.
pub(crate) fn unexplained(recording: &str, torque: &[TorqueCheck]) -> Vec<Finding> {
    let of = |check: &TorqueCheck| {
        let (joint, left) = (&check.joint, 100.0 * check.residual.relative_error);
        if check.residual.rows == 0 {
            Some(Finding {
                kind: "masked",
                size: 0.0,
                sentence: format!(
                    "{recording}, joint {joint}: every row is masked (too slow, or at the torque limit), so its torque was not checked."
                ),
                short: joint.clone(),
            })
        } else if check.residual.relative_error > UNEXPLAINED {
            Some(Finding {
                kind: "unexplained",
                size: left,
                sentence: format!(
                    "{recording}, joint {joint}: the description leaves {left:.0} % of the torque unexplained."
                ),
                short: format!("{joint} ({left:.0} %)"),
            })
        } else {
            None
        }
    };
    torque.iter().filter_map(of).collect()
}

/// Returns warnings about the description itself.
pub(crate) fn prior_warnings(robot: &Robot, columns: &[usize]) -> Vec<String> {
    let mut warnings = Vec::new();
    for (j, joint) in robot.joints.iter().enumerate() {
        if !columns.iter().any(|c| c / COLUMNS == j) {
            warnings.push(format!(
                "The description states neither inertia nor friction for joint {}; they count as zero.",
                joint.name
            ));
        } else if joint.friction.is_none() {
            warnings.push(format!(
                "The description states no friction for joint {}; it counts as zero.",
                joint.name
            ));
        }
    }
    warnings
}
